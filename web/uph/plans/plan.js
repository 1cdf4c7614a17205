/** What all plans share: two coded parts, sources and masks, each resumed as its bytes come. */

const NO_CELLS = new Uint8Array(0)

/**
 * A plan says how the placements of charts are arranged. One made of a payload sets `sources`, a BitDecoder,
 * `sourceSteps`, `total` placements and `totalCells` of masks, and has
 *
 * - `order`, the charts in coded order; `known`, how many placements have come;
 * - `placements(chart)`, those of a chart whose sources have come;
 * - `decodeMasks()`, a generator that fills `cells` and counts `knownCells`; `maskBits()`, the decoder it reads.
 */
export class Plan {
  constructor(charts, exemplar) {
    this.charts = charts
    this.exemplar = exemplar
    this.cells = NO_CELLS
    this.knownCells = 0
    this.masks = null
    /** Charts whose placements have come, and those that changed since somebody emptied the set. */
    this.knownCharts = new Set()
    this.changed = new Set()
  }

  /** Whether every placement and every mask has come. */
  get complete() {
    return this.known === this.total && this.knownCells === this.totalCells
  }

  feedSources(part) {
    this.sources.feed(part)
    this.goOn()
  }

  /** Read on, as far as sources and warp fields have come. */
  goOn() {
    this.sourceSteps.next()
  }

  feedMasks(part, fail) {
    if (!this.totalCells || this.known < this.total) fail('masks come where none are due')
    if (!this.masks) {
      this.cells = new Uint8Array(this.totalCells)
      this.masks = this.maskBits()
      this.maskSteps = this.decodeMasks()
    }
    this.masks.feed(part)
    this.maskSteps.next()
  }

  /** Whether a chart whose sources have come has no placements. */
  isEmpty() {
    return false
  }

  markKnown(chart) {
    this.knownCharts.add(chart)
    this.changed.add(chart)
  }
}
