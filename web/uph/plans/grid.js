/** Grid plans (method "quilt") [4, 5.5]: on each chart the blocks transferred to it, then its own, on a grid. */

import { ceilDivide, clamp, fromZigzag, range } from '../numbers.js'
import { Coverage } from './coverage.js'
import { decodeGridMasks, gridMaskBits, straightCells } from './grid-masks.js'
import { LIMIT, ONE_MIXER, SKIP, gridBits } from './grid-model.js'
import { OwnBlockDecoder } from './grid-own.js'
import { TransferDecoder } from './grid-transfers.js'
import { MASK_CUT, MASK_NONE, MAX_MASK_CELLS, MAX_PLACEMENTS, checkPlacement, maskWindow } from './placement.js'
import { Plan } from './plan.js'

const TURNED = 32 // added to the feather
const FAR = 2 ** 20
// Numbers of a block grid: what the first chart's are guessed to be, and what is allowed.
const GRID_NUMBERS = {
  rows: [1, 1, FAR],
  columns: [1, 1, FAR],
  firstRow: [20, -FAR, FAR],
  firstColumn: [20, -FAR, FAR],
  height: [40, 1, 4096],
  width: [40, 1, 4096],
  stepRow: [28, 1, FAR],
  stepColumn: [28, 1, FAR],
  level: [0, 0, 12],
  maskCell: [2, 1, 255],
}
const NAMES = Object.keys(GRID_NUMBERS)
const FIRST_GUESS = Object.fromEntries(NAMES.map((name) => [name, GRID_NUMBERS[name][0]]))

/** Positions along an axis that reach the chart's end. */
function countPositions(length, first, size, step) {
  return Math.max(1, 1 + ceilDivide(length - first + (size >> 1) - size, step))
}

export class GridPlan extends Plan {
  constructor(reader, charts, fields, exemplar, budget) {
    super(charts, exemplar)
    this.budget = budget
    this.fields = fields
    this.fail = (what) => reader.fail(what)
    const { place } = reader
    const feather = reader.u8('feather', TURNED + 16)
    this.turned = feather >= TURNED // own blocks have symmetries
    this.feather = reader.within(feather % TURNED, 'feather', 0, 16, place)
    this.grids = this.#parseGrids(reader) // in coded order; those of one chart follow each other
    reader.end('plan')
    this.gridsOf = [] // per chart: its first grid and the one behind its last
    this.grids.forEach(({ chart }, n) => ((this.gridsOf[chart] ??= [n, n])[1] = n + 1))
    this.starts = [0] // per grid: its first block
    for (const { blocks } of this.grids) this.starts.push(this.starts.at(-1) + blocks)
    this.order = [...new Set(this.grids.map(({ chart }) => chart))]
    this.total = this.starts.at(-1)
    this.totalCells = 0
    this.blocks = []
    this.done = 0 // grids whose blocks have come, and those of them that have straight cuts
    this.straight = { done: 0, coverage: null }
    this.sources = gridBits()
    this.transfers = new TransferDecoder(this)
    this.own = new OwnBlockDecoder(this)
    this.sourceSteps = this.#decodeSources()
    this.goOn()
  }

  get known() {
    return this.blocks.length
  }

