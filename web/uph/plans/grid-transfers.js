/** Blocks of a grid plan that lie on a chart because a block of another chart reaches over the seam [5.5]. */

import {
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
import { symmetryTimes, turnedAlike } from '../symmetry.js'

const FAR = [-16384 - 4096, 32768]
const SIZE = [1, 4096]
const MATRIX_UNIT = 64 // of what is added to the field's matrix

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
    const block = { link, mode: NO_MODE, agrees: 0, maskCell: grid.maskCell }
    const n = blocks.length
    const guess = new TransferGuess(block, {
      linked: link < 0 ? null : blocks[link],
      before: n > starts[place] ? blocks[n - 1] : null,
      further: n > starts[place] + 1 ? blocks[n - 2] : null,
      linkedBefore: n > starts[place] && blocks[n - 1].link >= 0 ? blocks[blocks[n - 1].link] : null,
      grid,
      field,
      turned: this.plan.turned,
    })
    const unlinked = link >= 0 ? 0 : 2
    let differed = 0
    for (const [name, f] of TRANSFERRED_NUMBERS) {
      const difference = yield* decodeInteger(sources, f, unlinked | differed)
      differed = difference ? 1 : 0
      block[name] = difference + guess.of(name)
      const [least, most] = this.limits[name]
      if (!(block[name] >= least && block[name] <= most)) fail(`${name} of block ${n} is out of range`)
      if (name === 'column') yield* this.#decodeCenter(block, field)
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
    const further = n > starts[place] + 1 ? blocks[n - 2].link : -1
    let chart = 0 // that of the link before, as steps back in coded order
    let onward = -1
    if (before >= 0) {
      for (chart = 1; starts[place - chart] > before; ) chart++
      onward = before + 1
      if (further >= starts[place - chart] && further < before) onward = 2 * before - further
      if (onward >= starts[place - chart + 1]) onward = -1
    }
    if (onward >= 0) {
      sources.input[0] = RUN + (further >= 0 ? 1 : 0)
      let bit
      while ((bit = sources.bit(1, ONE_MIXER, LIMIT)) < 0) yield
      if (bit) return onward
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
    if (!before) return 0
    if (name === 'row' || name === 'column') return this.#centre(name)
    return before[name]
  }

  /** The linked block's, turned as the block before is. */
  #symmetry() {
    const { linked, linkedBefore, before } = this
    if (!linkedBefore) return linked.symmetry
    return turnedAlike(linked.symmetry, linkedBefore.symmetry, before.symmetry)
  }

  /** The linked block's size, turned and scaled to this chart. */
  #size(name) {
    const { block, linked, grid } = this
    const [a, b, c, d] = block.matrix
    const [p, q, r, s] = linked.matrix
    const [y, x] = name === 'height' ? [d, b] : [c, a]
    const tall = Math.abs(y * p - x * r) * linked.height
    const wide = Math.abs(y * q - x * s) * linked.width
    const cells = Math.floor(Math.floor((tall + wide) / Math.max(1, Math.abs(a * d - b * c))) / grid.maskCell)
    return Math.min((cells + 2) * grid.maskCell, 4096)
  }

  /** The linked block's source, else what the block before would show here. */
  #source(name) {
    const { block, linked, before, field } = this
    if (linked) return linked[name]
    if (!before) return 0
    return sourceAt(before, field, block.row, block.column)[name === 'sourceRow' ? 0 : 1]
  }

  /** From the block before, by the step between the linked ones, else by the step before. */
  #centre(name) {
    const { linked, linkedBefore, before, further } = this
    if (!linked || !linkedBefore) return further ? 2 * before[name] - further[name] : before[name]
    const [down, right] = [linked.row - linkedBefore.row, linked.column - linkedBefore.column]
    const [p, q, r, s] = symmetryTimes((this.turned ? linkedBefore : linked).symmetry, linked.center)
    const y = Math.floor((p * down + q * right) / 16)
    const x = Math.floor((r * down + s * right) / 16)
    const [a, b, c, d] = before.matrix
    let area = Math.floor((a * d - b * c) / 16)
    let number = name === 'row' ? d * y - b * x : a * x - c * y
    if (area < 0) [area, number] = [-area, -number]
    return before[name] + (area > 0 ? Math.floor((2 * number + area) / (2 * area)) : 0)
  }
}
