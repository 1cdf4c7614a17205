/** Where a mesh's vertices lie [5.4]. */

import { bitLength, signOf, sizeClass } from './numbers.js'

const AXIS = 2 // a plain number

export function decodePositions(numbers, mesh, most) {
  const { positions, vertexCount } = mesh
  const left = new Int32Array(3 * vertexCount)
  for (let v = 0; v < vertexCount; v++) {
    let before = 0
    for (let k = 0; k < 3; k++) {
      const guess = guessOf(mesh, left, v, k)
      const old = (back) => (v >= back ? left[3 * (v - back) + k] : 0)
      let value
      if (guess.known) {
        const spread = Math.min(31, sizeClass(guess.spread))
        const places = [
          Math.min(31, sizeClass(guess.left)),
          Math.min(3, guess.known) * 32 + spread,
          k ? before : 31 + Math.min(15, bitLength(left[3 * v - 3])),
          Math.min(15, bitLength(old(1))) * 16 + Math.min(15, bitLength(old(2))),
        ]
        const signs = [guess.sign * 9 + signOf(old(1)) * 3 + (k ? signOf(left[3 * v]) : 0), spread]
        value = left[3 * v + k] = numbers.leftover(k, places, signs)
      } else value = numbers.plain(AXIS)
      positions[3 * v + k] = numbers.within(guess.value + value, 0, most)
      before = before * 22 + Math.min(21, bitLength(Math.min(Math.abs(value), 2 ** 31)))
    }
  }
}

/** The mean of the parallelograms that known triangles across suggest, how many and how far apart they are. */
function guessOf({ positions, triangles, twins, latestCorner, earlierCorners }, left, v, k) {
  let [total, known, low, high] = [0, 0, Infinity, -Infinity]
  let [around, signs, neighbours] = [0, 0, 0]
  for (let corner = latestCorner[v]; corner >= 0; corner = earlierCorners[corner]) {
    const first = corner - (corner % 3)
    const opposite = first + ((corner + 1) % 3)
    const a = triangles[opposite]
    const b = triangles[first + ((corner + 2) % 3)]
    for (const vertex of [a, b]) {
      if (vertex >= v) continue
      around += Math.abs(left[3 * vertex + k])
      signs += left[3 * vertex + k]
      neighbours++
    }
    const twin = twins[opposite]
    if (a >= v || b >= v || twin < 0) continue
    const across = triangles[twin - (twin % 3) + ((twin + 2) % 3)]
    if (across >= v) continue
    const value = positions[3 * a + k] + positions[3 * b + k] - positions[3 * across + k]
    total += value
    known++
    low = Math.min(low, value)
    high = Math.max(high, value)
  }
  if (neighbours) around = Math.floor((2 * around) / neighbours)
  if (!known) return { value: v ? positions[3 * v - 3 + k] : 0, known, left: around }
  const value = Math.floor((2 * total + known) / (2 * known))
  return { value, known, spread: high - low, left: around, sign: signOf(signs) }
}
