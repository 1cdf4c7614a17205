/**
 * Textures of charts, as a page shows them, where they changed: of what the page is to paint them, `recipes.js`, or painted here, by
 * `painting.js`. These are parts, which are loaded.
 */

import { hasPart, part } from '../uph-core.js'
import { TARGETS, hasMap } from './maps.js'
import { SLICE, yieldToMessages } from './schedule.js'

const LEAST_SHARE = 1 / 16 // of the charts: as many are painted, however long that takes

export class ChartTextures {
  #mesher
  #shrink // 2^shrink texels each way become one
  #sizes // of the textures, without gutters
  #nearness // of charts: what is nearest is painted first
  #dirty = new Map() // per target: charts to paint
  #recipes = null // where the page paints
  #here = null // paints where it does not

  constructor(mesher, sizes, shrink, nearness, onPage) {
    /** Whether the page's graphics card paints. */
    this.onPage = onPage && !shrink
    this.#mesher = mesher
    this.#sizes = sizes
    this.#shrink = shrink
    this.#nearness = nearness
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
    this.#recipes = null
  }

  /** Charts have other placements. */
  forget(charts) {
    this.#recipes?.forget(charts)
  }

  /** Paint all of it here from now on: the page can not, or would show something else. */
  paintHere() {
    if (!this.onPage) return
    this.onPage = false
    for (const target of this.#dirty.keys()) this.markDirty(target)
  }

  /** Use memory again that the page has given back. */
  recycle(buffers) {
    this.#here?.recycle(buffers)
  }

  /** Whether the part is there that is needed now. */
  get isReady() {
    return hasPart(this.onPage ? 'ChartRecipes' : 'ChartPainting')
  }

  /** 'opaque', 'mask' or 'blend', as glTF has it, and as the Python side decides. */
  get alphaMode() {
    return this.#here?.alphaMode ?? 'opaque'
  }

  /** Paint what is dirty, charts with placements for so many milliseconds, or until there is something to see; returns what the page must take over. */
  async paint(decoder, most = Infinity) {
    const jobs = [...this.#dirty].filter(([, charts]) => charts.size)
    for (const [target] of jobs) this.#dirty.set(target, new Set())
    const entries = []
    let until = performance.now() + SLICE
    const end = performance.now() + most
    let least = LEAST_SHARE * this.#sizes.length
    for (const [target, dirty] of jobs) {
      const painted = new Map()
      if (this.onPage && !this.#listing.addSheet(decoder, target, entries)) this.paintHere()
      const [later, bare, kept] = [[], [], []]
      for (const chart of [...dirty].sort((a, b) => this.#nearness[b] - this.#nearness[a])) {
        if (!this.isReady) kept.push(chart)
        else if (!decoder.isPlaced(chart)) bare.push(chart)
        else if (least-- < 0 && performance.now() > end) later.push(chart)
        else if (!this.onPage) painted.set(chart, this.#painting.paintChart(decoder, target, chart))
        else {
          const isListed = this.#listing.addRecipe(decoder, target, chart, entries)
          if (isListed === null) this.paintHere()
          if (!isListed) (this.onPage ? bare : kept).push(chart)
        }
        if (performance.now() > until) {
          await yieldToMessages()
          until = performance.now() + SLICE
        }
      }
      this.markDirty(target, [...later, ...kept])
      entries.push(...this.#unplacedEntries(target, [...bare, ...later], decoder))
      if (painted.size) entries.push(...this.#painting.fillGutters(target, painted))
    }
    return entries
  }

  /** What tells the page what to paint. */
  get #listing() {
    return (this.#recipes ??= new (part('ChartRecipes'))(this.#mesher, this.#sizes))
  }

  /** What paints here. */
  get #painting() {
    return (this.#here ??= new (part('ChartPainting'))(this.#mesher, this.#sizes, this.#shrink))
  }

  /** Charts whose placements have not come: the page shows the exemplar's mean on them. */
  #unplacedEntries(target, charts, decoder) {
    this.#here?.forget(target, charts)
    const entries = charts.map((chart) => ({ chart, target, unplaced: true }))
    if (target === 'color' && charts.length) {
      const data = decoder.meanRgba()
      if (hasMap(decoder, 'opacity')) data[3] = decoder.meanRgba('opacity')[0]
      entries.unshift({ target, preview: true, height: 1, width: 1, data })
    }
    return entries
  }
}
