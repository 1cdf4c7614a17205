/** Normals of a triangle mesh: smooth, but for creases. */

const CREASE = Math.cos((40 * Math.PI) / 180)
const MANY = 32 // triangles at a vertex, from which on no creases are looked for

/** The unit normal of each corner: the mean, by area, of those triangles at its vertex that lean less than a crease. */
export function creasedNormals({ positions, triangles }) {
  const flat = flatNormals(positions, triangles)
  const { first, next, degrees } = cornersOfVertices(triangles, positions.length / 3)
  const out = new Float32Array(3 * triangles.length)
  const around = sumsAround(flat, triangles, positions.length / 3)
  for (let corner = 0; corner < triangles.length; corner++) {
    const vertex = triangles[corner]
    const own = 4 * Math.floor(corner / 3)
    const sum = [0, 0, 0]
    if (degrees[vertex] > MANY) sum.forEach((_, k) => (sum[k] = around[3 * vertex + k]))
    else {
      for (let other = first[vertex]; other >= 0; other = next[other]) {
        const at = 4 * Math.floor(other / 3)
        const cosine = flat[own] * flat[at] + flat[own + 1] * flat[at + 1] + flat[own + 2] * flat[at + 2]
        if (at !== own && cosine < CREASE) continue
        for (let k = 0; k < 3; k++) sum[k] += flat[at + k] * flat[at + 3]
      }
    }
    const length = Math.hypot(...sum)
    for (let k = 0; k < 3; k++) out[3 * corner + k] = length > 0 ? sum[k] / length : k === 2 ? 1 : 0
  }
  return out
}

/** Per triangle its unit normal and twice its area. */
function flatNormals(p, triangles) {
  const out = new Float64Array((4 * triangles.length) / 3)
  for (let t = 0; t < triangles.length / 3; t++) {
    const [a, b, c] = [0, 1, 2].map((k) => 3 * triangles[3 * t + k])
    const u = [0, 1, 2].map((k) => p[b + k] - p[a + k])
    const v = [0, 1, 2].map((k) => p[c + k] - p[a + k])
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    const length = Math.hypot(...n)
    if (length > 0) out.set([n[0] / length, n[1] / length, n[2] / length, length], 4 * t)
  }
  return out
}

/** The corners of each vertex as a list: its first, each one's next, and how many. */
function cornersOfVertices(triangles, count) {
  const first = new Int32Array(count).fill(-1)
  const next = new Int32Array(triangles.length)
  const degrees = new Uint32Array(count)
  triangles.forEach((vertex, corner) => {
    next[corner] = first[vertex]
    first[vertex] = corner
    degrees[vertex]++
  })
  return { first, next, degrees }
}

/** Normals by area, summed at each vertex. */
function sumsAround(flat, triangles, count) {
  const out = new Float64Array(3 * count)
  triangles.forEach((vertex, corner) => {
    const at = 4 * Math.floor(corner / 3)
    for (let k = 0; k < 3; k++) out[3 * vertex + k] += flat[at + k] * flat[at + 3]
  })
  return out
}
