/** Where edges of a surface's faces meet, or are a point [2]. Edges are numbered 4·face + edge. */

const MAX_SEAMS = 2 ** 20
const UNIT = 2 ** 30 // parts of a patch's edge

// Kinds of a seam: 0, or one of these; plus PARTIAL if it does not consist of complete edges.
const [OPPOSED, POINT, PARTIAL] = [1, 2, 3]

/**
 * Returns `shared`, seams {a, b, a0, a1, b0, b1}: the interval a0 < a1 of edge a meets b0 to b1 of edge b, the map linear;
 * and `points`, intervals {edge, low, high} that have collapsed.
 */
export function parseSeams(reader, faces) {
  const shared = []
  const points = []
  const taken = new Map()
  const parseInterval = (edge, isPartial) => {
    const { rows, columns } = faces[edge >> 2]
    const length = UNIT * (edge & 1 ? rows : columns)
    const low = isPartial ? reader.varint('where a seam begins', length - 1) : 0
    const high = isPartial ? low + reader.varint('extent of a seam', length - low, 1) : length
    if (!taken.has(edge)) taken.set(edge, [])
    taken.get(edge).push([low, high])
    return [low / UNIT, high / UNIT]
  }
  for (let left = reader.left ? reader.varint('number of seams', Math.min(MAX_SEAMS, reader.left), 1) : 0; left > 0; left--) {
    const code = reader.u8('kind of a seam', PARTIAL + POINT)
    const kind = code % PARTIAL
    const edges = (kind === POINT ? [0] : [0, 0]).map(() => reader.varint('edge of a face', 4 * faces.length - 1))
    const [[a0, a1], other] = edges.map((edge) => parseInterval(edge, code >= PARTIAL))
    if (kind === POINT) points.push({ edge: edges[0], low: a0, high: a1 })
    else {
      const [b0, b1] = kind === OPPOSED ? [other[1], other[0]] : other
      shared.push({ a: edges[0], b: edges[1], a0, a1, b0, b1 })
    }
  }
  for (const parts of taken.values()) {
    parts.sort(([p], [q]) => p - q)
    if (parts.some(([low], k) => k && parts[k - 1][1] > low)) reader.fail('seams overlap; allowed: one after the other along an edge')
  }
  return { shared, points }
}
