/** A mesh in place of a surface of patches [2, 5.4]. */

import { range } from '../numbers.js'
import { FrontDecoder } from './front.js'
import { decodeIslands } from './islands.js'
import { MeshNumbers } from './mesh-numbers.js'

const MAX_PARTS = 2 ** 16
export const TRIANGLES_A_BYTE = 4096
const MOST = 1e18 // of a position

/** Returns the surface: positions, and per corner of a triangle its vertex and (s, t) on its island. */
export function parseMesh(reader, maxTriangles) {
  const name = parseText(reader)
  const metres = reader.u8('flags of the mesh', 1) ? reader.float('metres', 8) : null
  const partCount = reader.varint('number of parts', Math.min(MAX_PARTS, reader.left), 1)
  const parts = range(partCount).map(() => parseText(reader))
  const triangleCount = reader.varint('number of triangles', Math.min(maxTriangles, TRIANGLES_A_BYTE * reader.left), 1)
  const vertexCount = reader.varint('number of vertices', 3 * triangleCount, 1)
  const islandCount = reader.varint('number of islands', triangleCount, 1)
  const bits = reader.u8('bits of a coordinate', 16)
  const [x, y, z, step, unit] = range(5).map(() => reader.float('origin or step', 8))
  if (!(step > 0 && unit > 0)) reader.fail('a step is not above 0')
  const mesh = parseTriangles(reader, { triangleCount, vertexCount, islandCount, parts, limit: 2 ** bits - 1 }, decodeIslands)
  const positions = placed(reader, mesh, [x, y, z], step)
  const parameters = Float64Array.from(mesh.parameters, (value) => value * unit)
  if (!parameters.every(Number.isFinite)) reader.fail('a parameter is not finite')
  checkIslands(reader, mesh)
  return {
    kind: 'mesh',
    name,
    metres,
    parts,
    faces: range(islandCount).map(() => null),
    triangles: mesh.vertices,
    island: mesh.island,
    part: mesh.part,
    seams: mesh.seams,
    positions,
    parameters,
  }
}

/** The rest of the reader's bytes: triangles and integer positions, and what `decodeMore(numbers, mesh)` reads. */
export function parseTriangles(reader, counts, decodeMore = () => {}) {
  const mesh = emptyMesh(counts)
  const numbers = new MeshNumbers(reader)
  new FrontDecoder(numbers, mesh).decode()
  decodeMore(numbers, mesh)
  if (numbers.bits.unread) reader.fail('mesh has bytes too many')
  reader.take(reader.left)
  return mesh
}

/** Positions in the model's units. */
export function placed(reader, { positions }, origin, step) {
  const found = Float64Array.from(positions, (value, n) => origin[n % 3] + value * step)
  if (!found.every((value) => Math.abs(value) <= MOST)) reader.fail('a position is beyond 1e18')
  return found
}

function emptyMesh(counts) {
  const { triangleCount, vertexCount } = counts
  const corners = 3 * triangleCount
  return {
    ...counts,
    vertices: new Int32Array(corners), // of each corner
    twins: new Int32Array(corners).fill(-1), // of each edge, by the corner that it begins at: the same edge, as the triangle across has it
    seams: new Uint8Array(corners),
    island: new Int32Array(triangleCount),
    part: new Int32Array(triangleCount),
    positions: new Int32Array(3 * vertexCount),
    parameters: new Int32Array(2 * corners),
  }
}

/** Check that every island has a triangle. */
function checkIslands(reader, { island, islandCount }) {
  const seen = new Set(island)
  seen.delete(-1)
  if (seen.size < islandCount) reader.fail('an island has no triangle')
}

function parseText(reader) {
  const length = reader.varint('length of a name', 200)
  return new TextDecoder().decode(reader.data.slice(reader.take(length, 'name'), reader.place))
}
