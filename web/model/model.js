/** Charts with geometry and textures from a stream's worker: the viewer draws them, and scenes of three.js are built from them. */

import { SKETCHED_TEXELS, UphClient } from '../uph-client.js'
import { putGutter } from '../uph-gutter.js'
import { Detail } from './detail.js'

/**
 * Texture side that every graphics card supports, and the number of all texels: if there would be more, all charts get fewer. And the largest
 * distance of the mesh from the surface, in pixels.
 */
export const DEFAULTS = { maxTextureSize: 4096, maxTexels: 2 ** 26, errorPixels: 0.4 }

let version = 0

/**
 * A textured surface that refines.
 *
 * Events: `progress` {received, total}, `surface` {before} (there are other charts: of a base, a coarse mesh, then of the
 * surface itself; `before` is the sphere of the one before), `first`, `refine`, `geometry`, `complete`, `stalled` {attempt, message}, `resumed`, `error` {error}.
 */
export class Model extends EventTarget {
  /**
   * Per chart: `bounds`, a sphere round it, `geometry`, and `textures` by target, each of `width`, `height`, `version`, a `key` of its own, and `data`; or
   * `recipe` and `sheets`, by role, of which the graphics card paints it.
   */
  charts = []
  /** By role: the sample, as the graphics card paints from it. */
  #sheets = {}
  /** Triangles on no chart, and their colour. */
  plain = null
  metres = null // length of the model's unit, if it is known
  mean = [0.5, 0.5, 0.5]
  texels = 0
  shown = { bytes: 0, coefficients: 0, placements: 0 }
  roles = []
  alpha = 'opaque'
  sphere = { center: [0, 0, 0], radius: 1 }
  /** What to draw as lines, see `lines.js`: `edges` instead of triangles, `borders` too, each a function of a geometry, with a `shader` and the borders' `ink`. */
  lines = null
  #client
  #incoming = null // another surface, its charts, and its place among them: until it has textures
  #detail = null
  #pixels
  #perUnit = null // how many pixels a unit of length takes in a sphere, as measured last
  #errorPixels

  /**
   * @param {Worker} worker that runs uph-worker.js
   * @param {object} [options] limits other than `DEFAULTS`; `eye`, a vector toward the viewer; `pixels`, the length of the model's radius at its
   *   nearest point: without it, all texels are painted; `onPage`: the graphics card paints, not the worker; `whole`: nothing is shown before
   *   everything has arrived
   */
  constructor(worker, { eye, pixels = Infinity, onPage, ...limits } = {}) {
    super()
    this.onPage = onPage
    this.#pixels = pixels
    const view = {
      begin: (message) => this.#begin(message),
      takeMeshes: (message) => this.#takeMeshes(message),
      takeTexture: (entry) => this.#takeTexture(entry),
      show: (state, first) => this.#show(state, first),
      notify: (type, detail) => this.#notify(type, detail),
    }
    const { errorPixels, ...most } = { ...DEFAULTS, ...limits }
    this.#errorPixels = errorPixels
    this.#client = new UphClient(worker, { ...most, eye, pixels, onPage, sketches: SKETCHED_TEXELS }, view)
  }

  /** The receiver of bytes. */
  get client() {
    return this.#client
  }

  get received() {
    return this.#client.received
  }

  /** Length of the whole stream; null before its header has arrived. */
  get total() {
    return this.#client.total
  }

  get complete() {
    return this.#client.complete
  }

  /** Whether there is a textured picture. */
  get first() {
    return this.#client.first
  }

  /** The geometries to draw: those of charts, and that of triangles on no chart. */
  get geometries() {
    return [...this.charts.map(({ geometry }) => geometry), this.plain].filter(Boolean)
  }

  get quads() {
    return Math.round(this.charts.reduce((sum, { geometry }) => sum + (geometry?.indices.length ?? 0), 0) / 6)
  }

  /** Show a prefix only: {bytes}, or {coefficients}, a share of 0 to 1; null shows all received bytes. */
  setLimit(limit) {
    this.#client.send({ kind: 'limit', ...limit })
  }

  /** Show the model with another sample of the same shape, see `UphClient`; null: the stream's own. */
  setExemplar(image) {
    return this.#client.setExemplar(image)
  }

