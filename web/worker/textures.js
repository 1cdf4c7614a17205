/** Textures of charts, as a page shows them, where they changed: of what the page is to paint them, or painted here. */

import { ChartPainting } from './chart-painting.js'
import { ChartRecipes } from './recipes.js'
import { SLICE } from './schedule.js'

export class ChartTextures {
  #mesher
  #sizesAt // sizes of the textures, without gutters, by texels a step
  #density // texels a step
  #mostSketched // texels of a sketch
  #nearness // of charts: what is nearest is painted first
  #dirty = new Map() // per target: charts to paint
  #sketched = new Set() // targets that are to be painted in full
  #recipes = null // where the page paints
  #paintings = new Map() // paint where it does not, by texels a step
  #painter = null // the one of these that was used last

  /** A sketch of all charts has `most` texels; undefined: no sketches. `sizesAt(density)` returns the sizes of the textures. */
  constructor(mesher, sizesAt, density, nearness, onPage, most) {
    /** Whether the page's graphics card paints. */
    this.onPage = onPage
    this.#mesher = mesher
    this.#sizesAt = sizesAt
    this.#density = density
    this.#nearness = nearness
    this.#mostSketched = Math.max(most, nearness.length)
  }

  /** Paint with so many texels a step from now on. What the page has stays until then. */
  set density(density) {
    if (density === this.#density) return
    this.#density = density
    this.#recipes?.resize(this.#sizesAt(density), density)
    this.#paintings.clear()
    for (const target of this.#dirty.keys()) this.markDirty(target)
  }

  get #sketchDensity() {
    let density = this.#density
    while (texelsOf(this.#sizesAt(density)) > this.#mostSketched) density /= 2
    return density
  }

  /** Texels of all charts. */
  get texels() {
    return texelsOf(this.#sizesAt(this.#density))
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
    const density = isSketch && !this.onPage ? this.#sketchDensity : this.#density
    if (density === this.#density) {
      for (const target of this.#sketched) this.markDirty(target)
      this.#sketched.clear()
    }
    const jobs = [...this.#dirty].filter(([, charts]) => charts.size)
    for (const [target] of jobs) this.#dirty.set(target, new Set())
    const entries = []
    let until = performance.now() + SLICE
    for (const [target, dirty] of jobs) {
      let painter = this.#painterAt(density)
      if (!painter.begin(decoder, target, entries)) {
        this.paintHere()
        painter = this.#painterAt(density)
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
      if (density !== this.#density) this.#sketched.add(target)
    }
    return entries
  }

  /** What paints so many texels a step, on the page or here. */
  #painterAt(density) {
    if (this.onPage) return (this.#painter = this.#recipes ??= new ChartRecipes(this.#mesher, this.#sizesAt(density), density))
    if (!this.#paintings.has(density)) this.#paintings.set(density, new ChartPainting(this.#mesher, this.#sizesAt(density), density))
    return (this.#painter = this.#paintings.get(density))
  }
}

/** Texels of charts with these sizes. */
export function texelsOf(sizes) {
  return sizes.reduce((sum, { height, width }) => sum + height * width, 0)
}
