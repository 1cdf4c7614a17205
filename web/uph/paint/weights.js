/** Weights of a placement's texels [8]: 0 to 256, from its mask. */

import { ceilDivide } from '../numbers.js'
import { part } from '../parts.js'
import { MASK_NONE, MASK_RAMP } from '../plans/placement.js'

/** Arrays that are used again and again, by name: at least so long, what is in them counts for nothing. */
export class Scratch {
  take(name, Kind, length) {
    if (!(this[name]?.length >= length)) this[name] = new Kind(length)
    return this[name]
  }
}

/**
 * Weights of rows [start, stop) of a placement's rectangle, null if all are 256: `values`, `width` of them a row, for
 * texels from (top, left) on, all of those that lie on its chart.
 */
export function placementWeights(placement, scratch, start, stop) {
  const { width, mask } = placement
  if (mask === MASK_NONE) return null
  if (mask === MASK_RAMP) {
    const values = scratch.take('weights', Uint16Array, (stop - start) * width)
    part('fillRamp')(placement, values, start, stop)
    return { values, width, top: start, left: 0 }
  }
  const seen = windowPart(placement, start, stop)
  const values = scratch.take('weights', Uint16Array, seen.height * seen.width)
  fillCut(seen, values, scratch.take('feathered', Uint16Array, seen.height * seen.width))
  return { values, width: seen.width, top: seen.top, left: seen.left }
}

/**
 * The part of a placement that its mask's window covers, in texels, as far as feathering carries it into rows
 * [start, stop); what its ends do to others is never seen.
 */
function windowPart({ height, width, maskCell, feather, cells, window }, start, stop) {
  const above = Math.max(window.top, Math.floor((start - feather) / maskCell))
  const end = Math.min(window.top + window.rows, ceilDivide(stop + feather, maskCell))
  const [top, left] = [above * maskCell, window.left * maskCell]
  return {
    ...{ top, left, maskCell, feather, rows: end - above, columns: window.columns },
    cells: cells.subarray((above - window.top) * window.columns),
    height: Math.min(height, end * maskCell) - top,
    width: Math.min(width, left + window.columns * maskCell) - left,
  }
}

/** A mask's cells as weights, feathered. */
function fillCut(part, weights, spare) {
  const { height, width, feather } = part
  fillCells(part, weights)
  spare.set(weights.subarray(0, height * width))
  const spans = mixedSpans(part)
  for (let pass = 0; pass < feather; pass++) {
    for (const [i, start, end] of spans) {
      const k = i * width
      smooth(weights, spare, k + start, k + end, i ? -width : 0, i < height - 1 ? width : 0)
    }
    for (const [i, start, end] of spans) {
      const k = i * width
      const last = width - 1
      if (start === 0) smooth(spare, weights, k, k + 1, 0, last ? 1 : 0)
      if (end === width && last) smooth(spare, weights, k + last, k + width, -1, 0)
      smooth(spare, weights, k + Math.max(start, 1), k + Math.min(end, last), -1, 1)
    }
  }
}

function fillCells({ height, width, maskCell, cells }, weights) {
  for (let i = 0, at = 0; i < height; i++) {
    const start = i * width
    if (i % maskCell) {
      weights.copyWithin(start, start - width, start)
      continue
    }
    for (let k = start; k < start + width; at++) {
      for (const end = Math.min(k + maskCell, start + width); k < end; k++) weights[k] = cells[at] << 8
    }
  }
}

/** One step of feathering for the weights [k, end), whose neighbours lie `before` and `behind`. */
function smooth(from, to, k, end, before, behind) {
  for (; k < end; k++) to[k] = (51 * (from[k + before] + from[k + behind]) + 154 * from[k] + 128) >> 8
}

/** Rows of texels [row, start, end) that feathering may change: those of cells not far from one that differs. */
function mixedSpans(part) {
  const { height, width, maskCell, columns } = part
  const mixed = mixedCells(part)
  const spans = []
  for (let i = 0; i < height; i++) {
    const line = Math.floor(i / maskCell) * columns
    for (let b = 0; b < columns; b++) {
      const start = b
      while (b < columns && mixed[line + b]) b++
      if (b > start) spans.push([i, start * maskCell, Math.min(b * maskCell, width)])
    }
  }
  return spans
}

/** Which cells lie as far from one that differs from its neighbour as feathering reaches. */
function mixedCells({ maskCell, feather, cells, rows, columns }) {
  const reach = ceilDivide(feather, maskCell)
  const mixed = new Uint8Array(rows * columns)
  for (let a = 0, at = 0; a < rows; a++) {
    for (let b = 0; b < columns; b++, at++) {
      const besideDiffers = b + 1 < columns && cells[at] !== cells[at + 1]
      const belowDiffers = a + 1 < rows && cells[at] !== cells[at + columns]
      if (!besideDiffers && !belowDiffers) continue
      for (let i = Math.max(a - reach, 0); i <= Math.min(a + 1 + reach, rows - 1); i++) {
        mixed.fill(1, i * columns + Math.max(b - reach, 0), i * columns + Math.min(b + 2 + reach, columns))
      }
    }
  }
  return mixed
}
