/** Meshes of the charts of a triangle mesh: its own triangles, with smooth normals and tangents along the texture. */

import { creasedNormals } from './smooth-normals.js'

const LOOKED_AT = 16 // vertices of a chart at one place

/** What `SurfaceMesher` is for patches; it takes `counts` as well, and makes nothing of them. */
export class TriangleMesher {
  #surface
  #charts
  #normals // of corners
  #triangles // per chart, and of none: numbers of triangles

  constructor(surface, charts) {
    this.#surface = surface
    this.#charts = charts
    this.#normals = creasedNormals(surface)
    this.#triangles = trianglesOf(surface, charts)
  }

  seams() {
    return [] // charts reach beyond their islands: nothing is missing there
  }

  frameAngles(chart, edge, count) {
    return new Float32Array(count)
  }

  bounds(chart) {
    const { positions, triangles } = this.#surface
    const low = [Infinity, Infinity, Infinity]
    const high = [-Infinity, -Infinity, -Infinity]
    for (const t of this.#triangles[chart]) {
      for (let n = 0; n < 9; n++) {
        const x = positions[3 * triangles[3 * t + Math.floor(n / 3)] + (n % 3)]
        low[n % 3] = Math.min(low[n % 3], x)
        high[n % 3] = Math.max(high[n % 3], x)
      }
    }
    if (!this.#triangles[chart].length) return { center: [0, 0, 0], radius: 0, bendS: 0, bendT: 0 }
    const center = low.map((x, k) => (x + high[k]) / 2)
    return { center, radius: Math.hypot(...low.map((x, k) => high[k] - x)) / 2, bendS: 0, bendT: 0 }
  }

  mesh(chart) {
    return this.#meshOf(this.#triangles[chart], this.#charts[chart])
  }

  /** The triangles that lie on no chart; null where there are none. */
  plainMesh() {
    const left = this.#triangles.at(-1)
    return left.length ? this.#meshOf(left, { s0: 0, s1: 1, t0: 0, t1: 1 }) : null
  }

  #meshOf(own, chart) {
    const { triangles, positions, seams } = this.#surface
    const made = new VertexMaker(this.#surface, this.#normals, chart, own.length)
    const outline = []
    own.forEach((t, n) => {
      for (let k = 0; k < 3; k++) {
        const corner = 3 * t + k
        made.indices[3 * n + k] = made.vertexOf(corner)
        if (!seams[corner]) continue
        for (const vertex of [triangles[corner], triangles[3 * t + ((k + 1) % 3)]]) {
          outline.push(...positions.subarray(3 * vertex, 3 * vertex + 3))
        }
      }
    })
    return { ...made.finish(), outline: Float32Array.from(outline) }
  }
}

/** Makes the vertices of a chart: one for all corners of one place, parameters and normal. */
class VertexMaker {
  #surface
  #normals
  #chart
  #first = new Map() // of each vertex of the mesh, the latest of its own here
  #before = []
  #corners = []
  #tangents = []

  constructor(surface, normals, chart, count) {
    this.#surface = surface
    this.#normals = normals
    this.#chart = chart
    this.indices = new Uint32Array(3 * count)
  }

  vertexOf(corner) {
    const vertex = this.#surface.triangles[corner]
    let found = this.#first.get(vertex) ?? -1
    for (let n = 0; n < LOOKED_AT && found >= 0; n++) {
      if (this.#isSame(corner, this.#corners[found])) break
      found = n === LOOKED_AT - 1 ? -1 : this.#before[found]
    }
    if (found < 0) {
      found = this.#corners.length
      this.#corners.push(corner)
      this.#before.push(this.#first.get(vertex) ?? -1)
      this.#first.set(vertex, found)
      this.#tangents.push(0, 0, 0)
    }
    this.#addTangent(corner, found)
    return found
  }

  #isSame(a, b) {
    const { parameters: q } = this.#surface
    const n = this.#normals
    const apart = [0, 1, 2].some((k) => n[3 * a + k] !== n[3 * b + k])
    return !apart && q[2 * a] === q[2 * b] && q[2 * a + 1] === q[2 * b + 1]
  }

  /** Add where t grows on a corner's triangle. */
  #addTangent(corner, at) {
    const { triangles, positions: p, parameters: q } = this.#surface
    const [a, b, c] = [0, 1, 2].map((k) => corner - (corner % 3) + k)
    const [s1, t1] = [q[2 * b] - q[2 * a], q[2 * b + 1] - q[2 * a + 1]]
    const [s2, t2] = [q[2 * c] - q[2 * a], q[2 * c + 1] - q[2 * a + 1]]
    const sign = Math.sign(s1 * t2 - t1 * s2)
    for (let k = 0; k < 3; k++) {
      const [x, y, z] = [a, b, c].map((n) => p[3 * triangles[n] + k])
      this.#tangents[3 * at + k] += sign * (s1 * (z - x) - s2 * (y - x))
    }
  }

  finish() {
    const { triangles, positions: p, parameters: q } = this.#surface
    const { s0, s1, t0, t1 } = this.#chart
    const count = this.#corners.length
    const positions = new Float32Array(3 * count)
    const normals = new Float32Array(3 * count)
    const tangents = new Float32Array(4 * count)
    const parameters = new Float32Array(2 * count)
    this.#corners.forEach((corner, n) => {
      const vertex = triangles[corner]
      positions.set(p.subarray(3 * vertex, 3 * vertex + 3), 3 * n)
      const normal = this.#normals.subarray(3 * corner, 3 * corner + 3)
      normals.set(normal, 3 * n)
      tangents.set([...upright(this.#tangents.slice(3 * n, 3 * n + 3), normal), 1], 4 * n)
      parameters[2 * n] = (q[2 * corner] - s0) / (s1 - s0)
      parameters[2 * n + 1] = (q[2 * corner + 1] - t0) / (t1 - t0)
    })
    return { positions, normals, tangents, parameters, indices: this.indices }
  }
}

/** A unit tangent, upright to a normal; any one where there is none. */
function upright(v, normal) {
  for (const tangent of [v, [1, 0, 0], [0, 1, 0]]) {
    const along = tangent.reduce((sum, x, k) => sum + x * normal[k], 0)
    const out = tangent.map((x, k) => x - along * normal[k])
    const length = Math.hypot(...out)
    if (length > 1e-6 * Math.hypot(...tangent)) return out.map((x) => x / length)
  }
  return [1, 0, 0]
}

/** The triangles of each chart, and last those of none. */
function trianglesOf({ island, parameters, faces }, charts) {
  const byIsland = faces.map(() => [])
  charts.forEach(({ face }, n) => byIsland[face].push(n))
  const found = [...charts.map(() => []), []]
  island.forEach((face, t) => {
    const own = face < 0 ? [] : byIsland[face]
    const middle = [0, 1].map((j) => (parameters[6 * t + j] + parameters[6 * t + 2 + j] + parameters[6 * t + 4 + j]) / 3)
    const holds = ({ s0, s1, t0, t1 }) => middle[0] >= s0 && middle[0] < s1 && middle[1] >= t0 && middle[1] < t1
    const at = own.length > 1 ? own.find((n) => holds(charts[n])) : own[0]
    found[at ?? charts.length].push(t)
  })
  return found
}
