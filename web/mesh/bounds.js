/** How large a chart is and how much it bends, and how many segments that takes. */

import { basisTable, distance, evaluate, range } from './bezier.js'
import { INACCURATE, slopeBounds, unitNormal } from './frames.js'

/** The most segments along an edge. */
export const MAX_SEGMENTS = 256

const SAMPLES = 8 // cells each way
const MARGIN = 1.2 // bends are sampled

/** A sphere round a patch, and about how much it bends along s and along t: {center, radius, bendS, bendT}. */
export function boundsOf(patch) {
  const v = evaluate(patch, basisTable(patch.m, SAMPLES, 0), basisTable(patch.n, SAMPLES, 0))
  const { bendS, bendT } = bendsOf(patch, v)
  const box = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity]
  for (let at = 0; at < v.length; at += 9) {
    for (let c = 0; c < 3; c++) {
      box[c] = Math.min(box[c], v[at + c])
      box[c + 3] = Math.max(box[c + 3], v[at + c])
    }
  }
  const center = range(3, (c) => (box[c] + box[c + 3]) / 2)
  let radius = 0
  for (let at = 0; at < v.length; at += 9) radius = Math.max(radius, distance(v, at, center, 0))
  return { center, radius: radius + (bendS + bendT) / (8 * SAMPLES ** 2), bendS, bendT }
}

function bendsOf(patch, v) {
  const row = 9 * (SAMPLES + 1)
  const normal = [0, 0, 0]
  const slopes = slopeBounds(patch)
  let [bendS, bendT, twist] = [0, 0, 0]
  for (let at = 0; at < v.length; at += 9) {
    if ((at + 9) % row) bendT = Math.max(bendT, distance(v, at + 6, v, at + 15))
    if (at + row >= v.length) continue
    bendS = Math.max(bendS, distance(v, at + 3, v, at + row + 3))
    if (!unitNormal(v, at, slopes, INACCURATE, normal, 0)) continue
    // Twist bends cells as well, but only out of the surface.
    const out = normal.reduce((sum, x, c) => sum + x * (v[at + row + 6 + c] - v[at + 6 + c]), 0)
    twist = Math.max(twist, Math.abs(out))
  }
  return { bendS: MARGIN * SAMPLES * (bendS + twist), bendT: MARGIN * SAMPLES * (bendT + twist) }
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
