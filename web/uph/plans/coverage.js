/** What blocks cover of a chart so far, and what that says of the next block's mask [5.6]. */

import { clamp } from '../numbers.js'
import { topLeft } from './placement.js'

// What is known of a cell before it is decoded. From NEAR_BARE on it is new, unless the mask says otherwise.
export const OPEN = 0
export const BESIDE_COVERED = 1 // on the rim, and what lies beyond is covered
export const NEAR_BARE = 2 // one of the cells round it is bare
export const BARE = 3 // some of its texels are not covered
export const UNSEEN = 4 // of the block, but not of its window

const RING = 2 // cells round a window

/**
 * A block's window with a ring of cells round it, row by row: `cells`, 1 where they are new, `classes`, what is known
 * of them, and `under`, whether their first texel is covered. Cells of the block beyond its window are UNSEEN and new,
 * those beyond the block are OPEN and old. The window's begin at `first`, rows are `stride` apart. It uses the coverage's
 * memory, until the next one.
 */
export class MaskFrame {
  constructor(block, coverage) {
    const { height, width, maskCell, window } = block
    this.block = block
    ;[this.top, this.left] = topLeft(block)
    this.rows = Math.ceil(height / maskCell) // of the block, in cells
    this.columns = Math.ceil(width / maskCell)
    this.stride = window.columns + 2 * RING
    this.first = RING * this.stride + RING
    ;[this.cells, this.classes, this.under, this.open] = coverage.memory((window.rows + 2 * RING) * this.stride)
    this.#fillRing(window)
  }

  #fillRing({ top, left, rows, columns }) {
    for (let i = -RING, at = 0; i < rows + RING; i++) {
      for (let j = -RING; j < columns + RING; j++, at++) {
        if (j === 0 && i >= 0 && i < rows) [j, at] = [columns, at + columns]
        if (top + i < 0 || left + j < 0 || top + i >= this.rows || left + j >= this.columns) continue
        this.cells[at] = 1
        this.classes[at] = UNSEEN
      }
    }
  }

  /** Call take(place, row, column) for each cell of the window; rows and columns are those of the block. */
  forEach(take) {
    const { top, left, rows, columns } = this.block.window
    for (let i = 0; i < rows; i++) {
      for (let j = 0, at = this.first + i * this.stride; j < columns; j++, at++) take(at, top + i, left + j)
    }
  }

  /** The first row of texels of the cells of row i. */
  rowAt(i) {
    return this.top + Math.min(this.block.height, i * this.block.maskCell)
  }

  /** The same of columns. */
  columnAt(j) {
    return this.left + Math.min(this.block.width, j * this.block.maskCell)
  }

  /**
   * How many cells come before the first new one or the block's rim, at most 7 of each: to the right, times 8, and below.
   * An array by place.
   */
  openCells() {
    const { classes, open, stride } = this
    const { top, left, rows, columns } = this.block.window
    // Beyond a window that ends within the block, cells are new.
    const count = (isRim, next, shift) => (isRim || classes[next] >= NEAR_BARE ? 0 : Math.min(7, ((open[next] >> shift) & 7) + 1))
    for (let i = top + rows; i-- > top; ) {
      for (let j = left + columns, at = this.first + (i - top) * stride + columns; j-- > left; ) {
        at--
        const right = count(j === this.columns - 1, at + 1, 3)
        const below = count(i === this.rows - 1, at + stride, 0)
        open[at] = 8 * right + below
      }
    }
    return open
  }

  /** Take over the cells of the window. */
  putCells(cells) {
    let from = 0
    this.forEach((at) => (this.cells[at] = cells[from++]))
  }

  /** Write the cells of the window to out[to] and so on. */
  copyCells(out, to) {
    const { rows, columns } = this.block.window
    for (let i = 0, at = this.first; i < rows; i++, at += this.stride, to += columns) {
      out.set(this.cells.subarray(at, at + columns), to)
    }
  }
}