  /** Resolves when all received bytes, up to the limit, are in the textures. */
  settled() {
    return this.#client.settled()
  }

  /** The bytes received so far. */
  bytes() {
    return this.#client.bytes()
  }

  /** Stop receiving: the picture stays. */
  abort() {
    this.#client.abort()
  }

  /** The graphics card can not paint after all: let the worker paint. */
  paintInWorker() {
    this.onPage = false
    this.isBare = true // until a texture of it is here
    for (const chart of [...this.charts, ...this.#ownCharts]) chart.textures = {}
    this.#client.send({ kind: 'paint' })
  }

  /** Tessellate and paint the charts for this size on screen. `eye` is in the model's own space. */
  measure(eye, pixelsAtOne, near) {
    this.#perUnit = ({ center, radius }) => pixelsAtOne / Math.max(Math.hypot(...center.map((x, k) => x - eye[k])) - radius, near)
    this.charts.forEach(({ bounds }, chart) => this.measureChart(chart, this.#perUnit(bounds)))
  }

  /** Tessellate a chart for this size on screen. */
  measureChart(chart, perUnit) {
    if (!this.#incoming) this.#detail?.measure(chart, perUnit)
  }

  /** Resolves when the geometry is fine enough for this many pixels per unit. */
  async refineTo(perUnit) {
    const detail = this.#detail
    detail.leastPerUnit = perUnit
    detail.askForLeast()
    await this.settled()
    detail.leastPerUnit = 0
  }

  dispose() {
    this.#client.dispose()
    this.#detail = null
  }

  #notify(type, detail = {}) {
    this.dispatchEvent(Object.assign(new Event(type), detail, { detail }))
  }

  #begin({ bounds, sphere, plain, metres }) {
    const charts = bounds.map((one) => ({ bounds: one, geometry: null, textures: {} }))
    this.#incoming = { charts, plain, metres, sphere }
    this.#detail = new Detail(bounds, this.#errorPixels, this.#pixels / sphere.radius, (message) => this.#client.send(message))
  }

  /** The charts that the worker speaks of. */
  get #ownCharts() {
    return (this.#incoming ?? this).charts
  }

  #takeMeshes({ pieces, counts }) {
    if (!this.#detail.counts) {
      this.#detail.counts = counts
      // What takes the place of another surface is as fine as that from the beginning.
      if (this.#perUnit) this.#ownCharts.forEach(({ bounds }, chart) => this.#detail.measure(chart, this.#perUnit(bounds)))
    }
    for (const { chart, ...geometry } of pieces) this.#ownCharts[chart].geometry = geometry
    if (!this.#incoming) this.#notify('geometry')
  }

  /** Take over one texture; returns the memory of the previous one. */
  #takeTexture({ chart, target, height, width, data, gutter, role, sheet, recipe, roles, ...rest }) {
    if (sheet) this.#sheets[role] = { data, height, width, ...rest }
    else if (recipe) this.#ownCharts[chart].recipe = { ...recipe, numbers: data }
    // No data: a recipe, sent before the worker heard that it is to paint.
    if (sheet || recipe || !(data || this.onPage)) return null
    const { textures } = this.#ownCharts[chart]
    const old = textures[target]
    if (gutter) {
      putGutter(old.data, { height: old.height - 2, width: old.width - 2 }, data)
      old.version = ++version
      return null
    }
    const made = { key: old?.key ?? {}, width: width + 2, height: height + 2, version: ++version }
    const painted = data ? { data } : { recipe: this.#ownCharts[chart].recipe, sheets: Object.fromEntries(roles.map((one) => [one, this.#sheets[one]])) }
    textures[target] = { ...made, ...painted }
    this.isBare &&= !data
    return old?.data?.buffer ?? null
  }

  #show({ bytes, coefficients, placements, roles, alpha = 'opaque', mean, texels }, isFirst) {
    const before = this.sphere
    const incoming = this.#incoming
    this.#incoming = null
    Object.assign(this, { roles, alpha, mean, texels, shown: { bytes, coefficients, placements } }, incoming)
    if (incoming) this.#notify('surface', { before })
    this.#notify(isFirst ? 'first' : 'refine')
  }
}
