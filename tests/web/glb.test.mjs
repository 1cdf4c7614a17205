// What the writer of GLB files promises: run with `node --test`, also by test_web_mesh.py.
import assert from 'node:assert/strict'
import { test } from 'node:test'

import { writeGlb } from '../../web/uph-glb.js'

const PLAIN = { positions: new Float32Array(9), normals: new Float32Array(9), indices: new Uint16Array(3) }

for (const [metres, scale] of [
  [null, undefined],
  [1, undefined],
  [0.001, [0.001, 0.001, 0.001]],
]) {
  test(`a unit of ${metres} m has scale ${scale}`, async () => {
    const model = { name: 'x', charts: [], plain: PLAIN, metres, mean: [0, 0, 0], roles: ['albedo'], alpha: 'opaque' }
    const file = await writeGlb(model)
    const length = new DataView(file.buffer, file.byteOffset).getUint32(12, true)
    const { nodes } = JSON.parse(new TextDecoder().decode(file.subarray(20, 20 + length)))
    assert.deepEqual(nodes[0].scale, scale)
  })
}
