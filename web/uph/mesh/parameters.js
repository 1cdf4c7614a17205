/** Parameters of a mesh's wedges [5.4]. */

import { clamp } from '../numbers.js'
import { bitLength, signOf, sizeClass } from './numbers.js'

const MOST = 2 ** 28
const PARAMETER = 5 // a plain number
const FIRST_AXIS = 3

export function decodeParameters(numbers, mesh) {
  const { parameters: q, wedgeCount } = mesh
  const left = new Int32Array(2 * wedgeCount)
  for (let w = 0; w < wedgeCount; w++) {
    const guess = guessOf(mesh, left, w)
    let before = 0
    for (let j = 0; j < 2; j++) {
      const at = 2 * w + j
      let value
      if (guess.known) {
        const old = left[at - 2]
        const spread = Math.min(31, sizeClass(guess.spread))
        const places = [
          Math.min(31, sizeClass(guess.left[j])),
          Math.min(3, guess.known) * 32 + spread,
          j ? before : 32 + Math.min(15, bitLength(left[2 * w - 2])),
          Math.min(15, bitLength(guess.size)) * 16 + Math.min(15, bitLength(old)),
        ]
        const signs = [signOf(guess.signs[j]) * 9 + signOf(old) * 3 + (j ? signOf(left[2 * w]) : 0), spread]
        value = left[at] = numbers.leftover(FIRST_AXIS + j, places, signs)
      } else value = numbers.plain(PARAMETER)
      q[at] = numbers.within(guess.value[j] + value, -MOST, MOST)
      before = Math.min(31, bitLength(value))
    }
  }
}

function guessOf(mesh, left, w) {
  const { parameters: q, cornerWedges, wedgeCorners, wedgeNext } = mesh
  const guess = { value: [0, 0], known: 0, spread: 0, left: [0, 0], signs: [0, 0], size: 0 }
  let last = null
  let one = -1
  for (let corner = wedgeCorners[w]; corner >= 0; corner = wedgeNext[corner]) {
    const first = corner - (corner % 3)
    const a = cornerWedges[first + ((corner + 1) % 3)]
    const b = cornerWedges[first + ((corner + 2) % 3)]
    if (a < w && b < w) {
      const turned = turn(mesh, corner)
      if (last) guess.spread = Math.max(guess.spread, Math.abs(turned[0] - last[0]) + Math.abs(turned[1] - last[1]))
      last = turned
      guess.known++
      guess.size = Math.abs(q[2 * a] - q[2 * b]) + Math.abs(q[2 * a + 1] - q[2 * b + 1])
      for (let j = 0; j < 2; j++) {
        const [la, lb] = [left[2 * a + j], left[2 * b + j]]
        guess.value[j] += turned[j]
        guess.left[j] += Math.abs(la) + Math.abs(lb)
        guess.signs[j] += la + lb
      }
    } else if (a < w) one = Math.max(one, a)
    else if (b < w) one = Math.max(one, b)
  }
  const { known, value } = guess
  if (known) {
    guess.value = value.map((x) => Math.floor((2 * x + known) / (2 * known)))
    guess.left = guess.left.map((x) => Math.floor(x / known))
  } else if (one >= 0) guess.value = [q[2 * one], q[2 * one + 1]]
  return guess
}

/** Where the parameters of a corner should lie, from those of the triangle's others and its shape. */
function turn({ positions: p, parameters: q, triangles, cornerWedges }, corner) {
  const first = corner - (corner % 3)
  const [atA, atB] = [first + ((corner + 1) % 3), first + ((corner + 2) % 3)]
  const [a, b, c] = [triangles[atA], triangles[atB], triangles[corner]]
  const [wa, wb] = [2 * cornerWedges[atA], 2 * cornerWedges[atB]]
  const [ex, ey, ez] = [0, 1, 2].map((k) => p[3 * b + k] - p[3 * a + k])
  const [dx, dy, dz] = [0, 1, 2].map((k) => p[3 * c + k] - p[3 * a + k])
  const square = ex * ex + ey * ey + ez * ez
  if (!square) return [q[wa], q[wa + 1]]
  const [nx, ny, nz] = [ey * dz - ez * dy, ez * dx - ex * dz, ex * dy - ey * dx]
  const along = (ex * dx + ey * dy + ez * dz) / square
  const up = Math.sqrt(nx * nx + ny * ny + nz * nz) / square
  const [s, t] = [q[wb] - q[wa], q[wb + 1] - q[wa + 1]]
  const round = (x) => Math.floor(clamp(x, -MOST, MOST) + 0.5)
  return [round(q[wa] + (along * s - up * t)), round(q[wa + 1] + (along * t + up * s))]
}
