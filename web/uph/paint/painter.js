/** Paints charts [8]: each texel from the placements that the cells round it show, in one pass. */

import { clamp } from '../numbers.js'
import { FARTHEST } from '../placements.js'
import { SYMMETRIES } from '../symmetry.js'
import { turnNormals } from './normals.js'
import { bilinear, mirrored, pyramidLevel } from './pyramid.js'
import { CellTones, addTone } from './tones.js'

/** Height and width in texels of a chart that is painted with so many texels a step. */
export function paintedSize({ height, width }, density) {
  const texels = (steps) => Math.max(1, Math.floor(steps * density + 0.5))
  return { height: texels(height), width: texels(width) }
}

/** Where texels lie of which so many cover so many steps, in 1/16 step. */
export function placesOf(texels, steps) {
  return new Int32Array(texels).map((_, n) => Math.floor(((2 * n + 1) * 8 * steps) / texels))
}

/**
 * Paints a chart: `chart` has height and width in steps, `size` in texels; `layers` have a `grid`, `placements` and `labels`, see
 * `quilt.js`; with `hasTones` broad shades are blended over several cells; the map is a `MapPyramid`.
 */
export class ChartPainter {
  constructor({ chart, size, field, layers, hasTones, pyramid }) {
    const { data, channels } = pyramid.picture
    this.channels = channels
    this.downPlaces = placesOf(size.height, chart.height)
    this.columns = placesOf(size.width, chart.width)
    this.field = field
    this.pyramid = pyramid
    this.isFloat = data instanceof Float32Array
    const ratio = (size.height * size.width) / (chart.height * chart.width)
    const shown = (placement) => shownBy(placement, pyramid, ratio)
    this.layers = layers.map(({ grid, placements, labels }) => ({ grid, placements, labels, shown, known: [], ...spansOf(grid, this.columns) }))
    this.matrices = new Int32Array(4 * size.width) // of the field, along the row
    this.sums = new (this.isFloat ? Float32Array : data instanceof Uint8Array ? Int32Array : Float64Array)(size.width * channels)
    this.covered = new Int32Array(size.width) // by the layer, in 1/256
    this.tones = hasTones && !pyramid.isSharp ? new CellTones(layers[0], field, pyramid, ratio) : null
    this.isConstant = field.isIdentity
    if (this.isConstant) field.along(0, this.columns, this.matrices)
  }

  /** Texels of rows [start, stop), as samples of the map. */
  rows(start, stop) {
    const { sums, pyramid } = this
    const out = new pyramid.picture.data.constructor((stop - start) * sums.length)
    for (let row = start, at = 0; row < stop; row++, at += sums.length) this.#paint(row, out.subarray(at, at + sums.length))
    return out
  }

