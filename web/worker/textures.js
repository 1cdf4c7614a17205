/** Textures of charts, as a page shows them: painted where they changed, with gutters from beyond their edges. */

import { Scratch } from '../uph-core.js'
import { edgeLines, makeGutter, putGutter } from '../uph-gutter.js'
import { TARGETS, hasMap } from './maps.js'
import { chartRecipe, gutterPoints, sampleSheet } from './recipes.js'
import { SLICE, yieldToMessages } from './schedule.js'

export class ChartTextures {
  #mesher
  #shrink // 2^shrink texels each way become one
  #sizes // of the textures, without gutters
  #nearness // of charts: what is nearest is painted first
  #dirty = new Map() // per target: charts to paint
  #lines = {} // per target and chart: the texels along its four edges
  #angles = new Map() // per edge: angles between the frames of either side
  #alpha // per chart: how many texels are see-through, and how many of them are soft
  #spare = []
  #onPage // the page's graphics card paints
  #sent = new Set() // charts of which the page has the recipe
  #pictures = {} // per target: the maps that the page has
  #scratch = new Scratch()

  constructor(mesher, sizes, shrink, nearness, onPage) {
    this.#onPage = onPage && !shrink
    this.#mesher = mesher
    this.#sizes = sizes
    this.#shrink = shrink
    this.#nearness = nearness
    this.#alpha = sizes.map(() => ({ clear: 0, soft: 0 }))
  }

  /** Have charts painted again; all of them if none are named. */
  markDirty(target, charts = this.#sizes.keys()) {
    const set = this.#dirty.get(target) ?? new Set()
    for (const chart of charts) set.add(chart)
    this.#dirty.set(target, set)
  }

