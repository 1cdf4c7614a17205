/** Masks of grid plans [5.6]: what is covered already says which cells have to be told. */

import { BitDecoder } from '../bits.js'
import { BESIDE_COVERED, Coverage, MaskFrame, NEAR_BARE } from './coverage.js'
import { BEYOND_LINKED, NEW_THERE, NOT_LINKED, OLD_THERE, cutStraight } from './straight.js'

// Where counters by shape, by place and by distances begin, and the one that says that a mask is irregular.
const BY_PLACE = 8192
const BY_DISTANCE = BY_PLACE + 32768
const IRREGULAR = BY_DISTANCE + 8192
const IRREGULAR_MIXER = 64
const LIMIT = 400

/** A decoder of the bits of such masks. */
export function gridMaskBits() {
  const bits = new BitDecoder(IRREGULAR + 1, IRREGULAR_MIXER + 1, 24030)
  bits.setWeights(IRREGULAR_MIXER, IRREGULAR_MIXER + 1, 72090)
  return bits
}

/**
 * The cells of the masks of a chart's grids: what `known(block)` gives, else straight cuts; null for blocks without a
 * mask. `cellsOf` gives the cells of the blocks that transferred ones come from.
 */
export function straightCells(plan, places, coverage, known, cellsOf) {
  const { blocks, starts, grids } = plan
  const found = []
  const here = new Map() // cells of blocks of these grids
  const cellsHere = (block) => here.get(block) ?? cellsOf(block)
  for (const place of places) {
    const firstOwn = starts[place] + grids[place].transferred
    for (let n = starts[place]; n < starts[place + 1]; n++) {
      const block = blocks[n]
      if (!block.cut) {
        coverage.addRectangle(block)
        found.push(null)
        continue
      }
      const shows = shownOfLinked(blocks[block.link], block, cellsHere)
      found.push(cutStraight(coverage, block, { isOwn: n >= firstOwn, known: known(block), shows }))
      here.set(block, found.at(-1))
    }
  }
  return found
}

/** Decode the masks of all blocks of a plan, grid after grid; waits where bytes are missing. */
export function* decodeGridMasks(plan) {
  const { blocks, starts, charts, changed } = plan
  let coverage
  for (const [place, { chart, transferred }] of plan.grids.entries()) {
    plan.maskChart = chart
    if (plan.grids[place - 1]?.chart !== chart) coverage = new Coverage(charts[chart])
    const firstOwn = starts[place] + transferred
    for (let n = starts[place]; n < starts[place + 1]; n++) {
      const block = blocks[n]
      const isOwn = n >= firstOwn
      if (!block.cut) {
        coverage.addRectangle(block)
        continue
      }
      const frame = new MaskFrame(block, coverage)
      coverage.classify(frame, isOwn)
      yield* decodeMask(plan, frame, isOwn)
      frame.copyCells(plan.cells, block.firstCell)
      plan.knownCells += block.cellCount
      changed.add(chart)
      if (isOwn) coverage.addRectangle(block)
      else coverage.addNewCells(frame)
    }
  }
}

function* decodeMask(plan, frame, isOwn) {
  const { masks } = plan
  const { input } = masks
  const { block, cells, classes, under, stride } = frame
  const knownCells = ({ firstCell }) => plan.cells.subarray(firstCell)
  const { top, left, rows, columns } = block.window
  let irregular = 0
  if (isOwn) {
    input[0] = IRREGULAR
    while ((irregular = masks.bit(1, IRREGULAR_MIXER, LIMIT)) < 0) yield
  }
  const isTold = (at) => irregular || classes[at] < NEAR_BARE
  frame.forEach((at) => {
    if (!isTold(at)) cells[at] = 1
  })
  const kind = isOwn ? 0 : 1
  const shows = isOwn ? null : shownOfLinked(plan.blocks[block.link], block, knownCells)
  const open = frame.openCells()
  for (let i = top; i < top + rows; i++) {
    for (let j = left, at = frame.first + (i - top) * stride; j < left + columns; j++, at++) {
      if (!isTold(at)) continue
      const north = at - stride
      const near = cells[at - 1] + 2 * cells[north] + 4 * cells[north - 1] + 8 * cells[north + 1]
      const around = near + 16 * cells[at - 2] + 32 * cells[north - stride] + 64 * cells[north + 2]
      const shown = shows ? shows(i, j) : block.agrees
      input[0] = ((kind * 128 + around) * 8 + newBehind(classes, at, stride)) * 4 + shown
      input[1] = BY_PLACE + ((kind * 1024 + Math.min(i, 31) * 32 + Math.min(j, 31)) * 4 + (near & 3)) * 4 + shown
      input[2] = BY_DISTANCE + ((kind * 64 + open[at]) * 16 + near) * 4 + shown
      const seeded = classes[at] === BESIDE_COVERED || (kind && under[at]) ? 1 : 0
      let bit
      while ((bit = masks.bit(3, (kind * 16 + near) * 2 + seeded, LIMIT)) < 0) yield
      cells[at] = bit
    }
  }
}

/** Whether the cells to the right, below, and below to the left are new, as bits. */
function newBehind(classes, at, stride) {
  const below = at + stride
  const isNew = (near) => (classes[near] >= NEAR_BARE ? 1 : 0)
  return isNew(at + 1) + 2 * isNew(below) + 4 * isNew(below - 1)
}

/** A function of what the block that a transferred one comes from, if any, shows at the middle of cell (i, j). */
function shownOfLinked(linked, block, cellsOf) {
  if (!linked) return () => NOT_LINKED
  const { maskCell, matrix } = block
  let [a, b, c, d] = linked.matrix
  if (a * d < b * c) [a, b, c, d] = [-a, -b, -c, -d]
  const area = Math.floor(Math.abs(a * d - b * c) / 16)
  if (area === 0) return () => NOT_LINKED
  const cells = linked.cut && cellsOf(linked)
  return (i, j) => {
    const down = 2 * (i * maskCell - (block.height >> 1)) + maskCell - 1
    const right = 2 * (j * maskCell - (block.width >> 1)) + maskCell - 1
    const y = Math.floor((matrix[0] * down + matrix[1] * right) / 16)
    const x = Math.floor((matrix[2] * down + matrix[3] * right) / 16)
    const row = Math.floor((d * y - b * x + area) / (2 * area)) + (linked.height >> 1)
    const column = Math.floor((a * x - c * y + area) / (2 * area)) + (linked.width >> 1)
    if (row < 0 || column < 0 || row >= linked.height || column >= linked.width) return BEYOND_LINKED
    return !cells || cellAt(linked, cells, row, column) ? NEW_THERE : OLD_THERE
  }
}

/** The cell of a block at one of its texels; those beyond its window are new. */
function cellAt({ maskCell, window }, cells, row, column) {
  const i = Math.floor(row / maskCell) - window.top
  const j = Math.floor(column / maskCell) - window.left
  if (i < 0 || j < 0 || i >= window.rows || j >= window.columns) return 1
  return cells[i * window.columns + j]
}
