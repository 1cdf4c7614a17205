/** Vertices along the edges of charts: those of both sides of a seam, at positions that one side gives to both. */

import { basis, evaluate, range } from './bezier.js'
import { MAX_SEGMENTS } from './bounds.js'
import { cornerOf, orientSeam } from './chart-seams.js'
import { EPS } from './edge-seams.js'

export class RimMaker {
  #patches
  #charts
  #seams

  constructor(patches, charts, seams) {
    this.#patches = patches
    this.#charts = charts
    this.#seams = seams
  }

  /** Segments along an edge, 4·chart + edge: at least two, so that the grid has an inside. */
  segments(side, counts) {
    const count = counts[2 * (side >> 2) + (side & 1 ? 0 : 1)]
    if (!(count >= 1 && count <= MAX_SEGMENTS)) {
      throw new RangeError(`count of chart ${side >> 2} is ${count}; allowed: 1 to ${MAX_SEGMENTS}`)
    }
    return Math.max(2, Math.floor(count))
  }

  /** Vertices along an edge, in the order in which they go round the chart: their parameters `us`, and `points`. */
  rim(side, counts) {
    const count = this.segments(side, counts)
    const line = new RimLine(this.#corner(cornerOf(side, 0)))
    const addOwn = (stop) => {
      const first = line.end
      const own = range(count, (k) => k / count).filter((u) => u > first + EPS && u < stop - EPS)
      const v = this.#pointsAlong(side, own)
      own.forEach((u, k) => line.add(u, v, 9 * k))
    }
    for (const seam of this.#seams.sides[side]) {
      const { start, stop } = orientSeam(seam, side)
      addOwn(start)
      this.#addSeam(line, seam, side, counts, start, stop)
    }
    addOwn(1)
    line.add(1, this.#corner(cornerOf(side, 1)), 0)
    const { us, points } = line
    if (this.#seams.isPoint[side]) for (let k = 3; k < points.length; k++) points[k] = points[k - 3]
    if ((side & 3) < 2) return { us, points }
    return { us: us.reverse(), points: range(us.length, () => points.splice(-3)).flat() }
  }

  /** Add the vertices of a seam from `start` to `stop` of an edge. */
  #addSeam(line, seam, side, counts, start, stop) {
    const places = this.#breaks(seam, counts)
    const v = this.#pointsOnSeam(seam, places, side)
    const reversed = side !== seam.a && seam.b0 > seam.b1
    for (let k = 0; k < places.length; k++) {
      const n = reversed ? places.length - 1 - k : k
      const x = reversed ? 1 - places[n] : places[n]
      if (k || start > line.end + EPS) line.add(x === 1 ? stop : start + (stop - start) * x, v, 9 * n)
    }
  }

  /** Breaks of both sides, 0 to 1 along the seam. */
  #breaks({ a, b, a0, a1, b0, b1 }, counts) {
    const breaks = []
    for (const [side, first, last] of [
      [a, a0, a1],
      [b, b0, b1],
    ]) {
      const segments = this.segments(side, counts)
      const [low, high] = [first, last].sort((p, q) => p - q)
      for (let k = Math.ceil(low * segments); k <= high * segments; k++) {
        breaks.push((k / segments - first) / (last - first))
      }
    }
    breaks.sort((p, q) => p - q)
    return [0, ...breaks.filter((x, k) => x > EPS && x < 1 - EPS && !(k && x - breaks[k - 1] < EPS)), 1]
  }

  /** Points of a seam as its side a has them, corners where they belong. */
  #pointsOnSeam(seam, places, side) {
    const { a, a0, a1, b0, b1 } = seam
    const { from, to } = orientSeam(seam, side)
    const reversed = side !== a && b0 > b1
    const v = this.#pointsAlong(a, places.map((x) => a0 + (a1 - a0) * x))
    ;[from, to].forEach((corners, k) => {
      const corner = Math.max(...corners)
      if (corner >= 0) v.set(this.#corner(corner), (k ? !reversed : reversed) ? v.length - 9 : 0)
    })
    return v
  }

  /** Points of a chart's edge at parameters of it, nine numbers each of which three are the point. */
  #pointsAlong(side, us) {
    const { patch, s0, s1, t0, t1 } = this.#charts[side >> 2]
    const { m, n } = this.#patches[patch]
    const at = [[s0, t1, s1, t0][side & 3]]
    if (side & 1) return evaluate(this.#patches[patch], basis(m, us.map((u) => s0 + (s1 - s0) * u)), basis(n, at))
    return evaluate(this.#patches[patch], basis(m, at), basis(n, us.map((u) => t0 + (t1 - t0) * u)))
  }

  /** The point of a corner, 4·chart + corner. */
  #corner(corner) {
    const root = this.#seams.rootOf(corner)
    const side = (root & -4) + [0, 0, 2, 2][root & 3]
    return this.#pointsAlong(side, [[0, 1, 1, 0][root & 3]]).subarray(0, 3)
  }
}

/** Vertices along a line, parameters rising. */
class RimLine {
  constructor(first) {
    this.us = [0]
    this.points = [...first]
  }

  /** The last parameter. */
  get end() {
    return this.us.at(-1)
  }

  add(u, v, at) {
    if (!(u > this.end)) return
    this.us.push(u)
    this.points.push(v[at], v[at + 1], v[at + 2])
  }
}
