/** Strip plans (method "paper") [4, 5.2]: blocks on a grid and along strips; only the choice of candidates is coded. */

import { BitDecoder, hash } from '../bits.js'
import { decodeMask, maskBits } from '../masks.js'
import { ceilDivide, clamp, range } from '../numbers.js'
import { MAX_PATCHES } from '../surface.js'
import { MASK_CUT, MASK_NONE, MASK_RAMP, MAX_MASK_CELLS, MAX_PLACEMENTS, maskWindow } from './placement.js'
import { Plan } from './plan.js'
import { Strip, edgeLength } from './strip.js'

// Where counters by name, and those by hash, begin.
const FOLLOWS = 0
const TREE = 128
const HASHED = TREE + 4096
const COUNTERS = HASHED + 3 * 65536
const TREE_MIXER = 4
const MIXERS = 20
const LIMIT = 255
const NO_MODE = 3

/** Blocks of a size: their distance, and their candidates, rows × columns of them, every `tile` pixels. */
class Blocks {
  constructor(block, overlap, tile, { height, width }) {
    Object.assign(this, { block, overlap, tile, step: block - overlap, half: block >> 1 })
    this.rows = Math.floor((height - block) / tile) + 1
    this.columns = Math.floor((width - block) / tile) + 1
    this.jump = Math.max(1, Math.floor(this.step / tile))
  }

  along(length) {
    return Math.max(1, ceilDivide(length - this.overlap, this.step))
  }

  /** Where a block of a candidate has its centre. */
  source(candidate) {
    const { columns, tile, half } = this
    return [16 * (Math.floor(candidate / columns) * tile + half), 16 * ((candidate % columns) * tile + half)]
  }
}

export class StripPlan extends Plan {
  constructor(reader, charts, exemplar, budget) {
    super(charts, exemplar)
    const most = Math.min(256, exemplar.height, exemplar.width)
    const block = reader.varint('block', most, 2)
    const overlap = reader.varint('overlap', (block - 1) >> 1, 1)
    const tile = 2 ** reader.u8('levels', 6)
    this.blocks = new Blocks(block, overlap, tile, exemplar)
    this.strips = this.#parseStrips(reader, most, exemplar)
    reader.end('plan')
    this.order = range(charts.length)
    this.#countBlocks(reader)
    const fail = (what) => reader.fail(what)
    budget.checkCells(this.totalCells, fail)
    const along = this.total - this.starts[charts.length]
    if (along) budget.spendStrips(along, this.edgeBlocks.block, this.feather, fail)
    this.known = 0
    this.chosen = new Int32Array(this.total) // per block its candidate
    this.modes = new Uint8Array(this.total) // per block which neighbour it follows: 0 none, 1 left, 2 above
    this.sources = new BitDecoder(COUNTERS, MIXERS, 18022)
    this.sourceSteps = this.#decodeSources((what) => reader.fail(what))
  }

  #parseStrips(reader, most, exemplar) {
    const { overlap, tile } = this.blocks
    const count = reader.varint('number of strips', 4 * MAX_PATCHES)
    this.maskCell = 0
    this.side = 0 // cells along a side of a mask
    if (count) {
      const block = reader.varint('edge block', most, 2 * overlap + 1)
      this.edgeBlocks = new Blocks(block, overlap, tile, exemplar)
      this.maskCell = reader.u8('cell')
      this.feather = reader.u8('feather', 16)
      if (!this.maskCell || block % this.maskCell || block % 2) {
        reader.fail(`cell is ${this.maskCell}; allowed: divisors of the edge block, ${block}, which is even`)
      }
      this.side = block / this.maskCell
    }
    if (3 * count > reader.left) reader.fail(`${count} strips take more bytes than are left`)
    return range(count).map(() => this.#parseStrip(reader, this.charts, this.edgeBlocks.block))
  }

