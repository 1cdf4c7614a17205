/** Chunk B, a base [2.1]: a coarse mesh of the whole surface, shown until the surface and its layout have come. */

import { WarpField } from './field.js'
import { TRIANGLES_A_BYTE, parseTriangles, placed } from './mesh/parse.js'
import { range } from './numbers.js'

const SIDES = 6 // of the box: +x −x +y −y +z −z
const MOST_STEPS = 512 // of a chart, each way, without its margins
const MARGIN = 8 // steps
const MOST_PIXELS = 2 ** 24 // of the exemplar in a step of positions
const OCTAVE = 32 // steps of a node's size
const MOST_OCTAVES = 6

// Axis and sign of s, then of t, per side: seen from outside with z up (on ±z with y up), s runs down.
const PLACES = [
  [[2, -1], [1, 1]],
  [[2, -1], [1, -1]],
  [[2, -1], [0, -1]],
  [[2, -1], [0, 1]],
  [[1, -1], [0, 1]],
  [[1, -1], [0, -1]],
]

/** Returns its surface, charts and warp fields: one chart for each side of the box that triangles face. */
export function parseBase(reader, maxTriangles) {
  const triangleCount = reader.varint('number of triangles', Math.min(maxTriangles, TRIANGLES_A_BYTE * reader.left), 1)
  const vertexCount = reader.varint('number of vertices', 3 * triangleCount, 1)
  const bits = reader.u8('bits of a coordinate', 16)
  const [x, y, z, step, pixel, metres] = range(6).map(() => reader.float('origin or step', 4))
  if (!(step > 0 && pixel > 0 && metres >= 0)) reader.fail('a length of the base is not above 0')
  if (step > MOST_PIXELS * pixel) reader.fail('a step of the base has more than 2^24 pixels')
  const angles = range(SIDES).map(() => reader.u8('angle', 255))
  const mesh = parseTriangles(reader, { triangleCount, vertexCount, islandCount: 1, parts: [''], limit: 2 ** bits - 1 })
  const sides = Array.from(mesh.island, (_, t) => sideOf(mesh, t))
  const used = range(SIDES).filter((side) => sides.includes(side))
  const surface = {
    kind: 'mesh',
    name: '',
    metres: metres || null,
    parts: [''],
    faces: used.map(() => null),
    triangles: mesh.vertices,
    island: Int32Array.from(sides, (side) => used.indexOf(side)),
    part: mesh.part,
    seams: mesh.seams,
    positions: placed(reader, mesh, [x, y, z], step),
    parameters: parametersOf(mesh, sides, step),
  }
  const box = boxOf(mesh).map((ends) => ends.map((end) => end * step))
  let octaves = 0
  while (Math.max(...box.map(([low, high]) => high - low)) / (pixel * 2 ** octaves) > MOST_STEPS) octaves++
  const size = OCTAVE * Math.min(octaves, MOST_OCTAVES)
  return {
    surface,
    charts: used.map((side, island) => chartOn(island, box, side, pixel * 2 ** octaves)),
    fields: used.map((side) => WarpField.fromNodes(Int16Array.of(size, size, angles[side], 0), 0, 1, 1)),
  }
}

/** The side that a triangle faces, by the greatest part of its normal. */
function sideOf({ vertices, positions: p }, t) {
  const [a, b, c] = [0, 1, 2].map((k) => 3 * vertices[3 * t + k])
  const [u, v] = [b, c].map((d) => [0, 1, 2].map((k) => p[d + k] - p[a + k]))
  const normal = [0, 1, 2].map((k) => u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3])
  const sizes = normal.map(Math.abs)
  const axis = sizes.indexOf(Math.max(...sizes))
  return 2 * axis + (normal[axis] < 0 ? 1 : 0)
}

/** (s, t) of each corner, as it lies on the side of its triangle. */
function parametersOf({ vertices, positions }, sides, step) {
  const parameters = new Float64Array(2 * vertices.length)
  vertices.forEach((vertex, corner) => {
    PLACES[sides[Math.floor(corner / 3)]].forEach(([axis, sign], j) => {
      parameters[2 * corner + j] = sign * positions[3 * vertex + axis] * step
    })
  })
  return parameters
}

/** The least and the greatest coordinate along each axis. */
function boxOf({ positions }) {
  const box = range(3).map(() => [Infinity, -Infinity])
  positions.forEach((value, n) => {
    const ends = box[n % 3]
    ends[0] = Math.min(ends[0], value)
    ends[1] = Math.max(ends[1], value)
  })
  return box
}

/** The chart over a side of a box, with margins. */
function chartOn(face, box, side, step) {
  const [[low0, high0], [low1, high1]] = PLACES[side].map(([axis, sign]) => {
    const places = box[axis].map((end) => (sign * end) / step)
    return [Math.floor(Math.min(...places)) - MARGIN, Math.ceil(Math.max(...places)) + MARGIN]
  })
  return { face, height: high0 - low0, width: high1 - low1, s0: low0 * step, s1: high0 * step, t0: low1 * step, t1: high1 * step }
}
