/** Warp fields [3]: what takes texel steps of a chart to pixel steps of the exemplar. */

import { range } from './numbers.js'

/** What a matrix of a field has where one texel is one pixel. */
export const UNIT = 4096

const OCTAVE = 32 // steps of a size
const ANGLES = 256 // steps of a full circle
const COSINES = range(ANGLES).map((k) => Math.round(2 ** 14 * Math.cos((2 * Math.PI * k) / ANGLES)))
const POWERS = range(OCTAVE).map((k) => Math.round(2 ** 14 * 2 ** (k / OCTAVE)))

/** A grid of matrices (m00, m01, m10, m11), rows × columns of them, every 32 texels from −32·margin on. */
export class WarpField {
  constructor(margin, rows, columns, matrices, isIdentity = false) {
    this.margin = margin
    this.rows = rows
    this.columns = columns
    this.matrices = matrices
    this.isIdentity = isIdentity // a texel is a pixel, everywhere
  }

  /** The field of nodes (size down, size along, angle, shear). */
  static fromNodes(nodes, margin, rows, columns) {
    const matrices = new Int32Array(nodes.length)
    for (let n = 0; n < nodes.length; n += 4) {
      const [b, a, angle, shear] = nodes.subarray(n, n + 4)
      putColumn(matrices, n, b, angle + shear + ANGLES / 4)
      putColumn(matrices, n + 1, a, angle)
    }
    return new WarpField(margin, rows, columns, matrices, nodes.every((number) => number === 0))
  }

  /** The matrix at a texel, written to `out`. */
  at(row, column, out) {
    const { margin, rows, columns, matrices } = this
    let [i, j, down, right] = [margin + (row >> 5), margin + (column >> 5), row & 31, column & 31]
    if (i < 0 || i >= rows - 1) [i, down] = [i < 0 ? 0 : rows - 1, 0]
    if (j < 0 || j >= columns - 1) [j, right] = [j < 0 ? 0 : columns - 1, 0]
    const [below, beside] = [Math.min(i + 1, rows - 1), Math.min(j + 1, columns - 1)]
    const a = 4 * (i * columns + j)
    const b = 4 * (i * columns + beside)
    const c = 4 * (below * columns + j)
    const d = 4 * (below * columns + beside)
    for (let k = 0; k < 4; k++) {
      const upper = (matrices[a + k] * (32 - right) + matrices[b + k] * right) * (32 - down)
      out[k] = (upper + (matrices[c + k] * (32 - right) + matrices[d + k] * right) * down + 512) >> 10
    }
    return out
  }
}

/** The field of charts that have none: a texel is a pixel. */
export const IDENTITY_FIELD = new WarpField(0, 1, 1, Int32Array.of(UNIT, 0, 0, UNIT), true)

/** Put a column of length `steps` toward an angle into a matrix. */
function putColumn(matrices, at, steps, angle) {
  const octave = Math.floor(steps / OCTAVE)
  const size = (POWERS[steps - OCTAVE * octave] << (6 + octave)) >> 6
  matrices[at] = Math.floor((size * COSINES[(angle - ANGLES / 4) & 255] + 32768) / 65536)
  matrices[at + 2] = Math.floor((size * COSINES[angle & 255] + 32768) / 65536)
}

/**
 * Pixel steps, in 1/16, from the source of a block with centre matrix `center` to a texel with matrix `there`, so many
 * texels down and to the right of its centre: half the sum of both matrices times the texel steps.
 */
export function displacement(center, there, down, right) {
  return [
    Math.floor(((center[0] + there[0]) * down + (center[1] + there[1]) * right + 256) / 512),
    Math.floor(((center[2] + there[2]) * down + (center[3] + there[3]) * right + 256) / 512),
  ]
}
