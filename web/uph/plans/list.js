/** List plans [4, 5.3]: every placement is told on its own, number by number. */

import { BitDecoder } from '../bits.js'
import { decodeMask, maskBits } from '../masks.js'
import { range } from '../numbers.js'
import { Coverage } from './coverage.js'
import { INTEGER_COUNTERS, INTEGER_MIXERS, decodeInteger } from './integers.js'
import {
  MASK_CUT,
  MAX_MASK_CELLS,
  MAX_MATRIX,
  MAX_PLACEMENTS,
  checkPlacement,
  maskWindow,
} from './placement.js'
import { Plan } from './plan.js'
import { cutStraight } from './straight.js'

// The numbers of a placement, in coded order; then its source, and so on.
const NAMES = ['row', 'column', 'height', 'width', 'symmetry', 'mask', 'sides', 'ramp', 'maskCell', 'feather']
const SOURCE_ROW = 10
const SOURCE_COLUMN = 11
const FIRST_CELL = 12
const PLAIN_COUNT = 13
const CENTRED = 13 // in a fine list: whether a placement has a centre matrix, whose numbers follow; 2: told by its field
const COUNT = 18
const MASK = NAMES.indexOf('mask')
const ANY = [-(2 ** 31), 2 ** 31 - 1]
const LIMITS = [ANY, ANY, [1, 4096], [1, 4096], [0, 7], [0, 2], [0, 255], [0, 255], [0, 255], [0, 16]]
const ENTRY = [-MAX_MATRIX, MAX_MATRIX]

/** A list of placements for every chart; in a fine one sources are in 1/16 pixel, and there are centre matrices. */
export class ListPlan extends Plan {
  constructor(reader, charts, fields, exemplar, budget, isFine) {
    super(charts, exemplar)
    this.budget = budget
    this.fields = fields
    this.isFine = isFine
    this.order = range(charts.length)
    this.ends = [] // per chart: how many placements there are up to its last one
    this.total = 0
    for (let n = 0; n < charts.length; n++) {
      this.total += reader.varint('number of placements', MAX_PLACEMENTS)
      this.ends.push(this.total)
    }
    reader.within(this.total, 'number of placements', 0, MAX_PLACEMENTS)
    this.totalCells = reader.varint('number of cells', MAX_MASK_CELLS)
    reader.end('plan')
    budget.checkCells(this.totalCells, (what) => reader.fail(what))
    this.list = []
    this.limits = this.#limits()
    this.sources = new BitDecoder(COUNT * INTEGER_COUNTERS, COUNT * INTEGER_MIXERS, 72090)
    this.sourceSteps = this.#decodeSources((what) => reader.fail(what))
    this.goOn()
  }

  get known() {
    return this.list.length
  }

  isEmpty(chart) {
    return this.ends[chart] === (chart ? this.ends[chart - 1] : 0)
  }

  /** The placements of a chart whose sources have come, in painting order; masks that have not come are cut straight. */
  placements(chart) {
    const list = this.list.slice(chart ? this.ends[chart - 1] : 0, this.ends[chart])
    const known = ({ firstCell, cellCount }) =>
      firstCell + cellCount > this.knownCells ? null : this.cells.subarray(firstCell, firstCell + cellCount)
    const isCut = ({ mask }) => mask === MASK_CUT
    if (list.every((placement) => !isCut(placement) || known(placement))) {
      return list.map((placement) => (isCut(placement) ? { ...placement, cells: known(placement) } : placement))
    }
    const coverage = new Coverage(this.charts[chart])
    return list.map((placement) => {
      if (isCut(placement)) {
        return { ...placement, cells: cutStraight(coverage, placement, { isOwn: true, known: known(placement) }) }
      }
      coverage.addRectangle(placement)
      return placement
    })
  }

