/** Seams between edges of charts, and which corners of charts lie in one place. */

import { EPS, findEdgeSeams } from './edge-seams.js'
import { range } from './bezier.js'

const DEFAULT_TOLERANCE = 1e-9

// Corners (0, 0), (0, 1), (1, 1), (1, 0) are 0 to 3: where edges begin and end.
const BEGIN = [0, 1, 3, 0]
const END = [1, 2, 2, 3]

/** The corner, 4·chart + corner, at which an edge, 4·chart + edge, has parameter u; −1 for none. */
export function cornerOf(side, u) {
  return u === 0 ? (side & -4) + BEGIN[side & 3] : u === 1 ? (side & -4) + END[side & 3] : -1
}

/** A seam as an edge of a chart sees it, and which corners lie where it begins and ends: of either chart, or −1. */
export function orientSeam({ a, b, a0, a1, b0, b1 }, side) {
  const low = [cornerOf(a, a0), cornerOf(b, b0)]
  const high = [cornerOf(a, a1), cornerOf(b, b1)]
  if (a === side) return { start: a0, stop: a1, other: b, otherStart: b0, otherStop: b1, from: low, to: high }
  if (b0 < b1) return { start: b0, stop: b1, other: a, otherStart: a0, otherStop: a1, from: low, to: high }
  return { start: b1, stop: b0, other: a, otherStart: a1, otherStop: a0, from: high, to: low }
}

/** Edges of charts along a line, {side, low, high}: sorted, and without those that overlap the one before. */
function withoutOverlaps(spans) {
  let covered = -1
  return spans
    .sort((p, q) => p.low - q.low)
    .filter(({ low, high }) => {
      const fits = low > covered - EPS * (high - low)
      if (fits) covered = high
      return fits
    })
}

/** The first of spans that ends behind x. */
function firstBehind(spans, x) {
  let [from, to] = [0, spans.length]
  while (from < to) {
    const middle = (from + to) >> 1
    if (spans[middle].high > x) to = middle
    else from = middle + 1
  }
  return from
}

/** Cut a seam of two lines along the charts' edges that lie on them, and call add(a, b, [a0, a1], [b0, b1]) for each piece. */
function cutSeam(ones, others, { a0, a1, b0, b1 }, add) {
  const slope = (a1 - a0) / (b1 - b0)
  const step = slope > 0 ? 1 : -1
  let i = firstBehind(ones, a0)
  let j = firstBehind(others, b0)
  if (step < 0 && !(others[j]?.low < b0)) j--
  const parameter = ({ low, high }, x) => {
    const u = (x - low) / (high - low)
    return u < EPS ? 0 : u > 1 - EPS ? 1 : u
  }
  while (i < ones.length && others[j]) {
    const [one, other] = [ones[i], others[j]]
    const ends = [other.low, other.high].map((y) => a0 + (y - b0) * slope)
    const low = Math.max(a0, one.low, Math.min(...ends))
    const high = Math.min(a1, one.high, Math.max(...ends))
    const u = [low, high].map((x) => parameter(one, x))
    const v = [low, high].map((x) => parameter(other, b0 + (x - a0) / slope))
    if (u[1] - u[0] > EPS && Math.abs(v[1] - v[0]) > EPS) add(one.side, other.side, u, v)
    if (low >= a1) return
    if (one.high < Math.max(...ends)) i++
    else j += step
  }
}

/** Per edge of a chart, 4·chart + edge: its seams along it. */
export class ChartSeams {
  #roots // per corner, 4·chart + corner, the corner that gives its position

  /** Throws `RangeError` for patches that cannot be. */
  constructor(patches, charts, tolerance = DEFAULT_TOLERANCE) {
    const [edgeSeams, isPoint] = findEdgeSeams(patches, tolerance)
    this.sides = range(4 * charts.length, () => [])
    /** Whether an edge of a chart is a point. */
    this.isPoint = new Uint8Array(4 * charts.length)
    this.#roots = Int32Array.from(range(4 * charts.length, (k) => k))
    const { borders, lines } = this.#collectSpans(charts, isPoint)
    const add = (a, b, [a0, a1], [b0, b1]) => {
      const seam = { a, b, a0, a1, b0, b1 }
      this.sides[a].push(seam)
      this.sides[b].push(seam)
    }
    const sorted = borders.map(withoutOverlaps)
    for (const seam of edgeSeams) cutSeam(sorted[seam.a], sorted[seam.b], seam, add)
    const straight = { a0: 0, a1: 1, b0: 0, b1: 1 }
    for (const [before, behind] of lines) cutSeam(withoutOverlaps(before), withoutOverlaps(behind), straight, add)
    this.sides.forEach((seams, side) => this.#joinCorners(seams, side))
    for (let k = 0; k < this.#roots.length; k++) this.#roots[k] = this.#root(k)
  }

  /** The corner that gives the position of a corner. */
  rootOf(corner) {
    return this.#roots[corner]
  }

  /** What of charts' edges lies along each edge of a patch, and on either side of each line across one. */
  #collectSpans(charts, isPoint) {
    const borders = range(isPoint.length, () => [])
    const lines = new Map()
    charts.forEach(({ patch, s0, s1, t0, t1 }, n) => {
      for (let k = 0; k < 4; k++) {
        const at = [s0, t1, s1, t0][k]
        const isBehind = k === 0 || k === 3 // the chart lies behind this line
        const side = 4 * n + k
        const span = { side, low: k & 1 ? s0 : t0, high: k & 1 ? s1 : t1 }
        if (at === (isBehind ? 0 : 1)) {
          borders[4 * patch + k].push(span)
          if (!isPoint[4 * patch + k]) continue
          this.isPoint[side] = 1
          this.#join(cornerOf(side, 0), cornerOf(side, 1))
        } else {
          const key = `${patch} ${k & 1} ${Math.round(at * 2 ** 30)}`
          if (!lines.has(key)) lines.set(key, [[], []])
          lines.get(key)[isBehind ? 1 : 0].push(span)
        }
      }
    })
    return { borders, lines: lines.values() }
  }

  /** Sort the seams of an edge along it, and join the corners that lie at their ends. */
  #joinCorners(seams, side) {
    seams.sort((p, q) => orientSeam(p, side).start - orientSeam(q, side).start)
    let before = null
    for (const seam of seams) {
      const { start, stop, from, to } = orientSeam(seam, side)
      for (const corners of [from, to]) if (Math.min(...corners) >= 0) this.#join(...corners)
      // Two that touch this edge at one point touch each other there.
      const touching = Math.max(...from)
      if (before && start - before.stop < EPS && Math.min(touching, before.corner) >= 0) {
        this.#join(touching, before.corner)
      }
      before = { stop, corner: Math.max(...to) }
    }
  }

  #root(k) {
    while (this.#roots[k] !== k) k = this.#roots[k] = this.#roots[this.#roots[k]]
    return k
  }

  #join(k, l) {
    const [p, q] = [this.#root(k), this.#root(l)]
    this.#roots[Math.max(p, q)] = Math.min(p, q)
  }
}
