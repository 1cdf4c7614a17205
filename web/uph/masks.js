/** Masks of list and strip plans: cells, coded one after another in the context of those before [5.4]. */

import { BitDecoder } from './bits.js'

const BY_ROW = 65536
const BY_COLUMN = BY_ROW + 2048
const COUNTERS = BY_COLUMN + 3072
const LIMIT = 400

/** A decoder of the bits of such masks. */
export function maskBits() {
  return new BitDecoder(COUNTERS, 2, 24030)
}

/** Cells round (i, j) of a mask that begins at `first`, as bits: w, n, nw, ne, ww, nn. */
function cellsAround(cells, first, i, j, columns) {
  const at = first + i * columns + j
  const above = at - columns
  let found = j > 0 ? cells[at - 1] : 0
  if (j > 1) found += 16 * cells[at - 2]
  if (i > 1) found += 32 * cells[above - columns]
  if (i === 0) return found
  found += 2 * cells[above]
  if (j > 0) found += 4 * cells[above - 1]
  if (j + 1 < columns) found += 8 * cells[above + 1]
  return found
}

/**
 * Decode rows × columns cells of a plan's next mask, from `plan.knownCells` on; waits where bytes are missing.
 * `strip` tells the mask's place in a strip: 1 at its start, plus 2 at its end.
 */
export function* decodeMask(plan, { rows, columns }, strip) {
  const { masks, cells } = plan
  const { input } = masks
  const start = plan.knownCells
  for (let i = 0; i < rows; i++) {
    const edge = i === 0 ? 0 : i === rows - 1 ? 2 : 1
    for (let j = 0; j < columns; j++) {
      const around = cellsAround(cells, start, i, j, columns)
      const near = around & 15
      const part = Math.min(15, Math.floor((16 * j) / columns))
      input[0] = ((Math.min(i, 63) * 64 + Math.min(j, 63)) * 4 + strip) * 4 + (near & 3)
      input[1] = BY_ROW + (around * 16 + part) * 2 + (i === 0 ? 1 : 0)
      input[2] = BY_COLUMN + (near * 64 + Math.min(j, 63)) * 3 + edge
      let cell
      while ((cell = masks.bit(3, i === 0 ? 1 : 0, LIMIT)) < 0) yield
      cells[plan.knownCells++] = cell
    }
  }
}