  #limits() {
    const source = (size) => [0, (this.isFine ? 16 : 1) * size - 1]
    const { height, width } = this.exemplar
    return [...LIMITS, source(height), source(width), ANY, [0, 2], ENTRY, ENTRY, ENTRY, ENTRY]
  }

  *#decodeSources(fail) {
    const { charts, list, ends, fields } = this
    let before = new Array(COUNT).fill(0)
    let cellsEnd = 0
    for (let chart = 0; chart < charts.length; chart++) {
      while (list.length < ends[chart]) {
        while (!fields[chart]) yield
        const n = list.length
        before = yield* this.#decodeNumbers(before, cellsEnd, fields[chart], fail)
        const placement = this.#placement(before, charts[chart])
        checkPlacement(placement, charts[chart], fields[chart], (what) => fail(`placement ${n} ${what}`))
        if (placement.mask === MASK_CUT) {
          cellsEnd = placement.firstCell + placement.cellCount
          if (placement.firstCell < 0 || cellsEnd > this.totalCells) fail(`cells of placement ${n} are not there`)
        }
        this.budget.spend(placement, charts[chart], (what) => fail(`placement ${n} ${what}`))
        list.push(placement)
      }
      this.markKnown(chart)
    }
  }

  /** The numbers of the next placement, each told by how it differs from a guess; 0 for those that it lacks. */
  *#decodeNumbers(before, cellsEnd, field, fail) {
    const { list, limits, sources, isFine } = this
    const values = new Array(COUNT).fill(0)
    let differed = [0, 0] // of the last two numbers, whether they differed from their guess
    for (let f = 0; f < (isFine ? COUNT : PLAIN_COUNT); f++) {
      if (f > CENTRED && !values[CENTRED]) break
      let guess = before[f]
      let unit = 1
      if (f === SOURCE_ROW || f === SOURCE_COLUMN) {
        const axis = f - SOURCE_ROW
        if (list.length) guess += (isFine ? 16 : 1) * (values[axis] - before[axis])
      } else if (f > CENTRED && values[CENTRED] === 2) {
        guess = field.at(values[0], values[1], [])[f - CENTRED - 1]
        unit = 64
      } else if (f === FIRST_CELL) guess = values[MASK] === MASK_CUT ? cellsEnd : -1
      const difference = yield* decodeInteger(sources, f, 2 * differed[0] + differed[1])
      differed = [differed[1], difference ? 1 : 0]
      const value = difference * unit + guess
      if (value < limits[f][0] || value > limits[f][1]) {
        fail(`a number of placement ${list.length} is outside what is allowed`)
      }
      values[f] = value
    }
    return values
  }

  #placement(values, chart) {
    const placement = Object.fromEntries(NAMES.map((name, k) => [name, values[k]]))
    const unit = this.isFine ? 1 : 16
    placement.sourceRow = unit * values[SOURCE_ROW]
    placement.sourceColumn = unit * values[SOURCE_COLUMN]
    placement.centred = values[CENTRED] ? 1 : 0
    placement.center = values[CENTRED] ? values.slice(CENTRED + 1) : null
    if (placement.mask === MASK_CUT) {
      placement.firstCell = values[FIRST_CELL]
      placement.window = maskWindow(placement, chart)
      placement.cellCount = placement.maskCell ? placement.window.rows * placement.window.columns : Infinity
    }
    return placement
  }

  maskBits() {
    return maskBits()
  }

  *decodeMasks() {
    const cut = []
    for (let chart = 0, n = 0; chart < this.charts.length; chart++) {
      for (; n < this.ends[chart]; n++) {
        if (this.list[n].mask === MASK_CUT) cut.push({ placement: this.list[n], chart })
      }
    }
    cut.sort((a, b) => a.placement.firstCell - b.placement.firstCell)
    if (this.#followEachOther(cut)) {
      for (const { placement, chart } of cut) {
        yield* decodeMask(this, placement.window, 0)
        this.changed.add(chart)
      }
      return
    }
    // Windows that overlap or leave cells out: all cells are one row. A mask counts when its last cell has come.
    const endOf = ({ placement }) => placement.firstCell + placement.cellCount
    cut.sort((a, b) => endOf(a) - endOf(b))
    let counted = 0
    const markChanged = () => {
      while (counted < cut.length && endOf(cut[counted]) <= this.knownCells) this.changed.add(cut[counted++].chart)
    }
    for (const missing of decodeMask(this, { rows: 1, columns: this.totalCells }, 0)) {
      markChanged()
      yield missing
    }
    markChanged()
  }

  /** Whether windows lie one behind the other, from the first cell to the last. */
  #followEachOther(cut) {
    let end = 0
    for (const { placement } of cut) {
      if (placement.firstCell !== end) return false
      end += placement.cellCount
    }
    return cut.length > 0 && end === this.totalCells
  }
}
