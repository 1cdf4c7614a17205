/** What a chart shows before its placements have come: the exemplar, repeated and mirrored [4]. */

import { UNIT } from '../field.js'
import { clamp } from '../numbers.js'
import { HALF_TURN, MIRRORED_COLUMNS, MIRRORED_ROWS } from '../symmetry.js'
import { MASK_NONE } from './placement.js'

// By whether rows and columns of a repeat are mirrored.
const SYMMETRY_OF_REPEAT = [
  [0, MIRRORED_COLUMNS],
  [MIRRORED_ROWS, HALF_TURN],
]

/** How many texels `side` pixels take where a texel step is unit/4096 pixels. */
export function repeatSize(side, unit) {
  return Math.max(1, Math.floor((side * UNIT + (unit >> 1)) / unit))
}

/** The source, in 1/16 pixel, of the n-th repeat along an axis. */
function repeatSource(n, size, side, unit) {
  const texel = n & 1 ? size - 1 - (size >> 1) : size >> 1
  return clamp((((2 * texel + 1) * unit) >> 9) - 8, 0, 16 * side - 1)
}

/** The placements of a chart that repeats the exemplar. */
export function previewPlacements(chart, exemplar, unit) {
  const placements = []
  const [height, width] = [repeatSize(exemplar.height, unit), repeatSize(exemplar.width, unit)]
  for (let i = 0; i * height < chart.height; i++) {
    for (let j = 0; j * width < chart.width; j++) {
      placements.push({
        row: i * height + (height >> 1),
        column: j * width + (width >> 1),
        height,
        width,
        sourceRow: repeatSource(i, height, exemplar.height, unit),
        sourceColumn: repeatSource(j, width, exemplar.width, unit),
        symmetry: SYMMETRY_OF_REPEAT[i & 1][j & 1],
        mask: MASK_NONE,
      })
    }
  }
  return placements
}
