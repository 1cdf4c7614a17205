/** Meshes of charts: a grid inside, and a ring of vertices round it. */

import { distance, tabulate } from './bezier.js'
import { boundsOf } from './bounds.js'
import { builtInPatches } from './built-in.js'
import { ChartPart } from './chart-part.js'
import { ChartSeams } from './chart-seams.js'
import { writeFrames } from './frames.js'
import { RimMaker } from './rim.js'

/** Makes meshes of a surface's charts; see `uph-mesh.d.ts`. */
export class SurfaceMesher {
  #parts // of faces, one per chart
  #seams
  #rims

  constructor(surface, charts) {
    this.patches = surface.patches ?? builtInPatches(surface.kind, surface.params)
    this.#parts = charts.map((chart) => new ChartPart(this.patches, surface.faces[chart.face], chart))
    this.#seams = new ChartSeams(surface, charts)
    this.#rims = new RimMaker(this.#parts, this.#seams)
  }

  /** The seams along an edge of a chart; the maps between both sides are linear. */
  seams(chart, edge) {
    const side = 4 * this.#checked(chart) + edge
    return (this.#seams.sides[side] ?? []).map(({ start, stop, other, otherStart, otherStop }) => {
      return { start, stop, chart: other >> 2, edge: other & 3, otherStart, otherStop }
    })
  }

  /** A sphere round a chart, and about how much it bends along s and along t. */
  bounds(chart) {
    return boundsOf(this.#parts[this.#checked(chart)])
  }

  /** At each of `count` texels along an edge: the angle by which the tangents beyond it are turned against the chart's. */
  frameAngles(chart, edge, count) {
    const angles = new Float32Array(count)
    for (const seam of this.seams(chart, edge)) {
      const { start, stop, otherStart, otherStop } = seam
      const places = tabulate(count, (n) => (n + 0.5) / count).filter((u) => u >= start && u < stop)
      const slope = (otherStop - otherStart) / (stop - start)
      const across = places.map((u) => Math.min(1, Math.max(0, otherStart + slope * (u - start))))
      const own = this.#framesAlong(chart, edge, places)
      const other = this.#framesAlong(seam.chart, seam.edge, across)
      places.forEach((u, k) => {
        const [nx, ny, nz] = own.normals.subarray(3 * k)
        const [x, y, z] = own.tangents.subarray(4 * k)
        const [tx, ty, tz] = other.tangents.subarray(4 * k)
        const up = tx * (ny * z - nz * y) + ty * (nz * x - nx * z) + tz * (nx * y - ny * x)
        angles[Math.round(u * count - 0.5)] = Math.atan2(up, tx * x + ty * y + tz * z)
      })
    }
    return angles
  }

  /** The mesh of a chart; `counts` are the segments along s and along t of every chart. */
  mesh(chart, counts) {
    const part = this.#parts[this.#checked(chart)]
    const rows = this.#rims.breaks(4 * chart + 1, counts)
    const columns = this.#rims.breaks(4 * chart, counts)
    return meshOf(part, rows, columns, tabulate(4, (k) => this.#rims.rim(4 * chart + k, counts)))
  }

  #checked(chart) {
    if (!this.#parts[chart]) throw new RangeError(`chart is ${chart}; allowed: 0 to ${this.#parts.length - 1}`)
    return chart
  }

  /** Normals and tangents at parameters of a chart's edge. */
  #framesAlong(chart, edge, us) {
    const names = { positions: 3, normals: 3, tangents: 4, parameters: 2 }
    const found = Object.fromEntries(Object.entries(names).map(([name, k]) => [name, new Float32Array(k * us.length)]))
    const at = [edge === 1 || edge === 2 ? 1 : 0]
    const [S, T] = edge & 1 ? [us, at] : [at, us]
    writeFrames(this.#parts[chart], S, T, found, 0)
    return found
  }
}

/** The mesh of a chart's part of a face: a grid with lines at `rows` and `columns`, and a rim for each of the edges. */
function meshOf(part, rows, columns, rims) {
  const inner = (rows.length - 2) * (columns.length - 2)
  const round = rims.reduce((sum, { us }) => sum + us.length - 1, 0)
  const size = inner + round
  const mesh = {
    positions: new Float32Array(3 * size),
    normals: new Float32Array(3 * size),
    tangents: new Float32Array(4 * size),
    parameters: new Float32Array(2 * size),
    indices: new (size > 65535 ? Uint32Array : Uint16Array)(6 * (inner - 1) + 3 * round),
    outline: new Float32Array(6 * round),
  }
  writeFrames(part, rows.slice(1, -1), columns.slice(1, -1), mesh, 0)
  // Round the chart from corner to corner, what lies inside to the right.
  let start = inner
  rims.forEach(({ us, points }, k) => {
    const places = us.slice(0, -1)
    writeFrames(part, k & 1 ? places : [k / 2], k & 1 ? [k === 1 ? 1 : 0] : places, mesh, start)
    mesh.positions.set(points.slice(0, -3), 3 * start)
    start += places.length
  })
  const triangles = new TriangleWriter(mesh)
  writeGridTriangles(triangles, rows.length - 2, columns.length - 2)
  writeRimTriangles(triangles, rows, columns, rims, inner, round)
  mesh.indices = mesh.indices.slice(0, triangles.count)
  for (let k = 0; k < 2 * round; k++) {
    const from = 3 * (inner + (((k + 1) >> 1) % round))
    for (let c = 0; c < 3; c++) mesh.outline[3 * k + c] = mesh.positions[from + c]
  }
  return mesh
}

class TriangleWriter {
  constructor({ positions, indices }) {
    this.positions = positions
    this.indices = indices
    this.count = 0
  }

  add(a, b, c) {
    this.indices[this.count++] = a
    this.indices[this.count++] = b
    this.indices[this.count++] = c
  }

  /** Add a triangle unless two of its corners lie in one place. */
  addIfAny(a, b, c) {
    const areApart = (p, q) => distance(this.positions, 3 * p, this.positions, 3 * q) > 0
    if (areApart(a, b) && areApart(b, c) && areApart(c, a)) this.add(a, b, c)
  }
}

function writeGridTriangles(triangles, tall, wide) {
  for (let i = 0; i < tall - 1; i++) {
    for (let j = 0, a = i * wide; j < wide - 1; j++, a++) {
      triangles.add(a, a + wide, a + wide + 1)
      triangles.add(a, a + wide + 1, a + 1)
    }
  }
}

/** Triangles between each edge and the first line of the grid: always to what lies less far ahead. */
function writeRimTriangles(triangles, rows, columns, rims, inner, round) {
  const wide = columns.length - 2
  let start = 0
  rims.forEach(({ us }, k) => {
    const breaks = k & 1 ? rows : columns
    const last = breaks.length - 2
    const [first, step] = [[0, 1], [wide - 1, wide], [inner - 1, -1], [inner - wide, -wide]][k]
    const outer = (i) => inner + ((start + i) % round)
    const ahead = (u) => (k > 1 ? 1 - u : u)
    const line = (j) => ahead(breaks[k > 1 ? last + 1 - j : j])
    for (let i = 0, j = 1; i < us.length - 1 || j < last; ) {
      const a = outer(i)
      const b = first + step * (j - 1)
      const takesOuter =
        i < us.length - 1 && (j === last || ahead(us[i]) + ahead(us[i + 1]) <= line(j) + line(j + 1))
      triangles.addIfAny(a, b, takesOuter ? outer(++i) : first + step * j++)
    }
    start += us.length - 1
  })
}
