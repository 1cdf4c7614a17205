/** Masks of grid plans [5.6]: what is covered already says which cells have to be told. */

import { BitDecoder } from '../bits.js'
import { cellsAround } from '../masks.js'
import { ceilDivide, clamp } from '../numbers.js'
import { maskShape, topLeft } from './placement.js'

// What is known of a cell before it is decoded. From NEAR_BARE on it is new, unless the mask says otherwise.
const OPEN = 0
const BESIDE_COVERED = 1 // on the rim, and what lies beyond is covered
const NEAR_BARE = 2 // one of the cells round it is bare
const BARE = 3 // some of its texels are not covered
const OUTSIDE = 4 // too far beyond the chart to be seen

// Where counters by shape, by place and by distances begin, and the one that says that a mask is irregular.
const BY_PLACE = 8192
const BY_DISTANCE = BY_PLACE + 32768
const IRREGULAR = BY_DISTANCE + 8192
const IRREGULAR_MIXER = 64
const LIMIT = 400

// What a transferred block's cell shows of the block that it comes from; 1 old, 2 new.
const BEYOND_LINKED = 0
const NOT_LINKED = 3

/** A decoder of the bits of such masks. */
export function gridMaskBits() {
  const bits = new BitDecoder(IRREGULAR + 1, IRREGULAR_MIXER + 1, 24030)
  bits.setWeights(IRREGULAR_MIXER, IRREGULAR_MIXER + 1, 72090)
  return bits
}

/** Decode the masks of all blocks of a plan, chart after chart; waits where bytes are missing. */
export function* decodeGridMasks(plan) {
  const { blocks, starts, grids, charts, changed } = plan
  for (const [place, chart] of plan.order.entries()) {
    const coverage = new Coverage(charts[chart])
    const firstOwn = starts[place] + grids[chart].transferred
    for (let n = starts[place]; n < starts[place + 1]; n++) {
      const block = blocks[n]
      const isOwn = n >= firstOwn
      if (!block.cut) {
        coverage.addRectangle(block)
        continue
      }
      const known = coverage.classify(block, isOwn, plan.feather)
      yield* decodeMask(plan, block, isOwn, known)
      plan.knownCells += block.cellCount
      changed.add(chart)
      if (isOwn) coverage.addRectangle(block)
      else coverage.addNewCells(block, plan.cells, known.under)
    }
  }
}

function* decodeMask(plan, block, isOwn, { classes, under }) {
  const { masks, cells } = plan
  const { input } = masks
  const { firstCell } = block
  const [rows, columns] = maskShape(block)
  let irregular = 0
  if (isOwn) {
    input[0] = IRREGULAR
    while ((irregular = masks.bit(1, IRREGULAR_MIXER, LIMIT)) < 0) yield
  }
  const isCoded = (at) => classes[at] !== OUTSIDE && (irregular || classes[at] < NEAR_BARE)
  for (let at = 0; at < block.cellCount; at++) if (!isCoded(at)) cells[firstCell + at] = 1
  const kind = isOwn ? 0 : 1
  for (let i = 0, at = 0; i < rows; i++) {
    for (let j = 0; j < columns; j++, at++) {
      if (!isCoded(at)) continue
      const around = cellsAround(cells, firstCell, i, j, columns)
      const near = around & 15
      const shown = isOwn ? block.agrees : shownOfLinked(plan, block, i, j)
      input[0] = ((kind * 128 + around) * 8 + newBehind(classes, at, i, j, rows, columns)) * 4 + shown
      input[1] = BY_PLACE + ((kind * 1024 + Math.min(i, 31) * 32 + Math.min(j, 31)) * 4 + (near & 3)) * 4 + shown
      const distances = openRight(classes, at, j, columns) * 8 + openBelow(classes, at, i, rows, columns)
      input[2] = BY_DISTANCE + ((kind * 64 + distances) * 16 + near) * 4 + shown
      const seeded = classes[at] === BESIDE_COVERED || (kind && under[at]) ? 1 : 0
      let bit
      while ((bit = masks.bit(3, (kind * 16 + near) * 2 + seeded, LIMIT)) < 0) yield
      cells[firstCell + at] = bit
    }
  }
}

