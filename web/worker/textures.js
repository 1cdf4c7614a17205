/** Textures of charts, as a page shows them, where they changed: of what the page is to paint them, or painted here. */

import { ChartPainting } from './chart-painting.js'
import { ChartRecipes } from './recipes.js'
import { SLICE } from './schedule.js'

export class ChartTextures {
  #mesher
  #sizesAt // sizes of the textures, without gutters, by texels a step
  #densities // of each chart its texels a step
  #wanted // the same, from the next painting on
  #resized = new Set() // charts that differ in these, and what shows their edges
  #mostSketched // texels of a sketch
  #nearness // of charts: what is nearest is painted first
  #dirty = new Map() // per target: charts to paint
  #sketched = new Set() // targets that are to be painted in full
  #recipes = null // where the page paints
  #painting = null // where it does not
  #sketching = null // with fewer texels
  #painter = null // the one of these that was used last

  /** A sketch of all charts has `most` texels; undefined: no sketches. `sizesAt(densities)` returns the sizes of the textures. */
  constructor(mesher, sizesAt, densities, nearness, onPage, most) {
    /** Whether the page's graphics card paints. */
    this.onPage = onPage
    this.#mesher = mesher
    this.#sizesAt = sizesAt
    this.#densities = this.#wanted = densities
    this.#nearness = nearness
    this.#mostSketched = Math.max(most, nearness.length)
  }

  /** Paint charts with so many texels a step from the next painting on. What the page has stays until then. */
  set densities(densities) {
    const other = [...densities.keys()].filter((chart) => densities[chart] !== this.#wanted[chart])
    this.#wanted = densities
    // Where the page paints, it takes edges from charts of known sizes.
    const adjacent = other.flatMap((chart) => (this.onPage ? [0, 1, 2, 3].flatMap((edge) => this.#mesher.seams(chart, edge)) : []))
    const charts = [...other, ...adjacent.map(({ chart }) => chart)]
    for (const chart of charts) this.#resized.add(chart)
    for (const target of this.#dirty.keys()) this.markDirty(target, charts)
  }

  #resize() {
    if (this.#densities === this.#wanted) return
    this.#densities = this.#wanted
    const sizes = this.#sizesAt(this.#densities)
    for (const painter of [this.#recipes, this.#painting]) painter?.resize(sizes, this.#densities)
    this.#recipes?.forget(this.#resized)
    this.#resized.clear()
    this.#sketching = null
  }

  /** Which share of the texels a step a sketch has. */
  get #sketchShare() {
    let share = 1
    while (texelsOf(this.#sizesAt(this.#densities.map((density) => share * density))) > this.#mostSketched) share /= 2
    return share
  }

  /** Texels of all charts. */
  get texels() {
    return texelsOf(this.#sizesAt(this.#densities))
  }

  /** Have charts painted again; all of them if none are named. */
  markDirty(target, charts = this.#nearness.keys()) {
    const set = this.#dirty.get(target) ?? new Set()
    for (const chart of charts) set.add(chart)
    this.#dirty.set(target, set)
  }

  /** Whether there is anything to paint, in full too. */
  get isDirty() {
    return this.hasNews || this.#sketched.size > 0
  }

  /** Whether charts are to be painted of which there is no sketch either. */
  get hasNews() {
    return [...this.#dirty.values()].some((charts) => charts.size)
  }

  clearDirty() {
    this.#dirty.clear()
    this.#sketched.clear()
    this.#recipes = null
  }

  /** Charts have other placements, or labels. */
  forget(charts) {
    this.#recipes?.forget(charts)
  }

  /** From now on, paint everything in the worker: the page can not, or would show something else. */
  paintHere() {
    if (!this.onPage) return
    this.onPage = false
    for (const target of this.#dirty.keys()) this.markDirty(target)
  }

  /** Use memory again that the page has given back. */
  recycle(buffers) {
    this.#painter?.recycle(buffers)
  }

  /** 'opaque', 'mask' or 'blend', as glTF has it, and as the Python side decides. */
  get alphaMode() {
    return this.#painter?.alphaMode ?? 'opaque'
  }

  /** Paint what is dirty; returns what the page must take over. A sketch has fewer texels. `pause` lets messages in between slices. */
  async paint(decoder, isSketch, pause) {
    this.#resize()
    const share = isSketch && !this.onPage ? this.#sketchShare : 1
    if (share === 1) {
      for (const target of this.#sketched) this.markDirty(target)
      this.#sketched.clear()
    }
    const jobs = [...this.#dirty].filter(([, charts]) => charts.size)
    for (const [target] of jobs) this.#dirty.set(target, new Set())
    const entries = []
    let until = performance.now() + SLICE
    for (const [target, dirty] of jobs) {
      let painter = this.#painterAt(share)
      if (!painter.begin(decoder, target, entries)) {
        this.paintHere()
        painter = this.#painterAt(share)
        painter.begin()
      }
      for (const chart of [...dirty].sort((a, b) => this.#nearness[b] - this.#nearness[a])) {
        if (!painter.paint(decoder, target, chart, entries)) this.paintHere()
        if (performance.now() > until) {
          await pause()
          until = performance.now() + SLICE
        }
      }
      painter.end(target, entries)
      if (share < 1) this.#sketched.add(target)
    }
    return entries
  }

  /** What paints such a share of the texels a step, on the page or here. */
  #painterAt(share) {
    const densities = this.#densities.map((density) => share * density)
    const made = (Painter) => new Painter(this.#mesher, this.#sizesAt(densities), densities)
    if (this.onPage) this.#painter = this.#recipes ??= made(ChartRecipes)
    else if (share < 1) this.#painter = this.#sketching ??= made(ChartPainting)
    else this.#painter = this.#painting ??= made(ChartPainting)
    return this.#painter
  }
}

/** Texels of charts with these sizes. */
export function texelsOf(sizes) {
  return sizes.reduce((sum, { height, width }) => sum + height * width, 0)
}
