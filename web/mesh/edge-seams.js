/**
 * Seams between edges of patches: {a, b, a0, a1, b0, b1}, the interval a0 < a1 of edge a with b0 to b1 of edge b > a,
 * by a linear map, no farther apart than the tolerance. Where more than two edges lie in one place they are border.
 */

import { basisTable, distance, range } from './bezier.js'
import { EPS } from './chart-part.js'
import { PatchEdges } from './patch-edges.js'

const ALONE = -1
const CROWDED = -2

/**
 * Returns all seams of edges that do not lie inside a face, `inside`, and whether each edge is a point.
 *
 * Throws `RangeError` for patches that cannot be.
 */
export function findEdgeSeams(patches, inside, tolerance) {
  const edges = new PatchEdges(patches, tolerance)
  const live = range(edges.count, (e) => e).filter((e) => !edges.isPoint[e] && !inside[e])
  const { seams, partner } = findWholeSeams(edges, live)
  edges.steps = 0
  const lone = live.filter((e) => partner[e] === ALONE)
  return [[...seams, ...findPartialSeams(edges, lone)], edges.isPoint]
}

// ---------------------------------------------------------------- whole edges

/** Points in space, found by where they lie. */
class PointGrid {
  constructor(count, cellSize) {
    this.cellSize = cellSize
    this.heads = new Int32Array(2 ** Math.ceil(Math.log2(count))).fill(-1)
    this.next = new Int32Array(count)
  }

