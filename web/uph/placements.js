/** Placements [4]: one block of the exemplar on one chart, and how they are told one after another [5.2]. */

import { BitDecoder } from './bits.js'
import { INTEGER_COUNTERS, INTEGER_MIXERS, decodeInteger } from './integers.js'
import { clamp } from './numbers.js'
import { SYMMETRIES } from './symmetry.js'

/** The most of all placements of a quilt. */
export const MAX_PLACEMENTS = 2 ** 19

/** How far from its centre a placement tells places apart, in 1/16 step. */
export const FARTHEST = 16383

const MAX_MATRIX = 2 ** 18
const REMEMBERED = 128 // placements among which the nearest one is looked for

// The numbers of a placement, in coded order.
const ROW = 0
const COLUMN = 1
const SYMMETRY = 2
const CENTRED = 3
const MATRIX = 4
const SOURCE = 8
const COUNT = 10

/** The placement of a chart of which nothing is known: the exemplar's middle on its middle. */
export function barePlacement(chart, field, { height, width }) {
  const [row, column] = [8 * chart.height, 8 * chart.width]
  const center = field.at(row, column, [0, 0, 0, 0])
  return { row, column, symmetry: 0, center, sourceRow: 8 * (height - 1), sourceColumn: 8 * (width - 1) }
}

/** Where a placement reads, in 1/16 pixel, at a place where the field's matrix is `there`. */
export function sourceAt({ center, symmetry, ...placement }, there, row, column) {
  const [a, b, c, d] = there.map((entry, k) => entry + center[k])
  const down = clamp(row - placement.row, -FARTHEST, FARTHEST)
  const right = clamp(column - placement.column, -FARTHEST, FARTHEST)
  const [y, x, e, f] = [down >> 4, right >> 4, down & 15, right & 15]
  const v = (a * y + b * x + ((a * e + b * f) >> 4) + 256) >> 9
  const w = (c * y + d * x + ((c * e + d * f) >> 4) + 256) >> 9
  const [p, q, r, s] = SYMMETRIES[symmetry]
  return [placement.sourceRow + p * v + q * w, placement.sourceColumn + r * v + s * w]
}

/**
 * Decodes placements, layer after layer of charts; fail(what) is called for one that is not allowed. Sources and matrices are multiples
 * of powers of two, of which `bits` tells the exponents.
 */
export class PlacementDecoder {
  constructor({ height, width }, bits, fail) {
    ;[this.sourceBits, this.matrixBits] = bits
    this.bits = new BitDecoder(COUNT * INTEGER_COUNTERS, COUNT * INTEGER_MIXERS, 72090)
    this.most = [16 * height - 1, 16 * width - 1]
    this.middle = [8 * (height - 1), 8 * (width - 1)]
    this.fail = fail
  }

  /** The placements of a layer of a chart, so many, whose centres are those of cells; waits where bytes are missing. */
  *decode({ grid, count }, field) {
    const list = []
    let [i, j] = [0, -1] // of the cell of the placement before
    while (list.length < count) {
      this.before = [0, 0] // of the last two numbers, whether they were 0
      const further = yield* this.#number(ROW)
      i = this.#within('row', i + further, i, grid.rows - 1)
      const first = further || j < 0 ? 0 : j + 1
      j = this.#within('column', first + (yield* this.#number(COLUMN)), first, grid.columns - 1)
      list.push(yield* this.#decodeRest(list, grid.center(i), grid.center(j), field))
      list.at(-1).cell = i * grid.columns + j
    }
    return list
  }

  *#decodeRest(list, row, column, field) {
    const nearest = nearestOf(list, row, column)
    const there = field.at(row, column, [0, 0, 0, 0])
    const symmetry = this.#within('symmetry', (nearest?.symmetry ?? 0) + (yield* this.#number(SYMMETRY)), 0, 7)
    let center = there
    if (this.#within('centre', yield* this.#number(CENTRED), 0, 1)) {
      center = []
      for (let k = 0; k < 4; k++) {
        const entry = yield* this.#multiple(MATRIX + k, there[k], this.matrixBits)
        center.push(this.#within('centre matrix', entry, -MAX_MATRIX, MAX_MATRIX))
      }
    }
    const source = nearest ? sourceAt(nearest, there, row, column) : [...this.middle]
    for (let k = 0; k < 2; k++) {
      const guess = clamp(source[k], 0, this.most[k])
      source[k] = this.#within('source', yield* this.#multiple(SOURCE + k, guess, this.sourceBits), 0, this.most[k])
    }
    return { row, column, symmetry, center, sourceRow: source[0], sourceColumn: source[1] }
  }

  /** A number that is a multiple of 2^bits, told by how far it is from a guess. */
  *#multiple(kind, guess, bits) {
    return 2 ** bits * (((guess + ((1 << bits) >> 1)) >> bits) + (yield* this.#number(kind)))
  }

  *#number(kind) {
    const { before } = this
    const number = yield* decodeInteger(this.bits, kind, 2 * before[0] + before[1])
    this.before = [before[1], number ? 1 : 0]
    return number
  }

  #within(name, value, least, most) {
    if (!(value >= least && value <= most)) this.fail(`${name} of a placement is ${value}; allowed: ${least} to ${most}`)
    return value
  }
}

/** Of the last placements the one with the nearest centre, of several the latest; undefined if there is none. */
function nearestOf(list, row, column) {
  let [found, least] = [undefined, Infinity]
  for (let n = list.length - 1, end = Math.max(0, list.length - REMEMBERED); n >= end; n--) {
    const one = list[n]
    const far = (one.row - row) ** 2 + (one.column - column) ** 2
    if (far < least) [found, least] = [one, far]
  }
  return found
}
