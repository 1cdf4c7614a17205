/** Seams between edges of charts, and which corners of charts lie in one place. */

import { tabulate } from './bezier.js'
import { EPS } from './chart-part.js'

const LINES = 2 ** 30 // parameters that agree to this part of 1 are one line

// Corners (0, 0), (0, 1), (1, 1), (1, 0) are 0 to 3: where edges begin and end.
const BEGIN = [0, 1, 3, 0]
const END = [1, 2, 2, 3]

/** The corner, 4·chart + corner, at which an edge, 4·chart + edge, has parameter u; −1 for none. */
export function cornerOf(side, u) {
  return u === 0 ? (side & -4) + BEGIN[side & 3] : u === 1 ? (side & -4) + END[side & 3] : -1
}

/** A seam {a, b, a0, a1, b0, b1} as it is written: a ≤ b, a0 < a1, and a0 the lower end where a is b. */
function orderedSeam(a, b, [a0, a1], [b0, b1]) {
  if (a < b || (a === b && a0 <= Math.min(b0, b1))) return { a, b, a0, a1, b0, b1 }
  if (b0 < b1) return { a: b, b: a, a0: b0, a1: b1, b0: a0, b1: a1 }
  return { a: b, b: a, a0: b1, a1: b0, b0: a1, b1: a0 }
}

/**
 * A seam as its edge a sees it, and as its edge b does: {seam, isOther, start, stop, other, otherStart, otherStop}, and
 * `from` and `to`, which corners lie where it begins and ends: of either chart, or −1.
 */
function viewsOf(seam) {
  const { a, b, a0, a1, b0, b1 } = seam
  const low = [cornerOf(a, a0), cornerOf(b, b0)]
  const high = [cornerOf(a, a1), cornerOf(b, b1)]
  const one = { start: a0, stop: a1, other: b, otherStart: b0, otherStop: b1, from: low, to: high }
  const two =
    b0 < b1
      ? { start: b0, stop: b1, other: a, otherStart: a0, otherStop: a1, from: low, to: high }
      : { start: b1, stop: b0, other: a, otherStart: a1, otherStop: a0, from: high, to: low }
  return [
    { seam, isOther: false, ...one },
    { seam, isOther: true, ...two },
  ]
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

/** The first of the spans that end after x. */
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

  constructor({ faces, shared, points }, charts) {
    /** Views of seams. */
    this.sides = tabulate(4 * charts.length, () => [])
    /** Whether an edge of a chart is a point. */
    this.isPoint = new Uint8Array(4 * charts.length)
    /** Whether a chart meets itself. */
    this.meetsItself = new Uint8Array(charts.length)
    this.#roots = Int32Array.from(tabulate(4 * charts.length, (k) => k))
    const { borders, lines } = collectSpans(faces, charts)
    const add = (a, b, u, v) => {
      const seam = orderedSeam(a, b, u, v)
      const [one, other] = viewsOf(seam)
      this.sides[seam.a].push(one)
      this.sides[seam.b].push(other)
      if (a >> 2 === b >> 2) this.meetsItself[a >> 2] = 1
    }
    const sorted = borders.map(withoutOverlaps)
    for (const point of points) this.#markPoints(sorted[point.edge], point)
    for (const seam of shared) cutSeam(sorted[seam.a], sorted[seam.b], seam, add)
    for (const { before, after, length } of lines) {
      const straight = { a0: 0, a1: length, b0: 0, b1: length }
      cutSeam(withoutOverlaps(before), withoutOverlaps(after), straight, add)
    }
    for (const views of this.sides) this.#joinCorners(views)
    for (let k = 0; k < this.#roots.length; k++) this.#roots[k] = this.#root(k)
  }

  /** The corner that gives the position of a corner. */
  rootOf(corner) {
    return this.#roots[corner]
  }

  /** Mark the charts' edges that lie where an edge of a face has collapsed. */
  #markPoints(spans, { low, high }) {
    for (let k = firstBehind(spans, low); k < spans.length && spans[k].high <= high + EPS; k++) {
      const span = spans[k]
      if (span.low < low - EPS) continue
      this.isPoint[span.side] = 1
      this.#join(cornerOf(span.side, 0), cornerOf(span.side, 1))
    }
  }

  /** Sort the seams of an edge along it, and join the corners that lie at their ends. */
  #joinCorners(views) {
    views.sort((p, q) => p.start - q.start)
    let before = null
    for (const { start, stop, from, to } of views) {
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

/** What of charts' edges lies along each edge of a face, and on either side of each line across one. */
function collectSpans(faces, charts) {
  const borders = tabulate(4 * faces.length, () => [])
  const lines = new Map()
  charts.forEach(({ face, s0, s1, t0, t1 }, n) => {
    const { rows, columns } = faces[face]
    for (let k = 0; k < 4; k++) {
      const isAfter = k === 0 || k === 3 // the chart is after this line
      const at = Math.round([s0, t1, s1, t0][k] * LINES)
      const span = { side: 4 * n + k, low: k & 1 ? s0 : t0, high: k & 1 ? s1 : t1 }
      if (at === [0, columns, rows, 0][k] * LINES) borders[4 * face + k].push(span)
      else {
        const key = `${face} ${k & 1} ${at}`
        if (!lines.has(key)) lines.set(key, { before: [], after: [], length: k & 1 ? rows : columns })
        lines.get(key)[isAfter ? 'after' : 'before'].push(span)
      }
    }
  })
  return { borders, lines: lines.values() }
}
