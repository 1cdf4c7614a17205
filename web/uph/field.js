/** Warp fields [3]: what takes steps of a chart to pixel steps of the exemplar. */

import { range } from './numbers.js'

/** What a matrix of a field has where one step is one pixel. */
const UNIT = 4096

const OCTAVE = 32 // steps of a size
const ANGLES = 256 // steps of a full circle
const COSINES = range(ANGLES).map((k) => Math.round(2 ** 14 * Math.cos((2 * Math.PI * k) / ANGLES)))
const POWERS = range(OCTAVE).map((k) => Math.round(2 ** 14 * 2 ** (k / OCTAVE)))

/** A grid of matrices (m00, m01, m10, m11), rows × columns of them, in the middle of every 32nd step from −32·margin on. */
export class WarpField {
  constructor(margin, rows, columns, matrices, isIdentity = false) {
    this.margin = margin
    this.rows = rows
    this.columns = columns
    this.matrices = matrices
    this.isIdentity = isIdentity // a step is a pixel, everywhere
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

  /** The matrix at a place in 1/16 step, written to `out`. */
  at(row, column, out) {
    const { columns, matrices } = this
    const [above, below, down] = nodesRound(this.margin, this.rows, row)
    const [left, next, right] = nodesRound(this.margin, columns, column)
    for (let k = 0; k < 4; k++) {
      const first = between(matrices[4 * (above * columns + left) + k], matrices[4 * (below * columns + left) + k], down)
      const second = between(matrices[4 * (above * columns + next) + k], matrices[4 * (below * columns + next) + k], down)
      out[k] = between(first, second, right)
    }
    return out
  }

  /** The same at places along a row, one matrix after another. */
  along(row, places, out) {
    const { columns, matrices } = this
    const [above, below, down] = nodesRound(this.margin, this.rows, row)
    const line = new Int32Array(4 * columns)
    for (let n = 0; n < line.length; n++) line[n] = between(matrices[4 * above * columns + n], matrices[4 * below * columns + n], down)
    let [left, next] = [0, 0]
    for (let n = 0, before = NaN; n < places.length; n++) {
      const place = places[n] - 8
      if (place >> 9 !== before) [left, next] = nodesRound(this.margin, columns, places[n])
      before = place >> 9
      for (let k = 0, at = 4 * n; k < 4; k++, at++) {
        const first = line[4 * left + k]
        out[at] = left === next ? first : between(first, line[4 * next + k], place & 511)
      }
    }
  }
}

/** The nodes on either side of a place in 1/16 step, and how far it lies between them, in 1/512; beyond the grid its border. */
function nodesRound(margin, count, place) {
  const n = margin + ((place - 8) >> 9)
  if (n < 0) return [0, 0, 0]
  return n < count - 1 ? [n, n + 1, (place - 8) & 511] : [count - 1, count - 1, 0]
}

const between = (a, b, fraction) => (a * (512 - fraction) + b * fraction + 256) >> 9

/** The field of charts that have none: a step is a pixel. */
export const IDENTITY_FIELD = new WarpField(0, 1, 1, Int32Array.of(UNIT, 0, 0, UNIT), true)

/** Put a column of length `steps` toward an angle into a matrix. */
function putColumn(matrices, at, steps, angle) {
  const octave = Math.floor(steps / OCTAVE)
  const size = (POWERS[steps - OCTAVE * octave] << (6 + octave)) >> 6
  matrices[at] = Math.floor((size * COSINES[(angle - ANGLES / 4) & 255] + 32768) / 65536)
  matrices[at + 2] = Math.floor((size * COSINES[angle & 255] + 32768) / 65536)
}
