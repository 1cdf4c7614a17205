/** How large a chart is and how much it bends, and how many segments that takes. */

import { basis, distance, evaluate, tabulate } from './bezier.js'
import { INACCURATE, slopeBounds, unitNormal } from './frames.js'

/** The most segments along an edge. */
export const MAX_SEGMENTS = 256

const SAMPLES = 8 // cells each way, or more
const LEAST = 3 // cells of a patch each way
const MARGIN = 1.2 // bends are sampled

/** A sphere round a chart, and about how much it bends along s and along t: {center, radius, bendS, bendT}. */
export function boundsOf(part) {
  const cells = part.axes.map(({ first, last }) => Math.max(LEAST, Math.ceil(SAMPLES / (last - first + 1))))
  const lengths = part.axes.map(({ low, high }) => high - low)
  const bends = [0, 0, 0] // by s, by t, and the twist, per chart
  const steps = [0, 0] // the largest cells, in shares of the chart
  const points = []
  for (const { patch, S, T } of part.samples(cells)) {
    const v = evaluate(patch, basis(patch.m, S.places), basis(patch.n, T.places))
    const size = [S, T].map(({ places }) => places[1] - places[0])
    size.forEach((step, k) => (steps[k] = Math.max(steps[k], step / lengths[k])))
    const [byS, byT, twist] = secondDerivatives(patch, v, cells[1] + 1, size)
    bends[0] = Math.max(bends[0], byS * lengths[0] ** 2)
    bends[1] = Math.max(bends[1], byT * lengths[1] ** 2)
    bends[2] = Math.max(bends[2], twist * lengths[0] * lengths[1])
    points.push(v)
  }
  const [bendS, bendT] = [0, 1].map((k) => MARGIN * (bends[k] + bends[2]))
  const { center, radius } = sphereRound(points)
  return { center, radius: radius + (bendS * steps[0] ** 2 + bendT * steps[1] ** 2) / 8, bendS, bendT }
}

/** Largest second derivatives by s, by t, and by both out of the surface, from a grid of samples `size` apart. */
function secondDerivatives(patch, v, columns, size) {
  const row = 9 * columns
  const normal = [0, 0, 0]
  const slopes = slopeBounds(patch)
  let [byS, byT, twist] = [0, 0, 0]
  for (let at = 0; at < v.length; at += 9) {
    if ((at + 9) % row) byT = Math.max(byT, distance(v, at + 6, v, at + 15))
    if (at + row >= v.length) continue
    byS = Math.max(byS, distance(v, at + 3, v, at + row + 3))
    if (!unitNormal(v, at, slopes, INACCURATE, normal, 0)) continue
    // Twist bends cells as well, but only out of the surface.
    const out = normal.reduce((sum, x, c) => sum + x * (v[at + row + 6 + c] - v[at + 6 + c]), 0)
    twist = Math.max(twist, Math.abs(out))
  }
  return [byS / size[0], byT / size[1], twist / size[0]]
}

/** A sphere round points that lie nine numbers apart in lists. */
function sphereRound(lists) {
  const box = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity]
  for (const v of lists) {
    for (let at = 0; at < v.length; at += 9) {
      for (let c = 0; c < 3; c++) {
        box[c] = Math.min(box[c], v[at + c])
        box[c + 3] = Math.max(box[c + 3], v[at + c])
      }
    }
  }
  const center = tabulate(3, (c) => (box[c] + box[c + 3]) / 2)
  let radius = 0
  for (const v of lists) for (let at = 0; at < v.length; at += 9) radius = Math.max(radius, distance(v, at, center, 0))
  return { center, radius }
}

/**
 * Segments along s and t with which a chart's chords stay within `errorPixels` of it: powers of two from 1 to 256.
 *
 * `bounds` is what `SurfaceMesher.bounds` returns; `pixelsPerUnit` how large the model's unit is on the screen there.
 */
export function countsFor({ bendS, bendT }, pixelsPerUnit, errorPixels) {
  // Half the error to either direction: in the middle of a cell they add up.
  return [bendS, bendT].map((bend) => {
    const wanted = Math.log2(Math.sqrt((bend * pixelsPerUnit) / (4 * errorPixels)) || 1)
    return 2 ** Math.ceil(Math.min(Math.max(wanted, 0), Math.log2(MAX_SEGMENTS)))
  })
}
