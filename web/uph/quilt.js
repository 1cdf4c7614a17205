/** The quilt [4]: how charts are covered, from the received parts of chunks Q, P and M. */

import { CellGrid, LabelDecoder, nearestLabels } from './labels.js'
import { range } from './numbers.js'
import { MAX_PLACEMENTS, PlacementDecoder, barePlacement } from './placements.js'

const HALF = 1
const COMMON_CELL = 2
const LEAST_DENSITY = 1 / 8
const MAX_CELLS = 2 ** 27
const CELLS_A_STEP = 4
const CELLS_A_CHART = 32

/** A layer of a chart. `labels` are null until they have come; they count the layer's own placements. */
class Layer {
  labels = null
  #known = []
  #isSorted = true
  #nearest = null

  constructor(chart, grid, count, isSecond) {
    this.chart = chart
    this.grid = grid
    this.count = count
    this.isSecond = isSecond
  }

  /** Whether its labels have only one possible content: then they are not coded. */
  get isSettled() {
    return this.count === (this.isSecond ? 0 : 1)
  }

  /** The placements that are known, in the order of their cells. */
  get placements() {
    if (!this.#isSorted) this.#known.sort((a, b) => a.cell - b.cell)
    this.#isSorted = true
    return this.#known
  }

  /** How many of them are known. */
  get known() {
    return this.#known.length
  }

  add(placement) {
    this.#known.push(placement)
    this.#isSorted = false
    this.#nearest = null
  }

  /** Of each cell the placement that is nearest. */
  get nearest() {
    return (this.#nearest ??= nearestLabels(this.grid, this.placements))
  }

  /** What cells show where labels have not come. */
  get guessed() {
    return this.isSecond ? new Int32Array(this.grid.size).fill(-1) : this.nearest
  }

  /** Have the labels that have come; the nearest ones are needed no more. */
  label(labels) {
    this.labels = labels
    this.#nearest = null
  }
}

export class QuiltDecoder {
  /** From the payload of chunk Q. */
  constructor(reader, charts, exemplar) {
    const count = reader.varint('number of layers', 2, 1)
    /** Default density of painting charts, in texels per step each way. */
    this.density = LEAST_DENSITY * 2 ** reader.u8('density', 9)
    const bits = [reader.u8('bits of sources', 4), reader.u8('bits of offsets', 7)]
    const grids = range(count).map(() => parseGrids(reader, charts))
    /** How many cells all label maps have. */
    this.cells = countedCells(reader, grids.flat(), charts)
    const layers = grids.map((all, n) =>
      all.map((grid, chart) => new Layer(chart, grid, reader.varint('number of placements', grid.size, n ? 0 : 1), n > 0)),
    )
    reader.end('plan')
    /** Whether broad shades are blended over several cells. */
    this.hasTones = false
    /** Of each chart its layers. */
    this.layers = charts.map((_, chart) => layers.map((all) => all[chart]))
    /** How many placements there are. */
    this.total = layers.flat().reduce((sum, { count }) => sum + count, 0)
    reader.within(this.total, 'number of placements', 1, MAX_PLACEMENTS)
    this.placements = new PlacementDecoder(this.layers.flat(), exemplar, bits, (what) => reader.fail(what))
    /** Number of charts whose labels are coded and have not arrived. */
    this.unlabelled = this.layers.filter((all) => all.some((layer) => !layer.isSettled)).length
  }

  /** Charts of which placements or labels have come since somebody emptied the set. */
  get changed() {
    return this.placements.changed
  }

  /** Whether all placements and labels have come. */
  get complete() {
    return this.known === this.total && !this.unlabelled
  }

  /** How many placements are known. */
  get known() {
    return this.placements.known
  }

  /** How many charts have a placement of their own. */
  get placed() {
    return this.layers.filter(([first]) => first.known).length
  }

  /** Whether at least a sixteenth of all placements is known [2.1]. */
  get isSpread() {
    return 16 * this.known >= this.total
  }

  /** From chunk t. */
  addTones(reader) {
    if (this.layers[0].length > 1) reader.fail('tones with two layers; allowed: with one')
    this.hasTones = true
  }

  feedPlacements(part) {
    this.placements.feed(part)
  }

  feedLabels(part, fail) {
    if (this.known < this.total || !(this.unlabelled || this.labels)) fail('labels come where none are due')
    this.labels ??= new LabelDecoder()
    this.labelSteps ??= this.#decodeLabels(fail)
    this.labels.bits.feed(part)
    this.labelSteps.next()
  }

  /** Each layer's grid, placements and labels, the nearest ones where they have not come; null for a chart without placements. */
  layersOf(chart) {
    const layers = this.layers[chart]
    if (!layers[0].known) return null
    const isLabelled = layers.every((layer) => layer.labels || layer.isSettled)
    return layers.map((layer) => ({
      grid: layer.grid,
      placements: layer.placements,
      labels: (isLabelled && layer.labels) || layer.guessed,
    }))
  }

  *#decodeLabels(fail) {
    for (const [chart, layers] of this.layers.entries()) {
      const coded = layers.filter((layer) => !layer.isSettled)
      if (!coded.length) continue
      for (const layer of coded) layer.label(yield* this.labels.decode(layer, fail))
      this.unlabelled--
      this.changed.add(chart)
    }
  }
}

/** How a chart without placements is painted. */
export function bareLayers(chart, exemplar) {
  const grid = new CellGrid(chart, 255, false)
  return [{ grid, placements: [barePlacement(chart, exemplar)], labels: new Int32Array(grid.size) }]
}

/** The cells of all charts, of one layer. */
function parseGrids(reader, charts) {
  const flags = reader.u8('flags of a layer', HALF | COMMON_CELL)
  const cell = () => reader.varint('cell', 255, 1)
  const common = flags & COMMON_CELL ? cell() : 0
  return charts.map((chart) => new CellGrid(chart, common || cell(), Boolean(flags & HALF)))
}

function countedCells(reader, grids, charts) {
  const steps = charts.reduce((sum, { height, width }) => sum + height * width, 0)
  const cells = grids.reduce((sum, { size }) => sum + size, 0)
  reader.within(cells, 'number of cells', 1, Math.min(MAX_CELLS, CELLS_A_STEP * steps + CELLS_A_CHART * charts.length))
  return cells
}
