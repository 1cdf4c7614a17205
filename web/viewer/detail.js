/** How finely charts have to be tessellated for where they are seen. */

import { countsFor } from '../uph-mesh.js'

const MEASURE_EVERY = 120 // milliseconds between looks at how large charts are on screen
const MAX_QUADS = 2 ** 19

/** Asks for the segments that charts need, not at every frame. */
export class Detail {
  /** Segments of charts, along s and along t, that were asked for; null before there are any. */
  counts = null
  #bounds
  #errorPixels
  #request
  #askedAt = 0

  /** request(counts) is called when charts want other segments. */
  constructor(bounds, errorPixels, request) {
    this.#bounds = bounds
    this.#errorPixels = errorPixels
    this.#request = request
  }

  /** The charts are seen from `eye`, with so many pixels to the unit at distance 1; nothing is nearer than `near`. */
  measure(eye, pixelsAtOne, near) {
    const now = performance.now()
    if (!this.counts || now - this.#askedAt < MEASURE_EVERY) return
    this.#askedAt = now
    const wanted = this.counts.slice()
    this.#bounds.forEach((bounds, chart) => {
      const distance = Math.hypot(...bounds.center.map((x, k) => x - eye[k])) - bounds.radius
      const counts = countsFor(bounds, pixelsAtOne / Math.max(distance, near), this.#errorPixels)
      for (let k = 0; k < 2; k++) {
        const before = this.counts[2 * chart + k]
        // Coarser only where it pays, so that turning to and fro changes nothing.
        if (counts[k] > before || counts[k] < before / 2) wanted[2 * chart + k] = counts[k]
      }
    })
    const quads = () => wanted.reduce((sum, count, n) => (n % 2 ? sum + count * wanted[n - 1] : sum), 0)
    while (quads() > MAX_QUADS && wanted.some((count) => count > 1)) {
      wanted.forEach((count, n) => (wanted[n] = Math.max(1, count >> 1)))
    }
    if (wanted.every((count, n) => count === this.counts[n])) return
    this.counts = wanted
    this.#request(wanted)
  }
}
