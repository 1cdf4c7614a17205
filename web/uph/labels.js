/** Label maps [4]: which placement of a chart's layer each cell of a grid shows, −1 for none, and how they are coded [5.2]. */

import { BitDecoder } from './bits.js'
import { ceilDivide } from './numbers.js'

const OUTSIDE = -2

// Counters of a candidate's bit, by its place and context; and of plain bits after them.
const CONTEXTS = 256
const PLACES = 7
const MOST_BITS = 20

/** The cells of a chart's layer: squares of `cell` steps, with a row of them beyond each edge. */
export class CellGrid {
  constructor({ height, width }, cell, isHalf) {
    this.cell = cell
    this.rows = ceilDivide(height, cell) + 2
    this.columns = ceilDivide(width, cell) + 2
    /** What is added to a place in 1/16 step to count from the first cell's centre. */
    this.shift = 16 * cell - (isHalf ? 0 : 8 * cell)
  }

  get size() {
    return this.rows * this.columns
  }

  /** Where the cells of a row or column have their centre, in 1/16 step. */
  center(n) {
    return 16 * this.cell * n - this.shift
  }
}

/** Of each cell the placement whose own cell, `placements[n].cell`, is nearest, of several the first; −1 without any. */
export function nearestLabels({ rows, columns, size }, placements) {
  const above = new Int32Array(size).fill(-1) // of each cell the nearest one in its column
  placements.forEach(({ cell }, n) => (above[cell] = n))
  const rowOf = placements.map(({ cell }) => Math.floor(cell / columns))
  const below = above.slice()
  for (let n = columns; n < size; n++) if (above[n] < 0) above[n] = above[n - columns]
  for (let n = size - columns - 1; n >= 0; n--) if (below[n] < 0) below[n] = below[n + columns]
  for (let n = 0; n < size; n++) {
    const [a, b, i] = [above[n], below[n], Math.floor(n / columns)]
    if (a < 0 || (b >= 0 && rowOf[b] - i < i - rowOf[a])) above[n] = b
  }
  for (let i = 0; i < rows; i++) spreadAlong(above.subarray(i * columns, (i + 1) * columns), i, rowOf)
  return above
}

/** Make of a row, each cell's nearest in its column, each cell's nearest: the lower envelope of parabolas. */
function spreadAlong(row, i, rowOf) {
  const columns = row.length
  const nearest = row.slice()
  const [best, starts] = [[], []] // columns whose placements are nearest somewhere, and from which column on
  const far = (j) => j * j + (rowOf[nearest[j]] - i) ** 2
  for (let j = 0; j < columns; j++) {
    if (nearest[j] < 0) continue
    let start = 0
    while (best.length) {
      const before = best.at(-1)
      // Where both are as near, the lower number counts.
      const [difference, twice] = [far(j) - far(before), 2 * (j - before)]
      start = nearest[j] < nearest[before] ? ceilDivide(difference, twice) : Math.floor(difference / twice) + 1
      if (start > starts.at(-1)) break
      best.pop()
      starts.pop()
      start = 0
    }
    if (start >= columns) continue
    best.push(j)
    starts.push(start)
  }
  for (let n = 0; n < best.length; n++) row.fill(nearest[best[n]], starts[n], starts[n + 1] ?? columns)
}

/** Decodes the labels of layers, one after another. */
export class LabelDecoder {
  constructor() {
    this.bits = new BitDecoder(PLACES * CONTEXTS + MOST_BITS)
  }

  /** The labels of a layer; waits where bytes are missing. */
  *decode({ grid, count, nearest, isSecond }, fail) {
    const { bits } = this
    const { rows, columns } = grid
    const labels = new Int32Array(grid.size)
    const candidates = new Int32Array(PLACES)
    const plain = 32 - Math.clz32(count - 1)
    for (let i = 0, at = 0; i < rows; i++) {
      for (let j = 0; j < columns; j++, at++) {
        const context = lookRound(labels, nearest, i, j, rows, columns, candidates)
        let [label, bit] = [OUTSIDE, 0]
        for (let place = isSecond ? 0 : 1; place < PLACES && !bit; place++) {
          label = candidates[place]
          if (label === OUTSIDE || candidates.indexOf(label) < place) continue
          while ((bit = bits.coded(place * CONTEXTS + context)) < 0) yield
        }
        if (!bit) {
          label = 0
          for (let b = plain - 1; b >= 0; b--) {
            while ((bit = bits.coded(PLACES * CONTEXTS + b)) < 0) yield
            label = 2 * label + bit
          }
          if (label >= count) fail(`label ${label} of a cell; allowed: below ${count}`)
        }
        labels[at] = label
      }
    }
    return labels
  }
}

/** Note the candidates of a cell, in the order in which they are asked for, −1 of second layers alone; returns its context. */
function lookRound(labels, nearest, i, j, rows, columns, candidates) {
  const at = i * columns + j
  const w = j ? labels[at - 1] : OUTSIDE
  const n = i ? labels[at - columns] : OUTSIDE
  const nw = i && j ? labels[at - columns - 1] : OUTSIDE
  const ne = i && j + 1 < columns ? labels[at - columns + 1] : OUTSIDE
  const here = nearest[at]
  const right = nearest[at + Math.min(2, columns - 1 - j)]
  const below = nearest[at + columns * Math.min(2, rows - 1 - i)]
  candidates[0] = -1
  candidates[1] = w
  candidates[2] = n
  candidates[3] = here
  candidates[4] = ne
  candidates[5] = right
  candidates[6] = below
  // Without arrays: this is asked for every cell.
  return (
    (w === n ? 1 : 0) |
    (w === nw ? 2 : 0) |
    (n === ne ? 4 : 0) |
    (n === nw ? 8 : 0) |
    (here === w ? 16 : 0) |
    (here === n ? 32 : 0) |
    (right === w ? 64 : 0) |
    (below === n ? 128 : 0)
  )
}
