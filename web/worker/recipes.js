/** What the page's graphics card paints charts from: a sample with its pyramid, and each chart's blocks with their weights. */

import { SYMMETRIES, Scratch, halve, placementWeights, sourceOf, topLeft } from '../uph-blocks.js'
import { forEachAcross } from './across.js'
import { TARGETS, hasMap } from './maps.js'

/** Numbers that tell of a block, and weights in a row of their texture; the card's programs read them so. */
const BLOCK_NUMBERS = 14
const WEIGHTS_ROW = 4096
const MOST_SIDE = 4096 // of a texture

/** Lists what the page has to know. */
export class ChartRecipes {
  #mesher
  #sizes // of the textures
  #sent = new Set() // charts of which the page has the recipe
  #pictures = {} // per target: the maps that the page has
  #scratch = new Scratch()

  constructor(mesher, sizes) {
    this.#mesher = mesher
    this.#sizes = sizes
  }

  /** Charts have other placements. */
  forget(charts) {
    for (const chart of charts) this.#sent.delete(chart)
  }

  /** Have the page know a target's sample as it is now; false: it can not show it. */
  addSheet(decoder, target, entries) {
    const roles = TARGETS[target].filter((role) => hasMap(decoder, role))
    const pictures = roles.map((role) => decoder.exemplar(role))
    const known = this.#pictures[target]
    this.#pictures[target] = pictures
    if (known?.length === pictures.length && pictures.every((picture, n) => picture === known[n])) return true
    const sheet = sampleSheet(decoder, target, roles)
    if (sheet) entries.push({ target, sheet: true, ...sheet })
    return sheet !== null
  }

  /** Have the page paint a chart; returns whether there is something to paint, null if the page can not. */
  addRecipe(decoder, target, chart, entries) {
    if (!this.#sent.has(chart)) {
      const found = decoder.recipe(chart)
      if (!found) return false
      const recipe = chartRecipe(found, decoder.charts[chart], decoder.exemplarSize, this.#scratch)
      if (!recipe) return null
      const { weights: data, ...rest } = recipe
      const gutters = gutterPoints(this.#mesher, this.#sizes, chart, decoder.roles.includes('normal'))
      entries.push({ chart, recipe: { ...rest, gutters }, data })
      this.#sent.add(chart)
    }
    entries.push({ chart, target, ...this.#sizes[chart] })
    return true
  }
}

/**
 * A target's sample, of the maps with these roles, as one RGBA picture `data`, with the smaller levels of its pyramid to the right, one
 * below the other. Null where the card would show something else than the decoder: floats, what is see-through, or too large for a texture.
 */
function sampleSheet(decoder, target, roles) {
  const isSurface = target === 'surface'
  const pictures = roles.map((role) => decoder.exemplarRgba(role))
  const [{ height, width, data: first }] = pictures
  if (isSurface) {
    // Red, green, blue are ao, roughness, metallic.
    const rest = pictures.map(({ data }, n) => [TARGETS.surface.indexOf(roles[n]), data.slice()])
    for (const [channel, data] of rest) for (let n = 0; n < first.length; n += 4) first[n + channel] = data[n]
  } else if (roles.length > 1 || decoder.exemplar(roles[0]).data instanceof Float32Array) return null
  if (target === 'color') for (let n = 3; n < first.length; n += 4) if (first[n] < 255) return null
  const levels = [{ height, width, channels: 4, data: first }]
  while (Math.max(levels.at(-1).height, levels.at(-1).width) > 1) levels.push(halve(levels.at(-1)))
  const stride = width + ((width + 1) >> 1)
  const rows = Math.max(height, levels.reduce((sum, level) => sum + level.height, -height))
  if (Math.max(stride, rows) > MOST_SIDE) return null
  const data = new Uint8Array(4 * stride * rows)
  let top = 0
  levels.forEach((level, k) => {
    const wide = 4 * level.width
    for (let i = 0; i < level.height; i++) {
      data.set(level.data.subarray(i * wide, (i + 1) * wide), 4 * ((top + i) * stride + (k && width)))
    }
    if (k) top += level.height
  })
  return { data, height: rows, width: stride, size: [height, width] }
}

/**
 * The blocks of a chart, in painting order: `blocks`, of each where its rectangle is (top, left, height, width), what it shows (source,
 * symmetry, level, centre matrix), and where its weights are (place of row 0, column 0; width, 0 for none) in `weights`, rows of 4096;
 * `nodes` of the warp field, `columns` of them a row. Null where there are too many.
 */
function chartRecipe({ placements, field }, chart, exemplar, scratch) {
  const blocks = new Int32Array(BLOCK_NUMBERS * placements.length)
  const pieces = []
  let used = 0
  placements.forEach((placement, n) => {
    const { height, width, sourceRow, sourceColumn, symmetry } = placement
    const [top, left] = topLeft(placement)
    const { center, level } = sourceOf(placement, field, exemplar)
    const turned = SYMMETRIES[symmetry].reduce((bits, x, k) => bits | ((x + 1) << (2 * k)), 0)
    const [start, stop] = [Math.max(0, -top), Math.min(height, chart.height - top)]
    const found = placementWeights(placement, scratch, start, stop)
    let place = 0
    if (found) {
      const from = (start - found.top) * found.width
      // 255 stands for all of 256, too.
      const piece = new Uint8ClampedArray(found.values.subarray(from, from + (stop - start) * found.width))
      place = used - start * found.width - found.left
      used += piece.length
      pieces.push(piece)
    }
    const numbers = [top, left, height, width, sourceRow + 8, sourceColumn + 8, turned, level, ...center, place, found?.width ?? 0]
    blocks.set(numbers, BLOCK_NUMBERS * n)
  })
  if (used > WEIGHTS_ROW * MOST_SIDE) return null
  const weights = new Uint8Array(WEIGHTS_ROW * Math.max(1, Math.ceil(used / WEIGHTS_ROW)))
  pieces.reduce((at, piece) => (weights.set(piece, at), at + piece.length), 0)
  const { matrices, columns, margin, isIdentity } = field
  return { weights, blocks, nodes: matrices.slice(), columns, margin, isIdentity }
}

/**
 * What the gutter of a chart shows of those beside it: for each of them, `chart`, and `points`, five numbers each: column and row in the
 * texture, the texel along that chart's edge, which edge, and the angle by which normals turn.
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
        points.push(x, y, m, seam.edge, angles?.[n] ?? 0)
      })
    }
  }
  return [...found].map(([other, points]) => ({ chart: other, points: Float32Array.from(points) }))
}
