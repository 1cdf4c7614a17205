/**
 * Textures of charts, as a page shows them, where they changed: of what the page is to paint them, `recipes.js`, or painted here, by
 * `painting.js`. These are parts, which are loaded.
 */

import { hasPart, part } from '../uph-core.js'
import { shrunk } from '../uph/numbers.js'
import { TARGETS, hasMap } from './maps.js'
import { SLICE, yieldToMessages } from './schedule.js'

const LEAST = 8 // halves of charts are painted, or told the page, however long that takes

export class ChartTextures {
  #mesher
  #shrink // 2^shrink texels each way become one
  #sketched = 0 // as often again, in sketches
  #sizes // of the textures, without gutters
  #nearness // of charts: what is nearest is painted first
  #dirty = new Map() // per target: charts to paint
  #sketches = new Map() // per target: charts to paint in full
  #recipes = null // where the page paints
  #paintings = [] // paint where it does not, by how often again sizes are halved
  #last = 0 // which of them was used

  /** `most` texels has a sketch of all charts; undefined: there are none. */
  constructor(mesher, sizes, shrink, nearness, onPage, most) {
    /** Whether the page's graphics card paints. */
    this.onPage = onPage && !shrink
    this.#mesher = mesher
    this.#sizes = sizes
    this.#shrink = shrink
    this.#nearness = nearness
    const texels = sizes.reduce((sum, { height, width }) => sum + height * width, 0)
    while (texels > most * 4 ** this.#sketched) this.#sketched++
  }

  /** Have charts painted again; all of them if none are named. */
  markDirty(target, charts = this.#sizes.keys(), all = this.#dirty) {
    const set = all.get(target) ?? new Set()
    for (const chart of charts) set.add(chart)
    all.set(target, set)
  }

  /** Whether there is anything to paint, in full too. */
  get isDirty() {
    return this.hasNews || this.#sketches.size > 0
  }

  /** Whether charts are to be painted of which there is no sketch either. */
  get hasNews() {
    return [...this.#dirty.values()].some((charts) => charts.size)
  }

  clearDirty() {
    this.#dirty.clear()
    this.#sketches.clear()
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
    this.#paintings[0]?.recycle(buffers)
  }

  /** Whether the part is there that is needed now. */
  get isReady() {
    return hasPart(this.onPage ? 'ChartRecipes' : 'ChartPainting')
  }

  /** 'opaque', 'mask' or 'blend', as glTF has it, and as the Python side decides. */
  get alphaMode() {
    return this.#paintings[this.#last]?.alphaMode ?? 'opaque'
  }

  /** The exemplar's mean as RGBA. */
  mean(decoder) {
    return decoder.meanRgba('albedo', this.#last)
  }

  /**
   * Paint what is dirty, charts with placements for so many milliseconds, or until there is something to see; returns what the page must
   * take over. A sketch has fewer texels, which is soon done. `between` is called between slices.
   */
  async paint(decoder, isSketch, most, between) {
    const sketched = isSketch && !this.onPage ? this.#sketched : 0
    if (!sketched) for (const [target, charts] of this.#sketches) this.markDirty(target, charts)
    if (!sketched) this.#sketches.clear()
    this.#last = sketched
    const jobs = [...this.#dirty].filter(([, charts]) => charts.size)
    for (const [target] of jobs) this.#dirty.set(target, new Set())
    const entries = []
    let until = performance.now() + SLICE
    const end = performance.now() + most
    for (const [target, dirty] of jobs) {
      const painted = new Map()
      if (this.onPage && !this.#listing.addSheet(decoder, target, entries)) this.paintHere()
      const [later, bare, kept] = [[], [], []]
      for (const chart of [...dirty].sort((a, b) => this.#nearness[b] - this.#nearness[a])) {
        if (!this.isReady) kept.push(chart)
        else if (!decoder.isPlaced(chart) || (sketched && target === 'normal')) bare.push(chart)
        else if (2 * painted.size + entries.length > LEAST && performance.now() > end) later.push(chart)
        else if (!this.onPage) painted.set(chart, this.#painting(sketched).paintChart(decoder, target, chart))
        else {
          const isListed = this.#listing.addRecipe(decoder, target, chart, entries)
          if (isListed === null) this.paintHere()
          if (!isListed) (this.onPage ? bare : kept).push(chart)
        }
        if (performance.now() > until) {
          await yieldToMessages()
          between()
          until = performance.now() + SLICE
        }
      }
      this.markDirty(target, [...later, ...kept])
      entries.push(...this.#unplacedEntries(target, [...bare, ...later], decoder))
      if (painted.size) entries.push(...this.#painting(sketched).fillGutters(target, painted))
      if (sketched) this.markDirty(target, dirty, this.#sketches)
    }
    return entries
  }

  /** What tells the page what to paint. */
  get #listing() {
    return (this.#recipes ??= new (part('ChartRecipes'))(this.#mesher, this.#sizes))
  }

  /** What paints here, with sizes halved so often. */
  #painting(sketched) {
    const sizes = this.#sizes.map(({ height, width }) => ({ height: shrunk(height, sketched), width: shrunk(width, sketched) }))
    return (this.#paintings[sketched] ??= new (part('ChartPainting'))(this.#mesher, sizes, this.#shrink, sketched))
  }

  /** Charts whose placements have not come: the page shows the exemplar's mean on them. */
  #unplacedEntries(target, charts, decoder) {
    for (const painting of this.#paintings) painting?.forget(target, charts)
    const entries = charts.map((chart) => ({ chart, target, unplaced: true }))
    if (target === 'color' && charts.length) {
      const data = this.mean(decoder)
      if (hasMap(decoder, 'opacity')) data[3] = decoder.meanRgba('opacity', this.#last)[0]
      entries.unshift({ target, preview: true, height: 1, width: 1, data })
    }
    return entries
  }
}
