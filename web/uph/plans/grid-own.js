/** A chart's own blocks in a grid plan: most continue what a neighbour shows, or nearly so [5.5]. */

import { hash } from '../bits.js'
import {
  AS_BESIDE,
  CUT,
  FLAG,
  FLAG_BY_GUESS,
  FLAG_BY_UPPER,
  FLAG_MIXER,
  HASHED,
  LIMIT,
  NO_MODE,
  OFFSET,
  OFFSET_MIXER,
  OFF_PIXEL,
  OFF_PIXEL_MIXER,
  ONE_MIXER,
  TREE,
  TREE_MIXER,
  TURN,
} from './grid-model.js'
import { centerMatrix, sourceAt } from './placement.js'
import { symmetryTimes } from '../symmetry.js'

const NEAR = 3 // the largest small offset, in pixels of the level
const POSITION_BITS = 20

// Neighbours by their places in `near`.
const [LEFT, TOP, HERE, TOP_LEFT, TOP_RIGHT] = [0, 1, 2, 3, 4]

/** The pixel of a level at a position in 1/16 pixel, and the position of its middle. */
const toPixel = (position, level) => (position + 8) >> (4 + level)
const toPosition = (pixel, level) => ((16 * pixel + 8) << level) - 8

/** Decodes own blocks; `near` are those to the left, above, here or beyond, and above to the left and right. */
export class OwnBlockDecoder {
  constructor(plan) {
    const { exemplar } = plan
    this.plan = plan
    this.sources = plan.sources
    this.most = [16 * exemplar.height - 1, 16 * exemplar.width - 1] // the last position
  }

  /** The block at (i, j) of a grid; `later` if it is not the first there. */
  *decode(grid, i, j, near, later) {
    const { sources, most } = this
    const { fields, fail } = this.plan
    const field = fields[grid.chart]
    const [row, column] = [grid.firstRow + i * grid.stepRow, grid.firstColumn + j * grid.stepColumn]
    const { height, width, maskCell } = grid
    const block = { chart: grid.chart, row, column, height, width, maskCell, link: -1 }
    sources.input[0] = CUT + (later ? 1 : 0)
    let bit
    while ((bit = sources.bit(1, ONE_MIXER, LIMIT)) < 0) yield
    block.cut = bit
    block.symmetry = this.plan.turned ? yield* this.#decodeSymmetry(near) : 0
    block.center = centerMatrix(block, field)
    block.matrix = symmetryTimes(block.symmetry, block.center)
    const guesses = this.#guesses(block, near, field, 16 << grid.level)
    block.mode = yield* this.#decodeMode(near, guesses, 16 << grid.level)
    const source = block.mode
      ? yield* this.#decodeOffset(block.mode, guesses, grid.level)
      : yield* this.#decodePosition(guesses, grid.level)
    if (!source.every((position, axis) => position >= 0 && position <= most[axis])) {
      fail('source of a block lies outside the exemplar')
    }
    ;[block.sourceRow, block.sourceColumn] = source
    block.agrees = agreement(guesses, source, 16 << grid.level)
    return block
  }

