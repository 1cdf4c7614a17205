/** What the page's graphics card paints charts from: samples with their pyramids, and for each chart a list of numbers. */

import { turnOf } from '../uph-gutter.js'
import { MapPyramid, pyramidLevel } from '../uph/paint/pyramid.js'
import { TARGETS } from '../uph/roles.js'
import { SYMMETRIES } from '../uph/symmetry.js'
import { forEachAcross } from './across.js'
import { hasMap } from './maps.js'

const ROW = 4096 // numbers in a row of their texture
const MOST_SIDE = 4096 // of a texture
const HEAD = 9
const LAYER_HEAD = 5
const PLACEMENT_NUMBERS = 9
const MOST_TONES = 2 ** 22 // cells of a chart whose tones the card keeps

/** Lists what the page has to know, with the functions of `ChartPainting`. */
export class ChartRecipes {
  #mesher
  #sizes // of the textures
  #densities // of each chart its texels a step
  #sent = new Set() // charts of which the page has the recipe
  #sheets = new Map() // per role: the picture of which the page has the sheet, and its layers

  constructor(mesher, sizes, densities) {
    this.#mesher = mesher
    this.resize(sizes, densities)
  }

  /** Some charts are to be painted with other sizes, at so many texels a step; they are forgotten, too. */
  resize(sizes, densities) {
    this.#sizes = sizes
    this.#densities = densities
  }

  /** Charts have other placements, labels or sizes, or what lies beyond their edges has. */
  forget(charts) {
    for (const chart of charts) this.#sent.delete(chart)
  }

