/** Several models that are parts of one: each stream covers some of its charts. They are drawn as one, with one floor and one shadow. */

const FORWARDED = ['progress', 'refine', 'geometry', 'error']

/** Replaces a `Model` by its `parts`. Events are those of a model: `first` and `complete` when all parts have reached that state. */
export class Group extends EventTarget {
  sphere = { center: [0, 0, 0], radius: 1 }

  /** @param {import('./model.js').Model[]} parts */
  constructor(parts) {
    super()
    this.parts = parts
    for (const part of parts) {
      for (const type of FORWARDED) part.addEventListener(type, (event) => this.#notify(type, event.detail))
      for (const type of ['surface', 'first']) part.addEventListener(type, () => this.first && this.#begin(type))
      part.addEventListener('complete', () => this.complete && this.#notify('complete', {}))
    }
  }

  get first() {
    return this.parts.every((part) => part.first)
  }

  get complete() {
    return this.parts.every((part) => part.complete)
  }

  get received() {
    return this.#sum('received')
  }

  get total() {
    return this.parts.some((part) => part.total === null) ? null : this.#sum('total')
  }

  get texels() {
    return this.#sum('texels')
  }

  get quads() {
    return this.#sum('quads')
  }

  get charts() {
    return this.parts.flatMap((part) => part.charts)
  }

  get geometries() {
    return this.parts.flatMap((part) => part.geometries)
  }

  get roles() {
    return [...new Set(this.parts.flatMap((part) => part.roles))]
  }

  get shown() {
    return { bytes: this.#sum('received'), coefficients: 1, placements: 1 }
  }

  /** As `Model.measure`; the eye is given for the whole sphere, which all parts have. */
  measure(...seen) {
    for (const part of this.parts) part.measure(...seen)
  }

  async settled() {
    await Promise.all(this.parts.map((part) => part.settled()))
  }

  dispose() {
    for (const part of this.parts) part.dispose()
  }

  /** All parts are known: they stand in one world. */
  #begin(type) {
    const before = this.sphere
    this.sphere = enclosing(this.parts.map((part) => part.sphere))
    for (const part of this.parts) part.sphere = this.sphere
    this.#notify(type, { before })
  }

  #sum(name) {
    return this.parts.reduce((sum, part) => sum + (part[name] ?? 0), 0)
  }

  #notify(type, detail) {
    this.dispatchEvent(Object.assign(new Event(type), detail, { detail }))
  }
}

/** A sphere round spheres. */
function enclosing(spheres) {
  const side = (sign) => [0, 1, 2].map((k) => Math.max(...spheres.map(({ center, radius }) => sign * center[k] + radius)))
  const [high, low] = [side(1), side(-1)]
  const center = high.map((x, k) => (x - low[k]) / 2)
  const reach = (one) => Math.hypot(...center.map((x, k) => x - one.center[k])) + one.radius
  return { center, radius: Math.max(...spheres.map(reach)) || 1 }
}
