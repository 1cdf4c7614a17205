/** The surface [2]: a built-in one by its parameters, control nets, or a mesh. */

import { fromZigzag, range } from './numbers.js'
import { parseMesh } from './mesh/parse.js'
import { parseSeams } from './seams.js'

export const MAX_PATCHES = 65536
const MAX_POINTS = 2 ** 20
const MAX_BUILT_IN = 2 ** 14
const MAX_TOLERANCE = 0.01

// How parameters are read.
const number = (reader, name) => reader.float(name, 8)
const checkLength = (reader, name, value) => reader.within(value, name, 1e-9, 1e9)
const length = (reader, name) => checkLength(reader, name, number(reader, name))
const lengthOrZero = (reader, name) => {
  const value = number(reader, name)
  return value && checkLength(reader, name, value)
}
const span = (reader, name) => reader.varint(name, 256, 3)
const spans = (reader, name) => [reader.varint(name, 256, 1), reader.varint(name, 256, 1)]
const evenSpans = (reader, name) => {
  const counts = spans(reader, name)
  if (counts.some((count) => count < 4 || count % 2)) {
    reader.fail(`${name} is ${counts}; allowed: even numbers from 4 to 256`)
  }
  return counts
}
const tiling = (reader, name) => reader.u8(name, 1)

// Rows and columns of faces.
const oneOfSpans = ({ spans }) => [spans]
const oneRow = ({ spans }) => [[1, spans]]
const octantsOrSix = ({ tiling }) => (tiling ? [[2, 4]] : range(6).map(() => [1, 1]))

// By number: names, parameters with their defaults and how they are read, and rows and columns of its faces.
const BUILT_IN = {
  1: ['cyclide', { a: [6, length], c: [2, lengthOrZero], mu: [3, number], spans: [[4, 4], evenSpans] }],
  2: ['torus', { R: [2, length], r: [0.7, length], spans: [[4, 4], evenSpans] }],
  3: ['sphere', { r: [1, length], tiling: [0, tiling] }, octantsOrSix],
  4: ['plane', { width: [1, length], height: [1, length], spans: [[1, 1], spans] }],
  5: ['ellipsoid', { rx: [1.5, length], ry: [1, length], rz: [0.75, length] }, () => [[2, 4]]],
  6: ['cylinder', { r: [1, length], h: [2, length], spans: [4, span] }, oneRow],
  7: ['cone', { r1: [1, length], r2: [0.4, lengthOrZero], h: [1.5, length], spans: [4, span] }, oneRow],
  8: ['vase', { radius: [0.8, length], height: [2.4, length], spans: [4, span] }, ({ spans }) => [[10, spans]]],
}
const MESH = 9
const LAST = Math.max(MESH, ...Object.keys(BUILT_IN))

export function parseSurface(reader, maxTriangles) {
  const kind = reader.u8('kind of surface', LAST)
  const surface = parseKind(reader, kind, maxTriangles)
  reader.end('surface')
  return surface
}

function parseKind(reader, kind, maxTriangles) {
  if (kind === MESH) return parseMesh(reader, maxTriangles)
  const surface = kind ? parseBuiltIn(reader, BUILT_IN[kind]) : parseNets(reader)
  return { ...surface, ...parseSeams(reader, surface.faces) }
}

function parseBuiltIn(reader, [kind, parameters, gridsOf = oneOfSpans]) {
  const entries = Object.entries(parameters)
  const present = reader.left ? reader.u8('which parameters follow', 2 ** entries.length - 1) : 0
  const params = {}
  entries.forEach(([name, [value, read]], k) => {
    params[name] = (present >> k) & 1 ? read(reader, name) : value
  })
  const { a, c, mu, R, r } = params
  if (kind === 'cyclide' && !(c < a && c < mu && mu <= a)) reader.fail('a, c and mu are no ring: allowed: c < mu <= a')
  if (kind === 'torus' && !(r < R)) reader.fail(`r is ${r}; allowed: less than R, ${R}`)
  const { faces, patchCount } = layFaces(gridsOf(params))
  reader.within(patchCount, 'number of patches', 1, MAX_BUILT_IN)
  return { kind, params, faces, patchCount }
}

