/** Painting charts in the worker, with gutters from beyond their edges; and the functions that every painter has. */

import { edgeLines, makeGutter, putGutter } from '../uph-gutter.js'
import { ROLES, TARGETS } from '../uph/roles.js'
import { hasMap } from './maps.js'

/**
 * What changed is painted target by target: `begin` (returns whether it can be), `paint` chart after chart (likewise), `end`. Entries for
 * the page, as `uph-worker.js` lists them, go to `entries`. `ChartRecipes` has the same functions: there the graphics card paints.
 */
export class ChartPainting {
  #mesher
  #sizes // of the textures, without gutters
  #densities // of each chart its texels a step
  #lines = {} // per target and chart: the texels along its four edges
  #angles = new Map() // per edge: angles between the frames of either side
  #alpha // per chart: how many texels are see-through, and how many of them are soft
  #spare = []
  #painted = new Map() // charts of the target

  constructor(mesher, sizes, densities) {
    this.#mesher = mesher
    this.resize(sizes, densities)
    this.#alpha = sizes.map(() => ({ clear: 0, soft: 0 }))
  }

  /** Some charts are to be painted with other sizes, at so many texels a step. */
  resize(sizes, densities) {
    this.#sizes = sizes
    this.#densities = densities
    this.#angles.clear()
  }

  /** Use memory again. */
  recycle(buffers) {
    this.#spare = buffers
  }

  begin() {
    this.#painted = new Map()
    return true
  }

  paint(decoder, target, chart) {
    this.#painted.set(chart, this.#texels(decoder, target, chart))
    return true
  }

  /** RGBA texels of a chart with room for a gutter of one texel round it. */
  #texels(decoder, target, chart) {
    const { height, width } = this.#sizes[chart]
    const stride = width + 2
    const data = this.#buffer(4 * stride * (height + 2))
    const density = this.#densities[chart]
    const paint = (role, into) => decoder.rgba(chart, { role, density, into, stride, offset: 4 * (stride + 1) })
    const roles = TARGETS[target].filter((role) => hasMap(decoder, role))
    if (target === 'surface' || roles.length > 1) {
      data.fill(255)
      const one = new Uint8Array(data.length)
      for (const role of roles) {
        const { channel } = ROLES[role]
        if (channel === undefined) paint(role, data)
        else {
          paint(role, one)
          for (let n = channel, m = 0; n < data.length; n += 4, m += 4) data[n] = one[m]
        }
      }
    } else if (roles.length) paint(roles[0], data)
    if (target === 'color') this.#alpha[chart] = countAlpha(data, this.#sizes[chart])
    return data
  }

  #buffer(length) {
    const at = this.#spare.findIndex((buffer) => buffer.byteLength === length)
    if (at < 0) return new Uint8Array(length)
    return new Uint8Array(this.#spare.splice(at, 1)[0])
  }

  /** 'opaque', 'mask' or 'blend', as glTF has it, and as the Python side decides. */
  get alphaMode() {
    const sum = (key) => this.#alpha.reduce((total, one) => total + one[key], 0)
    if (!sum('clear')) return 'opaque'
    const texels = this.#sizes.reduce((total, { height, width }) => total + height * width, 0)
    return sum('soft') < texels / 20 ? 'mask' : 'blend'
  }

  /** Fill the gutters of painted charts, and of adjacent ones. */
  end(target, entries) {
    const painted = this.#painted
    const lines = (this.#lines[target] ??= [])
    for (const [chart, data] of painted) lines[chart] = edgeLines(data, this.#sizes[chart])
    const adjacent = new Set()
    for (const chart of painted.keys()) {
      for (let edge = 0; edge < 4; edge++) {
        for (const { chart: other } of this.#mesher.seams(chart, edge)) {
          if (!painted.has(other) && lines[other]) adjacent.add(other)
        }
      }
    }
    for (const [chart, data] of painted) {
      putGutter(data, this.#sizes[chart], this.#gutter(target, chart))
      entries.push({ chart, target, ...this.#sizes[chart], data })
    }
    for (const chart of adjacent) {
      entries.push({ chart, target, ...this.#sizes[chart], gutter: true, data: this.#gutter(target, chart) })
    }
  }

  #gutter(target, chart) {
    const lines = this.#lines[target]
    return makeGutter(lines[chart], this.#sizes[chart], (edge) => ({
      seams: this.#mesher.seams(chart, edge).flatMap((seam) => {
        const line = lines[seam.chart]?.[seam.edge]
        return line ? [{ ...seam, line }] : []
      }),
      angles: target === 'normal' ? this.#anglesOf(chart, edge) : null,
    }))
  }

  /** By which angle the frame beyond an edge is turned, texel after texel. */
  #anglesOf(chart, edge) {
    const key = 4 * chart + edge
    if (!this.#angles.has(key)) {
      const { height, width } = this.#sizes[chart]
      this.#angles.set(key, this.#mesher.frameAngles(chart, edge, edge % 2 ? height : width))
    }
    return this.#angles.get(key)
  }
}

/** How many texels are see-through, and how many of them are soft. */
function countAlpha(data, { height, width }) {
  const stride = width + 2
  const found = { clear: 0, soft: 0 }
  for (let row = 1; row <= height; row++) {
    for (let n = 4 * (row * stride + 1) + 3, end = n + 4 * width; n < end; n += 4) {
      if (data[n] < 255) found.clear++
      if (data[n] > 25 && data[n] < 230) found.soft++
    }
  }
  return found
}
