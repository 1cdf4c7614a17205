// Decodes the streams that a job file names and prints what each mesh is: run by test_web_meshes.py.
import { createHash } from 'node:crypto'
import { readFileSync } from 'node:fs'

import { UphDecoder, UphError } from '../../web/uph.js'

const digest = ({ buffer }) => createHash('sha256').update(new Uint8Array(buffer)).digest('hex').slice(0, 16)

function run(path) {
  const decoder = new UphDecoder()
  try {
    decoder.feed(new Uint8Array(readFileSync(path)))
  } catch (error) {
    if (!(error instanceof UphError)) throw error
    return { error: error.message }
  }
  const { name, metres, parts, triangles, island, part, positions, parameters } = decoder.surface
  const arrays = [triangles, island, part, positions, parameters].map(digest)
  return { name, metres, parts, arrays, charts: decoder.charts }
}

console.log(JSON.stringify(JSON.parse(readFileSync(process.argv[2], 'utf8')).map(run)))
