// Decodes what a job file names, cut where it says, and prints digests: run by test_web_decoder.py.
import { createHash } from 'node:crypto'
import { readFileSync } from 'node:fs'

import { EzwDecoder, UphDecoder, UphError } from '../../web/uph.js'

function digest(arrays) {
  const hash = createHash('sha256')
  for (const { buffer, byteOffset, byteLength } of arrays) hash.update(new Uint8Array(buffer, byteOffset, byteLength))
  return hash.digest('hex').slice(0, 16)
}

const MOST_TEXELS = 2 ** 21

function found(decoder) {
  if (decoder.needed) return { needed: decoder.needed }
  if (decoder.charts?.reduce((sum, { height, width }) => sum + height * width, 0) > MOST_TEXELS) {
    return { large: true, known: decoder.chartsKnown }
  }
  if (decoder instanceof EzwDecoder) return { image: digest([decoder.image().data]) }
  const texels = decoder.charts.flatMap((_, n) => {
    const middle = Math.ceil(decoder.paintedSize(n).height / 3)
    return [decoder.texels(n, { stop: middle }), decoder.texels(n, { start: middle })]
  })
  const shown = decoder.charts.map((_, n) => decoder.rgba(n))
  const maps = decoder.roles.slice(1).map((role) => {
    const painted = decoder.charts.map((_, n) => decoder.texels(n, { role }))
    const seen = decoder.charts.map((_, n) => decoder.rgba(n, { role }))
    return [role, digest([decoder.exemplar(role).data]), digest(painted), digest(seen)]
  })
  const [exemplar, known] = [digest([decoder.exemplar().data]), decoder.chartsKnown]
  return { exemplar, texels: digest(texels), shown: digest(shown), known, maps }
}

function run({ path, cuts, share, other, shown = true }) {
  const data = new Uint8Array(readFileSync(path))
  const decoder = path.endsWith('.ezw') ? new EzwDecoder() : new UphDecoder()
  if (share) decoder.mostCoefficients = share
  if (other) decoder.replaceExemplar({ ...other, data: new Uint8Array(other.data) })
  const results = []
  try {
    for (const cut of cuts) {
      decoder.feed(data.subarray(decoder.received, cut))
      if (shown) results.push(found(decoder))
    }
  } catch (error) {
    if (error instanceof RangeError) return [...results, { refused: error.message }]
    if (!(error instanceof UphError)) throw error
    results.push({ error: error.offset, what: error.message })
  }
  return results
}

const jobs = JSON.parse(readFileSync(process.argv[2], 'utf8'))
console.log(JSON.stringify(jobs.map(run)))
