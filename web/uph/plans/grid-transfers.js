/** Blocks of a grid plan that lie on a chart because a block of another chart reaches over the seam [5.5]. */

import {
  ALONE,
  CENTRED,
  CHART_NUMBER,
  LIMIT,
  LINK_NUMBER,
  MATRIX_NUMBER,
  NO_MODE,
  ONE_MIXER,
  RUN,
  TRANSFERRED_NUMBERS,
} from './grid-model.js'
import { decodeInteger } from './integers.js'
import { MAX_MATRIX, centerMatrix, sourceAt } from './placement.js'
import { clamp, modulo } from '../numbers.js'
import { symmetryTimes, turnedAlike } from '../symmetry.js'

const FAR = [-16384 - 4096, 32768]
const SIZE = [1, 4096]
const MATRIX_UNIT = 64 // of what is added to the field's matrix
const LATEST = 16 // transferred blocks before one that may lead to its place
const FARTHEST = 2 ** 24

/** The nearest quarter of a pixel to a position in 1/16 pixel. */
const toQuarter = (position) => ((position + 2) >> 2) * 4

/** Decodes transferred blocks: the block of another chart that each comes from, and how it differs from a guess. */
export class TransferDecoder {
  constructor(plan) {
    const { exemplar } = plan
    this.plan = plan
    this.limits = {
      ...{ symmetry: [0, 7], cut: [0, 1], height: SIZE, width: SIZE, row: FAR, column: FAR },
      ...{ sourceRow: [0, 16 * exemplar.height - 1], sourceColumn: [0, 16 * exemplar.width - 1] },
    }
  }

  /** The next block of a grid, at a place in coded order. */
  *decode(place) {
    const { blocks, starts, grids, fields, sources, fail } = this.plan
    const grid = grids[place]
    const field = fields[grid.chart]
    const link = yield* this.#decodeLink(place)
    const block = { link, chart: grid.chart, mode: NO_MODE, agrees: 0, maskCell: grid.maskCell }
    const n = blocks.length
    const near = nearestTransfer(blocks, starts[place], link)
    const guess = new TransferGuess(block, {
      linked: link < 0 ? null : blocks[link],
      before: n > starts[place] ? blocks[n - 1] : null,
      further: n > starts[place] + 1 ? blocks[n - 2] : null,
      near,
      nearLinked: near && blocks[near.link],
      grid,
      field,
      turned: this.plan.turned,
    })
    const unlinked = link >= 0 ? 0 : 2
    let differed = 0
    for (const [name, f] of TRANSFERRED_NUMBERS) {
      const difference = yield* decodeInteger(sources, near ? f : ALONE + f, unlinked | differed)
      differed = difference ? 1 : 0
      block[name] = difference + guess.of(name)
      const [least, most] = this.limits[name]
      if (!(block[name] >= least && block[name] <= most)) fail(`${name} of block ${n} is out of range`)
      if (name === 'column') yield* this.#decodeCenter(block, field)
      if (name === 'sourceColumn') block.place = placeOf(block, link < 0 ? block : blocks[link])
    }
    return block
  }

