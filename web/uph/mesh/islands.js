/** Seams, islands, parts and parameters of a mesh [5.4]. */

import { clamp } from '../numbers.js'
import { ISLAND, PART, PLAIN, SEAM, nextCorner } from './mesh-numbers.js'

const MOST = 2 ** 28 // steps of a parameter

/** Decodes `seams`, `island`, `part` and `parameters`. */
export function decodeIslands(numbers, mesh) {
  const pieces = Int32Array.from(mesh.island, (_, t) => t)
  const wedges = Int32Array.from(mesh.vertices, (_, corner) => corner)
  decodeSeams(numbers, mesh, pieces, wedges)
  const left = new Int32Array(2 * wedges.length)
  const last = [-1, 0] // island and part that were coded last
  for (let t = 0; t < pieces.length; t++) {
    const first = root(pieces, t)
    if (first === t) {
      last[0] = numbers.within(ISLAND, last[0] + 1, -1, mesh.islandCount - 1)
      if (mesh.parts.length > 1) last[1] = numbers.within(PART, last[1], 0, mesh.parts.length - 1)
    }
    mesh.island[t] = first < t ? mesh.island[first] : last[0]
    mesh.part[t] = first < t ? mesh.part[first] : last[1]
    for (let k = 0; k < 3 && mesh.island[t] >= 0; k++) decodeParameters(numbers, mesh, wedges, left, 3 * t + k)
  }
}

/** The first of what is joined. */
function root(links, at) {
  while (links[at] !== at) at = links[at] = links[links[at]]
  return at
}

function join(links, one, other) {
  const [a, b] = [root(links, one), root(links, other)]
  links[Math.max(a, b)] = Math.min(a, b)
}

/** Which edges, by the corners that they begin at, are seams or borders; what the others join. */
function decodeSeams(numbers, { twins, seams }, pieces, wedges) {
  for (let edge = 0; edge < twins.length; edge++) {
    const twin = twins[edge]
    if (twin < 0) seams[edge] = 1
    if (twin < 0 || twin > edge) continue
    if (numbers.flag(SEAM)) seams[edge] = seams[twin] = 1
    else {
      join(pieces, Math.floor(edge / 3), Math.floor(twin / 3))
      join(wedges, edge, nextCorner(twin))
      join(wedges, nextCorner(edge), twin)
    }
  }
}

function decodeParameters(numbers, mesh, wedges, left, corner) {
  const { parameters: q } = mesh
  const first = root(wedges, corner)
  const next = nextCorner(corner)
  const others = [next, nextCorner(next)]
  const [a, b] = others.map((one) => root(wedges, one))
  const isGuessed = a < corner && b < corner
  const guess = first === corner && isGuessed ? turned(mesh, corner, others, [a, b]) : [0, 1].map((j) => (corner ? q[2 * corner - 2 + j] : 0))
  for (let j = 0; j < 2; j++) {
    const at = 2 * corner + j
    if (first < corner) [q[at], left[at]] = [q[2 * first + j], left[2 * first + j]]
    else if (isGuessed) {
      q[at] = numbers.leftover(1, Math.abs(left[2 * a + j]) + Math.abs(left[2 * b + j]), guess[j], -MOST, MOST)
      left[at] = q[at] - guess[j]
    } else q[at] = numbers.within(PLAIN, guess[j], -MOST, MOST)
  }
}

/** The predicted parameters of a corner, from those of the two `others` of the triangle, at corners a and b, and its shape. */
function turned({ positions: p, parameters: q, vertices }, corner, others, [a, b]) {
  const at = (one) => [0, 1, 2].map((k) => p[3 * vertices[one] + k])
  const [from, to, here] = [...others, corner].map(at)
  const [ex, ey, ez] = to.map((x, k) => x - from[k])
  const [dx, dy, dz] = here.map((x, k) => x - from[k])
  const square = ex * ex + ey * ey + ez * ez
  if (!square) return [q[2 * a], q[2 * a + 1]]
  const [nx, ny, nz] = [ey * dz - ez * dy, ez * dx - ex * dz, ex * dy - ey * dx]
  const along = (ex * dx + ey * dy + ez * dz) / square
  const up = Math.sqrt(nx * nx + ny * ny + nz * nz) / square
  const [s, t] = [q[2 * b] - q[2 * a], q[2 * b + 1] - q[2 * a + 1]]
  const round = (x) => Math.floor(clamp(x, -MOST, MOST) + 0.5)
  return [round(q[2 * a] + (along * s - up * t)), round(q[2 * a + 1] + (along * t + up * s))]
}
