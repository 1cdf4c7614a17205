/** What lies beyond the edges of charts. */

/** Call take(n, m) for each of an edge's `count` texels that meets a seam, with the texel beyond, of `otherCount`. */
export function forEachAcross({ start, stop, otherStart, otherStop }, count, otherCount, take) {
  const slope = (otherStop - otherStart) / (stop - start)
  for (let n = Math.max(0, Math.ceil(start * count - 0.5)); n < count && (n + 0.5) / count < stop; n++) {
    const place = otherStart + slope * ((n + 0.5) / count - start)
    take(n, Math.min(otherCount - 1, Math.max(0, Math.floor(place * otherCount))))
  }
}