  get isDirty() {
    return [...this.#dirty.values()].some((charts) => charts.size)
  }

  clearDirty() {
    this.#dirty.clear()
    this.#sent.clear()
  }

  /** Charts have other placements. */
  forget(charts) {
    for (const chart of charts) this.#sent.delete(chart)
  }

  /** Paint all of it here from now on: the page can not, or would show something else. */
  paintHere() {
    if (!this.#onPage) return
    this.#onPage = false
    for (const target of Object.keys(this.#pictures)) this.markDirty(target)
  }

  /** Use memory again that the page has given back. */
  recycle(buffers) {
    this.#spare = buffers
  }

  /** Paint what is dirty, charts with placements for so many milliseconds; returns what the page must take over. */
  async paint(decoder, most = Infinity) {
    const jobs = [...this.#dirty].filter(([, charts]) => charts.size)
    for (const [target] of jobs) this.#dirty.set(target, new Set())
    const entries = []
    let until = performance.now() + SLICE
    const end = performance.now() + most
    for (const [target, dirty] of jobs) {
      const painted = new Map()
      if (this.#onPage) this.#addSheet(decoder, target, entries)
      const [later, bare] = [[], []]
      for (const chart of [...dirty].sort((a, b) => this.#nearness[b] - this.#nearness[a])) {
        if (!decoder.isPlaced(chart)) bare.push(chart)
        else if (performance.now() > end) later.push(chart)
        else if (!this.#onPage) painted.set(chart, this.#paintChart(decoder, target, chart))
        else if (!this.#addRecipe(decoder, target, chart, entries)) bare.push(chart)
        if (performance.now() > until) {
          await yieldToMessages()
          until = performance.now() + SLICE
        }
      }
      this.markDirty(target, later)
      entries.push(...this.#unplacedEntries(target, [...bare, ...later], decoder), ...this.#fillGutters(target, painted))
    }
    return entries
  }

  // ---------------------------------------------------------------- what the page paints

  /** Have the page know a target's sample as it is now. */
  #addSheet(decoder, target, entries) {
    const roles = TARGETS[target].filter((role) => hasMap(decoder, role))
    const pictures = roles.map((role) => decoder.exemplar(role))
    const known = this.#pictures[target]
    this.#pictures[target] = pictures
    if (known?.length === pictures.length && pictures.every((picture, n) => picture === known[n])) return
    const sheet = sampleSheet(decoder, target, roles)
    if (sheet) entries.push({ target, sheet: true, ...sheet })
    else this.paintHere()
  }

  /** Have the page paint a chart; returns whether there is something to paint. */
  #addRecipe(decoder, target, chart, entries) {
    if (!this.#sent.has(chart)) {
      const found = decoder.recipe(chart)
      if (!found) return false
      const recipe = chartRecipe(found, decoder.charts[chart], decoder.exemplarSize, this.#scratch)
      if (!recipe) {
        this.markDirty(target, [chart])
        this.paintHere()
        return true
      }
      const { weights: data, ...rest } = recipe
      const gutters = gutterPoints(this.#mesher, this.#sizes, chart, decoder.roles.includes('normal'))
      entries.push({ chart, recipe: { ...rest, gutters }, data })
      this.#sent.add(chart)
    }
    entries.push({ chart, target, ...this.#sizes[chart] })
    return true
  }

  // ---------------------------------------------------------------- what is painted here

  /** Charts whose placements have not come: the page shows the exemplar's mean on them. */
  #unplacedEntries(target, charts, decoder) {
    const lines = (this.#lines[target] ??= [])
    for (const chart of charts) delete lines[chart]
    const entries = charts.map((chart) => ({ chart, target, unplaced: true }))
    if (target === 'color' && charts.length) {
      const data = decoder.meanRgba()
      if (hasMap(decoder, 'opacity')) data[3] = decoder.meanRgba('opacity')[0]
      entries.unshift({ target, preview: true, height: 1, width: 1, data })
    }
    return entries
  }

  /** RGBA texels of a chart with room for a gutter of one texel round it. */
  #paintChart(decoder, target, chart) {
    const { height, width } = this.#sizes[chart]
    const stride = width + 2
    const data = this.#buffer(4 * stride * (height + 2))
    const paint = (role, into) => paintRole(decoder, chart, role, into, stride, this.#shrink)
    const roles = TARGETS[target].filter((role) => hasMap(decoder, role))
    if (target === 'surface' || roles.length > 1) {
      data.fill(255)
      const one = new Uint8Array(data.length)
      for (const role of roles) {
        const channel = role === 'opacity' ? 3 : TARGETS.surface.indexOf(role)
        if (channel < 0) paint(role, data)
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

  // ---------------------------------------------------------------- gutters

  /** Fill the gutters of painted charts, and of those beside them; returns what the page must take over. */
  #fillGutters(target, painted) {
    const lines = (this.#lines[target] ??= [])
    for (const [chart, data] of painted) lines[chart] = edgeLines(data, this.#sizes[chart])
    const beside = new Set()
    for (const chart of painted.keys()) {
      for (let edge = 0; edge < 4; edge++) {
        for (const { chart: other } of this.#mesher.seams(chart, edge)) {
          if (!painted.has(other) && lines[other]) beside.add(other)
        }
      }
    }
    const entries = []
    for (const [chart, data] of painted) {
      putGutter(data, this.#sizes[chart], this.#gutter(target, chart))
      entries.push({ chart, target, ...this.#sizes[chart], data })
    }
    for (const chart of beside) {
      entries.push({ chart, target, ...this.#sizes[chart], gutter: true, data: this.#gutter(target, chart) })
    }
    return entries
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

/** Paint a chart's role as RGBA into `into`, a gutter left free; 2^shrink texels each way become one. */
function paintRole(decoder, chart, role, into, stride, shrink) {
  const inside = 4 * (stride + 1)
  if (!shrink) return decoder.rgba(chart, { role, into, stride, offset: inside })
  const { height, width } = decoder.charts[chart]
  const step = 2 ** shrink
  const [shrunkHeight, shrunkWidth] = [Math.max(1, height >> shrink), Math.max(1, width >> shrink)]
  const rows = Math.min(step, height)
  const columns = Math.min(step, width)
  const band = new Uint8Array(4 * rows * width)
  for (let row = 0; row < shrunkHeight; row++) {
    decoder.rgba(chart, { role, into: band, stride: width, start: row * rows, stop: (row + 1) * rows })
    for (let column = 0; column < shrunkWidth; column++) {
      for (let k = 0; k < 4; k++) {
        let sum = 0
        for (let i = 0; i < rows; i++) {
          for (let j = 0; j < columns; j++) sum += band[4 * (i * width + column * columns + j) + k]
        }
        into[inside + 4 * (row * stride + column) + k] = Math.round(sum / (rows * columns))
      }
    }
  }
}