  /** A symmetry: that of the block to the left or above, or three bits. */
  *#decodeSymmetry(near) {
    const { input } = this.sources
    const [left, top] = [near[LEFT]?.symmetry, near[TOP]?.symmetry]
    let bit
    for (const guess of new Set([left, top])) {
      if (guess === undefined) continue
      input[0] = AS_BESIDE + (guess !== left ? 3 : top === undefined ? 0 : top === left ? 1 : 2)
      while ((bit = this.sources.bit(1, ONE_MIXER, LIMIT)) < 0) yield
      if (bit) return guess
    }
    let node = 1
    while (node < 8) {
      input[0] = TURN + node
      while ((bit = this.sources.bit(1, ONE_MIXER, LIMIT)) < 0) yield
      node = 2 * node + bit
    }
    return node - 8
  }

  /** Where the source would lie if it continued a neighbour: to the left, above, here; null where that is of no use. */
  #guesses(block, near, field, unit) {
    const [mostY, mostX] = this.most
    const extent = (a, b) => Math.floor((Math.abs(a) * block.height + Math.abs(b) * block.width) / 512)
    const [a, b, c, d] = block.matrix
    const [tall, wide] = [extent(a, b), extent(c, d)]
    const guesses = [null, null, null]
    for (const g of [LEFT, TOP, HERE]) {
      if (near[g]?.symmetry !== block.symmetry) continue
      const [y, x] = sourceAt(near[g], field, block.row, block.column)
      if (y < 0 || y > mostY || x < 0 || x > mostX) continue
      if (g === HERE && guesses.some((guess) => guess && guess.y === y && guess.x === x)) continue
      const room = Math.min(y - tall, mostY - 15 - y - tall, x - wide, mostX - 15 - x - wide)
      guesses[g] = { y, x, inside: room >= unit ? 2 : room >= -unit ? 1 : 0 }
    }
    return guesses
  }

  /** 1 + g for a source at guess g, 4 + g for one near it, 0 for any other. */
  *#decodeMode(near, guesses, unit) {
    const { input } = this.sources
    const apart = distanceClass(guesses, unit)
    const mode = (n) => (near[n] ? near[n].mode : NO_MODE)
    const beside = mode(LEFT) * 8 + mode(TOP)
    const upper = mode(TOP_LEFT) * 8 + mode(TOP_RIGHT)
    for (let step = 0; step < 6; step++) {
      const guess = guesses[step % 3]
      if (!guess || (step === TOP && apart === SAME)) continue
      const place = apart * 3 + guess.inside
      input[0] = FLAG + (step * 64 + beside) * 12 + place
      input[1] = FLAG_BY_GUESS + step * 12 + place
      input[2] = FLAG_BY_UPPER + step * 64 + upper
      let bit
      while ((bit = this.sources.bit(3, FLAG_MIXER + step, LIMIT)) < 0) yield
      if (bit) return 1 + step
    }
    return 0
  }

  /** A source at a guess, or a few pixels from it. */
  *#decodeOffset(mode, guesses, level) {
    const { input } = this.sources
    const g = (mode - 1) % 3
    const { y, x } = guesses[g]
    if (mode <= 3) return [y, x]
    const offset = [0, 0]
    for (let axis = 0; axis < 2; axis++) {
      let node = 1
      while (node < 8) {
        input[0] = OFFSET + g * 128 + (axis ? 8 + 8 * offset[0] : 0) + node
        let bit
        while ((bit = this.sources.bit(1, OFFSET_MIXER + axis, LIMIT)) < 0) yield
        node = 2 * node + bit
      }
      offset[axis] = node - 8
    }
    return [y, x].map((at, axis) => toPosition(toPixel(at, level) + offset[axis] - NEAR, level))
  }

  /** A source told without guesses. */
  *#decodePosition(guesses, level) {
    const { input } = this.sources
    input[0] = OFF_PIXEL
    let bit
    while ((bit = this.sources.bit(1, OFF_PIXEL_MIXER, LIMIT)) < 0) yield
    if (!bit) return (yield* this.#decodePixel(guesses, level)).map((pixel) => toPosition(pixel, level))
    const found = [0, 0]
    for (let axis = 0; axis < 2; axis++) {
      for (let b = POSITION_BITS - 1; b >= 0; b--) {
        input[0] = OFF_PIXEL + 1 + POSITION_BITS * axis + b
        while ((bit = this.sources.bit(1, OFF_PIXEL_MIXER, LIMIT)) < 0) yield
        found[axis] = 2 * found[axis] + bit
      }
    }
    return found
  }

  /** A pixel of the level, its row, then its column, bit by bit. */
  *#decodePixel(guesses, level) {
    const { input } = this.sources
    const region = (guess) => (guess ? 1 + (toPixel(guess.y, level) >> 2) * 1024 + (toPixel(guess.x, level) >> 2) : 0)
    const [left, top] = [region(guesses[LEFT]), region(guesses[TOP])]
    const found = [0, 0]
    for (let axis = 0; axis < 2; axis++) {
      const bits = 32 - Math.clz32(toPixel(this.most[axis] - 15, level))
      let node = 1
      for (let b = 0; b < bits; b++) {
        const key = axis ? node + 4096 * (1 + found[0]) : node
        input[0] = TREE + 2048 * axis + (node & 2047)
        input[1] = HASHED + hash(key, left, 0)
        input[2] = HASHED + 65536 + hash(key, top, 7)
        input[3] = HASHED + 131072 + hash(key, left, top + 19)
        let bit
        while ((bit = this.sources.bit(4, TREE_MIXER + 2 * axis + (left || top ? 1 : 0), LIMIT)) < 0) yield
        node = 2 * node + bit
      }
      found[axis] = node - 2 ** bits
    }
    return found
  }
}

const SAME = 0

/** How far the guesses from the left and from above lie apart: 0 at one place, 1 near, 2 far, 3 unknown. */
function distanceClass([left, top], unit) {
  if (!left || !top) return 3
  const distance = Math.max(Math.abs(left.y - top.y), Math.abs(left.x - top.x))
  return distance === 0 ? SAME : distance <= NEAR * unit ? 1 : 2
}

/** Whether the source agrees with what continues the left neighbour (1), the one above (2). */
function agreement(guesses, [row, column], unit) {
  let agrees = 0
  for (const g of [LEFT, TOP]) {
    const guess = guesses[g]
    if (guess && Math.abs(guess.y - row) <= unit && Math.abs(guess.x - column) <= unit) agrees |= 1 << g
  }
  return agrees
}
