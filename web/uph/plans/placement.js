/** Placements [4]: one block of the exemplar on one chart. */

import { displacement } from '../field.js'
import { ceilDivide } from '../numbers.js'
import { SYMMETRIES, symmetryTimes } from '../symmetry.js'

/** Masks. */
export const MASK_NONE = 0
export const MASK_RAMP = 1
export const MASK_CUT = 2

/** The most of all placements of a quilt, and of all cells of their masks. */
export const MAX_PLACEMENTS = 2 ** 19
export const MAX_MASK_CELLS = 2 ** 25

/** The largest side of a block on a chart with a field. */
export const MAX_WARPED_SIDE = 2048

/** How many rows and columns of cells a mask has. */
export function maskShape({ height, width, maskCell }) {
  return [ceilDivide(height, maskCell), ceilDivide(width, maskCell)]
}

export function maskCellCount(placement) {
  const [rows, columns] = maskShape(placement)
  return rows * columns
}

/** Row and column of the top left texel. */
export function topLeft({ row, column, height, width }) {
  return [row - (height >> 1), column - (width >> 1)]
}

/** The field at a placement's centre, written to `out`. */
export function centerMatrix(placement, field, out) {
  return field.at(placement.row, placement.column, out)
}

/** What takes texel steps at a placement's centre to pixel steps. */
export function blockMatrix(placement, field) {
  return symmetryTimes(placement.symmetry, centerMatrix(placement, field, [0, 0, 0, 0]))
}

/** Where a placement reads, in 1/16 pixel, at a texel, be it inside or beyond. */
export function sourceAt(placement, field, row, column) {
  const center = centerMatrix(placement, field, [0, 0, 0, 0])
  const there = field.at(row, column, [0, 0, 0, 0])
  const [y, x] = displacement(center, there, row - placement.row, column - placement.column)
  const [p, q, r, s] = SYMMETRIES[placement.symmetry]
  return [placement.sourceRow + p * y + q * x, placement.sourceColumn + r * y + s * x]
}

/** Check that a placement touches its chart and reads inside the exemplar; fail(what) is called if not. */
export function checkPlacement(placement, chart, field, exemplar, fail) {
  const { row, column, height, width, symmetry, mask, ramp, sourceRow, sourceColumn } = placement
  const [top, left] = topLeft(placement)
  if (top >= chart.height || top + height <= 0 || left >= chart.width || left + width <= 0) {
    fail('does not touch its chart')
  }
  if (mask === MASK_RAMP && ramp < 1) fail('has a ramp 0 texels wide; allowed: 1 to 255')
  if (!field.isIdentity) {
    if (Math.max(height, width) > MAX_WARPED_SIDE) {
      fail(`is ${width}×${height}; allowed: ${MAX_WARPED_SIDE} with a warp field`)
    }
    return // its source lies in the exemplar, and reads are clamped
  }
  if ((sourceRow | sourceColumn) & 15) fail('has a source that is not on a whole pixel')
  const [p, q, r, s] = SYMMETRIES[symmetry]
  for (const y of [top - row, top + height - 1 - row]) {
    for (const x of [left - column, left + width - 1 - column]) {
      const [i, j] = [sourceRow / 16 + p * y + q * x, sourceColumn / 16 + r * y + s * x]
      if (i < 0 || i >= exemplar.height || j < 0 || j >= exemplar.width) fail('reads outside the exemplar')
    }
  }
}
