/** Placements [4]: one block of the exemplar on one chart. */

import { displacement } from '../field.js'
import { ceilDivide, clamp } from '../numbers.js'
import { SYMMETRIES } from '../symmetry.js'

/** Masks. */
export const MASK_NONE = 0
export const MASK_RAMP = 1
export const MASK_CUT = 2

/** The most of all placements of a quilt, and of all cells of the windows of their masks. */
export const MAX_PLACEMENTS = 2 ** 19
export const MAX_MASK_CELLS = 2 ** 25

/** The largest side of a block on a chart with a warp field, or with a centre matrix of its own. */
export const MAX_WARPED_SIDE = 2048

/** The greatest number of a centre matrix. */
export const MAX_MATRIX = 2 ** 18

/**
 * The window of a placement's mask on its chart: the first row and column of its cells, and how many there are. A cell
 * belongs to it if one of its texels lies at most `feather` texels beyond the chart: feathering carries no farther.
 */
export function maskWindow({ row, column, height, width, maskCell, feather }, chart) {
  const interval = (low, count, length) => {
    const first = clamp(Math.floor((-feather - low) / maskCell), 0, count)
    return [first, clamp(ceilDivide(length + feather - low, maskCell), first, count) - first]
  }
  const [top, rows] = interval(row - (height >> 1), ceilDivide(height, maskCell), chart.height)
  const [left, columns] = interval(column - (width >> 1), ceilDivide(width, maskCell), chart.width)
  return { top, left, rows, columns }
}

/** Row and column of the top left texel. */
export function topLeft({ row, column, height, width }) {
  return [row - (height >> 1), column - (width >> 1)]
}

/** A placement's centre matrix: its own if it has one, else the field's at its centre. */
export function centerMatrix({ center, row, column }, field) {
  return center ?? field.at(row, column, [0, 0, 0, 0])
}

/** Where a placement reads, in 1/16 pixel, at a texel, be it inside or beyond. */
export function sourceAt(placement, field, row, column) {
  const there = field.at(row, column, [0, 0, 0, 0])
  const [down, right] = [row - placement.row, column - placement.column]
  const [y, x] = displacement(centerMatrix(placement, field), there, down, right)
  const [p, q, r, s] = SYMMETRIES[placement.symmetry]
  return [placement.sourceRow + p * y + q * x, placement.sourceColumn + r * y + s * x]
}

/** Check that a placement touches its chart and can be painted; fail(what) is called if not. */
export function checkPlacement(placement, chart, field, fail) {
  const { height, width, mask, ramp, centred } = placement
  const [top, left] = topLeft(placement)
  if (top >= chart.height || top + height <= 0 || left >= chart.width || left + width <= 0) {
    fail('does not touch its chart')
  }
  if (mask === MASK_RAMP && ramp < 1) fail('has a ramp 0 texels wide; allowed: 1 to 255')
  if ((centred || !field.isIdentity) && Math.max(height, width) > MAX_WARPED_SIDE) {
    fail(`is ${width}×${height}; allowed: ${MAX_WARPED_SIDE} where it is warped`)
  }
}
