/** Inverse wavelet transforms [7.4]. */

import { sizeAt } from './bands.js'

const SCALE_97 = 1.149604398860241

/** Take `factor` times the sum of its neighbours off every other sample, from `first` on. */
function lift(x, n, first, factor) {
  const last = n - 1
  if (!first) x[0] -= factor * (x[1] + x[1])
  for (let k = 2 - first; k < last; k += 2) x[k] -= factor * (x[k - 1] + x[k + 1])
  if ((last & 1) === first) x[last] -= factor * (x[last - 1] + x[last - 1])
}

/** What low-pass and high-pass samples are multiplied with, then how they are mixed. */
export const NINE_SEVEN = {
  scales: [1 / SCALE_97, SCALE_97],
  mix(x, n) {
    lift(x, n, 0, 0.443506852043971)
    lift(x, n, 1, 0.882911075530934)
    lift(x, n, 0, -0.052980118572961)
    lift(x, n, 1, -1.586134342059924)
  },
}

/** Undo a level of a line of n samples, `step` apart. */
function inverseLine(plane, start, step, n, line, { scales: [even, odd], mix }) {
  const low = (n + 1) >> 1
  for (let k = 0, at = start; k < n; k += 2, at += step) line[k] = plane[at] * even
  for (let k = 1, at = start + step * low; k < n; k += 2, at += step) line[k] = plane[at] * odd
  mix(line, n)
  for (let k = 0, at = start; k < n; k++, at += step) plane[at] = line[k]
}

/** Undo `levels` levels in place: of each, columns first. */
export function idwt2(plane, height, width, levels, transform) {
  const line = new plane.constructor(Math.max(height, width) + 1)
  for (let level = levels - 1; level >= 0; level--) {
    const rows = sizeAt(height, level)
    const columns = sizeAt(width, level)
    if (rows > 1) for (let c = 0; c < columns; c++) inverseLine(plane, c, width, rows, line, transform)
    if (columns > 1) for (let r = 0; r < rows; r++) inverseLine(plane, r * width, 1, columns, line, transform)
  }
}
