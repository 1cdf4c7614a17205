/** Weights of a placement whose mask is a ramp [8]. */

import { range } from '../numbers.js'

const SIDE_TOP = 1
const SIDE_LEFT = 2

/** Fill `weights` with those of rows [start, stop). */
export function fillRamp({ width, sides, ramp }, weights, start, stop) {
  const factor = (n, side) => (sides & side && n < ramp ? Math.floor(((2 * n + 1) * 128) / ramp) : 256)
  const factors = range(width).map((j) => factor(j, SIDE_LEFT))
  for (let i = start, k = 0; i < stop; i++) {
    const down = factor(i, SIDE_TOP)
    for (let j = 0; j < width; j++) weights[k++] = (down * factors[j]) >> 8
  }
}