  #bucket(x, y, z) {
    return (Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791)) & (this.heads.length - 1)
  }

  add(e, point) {
    const home = this.#bucket(...point.slice(0, 3).map((x) => Math.floor(x / this.cellSize)))
    this.next[e] = this.heads[home]
    this.heads[home] = e
  }

  /** Call visit(e) for all that may be so near a point, until it returns false. */
  visitNear(point, reach, visit) {
    const corner = (more) => point.map((x) => Math.floor((x + more) / this.cellSize))
    const [first, last] = [corner(-reach), corner(reach)]
    for (let x = first[0]; x <= last[0]; x++) {
      for (let y = first[1]; y <= last[1]; y++) {
        for (let z = first[2]; z <= last[2]; z++) {
          for (let e = this.heads[this.#bucket(x, y, z)]; e >= 0; e = this.next[e]) if (!visit(e)) return
        }
      }
    }
  }
}

/** Seams of live edges that coincide from end to end, and of each edge its partner, `ALONE` or `CROWDED`. */
function findWholeSeams(edges, live) {
  const { count, tolerance } = edges
  const partner = new Int32Array(count).fill(ALONE)
  const seams = []
  // Edges that coincide have their middles in one place.
  const middles = range(count, () => null)
  const grid = new PointGrid(count, 8 * tolerance + edges.size * 1e-5 || 1)
  for (const e of live) {
    const curve = edges.curve(e)
    middles[e] = edges.point(curve, basisTable(curve.d, 8, 0), 4)
    const found = findCoincident(edges, e, middles, grid)
    grid.add(e, middles[e])
    if (!found.length) continue
    const { other, reversed } = found[0]
    if (found.length === 1 && partner[other] === ALONE) {
      partner[e] = other
      partner[other] = e
      seams.push({ a: other, b: e, a0: 0, a1: 1, b0: reversed ? 1 : 0, b1: reversed ? 0 : 1 })
    } else {
      for (const f of [e, ...found.flatMap((one) => [one.other, partner[one.other]])]) if (f >= 0) partner[f] = CROWDED
    }
  }
  return { seams: seams.filter(({ a }) => partner[a] >= 0), partner }
}

/** Up to two edges before e that coincide with it. */
function findCoincident(edges, e, middles, grid) {
  const { tolerance } = edges
  const found = []
  grid.visitNear(middles[e], tolerance, (other) => {
    if (found.length === 2 || edges.isExhausted) return false
    edges.steps++
    if (distance(middles[other], 0, middles[e], 0) > tolerance || found[0]?.other === other) return true
    const [straight, reversed] = [gapBetween(edges, e, other, false), gapBetween(edges, e, other, true)]
    if (Math.min(straight, reversed) <= tolerance) found.push({ other, reversed: reversed < straight })
    return true
  })
  return found
}

/** How far two edges are apart at nine places, or more than the tolerance. */
function gapBetween(edges, a, b, reversed) {
  const [one, other] = [edges.curve(a), edges.curve(b)]
  let most = 0
  for (let k = 0; k <= 8 && most <= edges.tolerance; k++) {
    const p = edges.point(one, basisTable(one.d, 8, 0), k)
    most = Math.max(most, distance(p, 0, edges.point(other, basisTable(other.d, 8, 0), reversed ? 8 - k : k), 0))
  }
  return most
}

// ---------------------------------------------------------------- parts of edges

/** Seams of edges that coincide in part. Their ends are ends of one edge or the other. */
function findPartialSeams(edges, lone) {
  const { low, high, tolerance, longestAxis: axis } = edges
  const seamsOf = new Map()
  lone.sort((e, f) => low[3 * e + axis] - low[3 * f + axis])
  for (let n = 0; n < lone.length; n++) {
    const a = lone[n]
    for (let k = n + 1; k < lone.length && !edges.isExhausted; k++) {
      const b = lone[k]
      edges.steps++
      if (low[3 * b + axis] > high[3 * a + axis] + 2 * tolerance) break
      if (edges.areApart(a, b)) continue
      const seam = longestCommonPart(edges, Math.min(a, b), Math.max(a, b))
      if (!seam) continue
      for (const e of [a, b]) {
        if (!seamsOf.has(e)) seamsOf.set(e, [])
        seamsOf.get(e).push(seam)
      }
    }
  }
  const dropped = new Set()
  for (const [e, seams] of seamsOf) dropOverlaps(edges, e, seams, dropped)
  return new Set([...seamsOf.values()].flat().filter((seam) => !dropped.has(seam)))
}

/** The longest part that edges a and b have in common, or null. */
function longestCommonPart(edges, a, b) {
  const [endsA, endsB] = [edges.ends(a), edges.ends(b)]
  const near = endsA.filter((p) => edges.boxHolds(b, p)).length + endsB.filter((p) => edges.boxHolds(a, p)).length
  if (near < 2) return null
  const hits = [] // parameters on a and on b of an end of either
  for (const k of [0, 1]) {
    const [u, v] = [project(edges, a, endsB[k]), project(edges, b, endsA[k])]
    if (u >= 0) hits.push([u, k])
    if (v >= 0) hits.push([k, v])
  }
  const parts = hits.flatMap((p) => hits.map((q) => [p, q]))
  parts.sort(([p, q], [r, s]) => s[0] - r[0] - (q[0] - p[0]))
  const [one, other] = [edges.curve(a), edges.curve(b)]
  for (const [[a0, b0], [a1, b1]] of parts) {
    if (a1 - a0 < EPS || Math.abs(b1 - b0) < EPS) continue
    const close = range(9, (k) => {
      const p = edges.pointAt(one, a0 + ((a1 - a0) * k) / 8)
      return distance(p, 0, edges.pointAt(other, b0 + ((b1 - b0) * k) / 8), 0) <= edges.tolerance
    })
    if (!close.includes(false)) return { a, b, a0, a1, b0, b1 }
  }
  return null
}

/** The parameter of the point of an edge where a target lies, or −1. */
function project(edges, e, target) {
  if (!edges.boxHolds(e, target)) return -1
  const curve = edges.curve(e)
  const [first, last] = edges.ends(e)
  const chord = distance(first, 0, last, 0)
  const guess = chord ? distance(first, 0, target, 0) / chord : 0
  let u = refineProjection(edges, curve, target, Math.min(guess, 1))
  if (u < 0) {
    // Not from there: from the nearest of many places, if that is near enough.
    const samples = range(33, (k) => edges.point(curve, basisTable(curve.d, 32, 0), k))
    const gaps = samples.map((p) => distance(p, 0, target, 0))
    const nearest = Math.min(...gaps)
    const spacing = Math.max(...range(32, (k) => distance(samples[k], 0, samples[k + 1], 0)))
    if (nearest > 2 * spacing + edges.tolerance) return -1
    u = refineProjection(edges, curve, target, gaps.indexOf(nearest) / 32)
  }
  // Halves and their like come out as they were meant, so that breaks of both sides can agree.
  const plain = Math.round(u * 2 ** 20) / 2 ** 20
  return Math.abs(u - plain) < 1e-10 ? plain : u
}

/** Newton's steps from u toward a target; −1 where they do not lead there. */
function refineProjection(edges, curve, target, u) {
  for (let k = 0, before = -1; k < 8 && u !== before; k++) {
    const [p, slope] = edges.slopeAt(curve, u)
    let [step, square] = [0, 0]
    for (let c = 0; c < 3; c++) {
      step += (target[c] - p[c]) * slope[c]
      square += slope[c] * slope[c]
    }
    before = u
    u = Math.min(Math.max(u + step / (square || 1), 0), 1)
  }
  return distance(edges.pointAt(curve, u), 0, target, 0) <= edges.tolerance ? u : -1
}

/** A loose tolerance lets seams along an edge overlap by about as much; what overlaps by more is dropped. */
function dropOverlaps(edges, e, seams, dropped) {
  const lowEnd = (seam) => (seam.a === e ? 'a0' : seam.b0 < seam.b1 ? 'b0' : 'b1')
  seams.sort((p, q) => p[lowEnd(p)] - q[lowEnd(q)])
  const curve = edges.curve(e)
  let covered = 0
  for (const seam of seams) {
    if (dropped.has(seam)) continue
    const start = seam[lowEnd(seam)]
    const stop = seam.a === e ? seam.a1 : Math.max(seam.b0, seam.b1)
    if (start < covered) {
      const overlap = distance(edges.pointAt(curve, start), 0, edges.pointAt(curve, covered), 0)
      if ((covered - start > EPS && overlap > 4 * edges.tolerance) || stop < covered + EPS) {
        dropped.add(seam)
        continue
      }
      seam[lowEnd(seam)] = covered
    }
    covered = stop
  }
}