  /** Have the page know the samples of a target as they are now; false: it can not show them. */
  begin(decoder, target, entries) {
    const roles = TARGETS[target].filter((role) => hasMap(decoder, role))
    if (target === 'color' && roles.length > 1) return false
    const used = layersOf(decoder, this.#densities)
    for (const role of roles) {
      const picture = decoder.exemplar(role)
      const layers = role === 'normal' ? used : { ...used, symmetries: 1 }
      const known = this.#sheets.get(role)
      if (known?.picture === picture && known.symmetries === layers.symmetries && known.isSoft === layers.isSoft) continue
      const sheet = sampleSheet(picture, role, layers, target === 'color')
      if (!sheet) return false
      this.#sheets.set(role, { picture, ...layers })
      entries.push({ role, sheet: true, ...sheet })
    }
    return true
  }

  /** Have the page paint a chart; returns whether it can. */
  paint(decoder, target, chart, entries) {
    if (!this.#sent.has(chart)) {
      const data = chartNumbers(decoder.recipe(chart, this.#densities[chart]), decoder.exemplarSize)
      if (!data) return false
      const gutters = gutterPoints(this.#mesher, this.#sizes, chart, decoder.roles.includes('normal'))
      entries.push({ chart, recipe: { gutters }, data })
      this.#sent.add(chart)
    }
    const roles = TARGETS[target].filter((role) => hasMap(decoder, role))
    entries.push({ chart, target, roles, ...this.#sizes[chart] })
    return true
  }

  end() {}

  recycle() {}

  /** Transparent maps are not painted here. */
  get alphaMode() {
    return 'opaque'
  }
}

/** In how many of the symmetries placements show the sample, counted up to the last one, and whether any reads a softened level. */
function layersOf(decoder, densities) {
  let [most, isSoft] = [0, false]
  for (const chart of decoder.charts.keys()) {
    const recipe = decoder.recipe(chart, densities[chart])
    const ratio = texelsPerStep(recipe)
    for (const { symmetry, center } of recipe.layers.flatMap(({ placements }) => placements)) {
      most = Math.max(most, symmetry)
      isSoft ||= pyramidLevel(decoder.exemplarSize, center, ratio) % 2 === 1
    }
  }
  return { symmetries: most + 1, isSoft }
}

/** How many texels there are for each square step. */
function texelsPerStep({ chart, size }) {
  return (size.height * size.width) / (chart.height * chart.width)
}

/**
 * A map as pictures of four integers a pixel, `data`: one for each symmetry in use, then one with softened levels for each; in each, the
 * smaller levels of its pyramid are to the right, one below the other. Null if the card would show something else than the decoder: for floats, transparent
 * maps, or those too large for a texture.
 */
function sampleSheet(picture, role, { symmetries, isSoft }, isOpaque) {
  const { height, width, data: samples } = picture
  if (samples instanceof Float32Array) return null
  const pyramid = new MapPyramid(expanded(picture), role)
  const top = samples instanceof Uint8Array ? 255 : 65535
  if (isOpaque) for (let n = 3; n < pyramid.picture.data.length; n += 4) if (pyramid.picture.data[n] < top) return null
  const stride = width + ((width + 1) >> 1)
  const last = Math.ceil(Math.log2(Math.max(height, width)))
  let rows = 0
  for (let k = 1; k <= last; k++) rows += pyramid.level(2 * k, 0).height
  rows = Math.max(rows, height)
  if (Math.max(stride, rows) > MOST_SIDE) return null
  const count = isSoft ? 2 * symmetries : symmetries
  const data = new samples.constructor(4 * stride * rows * count)
  for (let n = 0; n < count; n++) {
    const soft = n < symmetries ? 0 : 1
    for (let k = 0, line = n * rows; k + soft <= last; k++) {
      const level = pyramid.level(2 * k + soft, n % symmetries)
      const wide = 4 * level.width
      for (let i = 0; i < level.height; i++) data.set(level.data.subarray(i * wide, (i + 1) * wide), 4 * ((line + i) * stride + (k && width)))
      if (k) line += level.height
    }
  }
  return { data, height: rows, width: stride, count, size: [height, width] }
}

/** A picture with four channels: grey as a colour, opaque where it has no alpha. */
function expanded({ height, width, channels, data }) {
  const [green, blue] = channels < 3 ? [0, 0] : [1, 2]
  const top = data instanceof Uint8Array ? 255 : 65535
  const out = new data.constructor(4 * height * width)
  for (let to = 0, at = 0; to < out.length; to += 4, at += channels) {
    out[to] = data[at]
    out[to + 1] = data[at + green]
    out[to + 2] = data[at + blue]
    out[to + 3] = channels & 1 ? top : data[at + channels - 1]
  }
  return { height, width, channels: 4, data: out }
}

/**
 * All that a chart is painted from as one list, in rows of 4096; `viewer/painting.js` reads it. First steps down and across; margin, rows,
 * columns and place of the field's nodes, and whether they turn; the number of layers; how many rows of cells have tones. Then of each layer
 * its cell, shift, columns, and the places of its labels and placements. Null where it is too long.
 */
function chartNumbers({ chart, size, field, layers, hasTones }, exemplar) {
  const sizes = layers.map(({ placements, labels }) => labels.length + PLACEMENT_NUMBERS * placements.length)
  let at = HEAD + LAYER_HEAD * layers.length
  const length = sizes.reduce((sum, one) => sum + one, at + field.matrices.length)
  const { rows, columns } = layers[0].grid
  if (length > ROW * MOST_SIDE || (hasTones && (rows * columns > MOST_TONES || Math.max(rows, columns) > MOST_SIDE))) return null
  const numbers = new Int32Array(ROW * Math.ceil(length / ROW))
  numbers.set([chart.height, chart.width, field.margin, field.rows, field.columns, at, field.isIdentity ? 0 : 1, layers.length, hasTones ? rows : 0])
  numbers.set(field.matrices, at)
  at += field.matrices.length
  const ratio = texelsPerStep({ chart, size })
  layers.forEach(({ grid, placements, labels }, n) => {
    const placed = at + labels.length
    numbers.set([grid.cell, grid.shift, grid.columns, at, placed], HEAD + LAYER_HEAD * n)
    numbers.set(labels, at)
    at = placed
    for (const { row, column, sourceRow, sourceColumn, center, symmetry } of placements) {
      const turned = SYMMETRIES[symmetry].reduce((bits, x, k) => bits | ((x + 1) << (2 * k)), 0)
      const shown = turned | (symmetry << 8) | (pyramidLevel(exemplar, center, ratio) << 12)
      numbers.set([row, column, sourceRow, sourceColumn, ...center, shown], at)
      at += PLACEMENT_NUMBERS
    }
  })
  return numbers
}

/**
 * What the gutter of a chart shows of adjacent charts: for each of them, `chart`, its `height` and `width`, and `points`, six numbers each: column and row in the
 * texture, the texel along that chart's edge, which edge, and sine and cosine of the angle by which normals turn, in 1/8192.
 */
function gutterPoints(mesher, sizes, chart, hasNormals) {
  const { height, width } = sizes[chart]
  const found = new Map()
  for (let edge = 0; edge < 4; edge++) {
    const count = edge % 2 ? height : width
    const angles = hasNormals ? mesher.frameAngles(chart, edge, count) : null
    for (const seam of mesher.seams(chart, edge)) {
      const other = sizes[seam.chart]
      if (!found.has(seam.chart)) found.set(seam.chart, [])
      const points = found.get(seam.chart)
      forEachAcross(seam, count, seam.edge % 2 ? other.height : other.width, (n, m) => {
        const [x, y] = [[n + 1, 0], [width + 1, n + 1], [n + 1, height + 1], [0, n + 1]][edge]
        points.push(x, y, m, seam.edge, ...turnOf(angles?.[n] ?? 0))
      })
    }
  }
  return [...found].map(([other, points]) => ({ chart: other, ...sizes[other], points: Float32Array.from(points) }))
}