  /** A block's centre matrix, and what its symmetry makes of it. */
  *#decodeCenter(block, field) {
    const { sources, fail } = this.plan
    sources.input[0] = CENTRED
    let bit
    while ((bit = sources.bit(1, ONE_MIXER, LIMIT)) < 0) yield
    block.centred = bit
    block.center = centerMatrix(block, field)
    for (let k = 0; bit && k < 4; k++) {
      block.center[k] += MATRIX_UNIT * (yield* decodeInteger(sources, MATRIX_NUMBER, k ? 1 : 0))
      if (Math.abs(block.center[k]) > MAX_MATRIX) fail("a block's centre matrix is out of range")
    }
    block.matrix = symmetryTimes(block.symmetry, block.center)
  }

  /** The number of the block that the next one comes from; −1 where it is told without. */
  *#decodeLink(place) {
    const { blocks, starts, sources, fail } = this.plan
    const n = blocks.length
    const before = n > starts[place] ? blocks[n - 1].link : -1
    let chart = 0 // that of the link before, as steps back in coded order
    if (before >= 0) {
      for (chart = 1; starts[place - chart] > before; ) chart++
      const [start, end] = [starts[place - chart], starts[place - chart + 1]]
      const last = lastLinks(blocks, starts[place], start, end)
      const usual = last.length < 4 ? 0 : last[0] - last[1] === last[2] - last[3] ? 1 : 2
      const steps = [last[1] - last[2], last[0] - last[1], 1]
      for (const [which, step] of steps.entries()) {
        const guess = before + step
        if (!(guess >= start && guess < end && step) || steps.indexOf(step) < which) continue
        sources.input[0] = RUN + 3 * which + usual
        let bit
        while ((bit = sources.bit(1, ONE_MIXER, LIMIT)) < 0) yield
        if (bit) return guess
      }
    }
    const back = chart + (yield* decodeInteger(sources, CHART_NUMBER, before >= 0 ? 1 : 0))
    if (back === 0) return -1
    if (back < 0 || back > place) fail('a block is transferred from a chart that is not there')
    const first = starts[place - back]
    const same = back === chart
    const link = (same ? before : first) + (yield* decodeInteger(sources, LINK_NUMBER, same ? 1 : 0))
    if (link < first || link >= starts[place - back + 1]) fail('a block is transferred that is not there')
    return link
  }
}

/** Links of the up to four latest blocks of a grid, the latest first, as far as they lie from block `start` to `end`. */
function lastLinks(blocks, base, start, end) {
  const found = []
  for (let m = blocks.length - 1; m >= Math.max(base, blocks.length - 4); m--) {
    const { link } = blocks[m]
    if (link < start || link >= end) break
    found.push(link)
  }
  return found
}

/**
 * The transferred block of this grid, of the latest ones, that was nearest to the next one on the chart from which both
 * come; null if there is none.
 */
function nearestTransfer(blocks, start, link) {
  let [found, least] = [null, Infinity]
  const linked = blocks[link]
  for (let m = blocks.length - 1; linked && m >= Math.max(start, blocks.length - LATEST); m--) {
    const other = blocks[blocks[m].link]
    if (other?.chart !== linked.chart) continue
    const apart = Math.abs(linked.row - other.row) + Math.abs(linked.column - other.column)
    if (apart < least) [found, least] = [blocks[m], apart]
  }
  return found
}

/** The inverse of a matrix times (y, x), times factor·2^shift; 0 where there is none. */
function steps([p, q, r, s], y, x, factor, shift) {
  let area = Math.floor((p * s - q * r) / 2 ** shift)
  const signed = area < 0 ? -factor : factor
  area = Math.abs(area)
  if (!area) return [0, 0]
  const share = (number) => clamp(Math.floor((2 * number + area) / (2 * area)), -FARTHEST, FARTHEST)
  return [share(signed * (s * y - q * x)), share(signed * (p * x - r * y))]
}

/** Where a transferred block shows what the one that it comes from has at its centre, in 1/64 texel. */
function placeOf({ row, column, matrix, sourceRow, sourceColumn }, linked) {
  const [down, right] = steps(matrix, sourceRow - linked.sourceRow, sourceColumn - linked.sourceColumn, 2 ** 14, 0)
  return [64 * row - down, 64 * column - right]
}

/** What is likely for the numbers of a transferred block, from those that are known already. */
class TransferGuess {
  constructor(block, known) {
    Object.assign(this, { block, ...known })
  }

  of(name) {
    const { linked, before, grid } = this
    if (name === 'cut' && !before) return 1
    if (name === 'height' || name === 'width') {
      if (linked) return this.#size(name)
      if (!before) return grid[name]
    }
    if (name === 'sourceRow' || name === 'sourceColumn') return this.#source(name)
    if (name === 'symmetry' && this.turned && linked) return this.#symmetry()
    if (name === 'row' || name === 'column') return this.#centre(name)
    return before ? before[name] : 0
  }