  #paint(row, out) {
    const place = this.downPlaces[row]
    if (!this.isConstant) this.field.along(place, this.columns, this.matrices)
    this.layers.forEach((layer, n) => {
      this.sums.fill(0)
      this.covered.fill(0)
      this.#addLayer(layer, place)
      this.#settle(out, n > 0)
    })
    if (this.tones) this.#addTones(place, out)
    if (this.pyramid.isNormal && !this.isConstant) turnNormals(out, this.matrices)
  }

  #addTones(place, out) {
    const { spans, fractions, grid } = this.layers[0]
    const size = 16 * grid.cell
    const i = Math.floor((place + grid.shift) / size)
    const [above, below] = [this.tones.row(i), this.tones.row(i + 1)]
    const down = Math.floor(((place + grid.shift) % size) / grid.cell)
    for (const { column, start, end } of spans) {
      if (!(above.some[column] || above.some[column + 1] || below.some[column] || below.some[column + 1])) continue
      for (let n = start; n < end; n++) addTone(out, n * this.channels, above.tones, below.tones, column, down, fractions[n], this.tones.channels)
    }
  }

  #addLayer(layer, place) {
    const { spans, labels, grid } = layer
    const { cell, columns, shift } = grid
    const first = columns * Math.floor((place + shift) / (16 * cell))
    const down = Math.floor(((place + shift) % (16 * cell)) / cell)
    /** Whether a cell shows the same as its neighbours to the right, below and between. */
    const isOne = (at) => labels[at] === labels[at + 1] && labels[at] === labels[at + columns] && labels[at] === labels[at + columns + 1]
    for (let n = 0; n < spans.length; n++) {
      const { column, start } = spans[n]
      const at = first + column
      const label = labels[at]
      if (isOne(at)) {
        // As far as it goes on like this.
        while (n + 1 < spans.length && labels[first + spans[n + 1].column] === label && isOne(first + spans[n + 1].column)) n++
        this.#add(layer, label, place, 16, 16, start, spans[n].end)
        continue
      }
      for (let k = 0; k < 4; k++) this.#addCell(layer, at, k, place, down, spans[n])
    }
  }

  /** Add what the k-th of four cells shows, and what others of them show with it; once. */
  #addCell(layer, at, k, place, down, { start, end }) {
    const { labels, grid } = layer
    const [a, b, c, d] = [labels[at], labels[at + 1], labels[at + grid.columns], labels[at + grid.columns + 1]]
    const label = k < 2 ? (k ? b : a) : k > 2 ? d : c
    if ((k > 0 && label === a) || (k > 1 && label === b) || (k > 2 && label === c)) return
    const left = (label === a ? 16 - down : 0) + (label === c ? down : 0)
    const right = (label === b ? 16 - down : 0) + (label === d ? down : 0)
    this.#add(layer, label, place, left, right, start, end)
  }

  /** Add what a placement shows to texels [start, end) of the row, from `left` to `right` of 16 between two columns of cells. */
  #add(layer, label, place, left, right, start, end) {
    if (label < 0) return
    const { columns, matrices, sums, covered, channels, isFloat } = this
    const { fractions } = layer
    const { placement, symmetry, shift, picture } = (layer.known[label] ??= layer.shown(layer.placements[label]))
    const { height, width, data } = picture
    const { row, column, sourceRow, sourceColumn } = placement
    const [c0, c1, c2, c3] = placement.center
    const [s0, s1, s2, s3] = symmetry
    const down = clamp(place - row, -FARTHEST, FARTHEST)
    const [y, e] = [down >> 4, down & 15]
    for (let n = start; n < end; n++) {
      const weight = left * (16 - fractions[n]) + right * fractions[n]
      if (!weight) continue
      covered[n] += weight
      const across = clamp(columns[n] - column, -FARTHEST, FARTHEST)
      const x = across >> 4
      const f = across & 15
      const a = c0 + matrices[4 * n]
      const b = c1 + matrices[4 * n + 1]
      const c = c2 + matrices[4 * n + 2]
      const d = c3 + matrices[4 * n + 3]
      const v = (a * y + b * x + ((a * e + b * f) >> 4) + 256) >> 9
      const w = (c * y + d * x + ((c * e + d * f) >> 4) + 256) >> 9
      const top = ((sourceRow + s0 * v + s1 * w + 8) >> shift) - 8
      const side = ((sourceColumn + s2 * v + s3 * w + 8) >> shift) - 8
      const above = mirrored(top >> 4, height) * width
      const below = mirrored((top >> 4) + 1, height) * width
      const here = mirrored(side >> 4, width)
      const next = mirrored((side >> 4) + 1, width)
      const g = top & 15
      const h = side & 15
      const s = g * h
      const r = 16 * g - s
      const q = 16 * h - s
      const p = 256 - q - r - s
      let i = (above + here) * channels
      let j = (above + next) * channels
      let k = (below + here) * channels
      let l = (below + next) * channels
      for (let to = n * channels, last = to + channels; to < last; to++, i++, j++, k++, l++) {
        if (isFloat) sums[to] += Math.fround(bilinear(data[i], data[j], data[k], data[l], p, q, r, s) * (weight / 256))
        else sums[to] += weight * (p * data[i] + q * data[j] + r * data[k] + s * data[l])
      }
    }
  }

  #settle(out, isSecond) {
    const { sums, covered, channels, isFloat } = this
    for (let n = 0, at = 0; n < covered.length; n++) {
      const w = covered[n]
      if (isSecond && !w) {
        at += channels
        continue
      }
      for (let k = 0; k < channels; k++, at++) {
        const below = isSecond ? out[at] : 0
        if (isFloat) out[at] = isSecond ? Math.fround(below * ((256 - w) / 256)) + sums[at] : sums[at]
        else out[at] = (below * (256 - w) * 256 + sums[at] + 32768) >>> 16
      }
    }
  }
}

/** How a placement shows a map where texels are so dense. */
function shownBy(placement, pyramid, ratio) {
  const { symmetry, center } = placement
  const level = pyramidLevel(pyramid.picture, center, ratio)
  return { placement, shift: level >> 1, symmetry: SYMMETRIES[symmetry], picture: pyramid.level(level, symmetry) }
}

/** The columns of cells between which texels lie: which texels, and how far each lies from the first column, in 1/16. */
function spansOf({ cell, shift }, places) {
  const spans = []
  const fractions = new Uint8Array(places.length)
  places.forEach((place, n) => {
    const column = Math.floor((place + shift) / (16 * cell))
    fractions[n] = Math.floor(((place + shift) % (16 * cell)) / cell)
    if (spans.at(-1)?.column === column) spans.at(-1).end = n + 1
    else spans.push({ column, start: n, end: n + 1 })
  })
  return { spans, fractions }
}
