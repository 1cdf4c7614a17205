/** A mesh in place of a surface of patches [2, 5.4]. */

import { range } from '../numbers.js'
import { FrontDecoder } from './front.js'
import { MeshNumbers } from './numbers.js'
import { decodeParameters } from './parameters.js'
import { decodePositions } from './positions.js'
import { WedgeDecoder } from './wedges.js'

const MAX_PARTS = 2 ** 16
const TRIANGLES_A_BYTE = 4096
const MOST = 1e18 // of a position

/** Returns the surface: positions, and per corner of a triangle its vertex and (s, t) on its island. */
export function parseMesh(reader, maxTriangles) {
  const name = parseText(reader)
  const metres = reader.u8('flags of the mesh', 1) ? reader.float('metres', 8) : null
  const partCount = reader.varint('number of parts', Math.min(MAX_PARTS, reader.left), 1)
  const parts = range(partCount).map(() => parseText(reader))
  const triangleCount = reader.varint('number of triangles', Math.min(maxTriangles, TRIANGLES_A_BYTE * reader.left), 1)
  const vertexCount = reader.varint('number of vertices', 3 * triangleCount, 1)
  const wedgeCount = reader.varint('number of wedges', 3 * triangleCount)
  const islandCount = reader.varint('number of islands', triangleCount, 1)
  const bits = reader.u8('bits of a coordinate', 16)
  const [x, y, z, step, unit] = range(5).map(() => reader.float('origin or step', 8))
  if (!(step > 0 && unit > 0)) reader.fail('a step is not above 0')
  const mesh = emptyMesh({ triangleCount, vertexCount, wedgeCount, islandCount, parts })
  const numbers = new MeshNumbers(reader)
  new FrontDecoder(numbers, mesh).decode()
  decodePositions(numbers, mesh, 2 ** bits - 1)
  new WedgeDecoder(numbers, mesh).decode()
  decodeParameters(numbers, mesh)
  if (numbers.bits.unread) reader.fail('mesh has bytes too many')
  const positions = Float64Array.from(mesh.positions, (value, n) => [x, y, z][n % 3] + value * step)
  const parameters = cornerParameters(mesh, unit)
  if (!positions.every((value) => Math.abs(value) <= MOST) || !parameters.every(Number.isFinite)) {
    reader.fail('a position is beyond 1e18, or a parameter is not finite')
  }
  checkIslands(reader, mesh)
  reader.take(reader.left)
  return {
    kind: 'mesh',
    name,
    metres,
    parts,
    faces: range(islandCount).map(() => null),
    triangles: mesh.triangles,
    island: mesh.island,
    part: mesh.part,
    seams: seamsOf(mesh),
    positions,
    parameters,
  }
}

function emptyMesh(counts) {
  const { triangleCount, vertexCount, wedgeCount } = counts
  const list = (length, value = 0) => new Int32Array(length).fill(value)
  return {
    ...counts,
    triangles: list(3 * triangleCount),
    twins: list(3 * triangleCount, -1),
    earlierCorners: list(3 * triangleCount),
    latestCorner: list(vertexCount, -1),
    island: list(triangleCount),
    part: list(triangleCount),
    positions: list(3 * vertexCount),
    cornerWedges: list(3 * triangleCount, -1),
    wedgeNext: list(3 * triangleCount),
    wedgeCorners: list(wedgeCount, -1),
    parameters: list(2 * wedgeCount),
  }
}

/** Check that every island has a triangle. */
function checkIslands(reader, { island, islandCount }) {
  const seen = new Set(island)
  seen.delete(-1)
  if (seen.size < islandCount) reader.fail('an island has no triangle')
}

function cornerParameters({ parameters, cornerWedges }, unit) {
  const out = new Float64Array(2 * cornerWedges.length)
  cornerWedges.forEach((wedge, corner) => {
    for (let j = 0; j < 2 && wedge >= 0; j++) out[2 * corner + j] = parameters[2 * wedge + j] * unit
  })
  return out
}

/** Which edges, by the corners that they begin at, are seams or borders. */
function seamsOf({ triangles, twins, cornerWedges }) {
  return Uint8Array.from(triangles, (_, corner) => {
    const twin = twins[corner]
    if (twin < 0) return 1
    const next = (n) => n - (n % 3) + ((n + 1) % 3)
    return cornerWedges[corner] !== cornerWedges[next(twin)] || cornerWedges[next(corner)] !== cornerWedges[twin] ? 1 : 0
  })
}

function parseText(reader) {
  const length = reader.varint('length of a name', 200)
  return new TextDecoder().decode(reader.data.slice(reader.take(length, 'name'), reader.place))
}
