/** The quilt [4]: how charts are covered, as far as chunks Q, P and M have told it. */

import { CellGrid, LabelDecoder, nearestLabels } from './labels.js'
import { range } from './numbers.js'
import { MAX_PLACEMENTS, PlacementDecoder, barePlacement } from './placements.js'

const HALF = 1
const COMMON_CELL = 2
const LEAST_DENSITY = 1 / 8
const MAX_CELLS = 2 ** 27
const CELLS_A_STEP = 4
const CELLS_A_CHART = 32

/** A layer of a chart. `placements` and `labels` are null until they have come; labels count the layer's own placements. */
class Layer {
  placements = null
  labels = null
  #nearest = null

  constructor(grid, count, isSecond) {
    this.grid = grid
    this.count = count
    this.isSecond = isSecond
  }

  /** Whether its labels can be only one thing: then they are not told. */
  get isSettled() {
    return this.count === (this.isSecond ? 0 : 1)
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
  /** Charts of which placements or labels have come since somebody emptied the set. */
  changed = new Set()
  /** How many charts have their placements: the first ones. */
  placed = 0

  /** From the payload of chunk Q; `fields` are those of the charts, null until they have come. */
  constructor(reader, charts, fields, exemplar) {
    this.charts = charts
    this.fields = fields
    const count = reader.varint('number of layers', 2, 1)
    /** Texels a step, each way, with which charts are painted where nothing else is asked for. */
    this.density = LEAST_DENSITY * 2 ** reader.u8('density', 9)
    const bits = [reader.u8('bits of sources', 4), reader.u8('bits of matrices', 7)]
    const grids = range(count).map(() => parseGrids(reader, charts))
    checkCells(reader, grids.flat(), charts)
    const layers = grids.map((all, n) =>
      all.map((grid) => new Layer(grid, reader.varint('number of placements', grid.size, n ? 0 : 1), n > 0)),
    )
    reader.end('plan')
    /** Of each chart its layers. */
    this.layers = charts.map((_, chart) => layers.map((all) => all[chart]))
    reader.within(layers.flat().reduce((sum, { count }) => sum + count, 0), 'number of placements', 1, MAX_PLACEMENTS)
    this.placements = new PlacementDecoder(exemplar, bits, (what) => reader.fail(what))
    this.placementSteps = this.#decodePlacements()
    /** How many charts there are whose labels are told and have not come. */
    this.unlabelled = this.layers.filter((all) => all.some((layer) => !layer.isSettled)).length
    this.goOn()
  }

  /** Whether all placements and labels have come. */
  get complete() {
    return this.placed === this.charts.length && !this.unlabelled
  }

  feedPlacements(part) {
    this.placements.bits.feed(part)
    this.goOn()
  }

  /** Read placements on, as far as they and warp fields have come. */
  goOn() {
    this.placementSteps.next()
  }

  feedLabels(part, fail) {
    if (this.placed < this.charts.length || !(this.unlabelled || this.labels)) fail('labels come where none are due')
    this.labels ??= new LabelDecoder()
    this.labelSteps ??= this.#decodeLabels(fail)
    this.labels.bits.feed(part)
    this.labelSteps.next()
  }

  /** Each layer's grid, placements and labels, the nearest ones where they have not come; null for a chart without placements. */
  layersOf(chart) {
    if (chart >= this.placed) return null
    const layers = this.layers[chart]
    const isLabelled = layers.every((layer) => layer.labels || layer.isSettled)
    return layers.map((layer) => ({ ...layer, labels: (isLabelled && layer.labels) || layer.guessed }))
  }

  *#decodePlacements() {
    for (const [chart, layers] of this.layers.entries()) {
      while (!this.fields[chart]) yield
      for (const layer of layers) layer.placements = yield* this.placements.decode(layer, this.fields[chart])
      this.placed++
      this.changed.add(chart)
    }
  }

  *#decodeLabels(fail) {
    for (const [chart, layers] of this.layers.entries()) {
      const told = layers.filter((layer) => !layer.isSettled)
      if (!told.length) continue
      for (const layer of told) layer.label(yield* this.labels.decode(layer, fail))
      this.unlabelled--
      this.changed.add(chart)
    }
  }
}

/** How a chart without placements is painted. */
export function bareLayers(chart, field, exemplar) {
  const grid = new CellGrid(chart, 255, false)
  return [{ grid, placements: [barePlacement(chart, field, exemplar)], labels: new Int32Array(grid.size) }]
}

/** The cells of all charts, of one layer. */
function parseGrids(reader, charts) {
  const flags = reader.u8('flags of a layer', HALF | COMMON_CELL)
  const cell = () => reader.varint('cell', 255, 1)
  const common = flags & COMMON_CELL ? cell() : 0
  return charts.map((chart) => new CellGrid(chart, common || cell(), Boolean(flags & HALF)))
}

function checkCells(reader, grids, charts) {
  const steps = charts.reduce((sum, { height, width }) => sum + height * width, 0)
  const cells = grids.reduce((sum, { size }) => sum + size, 0)
  reader.within(cells, 'number of cells', 1, Math.min(MAX_CELLS, CELLS_A_STEP * steps + CELLS_A_CHART * charts.length))
}