  #parseStrip(reader, charts, block) {
    const head = reader.u8('strip', 63)
    const a = reader.varint('chart', charts.length - 1)
    const b = reader.varint('chart', charts.length - 1)
    const [edgeA, edgeB, opposed] = [head & 3, (head >> 2) & 3, (head >> 4) & 1]
    const [lengthA, lengthB] = [edgeLength(charts[a], edgeA), edgeLength(charts[b], edgeB)]
    let [start, length, otherStart] = [0, lengthA, 0]
    if (head & 32) {
      start = reader.varint('start of a strip', lengthA)
      length = reader.varint('length of a strip', lengthA - start)
      otherStart = reader.varint('start of a strip on its other chart', lengthB)
    }
    if (length < block || otherStart + length > lengthB) {
      reader.fail(`strip of ${length} texels at ${otherStart}; allowed: an edge block, ${block}, to what fits ${lengthB}`)
    }
    return new Strip({ a, b, edgeA, edgeB, opposed, start, length, otherStart }, charts)
  }

  /** Where the runs of blocks begin, charts' first, then strips'; and where the masks of strips do. */
  #countBlocks(reader) {
    this.starts = [0]
    this.maskStarts = [0]
    for (const { height, width } of this.charts) {
      this.starts.push(this.starts.at(-1) + this.blocks.along(height) * this.blocks.along(width))
    }
    this.stripsOf = new Map()
    this.strips.forEach((strip, n) => {
      const count = this.edgeBlocks.along(strip.length)
      this.starts.push(this.starts.at(-1) + count)
      this.maskStarts.push(this.maskStarts.at(-1) + count * this.side ** 2)
      for (const chart of new Set([strip.a, strip.b])) {
        if (!this.stripsOf.has(chart)) this.stripsOf.set(chart, [])
        this.stripsOf.get(chart).push(n)
      }
    })
    this.total = reader.within(this.starts.at(-1), 'number of placements', 0, MAX_PLACEMENTS)
    this.totalCells = reader.within(this.maskStarts.at(-1), 'number of cells', 0, MAX_MASK_CELLS / 2)
  }

  // ---------------------------------------------------------------- sources

  *#decodeSources(fail) {
    const { charts, strips, starts } = this
    for (let run = 0; run + 1 < starts.length; run++) {
      const isStrip = run < charts.length ? 0 : 1
      const count = starts[run + 1] - starts[run]
      const kind = isStrip ? this.edgeBlocks : this.blocks
      let across = isStrip ? 1 : kind.along(charts[run].width)
      if (isStrip && !strips[run - charts.length].isUpright) across = count
      for (let n = 0; n < count; n++) {
        const block = starts[run] + n
        const near = this.#neighbours(block, n % across ? block - 1 : -1, n >= across ? block - across : -1, kind)
        let candidate = yield* this.#decodeFollowing(block, near, isStrip)
        if (candidate < 0) candidate = yield* this.#decodeCandidate(block, near, isStrip, kind, fail)
        this.chosen[block] = candidate
        this.known++
      }
      if (!isStrip) this.markKnown(run)
    }
  }

  /** Candidates and modes of the blocks to the left and above, and the candidates that would continue them. */
  #neighbours(block, leftBlock, topBlock, { jump, rows, columns }) {
    const { chosen, modes } = this
    const [left, top] = [leftBlock < 0 ? -1 : chosen[leftBlock], topBlock < 0 ? -1 : chosen[topBlock]]
    const leftMode = leftBlock < 0 ? NO_MODE : modes[leftBlock]
    const topMode = topBlock < 0 ? NO_MODE : modes[topBlock]
    const onward = left >= 0 && (left % columns) + jump < columns ? left + jump : -1
    const downward = top >= 0 && top + jump * columns < rows * columns ? top + jump * columns : -1
    return { left, top, leftMode, topMode, onward, downward }
  }

  /** The candidate of a block that continues a neighbour, else −1. */
  *#decodeFollowing(block, { left, top, leftMode, topMode, onward, downward }, isStrip) {
    const { sources, modes } = this
    const { input } = sources
    const equal = onward === downward ? 1 : 0
    for (let side = 0; side < 2; side++) {
      const guess = side ? downward : onward
      if (guess < 0 || (side && equal)) continue
      input[0] = FOLLOWS + (((isStrip * 2 + side) * 4 + leftMode) * 4 + topMode) * 2 + equal
      input[1] = HASHED + 65536 + hash(left, top, 5000 + side)
      let bit
      while ((bit = sources.bit(2, 2 * isStrip + side, LIMIT)) < 0) yield
      if (!bit) continue
      modes[block] = side + 1
      return guess
    }
    return -1
  }

  /** A candidate's row, then its column, bit by bit. */
  *#decodeCandidate(block, { left, top, onward, downward }, isStrip, { rows, columns }, fail) {
    const { sources } = this
    const { input } = sources
    const guessed = ((isStrip * 2 + (onward >= 0 ? 1 : 0)) * 2 + (downward >= 0 ? 1 : 0)) * 2
    const place = [0, 0]
    for (let axis = 0; axis < 2; axis++) {
      const bits = 32 - Math.clz32((axis ? columns : rows) - 1)
      let node = 1
      for (let b = 0; b < bits; b++) {
        const key = axis ? node + 4096 * (1 + place[0]) : node
        input[0] = TREE + axis * 2048 + (node & 2047)
        input[1] = HASHED + hash(key, left + 1, isStrip)
        input[2] = HASHED + 65536 + hash(key, top + 1, 7 + isStrip)
        input[3] = HASHED + 131072 + hash(key, left + 1, top + 19)
        let bit
        while ((bit = sources.bit(4, TREE_MIXER + guessed + axis, LIMIT)) < 0) yield
        node = 2 * node + bit
      }
      place[axis] = node - 2 ** bits
    }
    if (place[0] >= rows || place[1] >= columns) fail(`source of block ${block} lies outside the exemplar`)
    return place[0] * columns + place[1]
  }

  // ---------------------------------------------------------------- masks

  maskBits() {
    return maskBits()
  }

  *decodeMasks() {
    for (const { a, b, length } of this.strips) {
      const count = this.edgeBlocks.along(length)
      for (let n = 0; n < count; n++) {
        yield* decodeMask(this, { rows: this.side, columns: this.side }, (n === 0 ? 1 : 0) + (n === count - 1 ? 2 : 0))
        this.changed.add(a).add(b)
      }
    }
  }

  // ---------------------------------------------------------------- placements

  /** The placements of a chart whose sources have come, in painting order; edge blocks come with their masks. */
  placements(chart) {
    const { chosen, starts } = this
    const { block, overlap, step, half } = this.blocks
    const placements = []
    const across = this.blocks.along(this.charts[chart].width)
    const shared = { height: block, width: block, symmetry: 0, ramp: overlap }
    for (let n = 0; n < starts[chart + 1] - starts[chart]; n++) {
      const [r, c] = [Math.floor(n / across), n % across]
      const [sourceRow, sourceColumn] = this.blocks.source(chosen[starts[chart] + n])
      const [row, column, mask] = [r * step + half, c * step + half, n ? MASK_RAMP : MASK_NONE]
      placements.push({ ...shared, row, column, mask, sides: (r ? 1 : 0) + (c ? 2 : 0), sourceRow, sourceColumn })
    }
    for (const n of this.stripsOf.get(chart) ?? []) {
      const strip = this.strips[n]
      const blocks = this.#stripBlocks(n)
      if (strip.a === chart) placements.push(...blocks.map((one) => this.#clipped(strip.onA(one), chart)))
      if (strip.b === chart) placements.push(...blocks.map((one) => this.#clipped(strip.onB(one), chart)))
    }
    return placements
  }

  /** A placement whose cells are those of its window alone. */
  #clipped(placement, chart) {
    const window = maskWindow(placement, this.charts[chart])
    const { top, left, rows, columns } = window
    const cells = new Uint8Array(rows * columns)
    for (let i = 0; i < rows; i++) {
      const start = (top + i) * this.side + left
      cells.set(placement.cells.subarray(start, start + columns), i * columns)
    }
    return { ...placement, cells, window }
  }

  /** The blocks of a strip whose cells are known. */
  #stripBlocks(index) {
    const { side, edgeBlocks } = this
    const { block, step, half } = edgeBlocks
    const { start, length } = this.strips[index]
    const area = side * side
    const first = this.starts[this.charts.length + index]
    const known = Math.floor((this.knownCells - this.maskStarts[index]) / area)
    return range(clamp(known, 0, edgeBlocks.along(length))).map((n) => {
      const [sourceRow, sourceColumn] = edgeBlocks.source(this.chosen[first + n])
      return {
        ...{ height: block, width: block, mask: MASK_CUT, maskCell: this.maskCell, feather: this.feather },
        along: start + Math.min(n * step, length - block) + half,
        sourceRow,
        sourceColumn,
        cells: this.cells.subarray(this.maskStarts[index] + n * area, this.maskStarts[index] + (n + 1) * area),
      }
    })
  }
}
