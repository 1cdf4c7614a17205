/** Painting charts of models that have too many texels for the page: 2^shrink each way become one. */

import { shrunk } from '../uph/numbers.js'

/** Paint a chart's role as RGBA into `into`, a gutter left free. */
export function paintShrunk(decoder, chart, role, into, stride, shrink) {
  const inside = 4 * (stride + 1)
  const { height, width } = decoder.charts[chart]
  const step = 2 ** shrink
  const [shrunkHeight, shrunkWidth] = [shrunk(height, shrink), shrunk(width, shrink)]
  const rows = Math.min(step, height)
  const columns = Math.min(step, width)
  const band = new Uint8Array(4 * rows * width)
  for (let row = 0; row < shrunkHeight; row++) {
    decoder.rgba(chart, { role, into: band, stride: width, start: row * rows, stop: (row + 1) * rows })
    for (let column = 0; column < shrunkWidth; column++) {
      for (let k = 0; k < 4; k++) {
        let sum = 0
        for (let i = 0; i < rows; i++) {
          for (let j = 0; j < columns; j++) sum += band[4 * (i * width + column * columns + j) + k]
        }
        into[inside + 4 * (row * stride + column) + k] = Math.round(sum / (rows * columns))
      }
    }
  }
}