  /** The linked block's, turned as the nearest transferred one is. */
  #symmetry() {
    const { linked, near, nearLinked } = this
    return near ? turnedAlike(linked.symmetry, nearLinked.symmetry, near.symmetry) : linked.symmetry
  }

  /** The linked block's size, turned and scaled to this chart; one cell more where borders of cells then meet better. */
  #size(name) {
    const { block, linked, grid } = this
    const { maskCell } = grid
    const [a, b, c, d] = block.matrix
    const [p, q, r, s] = linked.matrix
    const isHeight = name === 'height'
    const [y, x] = isHeight ? [d, b] : [c, a]
    const extent = Math.abs(y * p - x * r) * linked.height + Math.abs(y * q - x * s) * linked.width
    let cells = Math.floor(Math.floor(extent / Math.max(1, Math.abs(a * d - b * c))) / maskCell) + 6
    const [along, across] = isHeight ? [s * a - q * c, s * b - q * d] : [p * d - r * b, p * c - r * a]
    const by = Math.floor(along / 16)
    if (2 * Math.abs(along) > Math.abs(across) && by) {
      const number = 32 * (2 * (linked[name] >> 1) + 1) * Math.floor((p * s - q * r) / 16) * Math.sign(by)
      const edge = Math.floor((2 * number + Math.abs(by)) / (2 * Math.abs(by)))
      const border = isHeight ? block.place[0] - 64 * block.row : block.place[1] - 64 * block.column
      const off = (count) => {
        const apart = modulo(border - edge + 64 * ((count * maskCell) >> 1) + 32, 64 * maskCell)
        return Math.min(apart, 64 * maskCell - apart)
      }
      if (off(cells + 1) < off(cells)) cells++
    }
    return Math.min(cells * maskCell, 4096)
  }

  /** The linked block's source, seen from where its centre is shown; else what the block before would show here. */
  #source(name) {
    const { block, linked, before, field } = this
    const axis = name === 'sourceRow' ? 0 : 1
    if (!linked) return before ? sourceAt(before, field, block.row, block.column)[axis] : 0
    if (!this.place) return toQuarter(linked[name])
    const [down, right] = [64 * block.row - this.place[0], 64 * block.column - this.place[1]]
    const [a, b] = block.matrix.slice(2 * axis)
    return toQuarter(linked[name] + Math.floor((a * down + b * right + 8192) / 16384))
  }

  /** By the nearest transferred block, else by the step before. */
  #centre(name) {
    const { near, before, further } = this
    if (near) {
      this.place ??= this.#place()
      return Math.floor((this.place[name === 'row' ? 0 : 1] + 32) / 64)
    }
    if (!before) return 0
    return further ? 2 * before[name] - further[name] : before[name]
  }

  /** As far from the nearest transferred block as both are on the other chart, seen through both fields. */
  #place() {
    const { linked, near, nearLinked, field } = this
    const [down, right] = [linked.row - nearLinked.row, linked.column - nearLinked.column]
    const there = linked.center.map((entry, k) => entry + nearLinked.center[k])
    const [p, q, r, s] = symmetryTimes(nearLinked.symmetry, there)
    const y = Math.floor((p * down + q * right) / 64)
    const x = Math.floor((r * down + s * right) / 64)
    const from = (matrix, factor, shift) => steps(matrix, y, x, factor, shift).map((far, axis) => near.place[axis] + far)
    const [row, column] = from(near.matrix, 16, 7).map((at) => Math.floor((at + 32) / 64))
    const here = field.at(row, column, []).map((entry, k) => entry + near.center[k])
    return from(symmetryTimes(near.symmetry, here), 8, 9)
  }
}