/** Whether the cells to the right, below, and below to the left are new, as bits. */
function newBehind(classes, at, i, j, rows, columns) {
  const right = j + 1 < columns && classes[at + 1] >= NEAR_BARE ? 1 : 0
  const below = i + 1 < rows && classes[at + columns] >= NEAR_BARE ? 2 : 0
  return right + below + (i + 1 < rows && j > 0 && classes[at + columns - 1] >= NEAR_BARE ? 4 : 0)
}

/** How many cells to the right come before the first new one or the rim, at most 7. */
function openRight(classes, at, j, columns) {
  let count = 0
  while (count < 7 && j + count + 1 < columns && classes[at + count + 1] < NEAR_BARE) count++
  return count
}

/** The same downward. */
function openBelow(classes, at, i, rows, columns) {
  let count = 0
  while (count < 7 && i + count + 1 < rows && classes[at + (count + 1) * columns] < NEAR_BARE) count++
  return count
}

/** What the block that a transferred one comes from shows at the middle of cell (i, j). */
function shownOfLinked({ blocks, cells }, block, i, j) {
  if (block.link < 0) return NOT_LINKED
  const linked = blocks[block.link]
  const { maskCell, matrix } = block
  const [top, left] = topLeft(block)
  const down = 2 * (top + i * maskCell - block.row) + maskCell - 1
  const right = 2 * (left + j * maskCell - block.column) + maskCell - 1
  const [a, b, c, d] = linked.matrix
  let area = a * d - b * c
  let y = Math.floor((matrix[0] * down + matrix[1] * right) / 16)
  let x = Math.floor((matrix[2] * down + matrix[3] * right) / 16)
  if (area < 0) [area, y, x] = [-area, -y, -x]
  area = Math.floor(area / 16)
  if (area === 0) return NOT_LINKED
  const row = Math.floor((d * y - b * x + area) / (2 * area)) + (linked.height >> 1)
  const column = Math.floor((a * x - c * y + area) / (2 * area)) + (linked.width >> 1)
  if (row < 0 || column < 0 || row >= linked.height || column >= linked.width) return BEYOND_LINKED
  if (!linked.cut) return 2
  const across = ceilDivide(linked.width, linked.maskCell)
  return 1 + cells[linked.firstCell + Math.floor(row / linked.maskCell) * across + Math.floor(column / linked.maskCell)]
}

/** Which texels of a chart are covered by blocks so far. */
class Coverage {
  constructor({ height, width }) {
    this.height = height
    this.width = width
    this.covered = new Uint8Array(height * width)
  }

