/** What a stream may ask for, checked before masks are made or anything is painted [9]. */

import { MASK_CUT, topLeft } from './plans/placement.js'

// The most that a caller may allow, the least where only the texels are told, and how many texels go with one.
const LIMITS = {
  samples: [12_800_000, 2 ** 16, 1],
  charts: [2 ** 18, 2 ** 12, 256],
  triangles: [2 ** 20, 2 ** 12, 8],
}
const MAX_TEXELS = 2 ** 31
const MAX_WORK = 128

const FREE_WORK = 2 ** 26
const WORK_A_TEXEL = 4
const CELLS_A_TEXEL = 4
const FREE_CELLS = 2 ** 22

/** Limits as a caller tells them, filled in. */
export function fillLimits({ texels = 2 ** 28, work = MAX_WORK, ...told } = {}) {
  const limits = { texels, work }
  for (const [name, [most, least, each]] of Object.entries(LIMITS)) {
    limits[name] = told[name] ?? Math.min(most, Math.max(least, Math.floor(texels / each)))
    delete told[name]
  }
  for (const name of Object.keys(told)) throw new RangeError(`limit ${name} is unknown; allowed: ${Object.keys(limits)}`)
  for (const [name, value] of Object.entries(limits)) {
    const most = { texels: MAX_TEXELS, work: MAX_WORK }[name] ?? LIMITS[name][0]
    if (!(Number.isInteger(value) && value >= 1 && value <= most)) {
      throw new RangeError(`limit of ${name} is ${value}; allowed: 1 to ${most}`)
    }
  }
  return limits
}

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

/** The work that a plan's placements may take. */
export class PaintBudget {
  constructor(charts, limits) {
    const texels = countTexels(charts)
    this.left = limits.work * texels + FREE_WORK
    this.cells = CELLS_A_TEXEL * texels + FREE_CELLS
  }

  /** Take what a placement costs of a chart; fail(what) is called where it is too much. */
  spend(placement, chart, fail) {
    const { height, width, mask, cut, maskCell, feather, window } = placement
    const [top, left] = topLeft(placement)
    const rows = Math.min(top + height, chart.height) - Math.max(top, 0)
    const columns = Math.min(left + width, chart.width) - Math.max(left, 0)
    this.left -= WORK_A_TEXEL * Math.max(rows, 0) * Math.max(columns, 0)
    if (mask === MASK_CUT || cut) {
      const tall = Math.min((window.top + window.rows) * maskCell, height) - window.top * maskCell
      const wide = Math.min((window.left + window.columns) * maskCell, width) - window.left * maskCell
      this.left -= Math.max(tall, 0) * Math.max(wide, 0) * (1 + feather)
    }
    if (this.left < 0) fail('takes more work than goes with the texels')
  }

  /** Take what blocks along strips cost: all of each, on both its charts. */
  spendStrips(blocks, size, feather, fail) {
    this.left -= 2 * blocks * size * size * (WORK_A_TEXEL + 1 + feather)
    if (this.left < 0) fail('strips take more work than goes with the texels')
  }

  checkCells(cells, fail) {
    if (cells > this.cells) fail(`masks have ${cells} cells; allowed here: ${this.cells}`)
  }
}