  /** The chart of each grid. */
  #parseOrder(reader) {
    const { length } = this.charts
    const more = reader.varint('how many grids there are', MAX_PLACEMENTS)
    if (!more) return range(length)
    const [order, seen] = [[], new Set()]
    while (order.length < length + more - 1) {
      const chart = reader.varint('number of a chart', length - 1)
      if (chart !== order.at(-1) && seen.has(chart)) this.fail("a chart's grids do not follow each other")
      seen.add(chart)
      order.push(chart)
    }
    if (seen.size < length) this.fail('a chart has no grid')
    return order
  }

  #parseGrids(reader) {
    let before = FIRST_GUESS
    let [blocks, positions] = [0, 0]
    return this.#parseOrder(reader).map((chart) => {
      const grid = this.#parseGrid(reader, this.charts[chart], before)
      grid.chart = chart
      blocks += grid.blocks
      positions += grid.positions
      reader.within(blocks, 'number of blocks', 0, MAX_PLACEMENTS)
      reader.within(positions, 'number of positions', 0, MAX_PLACEMENTS)
      before = grid
      return grid
    })
  }

  #parseGrid(reader, chart, before) {
    const changed = reader.varint('which numbers of a grid change', 2 ** NAMES.length - 1)
    const codes = NAMES.map((_, n) => ((changed >> n) & 1 ? reader.varint('change of a grid', 2 ** 24, 1) : 0))
    const grid = {}
    // From the last one on: how many rows and columns there are is guessed from the others.
    for (let n = NAMES.length - 1; n >= 0; n--) {
      const name = NAMES[n]
      let guess = before[name]
      if (name === 'rows') guess = countPositions(chart.height, grid.firstRow, grid.height, grid.stepRow)
      if (name === 'columns') guess = countPositions(chart.width, grid.firstColumn, grid.width, grid.stepColumn)
      const [, least, most] = GRID_NUMBERS[name]
      grid[name] = reader.within(guess + fromZigzag(codes[n]), `${name} of a grid`, least, most, reader.place)
    }
    for (const last of [
      grid.firstRow + (grid.rows - 1) * grid.stepRow,
      grid.firstColumn + (grid.columns - 1) * grid.stepColumn,
    ]) {
      reader.within(last, 'last position of a grid', -FAR, FAR, reader.place)
    }
    grid.transferred = reader.varint('number of transferred blocks', MAX_PLACEMENTS)
    grid.positions = grid.rows * grid.columns
    grid.own = grid.positions - reader.varint('number of positions skipped', grid.positions)
    grid.blocks = grid.transferred + grid.own
    return grid
  }

  // ---------------------------------------------------------------- sources

  *#decodeSources() {
    for (const [place, grid] of this.grids.entries()) {
      while (!this.fields[grid.chart]) yield
      const table = new BlockTable(grid)
      for (let t = 0; t < grid.transferred; t++) {
        const block = yield* this.transfers.decode(place)
        table.enterTransferred(block, this.blocks.length)
        this.blocks.push(block)
      }
      yield* this.#decodeOwnBlocks(grid, table)
      this.#checkBlocks(place, grid.chart)
      this.done = place + 1
      if (this.grids[place + 1]?.chart !== grid.chart) this.markKnown(grid.chart)
    }
  }

  *#decodeOwnBlocks(grid, table) {
    const { blocks, sources } = this
    let own = 0
    for (let i = 0; i < grid.rows; i++) {
      for (let j = 0; j < grid.columns; j++) {
        sources.input[0] = SKIP + table.skipContext(i, j)
        let there
        while ((there = sources.bit(1, ONE_MIXER, LIMIT)) < 0) yield
        if (!there) continue
        if (own === grid.own) this.fail(`chart ${grid.chart} has more blocks than its plan says`)
        const near = table.neighbours(i, j).map((n) => blocks[n])
        const block = yield* this.own.decode(grid, i, j, near, grid.transferred + own > 0)
        table.enterOwn(i, j, blocks.length)
        blocks.push(block)
        own++
      }
    }
    if (own !== grid.own) this.fail(`chart ${grid.chart} has other blocks than its plan says`)
  }

  /** Check a chart's blocks, and number the cells of their windows. */
  #checkBlocks(place, chart) {
    const { blocks, charts, fields, fail } = this
    for (let n = this.starts[place]; n < blocks.length; n++) {
      const block = blocks[n]
      const refuse = (what) => fail(`block ${n} ${what}`)
      checkPlacement(block, charts[chart], fields[chart], refuse)
      if (!block.cut) {
        this.budget.spend(block, charts[chart], refuse)
        continue
      }
      block.feather = this.feather
      block.window = maskWindow(block, charts[chart])
      this.budget.spend(block, charts[chart], refuse)
      block.firstCell = this.totalCells
      block.cellCount = block.window.rows * block.window.columns
      this.totalCells += block.cellCount
    }
    if (this.totalCells > MAX_MASK_CELLS) fail(`masks have ${this.totalCells} cells; allowed: ${MAX_MASK_CELLS}`)
    this.budget.checkCells(this.totalCells, fail)
  }

  // ---------------------------------------------------------------- masks and placements

  maskBits() {
    return gridMaskBits()
  }

  decodeMasks() {
    return decodeGridMasks(this)
  }

  isEmpty(chart) {
    const [first, end] = this.gridsOf[chart]
    return this.starts[first] === this.starts[end]
  }

  /** Give the blocks of all grids that have come straight cuts: each may show what is cut of one before. */
  #cutStraight() {
    const { grids, straight } = this
    for (; straight.done < this.done; straight.done++) {
      const place = straight.done
      const { chart } = grids[place]
      if (grids[place - 1]?.chart !== chart) straight.coverage = new Coverage(this.charts[chart])
      const cells = straightCells(this, [place], straight.coverage, () => null, (block) => block.straight)
      cells.forEach((one, n) => (this.blocks[this.starts[place] + n].straight = one))
    }
  }

  /** The placements of a chart whose sources have come, in painting order; masks that have not come are cut straight, if they count. */
  placements(chart, isSketch = false) {
    const [first, end] = this.gridsOf[chart]
    const blocks = this.blocks.slice(this.starts[first], this.starts[end])
    if (isSketch) return blocks
    const known = ({ firstCell, cellCount }) =>
      firstCell + cellCount > this.knownCells ? null : this.cells.subarray(firstCell, firstCell + cellCount)
    if (blocks.some((block) => block.cut && !known(block))) this.#cutStraight()
    let cells = blocks.map((block) => block.cut && (known(block) ?? block.straight))
    if (chart === this.maskChart && blocks.some((block) => block.cut && known(block))) {
      // Some of its masks have come: the others are cut by what those cover.
      const places = range(end - first).map((n) => first + n)
      cells = straightCells(this, places, new Coverage(this.charts[chart]), known, known)
    }
    return blocks.map((block, n) =>
      block.cut ? { ...block, mask: MASK_CUT, cells: cells[n] } : { ...block, mask: MASK_NONE },
    )
  }
}

