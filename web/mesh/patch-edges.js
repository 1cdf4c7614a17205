/** The edges of patches as curves in space, numbered 4·patch + edge: what seams are looked for among. */

import { basis, basisTable, distance, range } from './bezier.js'

const LARGEST = 1e30
const LOOSEST = 0.01 // the largest tolerance, relative to the size
const AXES = [0, 1, 2]

/** An edge as a curve of degree d: where its first control point lies in the net, and the step to the next. */
function curveOf({ m, n, net }, edge) {
  const down = edge & 1
  return { net, d: down ? m : n, start: 4 * [0, n, m * (n + 1), 0][edge], step: down ? 4 * (n + 1) : 4 }
}

/** Curves, boxes and end points of all edges. Throws `RangeError` for patches that cannot be. */
export class PatchEdges {
  /** `tolerance` is relative to the size of the box round all control points. */
  constructor(patches, tolerance) {
    this.patches = patches
    this.count = 4 * patches.length
    this.low = new Float64Array(3 * this.count).fill(Infinity)
    this.high = new Float64Array(3 * this.count).fill(-Infinity)
    this.box = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity]
    patches.forEach((patch, p) => this.#measure(patch, p))
    this.size = distance(this.box, 0, this.box, 3)
    this.tolerance = Math.min(Math.max(tolerance, 0), LOOSEST) * this.size
    /** Whether an edge has collapsed to a point. */
    this.isPoint = Uint8Array.from(
      range(this.count, (e) => distance(this.low, 3 * e, this.high, 3 * e) <= this.tolerance),
    )
    // Nets made to be slow to search are not searched to the end: what is left counts as border.
    this.steps = 0
    this.maxSteps = 1e7 + 500 * this.count
  }

  /** Extend the box, and those of a patch's edges, by its control points. */
  #measure({ m, n, net }, p) {
    const { low, high, box } = this
    for (let k = 0; k < net.length; k += 4) {
      const [i, j] = [Math.floor(k / 4 / (n + 1)), (k / 4) % (n + 1)]
      const weight = net[k + 3]
      for (let c = 0; c < 3; c++) {
        const x = net[k + c] / weight
        if (!(weight >= 1 / LARGEST && weight <= LARGEST && Math.abs(net[k + c]) <= LARGEST)) {
          throw new RangeError(
            `patch ${p}: control point [${i}, ${j}] is outside the limits; ` +
              `allowed: weights ${1 / LARGEST} to ${LARGEST}, coordinates times weight up to ${LARGEST}`,
          )
        }
        box[c] = Math.min(box[c], x)
        box[c + 3] = Math.max(box[c + 3], x)
        for (let e = 0; e < 4; e++) {
          if ((e & 1 ? j : i) !== [0, n, m, 0][e]) continue
          const at = 3 * (4 * p + e) + c
          low[at] = Math.min(low[at], x)
          high[at] = Math.max(high[at], x)
        }
      }
    }
  }

  /** Whether the search has taken too long. */
  get isExhausted() {
    return this.steps >= this.maxSteps
  }

  curve(e) {
    return curveOf(this.patches[e >> 2], e & 3)
  }

  /** The ends of an edge. */
  ends(e) {
    const curve = this.curve(e)
    return [0, 1].map((k) => this.point(curve, basisTable(curve.d, 1, 0), k))
  }

  /** The point of a curve for entry k of a basis. */
  point({ net, d, start, step }, { values }, k) {
    this.steps += 16 + 4 * d
    const h = [0, 0, 0, 0]
    for (let i = 0, b = k * (d + 1), p = start; i <= d; i++, b++, p += step) {
      for (let c = 0; c < 4; c++) h[c] += values[b] * net[p + c]
    }
    for (let c = 0; c < 3; c++) h[c] /= h[3]
    return h
  }

  /** The point of a curve at parameter u. */
  pointAt(curve, u) {
    this.steps += 4 * curve.d ** 2
    return this.point(curve, basis(curve.d, [u]), 0)
  }

  /** The same with the derivative there: [point, slope]. */
  slopeAt(curve, u) {
    this.steps += 4 * curve.d ** 2
    const { net, d, start, step } = curve
    const table = basis(d, [u])
    const point = this.point(curve, table, 0)
    const slope = [0, 0, 0, 0]
    for (let i = 0, p = start; i <= d; i++, p += step) {
      for (let c = 0; c < 4; c++) slope[c] += table.slopes[i] * net[p + c]
    }
    for (let c = 0; c < 3; c++) slope[c] = (slope[c] - point[c] * slope[3]) / point[3]
    return [point, slope]
  }

  /** Whether a point lies in the box of an edge, or nearly so. */
  boxHolds(e, point) {
    const { low, high, tolerance } = this
    return AXES.every((c) => point[c] >= low[3 * e + c] - tolerance && point[c] <= high[3 * e + c] + tolerance)
  }

  /** Whether the boxes of two edges are farther apart than the tolerance. */
  areApart(a, b) {
    const { low, high, tolerance } = this
    return AXES.some((c) => {
      const gap = Math.max(low[3 * a + c], low[3 * b + c]) - Math.min(high[3 * a + c], high[3 * b + c])
      return gap > 2 * tolerance
    })
  }

  /** The axis along which the patches reach farthest. */
  get longestAxis() {
    const extent = (c) => this.box[c + 3] - this.box[c]
    return [...AXES].sort((p, q) => extent(q) - extent(p))[0]
  }
}
