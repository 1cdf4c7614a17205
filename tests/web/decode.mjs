// Decodes what a job file names, cut where it says, and prints digests: run by test_web_decoder.py.
import { createHash } from 'node:crypto'
import { readFileSync } from 'node:fs'

import { EzwDecoder, UphDecoder, UphError } from '../../web/uph.js'

function digest(arrays) {
  const hash = createHash('sha256')
  for (const { buffer, byteOffset, byteLength } of arrays) hash.update(new Uint8Array(buffer, byteOffset, byteLength))
  return hash.digest('hex').slice(0, 16)
}

function found(decoder) {
  if (decoder.needed) return { needed: decoder.needed }
  if (decoder instanceof EzwDecoder) return { image: digest([decoder.image().data]) }
  const texels = decoder.charts.map((_, n) => decoder.texels(n))
  const maps = decoder.roles.slice(1).map((role) => [role, digest([decoder.exemplar(role).data])])
  if (maps.length) texels.push(...decoder.charts.map((_, n) => decoder.texels(n, 0, undefined, decoder.roles.at(-1))))
  return { exemplar: digest([decoder.exemplar().data]), texels: digest(texels), known: decoder.chartsKnown, maps }
}

function run({ path, cuts }) {
  const data = new Uint8Array(readFileSync(path))
  const decoder = path.endsWith('.ezw') ? new EzwDecoder() : new UphDecoder()
  const results = []
  try {
    for (const cut of cuts) {
      decoder.feed(data.subarray(decoder.received, cut))
      results.push(found(decoder))
    }
  } catch (error) {
    if (!(error instanceof UphError)) throw error
    results.push({ error: error.offset })
  }
  return results
}

const jobs = JSON.parse(readFileSync(process.argv[2], 'utf8'))
console.log(JSON.stringify(jobs.map(run)))
