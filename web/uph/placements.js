/** Placements [4]: one block of the exemplar on one chart, and how they come from coarse to fine [5.2]. */

import { BitDecoder } from './bits.js'
import { INTEGER_COUNTERS, decodeInteger } from './integers.js'

/** The most of all placements of a quilt. */
export const MAX_PLACEMENTS = 2 ** 19

/** Distance from its centre up to which a placement distinguishes places, in 1/16 step. */
export const FARTHEST = 16383

const MAX_OFFSET = 2 ** 18
const LINES_A_LAYER = 32

// Kinds of numbers; two of the first kind, four of the offset.
const CELL = 0
const OFFSET = 2
const OTHERS = 6
const KINDS = 7

// Counters of single bits after them.
const SYMMETRY = KINDS * INTEGER_COUNTERS
const HAS_OFFSET = SYMMETRY + 8
const SOURCE = HAS_OFFSET + 1
const SOURCE_BITS = 32

/** The placement of a chart of which nothing is known: the exemplar's middle on its middle. */
export function barePlacement(chart, { height, width }) {
  const [row, column] = [8 * chart.height, 8 * chart.width]
  return { row, column, symmetry: 0, offset: [0, 0, 0, 0], sourceRow: 8 * (height - 1), sourceColumn: 8 * (width - 1) }
}

/**
 * Decodes placements, box after box, and gives them to the layers that they are of; fail(what) is called for one that is not allowed.
 * Sources and offsets are multiples of powers of two, whose exponents are `bits`.
 */
export class PlacementDecoder {
  /** How many placements are known. */
  known = 0
  /** Charts that got some since somebody emptied the set. */
  changed = new Set()

  constructor(layers, { height, width }, bits, fail) {
    ;[this.sourceBits, this.offsetBits] = bits
    this.bits = new BitDecoder(SOURCE + 2 * SOURCE_BITS)
    this.most = [16 * height - 1, 16 * width - 1]
    this.fail = fail
    this.lines = Array.from({ length: 2 * LINES_A_LAYER }, () => ({ boxes: [], next: 0 }))
    for (const layer of layers) {
      const { rows, columns } = layer.grid
      if (layer.count) this.#queue({ layer, begin: [0, 0], end: [rows, columns], count: layer.count, cell: null })
    }
    this.steps = this.#decode()
    this.steps.next()
  }

  feed(part) {
    this.bits.feed(part)
    this.steps.next()
  }

  /** Put a box at the end of its line: by its layer, and by the bits of the number of its steps. */
  #queue(box) {
    const { grid, isSecond } = box.layer
    const bits = 32 - Math.clz32(cellsOf(box) * grid.cell ** 2)
    this.lines[LINES_A_LAYER * (isSecond ? 1 : 0) + LINES_A_LAYER - bits].boxes.push(box)
  }

  #next() {
    const line = this.lines.find(({ boxes, next }) => next < boxes.length)
    if (!line) return null
    const box = line.boxes[line.next]
    line.boxes[line.next++] = null
    if (line.next === line.boxes.length) [line.boxes, line.next] = [[], 0]
    return box
  }

  *#decode() {
    for (let box; (box = this.#next()); ) {
      const placement = box.cell ? null : yield* this.#placement(box)
      if (placement) box.cell = placement.at
      if (box.count > 1) yield* this.#cut(box)
      if (placement) {
        box.layer.add(placement)
        this.changed.add(box.layer.chart)
        this.known++
      }
    }
  }

  /** A placement of a box, which lies near its middle. */
  *#placement({ layer, begin, end, count }) {
    const at = []
    for (let k = 0; k < 2; k++) {
      const middle = (begin[k] + end[k] - 1) >> 1
      at.push(this.#within('cell', middle + (yield* decodeInteger(this.bits, CELL + k, Math.min(count, 4))), begin[k], end[k] - 1))
    }
    let symmetry = 1
    for (let b = 0; b < 3; b++) symmetry = 2 * symmetry + (yield* this.bits.wait(SYMMETRY + symmetry))
    const offset = [0, 0, 0, 0]
    if (yield* this.bits.wait(HAS_OFFSET)) {
      for (let k = 0; k < 4; k++) {
        const number = 2 ** this.offsetBits * (yield* decodeInteger(this.bits, OFFSET + k, 0))
        offset[k] = this.#within('offset', number, -MAX_OFFSET, MAX_OFFSET)
      }
    }
    const source = []
    for (let k = 0; k < 2; k++) source.push(yield* this.#coordinate(k))
    const { grid } = layer
    return {
      at,
      cell: at[0] * grid.columns + at[1],
      row: grid.center(at[0]),
      column: grid.center(at[1]),
      symmetry: symmetry - 8,
      offset,
      sourceRow: source[0],
      sourceColumn: source[1],
    }
  }

  *#coordinate(k) {
    const most = this.most[k] >> this.sourceBits
    let number = 0
    for (let b = 31 - Math.clz32(most); b >= 0; b--) number = 2 * number + (yield* this.bits.wait(SOURCE + k * SOURCE_BITS + b))
    return this.#within('source', number, 0, most) << this.sourceBits
  }

  /** Cut a box across its longer side; the half with the known placement comes first. */
  *#cut({ layer, begin, end, count, cell }) {
    const axis = end[0] - begin[0] >= end[1] - begin[1] ? 0 : 1
    const place = (begin[axis] + end[axis]) >> 1
    const others = (count >> 1) + (yield* decodeInteger(this.bits, OTHERS, Math.min(count, 5)))
    this.#within('number in a half', others, 0, count - 1)
    const halves = [
      { layer, begin, end: end.with(axis, place), count: 0, cell: null },
      { layer, begin: begin.with(axis, place), end, count: 0, cell: null },
    ]
    const [mine, other] = cell[axis] < place ? halves : halves.reverse()
    Object.assign(mine, { count: count - others, cell })
    other.count = others
    for (const half of [mine, other]) if (cellsOf(half) < half.count) this.fail('a box has more placements than cells')
    this.#queue(mine)
    if (others) this.#queue(other)
  }

  #within(name, value, least, most) {
    if (!(value >= least && value <= most)) this.fail(`${name} of a placement is ${value}; allowed: ${least} to ${most}`)
    return value
  }
}

const cellsOf = ({ begin, end }) => (end[0] - begin[0]) * (end[1] - begin[1])
