// Meshes the charts of the stream that it is given, and checks what the loader shows: run by test_web_meshes.py.
import assert from 'node:assert/strict'
import { readFileSync } from 'node:fs'

import { countsFor, TriangleMesher } from '../../web/uph-mesh.js'
import { UphDecoder } from '../../web/uph.js'

const decoder = new UphDecoder()
decoder.feed(new Uint8Array(readFileSync(process.argv[2])))
const { surface, charts } = decoder
const mesher = new TriangleMesher(surface, charts)
const pieces = charts.map((_, n) => mesher.mesh(n))
const plain = mesher.plainMesh()

const count = [...pieces, ...(plain ? [plain] : [])].reduce((sum, { indices }) => sum + indices.length, 0)
assert.equal(count, surface.triangles.length)
pieces.forEach(({ positions, normals, tangents, parameters, indices, outline }, n) => {
  assert.ok(parameters.every((x) => x >= 0 && x <= 1))
  assert.ok(indices.every((vertex) => vertex < positions.length / 3))
  assert.equal(outline.length % 6, 0)
  const { center, radius, ...bends } = mesher.bounds(n)
  assert.deepEqual(countsFor(bends, 1000, 0.5), [1, 1])
  for (let v = 0; v < positions.length / 3; v++) {
    const [p, normal] = [positions, normals].map((array) => array.subarray(3 * v, 3 * v + 3))
    const tangent = tangents.subarray(4 * v, 4 * v + 3)
    const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0)
    assert.ok(Math.abs(dot(normal, normal) - 1) < 1e-5)
    assert.ok(Math.abs(dot(tangent, tangent) - 1) < 1e-5)
    assert.ok(Math.abs(dot(normal, tangent)) < 1e-5)
    assert.ok(Math.hypot(...p.map((x, k) => x - center[k])) <= radius * (1 + 1e-5))
  }
})
const lengths = (arrays) => arrays.map(({ positions, indices }) => [positions.length / 3, indices.length / 3])
const outward = pieces.flatMap(({ positions, normals }) =>
  Array.from({ length: positions.length / 3 }, (_, v) => {
    const [p, n] = [positions, normals].map((array) => array.subarray(3 * v, 3 * v + 3))
    return p.reduce((sum, x, k) => sum + x * n[k], 0) / Math.hypot(...p)
  }),
)
console.log(JSON.stringify({ sizes: lengths(pieces), plain: plain && lengths([plain])[0], least: Math.min(...outward) }))