/** Faces of so many [rows, columns] of patches, which are numbered face after face, in each row by row. */
function layFaces(grids) {
  let patchCount = 0
  const faces = grids.map(([rows, columns]) => {
    const face = { rows, columns, firstPatch: patchCount }
    patchCount += rows * columns
    return face
  })
  return { faces, patchCount }
}

// Flags of control nets.
const DOUBLE = 1
const WEIGHTED = 2
const ALIKE = 4
const GRIDS = 8

function parseNets(reader) {
  const flags = reader.u8('flags of the nets', 15)
  const nameLength = reader.varint('length of the name', 200)
  const name = new TextDecoder().decode(reader.data.slice(reader.take(nameLength, 'name'), reader.place))
  const tolerance = reader.within(reader.float('tolerance', 8), 'tolerance', 0, MAX_TOLERANCE)
  const { faces, patchCount } = layFaces(parseGrids(reader, Boolean(flags & GRIDS)))
  const patches = parseDegrees(reader, patchCount, Boolean(flags & ALIKE))
  const total = patches.reduce((sum, { m, n }) => sum + (m + 1) * (n + 1), 0)
  const { index, count } = parseReferences(reader, total)
  const points = parsePoints(reader, count, flags)
  let place = 0
  for (const patch of patches) {
    const size = (patch.m + 1) * (patch.n + 1)
    patch.net = new Float64Array(4 * size)
    for (let k = 0; k < size; k++, place++) {
      patch.net.set(points.subarray(4 * index[place], 4 * index[place] + 4), 4 * k)
    }
  }
  return { kind: 'nets', name, tolerance, faces, patches, patchCount }
}

/** Rows and columns of patches of each face; one of each if they are not stored. */
function parseGrids(reader, areStored) {
  const count = reader.varint('number of faces', MAX_PATCHES, 1)
  let left = MAX_PATCHES - count
  return range(count).map(() => {
    if (!areStored) return [1, 1]
    const rows = reader.varint('rows of a face', left + 1, 1)
    const columns = reader.varint('columns of a face', Math.floor((left + 1) / rows), 1)
    left -= rows * columns - 1
    return [rows, columns]
  })
}

/** Degrees (m, n) of each patch. */
function parseDegrees(reader, count, alike) {
  const patches = []
  let total = 0
  for (let k = 0; k < count; k++) {
    const { m, n } = k && alike ? patches[0] : { m: reader.u8('degree', 32, 1), n: reader.u8('degree', 32, 1) }
    patches.push({ m, n })
    total += (m + 1) * (n + 1)
    if (total > MAX_POINTS) reader.fail(`nets have ${total} control points; allowed: ${MAX_POINTS}`)
  }
  return patches
}

/** Which point of the list each of `total` places in the nets has, and how many points there are. */
function parseReferences(reader, total) {
  const packed = reader.take(Math.ceil(total / 8), 'list of new points')
  const index = new Int32Array(total)
  const references = []
  let count = 0
  for (let n = 0; n < total; n++) {
    if ((reader.data[packed + (n >> 3)] >> (n & 7)) & 1) index[n] = count++
    else references.push([n, count - 1])
  }
  let last = 0
  for (const [n, most] of references) {
    last += fromZigzag(reader.varint('reference to a point', 2 * MAX_POINTS))
    index[n] = reader.within(last, 'reference to a point', 0, most)
  }
  return { index, count }
}

/** Control points (w·x, w·y, w·z, w). */
function parsePoints(reader, count, flags) {
  const [bytes, columns] = [flags & DOUBLE ? 8 : 4, flags & WEIGHTED ? 4 : 3]
  if (count * columns * bytes > reader.left) reader.fail('control points take more bytes than are left')
  const points = new Float64Array(4 * count)
  for (let n = 0; n < count; n++) {
    for (let k = 0; k < columns; k++) points[4 * n + k] = reader.float('control point', bytes)
    const weight = columns === 4 ? points[4 * n + 3] : (points[4 * n + 3] = 1)
    reader.within(weight, 'weight', 1e-30, 1e30)
    for (let k = 0; k < 3; k++) {
      if (bytes === 4) points[4 * n + k] *= weight
      reader.within(points[4 * n + k], 'control point, times its weight', -1e30, 1e30)
    }
  }
  return points
}
