/** What the decoder knows of maps, and how much. */

/** Share of the exemplar's coefficients that are known. */
export function knownShare(decoder) {
  const { known, count } = decoder.coefficients()
  return known / Math.max(1, count)
}

/** Whether something of a map is known: a normal map of which nothing is known would be no normals at all. */
export function hasMap(decoder, role) {
  const { known, complete } = decoder.coefficients(role)
  return role === 'albedo' || known > 0 || complete
}
