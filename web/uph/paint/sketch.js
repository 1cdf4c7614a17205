/** Sketches of charts: few texels, without masks, for as long as those are still to come. */

import { clamp, shrunk } from '../numbers.js'
import { centerMatrix, topLeft } from '../plans/placement.js'
import { SYMMETRIES } from '../symmetry.js'

/**
 * Samples of a chart of which one stands for 2^shrink texels each way, as the middle one of those: of the placement whose own middle is
 * nearest there, for its size, as the field is at that middle.
 */
export function sketch({ chart, field, placements, pyramid: { picture, mean }, shrink }) {
  const { channels, data } = picture
  const [height, width] = [shrunk(chart.height, shrink), shrunk(chart.width, shrink)]
  const out = new data.constructor(height * width * channels).map((_, n) => mean[n % channels])
  const least = new Float32Array(height * width).fill(2)
  const half = (1 << shrink) >> 1
  for (const placement of placements) {
    const [top, left] = topLeft(placement).map((texel) => Math.max(0, texel >> shrink))
    const pixelAt = pixelsOf(placement, field, picture)
    for (let row = top; row < height; row++) {
      const y = (row << shrink) + half - placement.row
      if (2 * y > placement.height) break
      for (let column = left; column < width; column++) {
        const x = (column << shrink) + half - placement.column
        if (2 * x > placement.width) break
        const far = Math.max(Math.abs(y) / placement.height, Math.abs(x) / placement.width)
        const at = row * width + column
        if (far >= least[at]) continue
        least[at] = far
        const from = channels * pixelAt(y, x)
        for (let k = 0; k < channels; k++) out[channels * at + k] = data[from + k]
      }
    }
  }
  return out
}

/** A function that tells which pixel lies so many texels below a placement's middle, and to the right of it. */
function pixelsOf({ sourceRow, sourceColumn, symmetry, ...placement }, field, { height, width, skipped = 0 }) {
  const [a, b, c, d] = centerMatrix(placement, field)
  const [p, q, r, s] = SYMMETRIES[symmetry]
  const pixel = (source, size) => clamp((source + (8 << skipped)) >> (4 + skipped), 0, size - 1)
  return (y, x) => {
    const [v, w] = [(a * y + b * x) / 256, (c * y + d * x) / 256]
    return pixel(sourceRow + p * v + q * w, height) * width + pixel(sourceColumn + r * v + s * w, width)
  }
}