/** Which block lies at each position of a chart's grid, with a ring of positions round it. */
class BlockTable {
  constructor(grid) {
    this.grid = grid
    this.stride = grid.columns + 2
    this.at = new Int32Array((grid.rows + 2) * this.stride).fill(-1)
    this.firstOwn = Infinity
  }

  #place(i, j) {
    return (i + 1) * this.stride + j + 1
  }

  /** Enter a block at the position nearest to it, or on the ring. */
  enterTransferred({ row, column }, number) {
    const { rows, columns, firstRow, firstColumn, stepRow, stepColumn } = this.grid
    const i = Math.floor((row - firstRow + (stepRow >> 1)) / stepRow)
    const j = Math.floor((column - firstColumn + (stepColumn >> 1)) / stepColumn)
    this.at[this.#place(clamp(i, -1, rows), clamp(j, -1, columns))] = number
  }

  enterOwn(i, j, number) {
    this.firstOwn = Math.min(this.firstOwn, number)
    this.at[this.#place(i, j)] = number
  }

  /** By what lies at a position, to its left and above (0 nothing, 1 a transferred block, 2 an own one) and the rim. */
  skipContext(i, j) {
    const place = this.#place(i, j)
    const owner = (at) => (this.at[at] < 0 ? 0 : this.at[at] < this.firstOwn ? 1 : 2)
    const rim = i === 0 || j === 0 || i === this.grid.rows - 1 || j === this.grid.columns - 1 ? 1 : 0
    return 2 * ((owner(place - 1) * 3 + owner(place - this.stride)) * 3 + owner(place)) + rim
  }

  /** Blocks to the left, above, here or beyond, above to the left and to the right; −1 for none. */
  neighbours(i, j) {
    const { at, stride } = this
    const place = this.#place(i, j)
    let here = at[place]
    for (const step of [1, stride, stride + 1, 1 - stride, -1 - stride]) if (here < 0) here = at[place + step]
    return [at[place - 1], at[place - stride], here, at[place - stride - 1], at[place - stride + 1]]
  }
}
