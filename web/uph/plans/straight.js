/** Masks that have not come yet: straight cuts, which follow from where blocks lie [4]. */

import { BESIDE_COVERED, MaskFrame, NEAR_BARE } from './coverage.js'

const FAR = 2 ** 20

// What a transferred block's cell shows of the block that it comes from: beyond it, old, new; or nothing is known.
export const BEYOND_LINKED = 0
export const OLD_THERE = 1
export const NEW_THERE = 2
export const NOT_LINKED = 3

/**
 * The cells of a block's window: `known`, or where they have not come a straight cut; the block then covers what it
 * covers. `shows(i, j)` tells what a transferred block shows at a cell of the block that it comes from.
 */
export function cutStraight(coverage, block, { isOwn, known, shows }) {
  const frame = new MaskFrame(block, coverage)
  coverage.classify(frame, true)
  const cells = known ?? (isOwn ? halved(frame) : seen(frame, shows))
  frame.putCells(cells)
  if (isOwn) coverage.addRectangle(block)
  else coverage.addNewCells(frame)
  return cells
}

/** What is new in the block that a transferred one comes from, and what would be bare. */
function seen(frame, shows) {
  const { rows, columns } = frame.block.window
  const cells = new Uint8Array(rows * columns)
  let to = 0
  frame.forEach((at, i, j) => (cells[to++] = frame.classes[at] >= NEAR_BARE || shows(i, j) === NEW_THERE ? 1 : 0))
  return cells
}

/** Each cell of an own block as the nearer side is: what lies beyond the rim, or what must be new. */
function halved(frame) {
  const { rows, columns } = frame.block.window
  const toOld = new Int32Array(rows * columns).fill(FAR)
  const toNew = new Int32Array(rows * columns).fill(FAR)
  let to = 0
  let hasNew = false
  frame.forEach((at) => {
    if (frame.classes[at] === BESIDE_COVERED) toOld[to] = 0
    if (frame.classes[at] >= NEAR_BARE) {
      toNew[to] = 0
      hasNew = true
    }
    to++
  })
  if (!hasNew) toNew[(rows >> 1) * columns + (columns >> 1)] = 0
  spread(toOld, rows, columns)
  spread(toNew, rows, columns)
  return Uint8Array.from(toNew, (steps, n) => (steps <= toOld[n] ? 1 : 0))
}

/** Let `steps` be how many cells it is to the nearest 0, along rows and columns. */
function spread(steps, rows, columns) {
  const reach = (at, from) => (steps[at] = Math.min(steps[at], steps[from] + 1))
  for (let i = 0, at = 0; i < rows; i++) {
    for (let j = 0; j < columns; j++, at++) {
      if (i) reach(at, at - columns)
      if (j) reach(at, at - 1)
    }
  }
  for (let i = rows - 1, at = rows * columns - 1; i >= 0; i--) {
    for (let j = columns - 1; j >= 0; j--, at--) {
      if (i < rows - 1) reach(at, at + columns)
      if (j < columns - 1) reach(at, at + 1)
    }
  }
}
