/** The tones of a chart's cells [8]: what evens out broad differences where placements meet. */

import { clamp, range } from '../numbers.js'
import { FARTHEST } from '../placements.js'
import { SYMMETRIES } from '../symmetry.js'
import { bilinear, mirrored, pyramidLevel } from './pyramid.js'

export const REACH = 7 // how many cells away, each way, a placement counts
export const MOST_OTHERS = 8 // how many other placements count, the first ones
export const HALVINGS = 3 // broad shades are read from a level that is halved so many times more than that of details
const WIDTH = REACH + 1 // weights along a row or column are 1, 2 … 8 … 2, 1
const BEFORE = [0] // the sum of the first ones
for (let n = 1; n < 2 * WIDTH; n++) BEFORE.push(BEFORE[n - 1] + Math.min(n, 2 * WIDTH - n))

export class CellTones {
  #rows = new Map()
  #runs = new Map()
  #named = new Int32Array(MOST_OTHERS)
  #weights = new Int32Array(MOST_OTHERS)
  #matrix = new Int32Array(4)

  /** `layer` as of a `ChartPainter`, `ratio` texels for each square step. */
  constructor({ grid, placements, labels }, field, pyramid, ratio) {
    const { data, height, width } = pyramid.picture
    /** How many channels have tones: all but alpha. */
    this.channels = pyramid.picture.channels - (pyramid.picture.channels % 2 ? 0 : 1)
    Object.assign(this, { grid, placements, labels, field, pyramid, ratio })
    this.last = 32 - Math.clz32(Math.max(height, width) - 1)
    this.isFloat = data instanceof Float32Array
    this.isWide = data instanceof Uint16Array
    this.shades = [0, 1].map(() => new (this.isFloat ? Float32Array : Int32Array)(this.channels))
    this.known = []
    this.across = range(grid.columns).map((j) => around(j, grid.columns))
  }

  /** A row of cells: their `tones`, and which of them have `some`. It and the row before are kept. */
  row(i) {
    if (!this.#rows.has(i)) {
      this.#rows.forEach((_, n) => n !== i - 1 && this.#rows.delete(n))
      this.#rows.set(i, this.#newRow(i))
    }
    return this.#rows.get(i)
  }

  #newRow(i) {
    const { grid, channels, isFloat, shades, field } = this
    const { columns } = grid
    const tones = new (isFloat ? Float32Array : Int32Array)(columns * channels)
    const some = new Uint8Array(columns)
    const down = around(i, grid.rows)
    this.#runs.forEach((_, n) => n < down.first && this.#runs.delete(n))
    for (let j = 0, to = 0; j < columns; j++, to += channels) {
      const across = this.across[j]
      const fade = clamp((down.weight * across.weight - 2560) >> 2, 0, 256)
      const count = fade && this.#others(i, j, down, across)
      if (!count) continue
      some[j] = 1
      const [row, column] = [grid.center(i), grid.center(j)]
      field.at(row, column, this.#matrix)
      this.#read(this.labels[i * columns + j], row, column, shades[0])
      for (let n = 0; n < count; n++) {
        this.#read(this.#named[n], row, column, shades[1])
        const weight = this.#weights[n]
        for (let k = 0; k < channels; k++) {
          const difference = shades[1][k] - shades[0][k]
          tones[to + k] += isFloat ? Math.fround(Math.fround(difference) * weight) : difference * weight
        }
      }
      for (let k = to; k < to + channels; k++) tones[k] = isFloat ? tones[k] * (fade / 2 ** 20) : ((tones[k] >> 8) * fade + 2048) >> 12
    }
    return { tones, some }
  }

