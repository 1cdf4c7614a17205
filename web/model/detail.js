/** How finely charts have to be tessellated for where they are seen. */

import { countsFor } from '../uph-mesh.js'

const MEASURE_EVERY = 120 // milliseconds between looks at how large charts are on screen
const MAX_QUADS = 2 ** 19

/** Gathers the segments that charts need in a frame, and asks for them together, not at every frame. */
export class Detail {
  /** Segments of charts, along s and along t, that were asked for; null before there are any. */
  counts = null
  /** Pixels that a unit of length takes at least, wherever it is seen from. */
  leastPerUnit = 0
  #bounds
  #errorPixels
  #request
  #wanted = null
  #askedAt = 0

  /** request(counts) is called when charts want other segments. */
  constructor(bounds, errorPixels, request) {
    this.#bounds = bounds
    this.#errorPixels = errorPixels
    this.#request = request
  }

  /** A chart is about to be drawn, so many pixels to the unit. */
  measure(chart, perUnit) {
    if (!this.counts) return
    if (!this.#wanted) {
      if (performance.now() - this.#askedAt < MEASURE_EVERY) return
      this.#wanted = this.counts.slice()
      setTimeout(() => this.#ask(), 0)
    }
    this.#want(chart, perUnit)
  }

  /** Ask for all charts at once, as finely as `leastPerUnit` needs. */
  askForLeast() {
    this.#wanted ??= this.counts.slice()
    for (const chart of this.#bounds.keys()) this.#want(chart, 0)
    this.#ask()
  }

  #want(chart, perUnit) {
    const counts = countsFor(this.#bounds[chart], Math.max(perUnit, this.leastPerUnit), this.#errorPixels)
    for (let k = 0; k < 2; k++) {
      const now = this.counts[2 * chart + k]
      // Coarser only where it pays, so that turning to and fro changes nothing.
      if (counts[k] > now || counts[k] < now / 2) this.#wanted[2 * chart + k] = counts[k]
    }
  }

  #ask() {
    const wanted = this.#wanted
    if (!wanted) return // asked for already
    this.#wanted = null
    this.#askedAt = performance.now()
    const quads = () => wanted.reduce((sum, count, n) => (n % 2 ? sum + count * wanted[n - 1] : sum), 0)
    while (quads() > MAX_QUADS && wanted.some((count) => count > 1)) {
      wanted.forEach((count, n) => (wanted[n] = Math.max(1, count >> 1)))
    }
    if (wanted.every((count, n) => count === this.counts[n])) return
    this.counts = wanted
    this.#request(wanted)
  }
}
