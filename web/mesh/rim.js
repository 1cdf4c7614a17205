/** Vertices along the edges of charts: those of both sides of a seam, at positions that one side gives to both. */

import { tabulate } from './bezier.js'
import { MAX_SEGMENTS } from './bounds.js'
import { EPS } from './chart-part.js'
import { cornerOf } from './chart-seams.js'

const RING = 4 // segments of a chart that may close to a ring, so that it stays hollow

export class RimMaker {
  #parts
  #seams

  constructor(parts, seams) {
    this.#parts = parts
    this.#seams = seams
  }

  /**
   * Where segments along an edge, 4·chart + edge, begin and end, 0 to 1: evenly, and at borders of patches where
   * derivatives jump. At least two, so that the grid has an inside; four where the chart may close to a ring.
   */
  breaks(side, counts) {
    const chart = side >> 2
    const axis = side & 1 ? 0 : 1
    const count = counts[2 * chart + axis]
    if (!(count >= 1 && count <= MAX_SEGMENTS)) {
      throw new RangeError(`count of chart ${chart} is ${count}; allowed: 1 to ${MAX_SEGMENTS}`)
    }
    const { first, last } = this.#parts[chart].axes[axis]
    const mayClose = last - first > 1 || this.#seams.meetsItself[chart]
    const segments = Math.max(mayClose ? RING : 2, Math.floor(count))
    const even = tabulate(segments + 1, (k) => k / segments)
    const isNew = (u) => Math.abs(u * segments - Math.round(u * segments)) > EPS * segments
    const jumps = this.#parts[chart].jumps[axis].filter(isNew)
    return jumps.length ? [...even, ...jumps].sort((p, q) => p - q) : even
  }

  /** Vertices along an edge, in the order in which they go round the chart: their parameters `us`, and `points`. */
  rim(side, counts) {
    const breaks = this.breaks(side, counts)
    const line = new RimLine(this.#corner(cornerOf(side, 0)))
    const addOwn = (stop) => {
      const first = line.end
      const own = breaks.filter((u) => u > first + EPS && u < stop - EPS)
      const v = this.#pointsAlong(side, own)
      own.forEach((u, k) => line.add(u, v, 9 * k))
    }
    for (const view of this.#seams.sides[side]) {
      addOwn(view.start)
      this.#addSeam(line, view, counts)
    }
    addOwn(1)
    line.add(1, this.#corner(cornerOf(side, 1)), 0)
    const { us, points } = line
    if (this.#seams.isPoint[side]) for (let k = 3; k < points.length; k++) points[k] = points[k - 3]
    if ((side & 3) < 2) return { us, points }
    return { us: us.reverse(), points: tabulate(us.length, () => points.splice(-3)).flat() }
  }

  /** Add the vertices of a seam that an edge sees. */
  #addSeam(line, view, counts) {
    const { seam, isOther, start, stop } = view
    const places = this.#seamBreaks(seam, counts)
    const reversed = isOther && seam.b0 > seam.b1
    const v = this.#pointsOnSeam(view, places, reversed)
    for (let k = 0; k < places.length; k++) {
      const n = reversed ? places.length - 1 - k : k
      const x = reversed ? 1 - places[n] : places[n]
      if (k || start > line.end + EPS) line.add(x === 1 ? stop : start + (stop - start) * x, v, 9 * n)
    }
  }

  /** Breaks of both sides, 0 to 1 along the seam. */
  #seamBreaks({ a, b, a0, a1, b0, b1 }, counts) {
    const breaks = []
    for (const [side, first, last] of [
      [a, a0, a1],
      [b, b0, b1],
    ]) {
      for (const u of this.breaks(side, counts)) breaks.push((u - first) / (last - first))
    }
    breaks.sort((p, q) => p - q)
    return [0, ...breaks.filter((x, k) => x > EPS && x < 1 - EPS && !(k && x - breaks[k - 1] < EPS)), 1]
  }

  /** Points of a seam as its side a has them, corners where they belong. */
  #pointsOnSeam({ seam, from, to }, places, reversed) {
    const { a, a0, a1 } = seam
    const v = this.#pointsAlong(a, places.map((x) => a0 + (a1 - a0) * x))
    ;[from, to].forEach((corners, k) => {
      const corner = Math.max(...corners)
      if (corner >= 0) v.set(this.#corner(corner), (k ? !reversed : reversed) ? v.length - 9 : 0)
    })
    return v
  }

  /** Points of a chart's edge at parameters of it, nine numbers each of which three are the point. */
  #pointsAlong(side, us) {
    const part = this.#parts[side >> 2]
    const at = [[0, 1, 1, 0][side & 3]]
    return side & 1 ? part.evaluate(us, at) : part.evaluate(at, us)
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
