/** Edges of faces, 4·face + edge, with parameters from 0 to the face's columns (edges 0, 2) or rows (edges 1, 3). */

import { EPS } from './chart-part.js'

/** Of each edge of a patch, 4·patch + edge, whether it lies inside a face. */
export function edgesInside(faces, patchCount) {
  const inside = new Uint8Array(4 * patchCount)
  for (const { rows, columns, firstPatch } of faces) {
    for (let k = 0; k < rows * columns; k++) {
      const [row, column] = [Math.floor(k / columns), k % columns]
      inside.set([row > 0, column < columns - 1, row < rows - 1, column > 0], 4 * (firstPatch + k))
    }
  }
  return inside
}

/** A seam {a, b, a0, a1, b0, b1} as it is written: a ≤ b, a0 < a1, and a0 the lower end where a is b. */
export function orderedSeam(a, b, [a0, a1], [b0, b1]) {
  if (a < b || (a === b && a0 <= Math.min(b0, b1))) return { a, b, a0, a1, b0, b1 }
  if (b0 < b1) return { a: b, b: a, a0: b0, a1: b1, b0: a0, b1: a1 }
  return { a: b, b: a, a0: b1, a1: b0, b0: a1, b1: a0 }
}

/** Seams of patches' edges as seams of faces' edges, joined as far as one linear map goes. */
export function joinSeams(seams, faces) {
  const starts = faces.map(({ firstPatch }) => firstPatch)
  // Edge of the face, and where the patch's edge begins on it.
  const place = (e) => {
    const patch = e >> 2
    const face = lastUpTo(starts, patch)
    const { columns, firstPatch } = faces[face]
    const k = patch - firstPatch
    return [4 * face + (e & 3), e & 1 ? Math.floor(k / columns) : k % columns]
  }
  const found = []
  for (const { a, b, a0, a1, b0, b1 } of seams) {
    const [[one, m], [other, n]] = [place(a), place(b)]
    found.push(orderedSeam(one, other, [m + a0, m + a1], [n + b0, n + b1]))
  }
  found.sort((p, q) => p.a - q.a || p.a0 - q.a0)
  const joined = []
  for (const seam of found) {
    const last = joined.at(-1)
    if (last && goesOn(last, seam)) Object.assign(last, { a1: seam.a1, b1: seam.b1 })
    else joined.push(seam)
  }
  return joined
}

/** The place of the last of rising numbers that is at most x. */
function lastUpTo(numbers, x) {
  let [from, to] = [0, numbers.length]
  while (to - from > 1) {
    const middle = (from + to) >> 1
    if (numbers[middle] > x) to = middle
    else from = middle
  }
  return from
}

/** Whether seam q goes on where p ends, by the same map. */
function goesOn(p, q) {
  if (p.a !== q.a || p.b !== q.b || Math.abs(p.a1 - q.a0) > EPS || Math.abs(p.b1 - q.b0) > EPS) return false
  const [one, other] = [p, q].map(({ a0, a1, b0, b1 }) => (b1 - b0) / (a1 - a0))
  return Math.abs(one - other) <= EPS * Math.abs(one)
}
