/** Where the texels of a placement come from [8]. */

import { sizeAt } from '../image/bands.js'
import { clamp } from '../numbers.js'
import { SYMMETRIES } from '../symmetry.js'
import { sourceOf } from './pyramid.js'

/** Traces rows of texels of a placement back to a level of the exemplar's pyramid. */
export class SourceTracer {
  constructor(placement, field, exemplar) {
    this.placement = placement
    this.field = field
    Object.assign(this, sourceOf(placement, field, exemplar))
    this.wide = sizeAt(exemplar.width, this.level)
    this.mostRow = 16 * (sizeAt(exemplar.height, this.level) - 1)
    this.symmetry = SYMMETRIES[placement.symmetry]
  }

  /**
   * Write the places of `count` texels from (row, column) on: pixel << 8 | fraction of rows << 4 | of columns.
   *
   * The displacement is that of `field.displacement`, in 32 bits, which hold it inside a block.
   */
  trace(row, column, count, places, place) {
    const { margin, rows, columns, matrices } = this.field
    const { center, level, wide, mostRow, placement } = this
    const mostColumn = 16 * (wide - 1)
    const [c0, c1, c2, c3] = center
    const [p, q, r, s] = this.symmetry
    const [sourceRow, sourceColumn] = [placement.sourceRow + 8, placement.sourceColumn + 8]
    const y = row - placement.row
    const upper = 4 * columns * Math.min(margin + (row >> 5), rows - 1)
    const lower = 4 * columns * Math.min(margin + (row >> 5) + 1, rows - 1)
    const low = row & 31
    const up = 32 - low
    for (const last = column + count; column < last; ) {
      // Between two nodes the matrix is linear along the row.
      const end = Math.min(last, (column | 31) + 1)
      const j = 4 * Math.min(margin + (column >> 5), columns - 1)
      const k = 4 * Math.min(margin + (column >> 5) + 1, columns - 1)
      const left0 = matrices[upper + j] * up + matrices[lower + j] * low
      const left1 = matrices[upper + j + 1] * up + matrices[lower + j + 1] * low
      const left2 = matrices[upper + j + 2] * up + matrices[lower + j + 2] * low
      const left3 = matrices[upper + j + 3] * up + matrices[lower + j + 3] * low
      const step0 = matrices[upper + k] * up + matrices[lower + k] * low - left0
      const step1 = matrices[upper + k + 1] * up + matrices[lower + k + 1] * low - left1
      const step2 = matrices[upper + k + 2] * up + matrices[lower + k + 2] * low - left2
      const step3 = matrices[upper + k + 3] * up + matrices[lower + k + 3] * low - left3
      for (; column < end; column++, place++) {
        const x = column - placement.column
        const along = column & 31
        const a0 = ((left0 * 32 + step0 * along + 512) >> 10) + c0
        const a1 = ((left1 * 32 + step1 * along + 512) >> 10) + c1
        const a2 = ((left2 * 32 + step2 * along + 512) >> 10) + c2
        const a3 = ((left3 * 32 + step3 * along + 512) >> 10) + c3
        const v = (Math.imul(a0, y) + Math.imul(a1, x) + 256) >> 9
        const w = (Math.imul(a2, y) + Math.imul(a3, x) + 256) >> 9
        const i = clamp(((sourceRow + p * v + q * w) >> level) - 8, 0, mostRow)
        const h = clamp(((sourceColumn + r * v + s * w) >> level) - 8, 0, mostColumn)
        places[place] = (((i >> 4) * wide + (h >> 4)) << 8) | ((i & 15) << 4) | (h & 15)
      }
    }
  }
}