  /** Of each cell of a row, how many from it on to the right show the same. */
  #newRuns(row) {
    const { labels, grid } = this
    const first = row * grid.columns
    const runs = new Int32Array(grid.columns).fill(1)
    for (let j = grid.columns - 2; j >= 0; j--) if (labels[first + j] === labels[first + j + 1]) runs[j] += runs[j + 1]
    this.#runs.set(row, runs)
    return runs
  }

  /** List the other placements round a cell, and their weights; returns how many. */
  #others(i, j, down, across) {
    const { labels, grid } = this
    const [named, weights] = [this.#named, this.#weights]
    const own = labels[i * grid.columns + j]
    const end = across.last + 1
    let count = 0
    for (let r = down.first; r <= down.last; r++) {
      const runs = this.#runs.get(r) ?? this.#newRuns(r)
      const first = r * grid.columns
      if (labels[first + across.first] === own && across.first + runs[across.first] >= end) continue
      const height = WIDTH - Math.abs(r - i)
      for (let c = across.first, stop; c < end; c = stop) {
        const label = labels[first + c]
        stop = Math.min(c + runs[c], end)
        if (label === own) continue
        let n = 0
        while (n < count && named[n] !== label) n++
        if (n === MOST_OTHERS) continue
        if (n === count) {
          named[n] = label
          weights[n] = 0
          count++
        }
        weights[n] += height * (BEFORE[stop - j + REACH] - BEFORE[c - j + REACH])
      }
    }
    return count
  }

  /** Read the broad shades of a placement at a place, of which the field's matrix is known; integers as numbers of 16 bits. */
  #read(label, row, column, out) {
    const { placement, symmetry, shift, picture } = (this.known[label] ??= this.#shownBy(this.placements[label]))
    const { height, width, channels, data } = picture
    const { center } = placement
    const m = this.#matrix
    const down = clamp(row - placement.row, -FARTHEST, FARTHEST)
    const right = clamp(column - placement.column, -FARTHEST, FARTHEST)
    const y = down >> 4
    const x = right >> 4
    const [a, b, c, d] = [center[0] + m[0], center[1] + m[1], center[2] + m[2], center[3] + m[3]]
    const v = (a * y + b * x + ((a * (down & 15) + b * (right & 15)) >> 4) + 256) >> 9
    const w = (c * y + d * x + ((c * (down & 15) + d * (right & 15)) >> 4) + 256) >> 9
    const top = ((placement.sourceRow + symmetry[0] * v + symmetry[1] * w + 8) >> shift) - 8
    const side = ((placement.sourceColumn + symmetry[2] * v + symmetry[3] * w + 8) >> shift) - 8
    const above = mirrored(top >> 4, height) * width
    const below = mirrored((top >> 4) + 1, height) * width
    const here = mirrored(side >> 4, width)
    const next = mirrored((side >> 4) + 1, width)
    const s = (top & 15) * (side & 15)
    const r = 16 * (top & 15) - s
    const q = 16 * (side & 15) - s
    const p = 256 - q - r - s
    let [i, j, k, l] = [(above + here) * channels, (above + next) * channels, (below + here) * channels, (below + next) * channels]
    for (let n = 0; n < out.length; n++, i++, j++, k++, l++) {
      if (this.isFloat) out[n] = bilinear(data[i], data[j], data[k], data[l], p, q, r, s)
      else {
        const sum = p * data[i] + q * data[j] + r * data[k] + s * data[l]
        out[n] = this.isWide ? (sum + 128) >> 8 : sum
      }
    }
  }

  #shownBy(placement) {
    const { pyramid, ratio, last } = this
    const shift = Math.min((pyramidLevel(pyramid.picture, placement.center, ratio) >> 1) + HALVINGS, last)
    return { placement, shift, symmetry: SYMMETRIES[placement.symmetry], picture: pyramid.level(2 * shift, placement.symmetry) }
  }
}

/** Add to a texel's first `channels` samples, from `out[at]` on, the tone between cells n and n + 1 of two rows, f and g of 16 from the first. */
export function addTone(out, at, above, below, n, f, g, channels) {
  const s = f * g
  const r = 16 * f - s
  const q = 16 * g - s
  const p = 256 - q - r - s
  const isFloat = out instanceof Float32Array
  const isWide = !(out instanceof Uint8Array)
  for (let k = at, i = n * channels, j = i + channels; k < at + channels; k++, i++, j++) {
    if (isFloat) out[k] += bilinear(above[i], above[j], below[i], below[j], p, q, r, s)
    else {
      const tone = p * above[i] + q * above[j] + r * below[i] + s * below[j]
      out[k] = isWide ? clamp(out[k] + ((tone + 128) >> 8), 0, 65535) : clamp(out[k] + ((tone + 32768) >> 16), 0, 255)
    }
  }
}

/** The first and the last of the cells round one along an axis of `size`, and the sum of their weights. */
function around(center, size) {
  const [first, last] = [Math.max(center - REACH, 0), Math.min(center + REACH, size - 1)]
  return { first, last, weight: BEFORE[last - center + WIDTH] - BEFORE[first - center + REACH] }
}
