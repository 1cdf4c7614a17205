// Makes meshes of the streams that a job file names, and prints all about them: run by test_web_mesh.py.
import { readFileSync } from 'node:fs'

import { SurfaceMesher } from '../../web/uph-mesh.js'
import { UphDecoder } from '../../web/uph.js'

function run({ path, counts }) {
  const decoder = new UphDecoder()
  decoder.feed(new Uint8Array(readFileSync(path)))
  const mesher = new SurfaceMesher(decoder.surface, decoder.charts)
  const seams = decoder.charts.map((_, n) => [0, 1, 2, 3].map((edge) => mesher.seams(n, edge)))
  const meshes = decoder.charts.map((_, n) =>
    Object.fromEntries(Object.entries(mesher.mesh(n, counts)).map(([name, values]) => [name, [...values]])),
  )
  return {
    nets: mesher.patches.map(({ m, n, net }) => ({ m, n, net: [...net] })),
    bounds: decoder.charts.map((_, n) => mesher.bounds(n)),
    seams,
    meshes,
  }
}

const jobs = JSON.parse(readFileSync(process.argv[2], 'utf8'))
console.log(JSON.stringify(jobs.map(run)))
