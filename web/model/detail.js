/** How finely charts have to be tessellated and painted for where they are seen. */

import { countsFor } from '../uph-mesh.js'

const ASK_EVERY = 120 // milliseconds
const MAX_QUADS = 2 ** 19
const WIDEST_TEXEL = 1.1 // pixels from which more texels are asked for

/** Gathers the segments and texels that charts need in some frames, and asks for them together. */
export class Detail {
  /** Segments of charts, along s and along t, that were asked for; null before there are any. */
  counts = null
  /** Pixels that a unit of length takes at least, wherever it is seen from. */
  leastPerUnit = 0
  #bounds
  #errorPixels
  #perUnit // of charts: for how many pixels a unit of length texels were asked for
  #isNearer = false // than that
  #request
  #wanted = null
  #askedAt = 0

  /** request(message) is called when charts want other segments, or more texels than for `perUnit` pixels; see `uph-worker.js`. */
  constructor(bounds, errorPixels, perUnit, request) {
    this.#bounds = bounds
    this.#errorPixels = errorPixels
    this.#perUnit = new Float32Array(bounds.length).fill(perUnit)
    this.#request = request
  }

  /** A chart is about to be drawn, so many pixels to the unit. */
  measure(chart, perUnit) {
    if (!this.counts) return
    if (!this.#wanted) {
      this.#wanted = this.counts.slice()
      setTimeout(() => this.#ask(), this.#askedAt + ASK_EVERY - performance.now())
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
    if (perUnit <= WIDEST_TEXEL * this.#perUnit[chart]) return
    this.#perUnit[chart] = perUnit
    this.#isNearer = true
  }

  #ask() {
    const wanted = this.#wanted
    if (!wanted) return // asked for already
    this.#wanted = null
    this.#askedAt = performance.now()
    if (this.#isNearer) this.#request({ kind: 'pixels', perUnit: this.#perUnit })
    this.#isNearer = false
    const quads = () => wanted.reduce((sum, count, n) => (n % 2 ? sum + count * wanted[n - 1] : sum), 0)
    while (quads() > MAX_QUADS && wanted.some((count) => count > 1)) {
      wanted.forEach((count, n) => (wanted[n] = Math.max(1, count >> 1)))
    }
    if (wanted.every((count, n) => count === this.counts[n])) return
    this.counts = wanted
    this.#request({ kind: 'counts', counts: wanted })
  }
}
