/** What a stream may ask for, checked before masks are made or anything is painted [9]. */

import { MASK_CUT, topLeft } from './plans/placement.js'

/** What a stream may ask for where a caller tells nothing; `work` is per texel. */
export const LIMITS = { texels: 2 ** 28, work: 128, samples: 12_800_000, charts: 2 ** 18, triangles: 2 ** 20 }

const FREE_WORK = 2 ** 26
const WORK_A_TEXEL = 4
const CELLS_A_TEXEL = 4
const FREE_CELLS = 2 ** 22

const countTexels = (charts) => charts.reduce((sum, { height, width }) => sum + height * width, 0)

/** Check charts. */
export function checkCharts(reader, charts, limits) {
  reader.within(charts.length, 'number of charts', 1, limits.charts)
  reader.within(countTexels(charts), 'number of texels', 1, limits.texels)
}

/** Check the samples of maps with these headers. */
export function checkSamples(reader, headers, limits) {
  const samples = headers.reduce((sum, { height, width, channels }) => sum + height * width * channels, 0)
  reader.within(samples, 'number of samples', 1, limits.samples, 0)
}

/**
 * The work that a plan's placements may take, for one map and for all together: a map of c channels takes
 * (1 + c) / 4 of it.
 */
export class PaintBudget {
  constructor(charts, limits) {
    const texels = countTexels(charts)
    this.spent = 0
    this.shares = 0
    this.most = limits.work * texels + FREE_WORK
    this.mostTogether = limits.work * limits.texels + FREE_WORK
    this.cells = CELLS_A_TEXEL * texels + FREE_CELLS
  }

  /** Count a further map; fail(what) is called where all are too much. */
  addMap(channels, fail) {
    this.shares += 1 + channels
    this.take(0, fail, '')
  }

  take(work, fail, what) {
    this.spent += work
    if (this.spent > this.most) fail(`${what}more work than goes with the texels`)
    if (Math.floor((this.spent * this.shares) / 4) > this.mostTogether) fail('makes all maps take more work than is allowed here')
  }

  /** Take what a placement costs of a chart; fail(what) is called where it is too much. */
  spend(placement, chart, fail) {
    const { height, width, mask, cut, maskCell, feather, window } = placement
    const [top, left] = topLeft(placement)
    const rows = Math.min(top + height, chart.height) - Math.max(top, 0)
    const columns = Math.min(left + width, chart.width) - Math.max(left, 0)
    let work = WORK_A_TEXEL * Math.max(rows, 0) * Math.max(columns, 0)
    if (mask === MASK_CUT || cut) {
      const tall = Math.min((window.top + window.rows) * maskCell, height) - window.top * maskCell
      const wide = Math.min((window.left + window.columns) * maskCell, width) - window.left * maskCell
      work += Math.max(tall, 0) * Math.max(wide, 0) * (1 + feather)
    }
    this.take(work, fail, 'takes ')
  }

  /** Take what blocks along strips cost: all of each, on both its charts. */
  spendStrips(blocks, size, feather, fail) {
    this.take(2 * blocks * size * size * (WORK_A_TEXEL + 1 + feather), fail, 'strips take ')
  }

  checkCells(cells, fail) {
    if (cells > this.cells) fail(`masks have ${cells} cells; allowed here: ${this.cells}`)
  }
}