  /** The part of texels [top, bottom) × [left, right) that lies on the chart. */
  #clip(top, bottom, left, right) {
    return [Math.max(top, 0), Math.min(bottom, this.height), Math.max(left, 0), Math.min(right, this.width)]
  }

  /** Cover a block's rectangle. */
  addRectangle(block) {
    const [top, left] = topLeft(block)
    const [r0, r1, c0, c1] = this.#clip(top, top + block.height, left, left + block.width)
    for (let r = r0; r < r1; r++) this.covered.fill(1, r * this.width + c0, r * this.width + c1)
  }

  /** Cover a transferred block's new cells, where all cells round them are there, and new or covered. */
  addNewCells(block, cells, under) {
    const { height, width, maskCell, firstCell } = block
    const [top, left] = topLeft(block)
    const [rows, columns] = maskShape(block)
    const isSolid = (i, j) => {
      if (i === 0 || j === 0 || i === rows - 1 || j === columns - 1) return false
      for (let a = i - 1; a <= i + 1; a++) {
        for (let at = a * columns + j - 1, k = 0; k < 3; at++, k++) {
          if (cells[firstCell + at] !== 1 && under[at] !== 1) return false
        }
      }
      return cells[firstCell + i * columns + j] === 1
    }
    for (let i = 0; i < rows; i++) {
      for (let j = 0; j < columns; j++) {
        if (!isSolid(i, j)) continue
        const bottom = top + Math.min(height, (i + 1) * maskCell)
        const right = left + Math.min(width, (j + 1) * maskCell)
        const [r0, r1, c0, c1] = this.#clip(top + i * maskCell, bottom, left + j * maskCell, right)
        for (let r = r0; r < r1; r++) for (let c = c0; c < c1; c++) this.covered[r * this.width + c] = 1
      }
    }
  }

  /** What is known of each cell of a block's mask (`classes`), and whether its first texel is covered (`under`). */
  classify(block, isOwn, feather) {
    const [rows, columns] = maskShape(block)
    const classes = new Uint8Array(rows * columns)
    const under = new Uint8Array(rows * columns).fill(1)
    this.#findBare(block, isOwn, feather, classes, under)
    if (isOwn) {
      markNearBare(classes, rows, columns)
      this.#markBesideCovered(block, classes)
    }
    return { classes, under }
  }

  #findBare(block, isOwn, feather, classes, under) {
    const { height: tall, width: wide, covered } = this
    const { height, width, maskCell } = block
    const [top, left] = topLeft(block)
    const [rows, columns] = maskShape(block)
    for (let i = 0, at = 0; i < rows; i++) {
      const [r0, r1] = [top + i * maskCell, top + Math.min(height, (i + 1) * maskCell)]
      for (let j = 0; j < columns; j++, at++) {
        const [c0, c1] = [left + j * maskCell, left + Math.min(width, (j + 1) * maskCell)]
        if (r1 + feather <= 0 || c1 + feather <= 0 || r0 - feather >= tall || c0 - feather >= wide) {
          classes[at] = OUTSIDE
          continue
        }
        if (r0 >= 0 && r0 < tall && c0 >= 0 && c0 < wide) under[at] = covered[r0 * wide + c0]
        if (!isOwn) continue
        for (let r = Math.max(r0, 0); r < Math.min(r1, tall) && classes[at] === OPEN; r++) {
          for (let c = Math.max(c0, 0); c < Math.min(c1, wide); c++) if (!covered[r * wide + c]) classes[at] = BARE
        }
      }
    }
  }

  #markBesideCovered(block, classes) {
    const { height: tall, width: wide, covered } = this
    const { height, width, maskCell } = block
    const [top, left] = topLeft(block)
    const [rows, columns] = maskShape(block)
    const isCovered = (r, c) => covered[clamp(r, 0, tall - 1) * wide + clamp(c, 0, wide - 1)]
    for (let i = 0, at = 0; i < rows; i++) {
      for (let j = 0; j < columns; j++, at++) {
        if (classes[at] !== OPEN) continue
        const [r, c] = [top + i * maskCell, left + j * maskCell]
        if (
          (i === 0 && r > 0 && isCovered(top - 1, c)) ||
          (i === rows - 1 && top + height < tall && isCovered(top + height, c)) ||
          (j === 0 && c > 0 && isCovered(r, left - 1)) ||
          (j === columns - 1 && left + width < wide && isCovered(r, left + width))
        ) {
          classes[at] = BESIDE_COVERED
        }
      }
    }
  }
}

function markNearBare(classes, rows, columns) {
  for (let i = 0, at = 0; i < rows; i++) {
    for (let j = 0; j < columns; j++, at++) {
      if (classes[at] !== OPEN) continue
      for (let a = Math.max(i - 1, 0); a < Math.min(i + 2, rows); a++) {
        for (let b = Math.max(j - 1, 0); b < Math.min(j + 2, columns); b++) {
          if (classes[a * columns + b] === BARE) classes[at] = NEAR_BARE
        }
      }
    }
  }
}
