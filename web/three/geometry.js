/** Geometry of charts, from what the worker tessellates. */

import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshStandardMaterial, Sphere, Vector3 } from 'three'
import { PLAIN } from './materials.js'

/** The geometry of a chart. Its textures leave room for their gutters by themselves. */
export function chartGeometry(piece, { center, radius }) {
  const { positions, normals, tangents, parameters, indices } = piece
  const uv = new Float32Array(parameters.length)
  for (let n = 0; n < uv.length; n += 2) {
    uv[n] = parameters[n + 1]
    uv[n + 1] = parameters[n]
  }
  const geometry = new BufferGeometry()
  geometry.setAttribute('position', new BufferAttribute(positions, 3))
  geometry.setAttribute('normal', new BufferAttribute(normals, 3))
  geometry.setAttribute('tangent', new BufferAttribute(tangents, 4))
  geometry.setAttribute('uv', new BufferAttribute(uv, 2))
  geometry.setIndex(new BufferAttribute(indices, 1))
  geometry.boundingSphere = new Sphere(new Vector3(...center), radius)
  return geometry
}

/** The triangles that lie on no chart, of one colour. */
export function plainMesh({ positions, normals, indices }) {
  const geometry = new BufferGeometry()
  geometry.setAttribute('position', new BufferAttribute(positions, 3))
  geometry.setAttribute('normal', new BufferAttribute(normals, 3))
  geometry.setIndex(new BufferAttribute(indices, 1))
  const mesh = new Mesh(geometry, new MeshStandardMaterial({ side: DoubleSide, ...PLAIN }))
  mesh.name = 'plain'
  return mesh
}

/** The outlines of all charts as line segments. */
export function outlineGeometry(geometries) {
  const outlines = geometries.map(({ outline }) => outline)
  const lines = new Float32Array(outlines.reduce((sum, outline) => sum + outline.length, 0))
  let at = 0
  for (const outline of outlines) {
    lines.set(outline, at)
    at += outline.length
  }
  return new BufferGeometry().setAttribute('position', new BufferAttribute(lines, 3))
}