/** Which texels of a chart are covered by blocks so far. */
export class Coverage {
  constructor({ height, width }) {
    this.height = height
    this.width = width
    this.covered = new Uint8Array(height * width)
    this.spare = [0, 0, 0, 0]
  }

  /** Four arrays of so many zeros at least: those given before. */
  memory(size) {
    this.spare = this.spare.map((one) => (one.length >= size ? one.fill(0, 0, size) : new Uint8Array(size)))
    return this.spare
  }

  #fill(top, bottom, left, right) {
    const c0 = Math.max(left, 0)
    const c1 = Math.min(right, this.width)
    if (c0 >= c1) return
    for (let r = Math.max(top, 0); r < Math.min(bottom, this.height); r++) {
      this.covered.fill(1, r * this.width + c0, r * this.width + c1)
    }
  }

  /** Cover a block's rectangle. */
  addRectangle(block) {
    const [top, left] = topLeft(block)
    this.#fill(top, top + block.height, left, left + block.width)
  }

  /** Cover a transferred block's new cells, where all cells round them are there, and new or covered. */
  addNewCells(frame) {
    const { cells, under, stride } = frame
    frame.forEach((at, i, j) => {
      if (!cells[at] || i === 0 || j === 0 || i === frame.rows - 1 || j === frame.columns - 1) return
      for (const row of [at - stride, at, at + stride]) {
        for (let near = row - 1; near <= row + 1; near++) if (!cells[near] && !under[near]) return
      }
      this.#fill(frame.rowAt(i), frame.rowAt(i + 1), frame.columnAt(j), frame.columnAt(j + 1))
    })
  }

  /** Write what is known of each cell of a frame, and whether its first texel is covered. */
  classify(frame, isOwn) {
    const { height, width, covered } = this
    const { classes, under } = frame
    frame.forEach((at, i, j) => {
      const r = frame.rowAt(i)
      const c = frame.columnAt(j)
      under[at] = r >= 0 && r < height && c >= 0 && c < width ? covered[r * width + c] : 1
      if (isOwn && this.#isBare(r, frame.rowAt(i + 1), c, frame.columnAt(j + 1))) classes[at] = BARE
    })
    if (!isOwn) return
    frame.forEach((at) => {
      if (classes[at] === OPEN && isNearBare(classes, at, frame.stride)) classes[at] = NEAR_BARE
    })
    this.#markBesideCovered(frame)
  }

  /** Whether a texel of these that lies on the chart is not covered. */
  #isBare(top, bottom, left, right) {
    const c0 = Math.max(left, 0)
    const c1 = Math.min(right, this.width)
    for (let r = Math.max(top, 0); r < Math.min(bottom, this.height); r++) {
      for (let at = r * this.width + c0, end = r * this.width + c1; at < end; at++) if (!this.covered[at]) return true
    }
    return false
  }

  #markBesideCovered(frame) {
    const { height: tall, width: wide, covered } = this
    const { block, classes, top, left, rows, columns } = frame
    const [bottom, right] = [top + block.height, left + block.width]
    const isCovered = (r, c) => covered[clamp(r, 0, tall - 1) * wide + clamp(c, 0, wide - 1)]
    frame.forEach((at, i, j) => {
      if (classes[at] !== OPEN) return
      const r = frame.rowAt(i)
      const c = frame.columnAt(j)
      if (
        (i === 0 && r > 0 && isCovered(top - 1, c)) ||
        (i === rows - 1 && bottom < tall && isCovered(bottom, c)) ||
        (j === 0 && c > 0 && isCovered(r, left - 1)) ||
        (j === columns - 1 && right < wide && isCovered(r, right))
      ) {
        classes[at] = BESIDE_COVERED
      }
    })
  }
}

function isNearBare(classes, at, stride) {
  for (const row of [at - stride, at, at + stride]) {
    for (let near = row - 1; near <= row + 1; near++) if (classes[near] === BARE) return true
  }
  return false
}
