import type { Chart, Patch, Surface } from './uph.js'

/** A seam from the side of one chart's edge: an interval that coincides with one of another chart's edge (or of its own). */
export interface ChartSeam {
  /** 0 ≤ start < stop ≤ 1, in the edge's own parameter: t on edges 0 and 2, s on edges 1 and 3. */
  start: number
  stop: number
  chart: number
  edge: number
  /** Parameters there of start and stop, linear in between; otherStart > otherStop if it runs in the opposite direction. */
  otherStart: number
  otherStop: number
}

export interface Bounds {
  /** A sphere round the chart. */
  center: [number, number, number]
  radius: number
  /**
   * Upper estimates of |∂²S/∂s²| and |∂²S/∂t²|, the twist out of the surface included, with s and t from 0 to 1
   * over the chart: n segments along s have chords no farther than about bendS / (8·n²) from it.
   */
  bendS: number
  bendT: number
}

/** Triangles, counter-clockwise seen from outside. Where a chart crosses a crease, the normals are those after it. */
export interface ChartMesh {
  positions: Float32Array
  /** Of length 1; where an edge has collapsed to a point, the limit along the chart. */
  normals: Float32Array
  /** (x, y, z, w): where t, the texture's columns, grows; cross(normal, tangent)·w is up in the texture; w is 1. */
  tangents: Float32Array
  /** (s, t), from 0 to 1 over the chart: row 0 of its texels is at s = 0, column 0 at t = 0. */
  parameters: Float32Array
  indices: Uint16Array | Uint32Array
  /** The chart's edges as line segments: pairs of points, once around it. */
  outline: Float32Array
}

/**
 * Makes meshes of a surface's charts, each of any fineness. Along a seam both charts have the vertices of either, at
 * positions equal to the bit: there are no gaps, and the meshes of a closed surface are closed.
 */
export class SurfaceMesher {
  /** Data from `UphDecoder`. */
  constructor(surface: Surface, charts: readonly Chart[])
  /** The surface's patches, including those of a built-in one. */
  readonly patches: readonly Patch[]
  /** The seams of an edge of a chart, along it. Throws `RangeError` if there is no such chart. */
  seams(chart: number, edge: 0 | 1 | 2 | 3): ChartSeam[]
  /**
   * At each of `count` places along an edge, (n + ½)/count: the angle by which the tangents beyond it are turned against
   * the chart's own, about its normal; 0 at borders. Used for a normal map's gutter.
   */
  frameAngles(chart: number, edge: 0 | 1 | 2 | 3, count: number): Float32Array
  /** Position and bending of a chart, from samples. Throws `RangeError` if there is no such chart. */
  bounds(chart: number): Bounds
  /**
   * The mesh of a chart.
   *
   * `counts` holds two numbers for every chart of the surface, its segments along s and along t: 1 to 256, powers of
   * two to keep vertices along seams few. A chart gets at least 2, or 4 where it may close to a ring.
   * Borders of patches inside a chart are lines of the mesh where derivatives jump. A mesh changes with the counts of
   * its chart and of the adjacent charts. Throws `RangeError` if there is no such chart, or for a count outside its range.
   */
  mesh(chart: number, counts: ArrayLike<number>): ChartMesh
}

/**
 * Meshes of the charts of a mesh: its own triangles, with normals that are smooth but for creases of 40°. It has the
 * methods of `SurfaceMesher`; there are no seams to fill, and `counts` change nothing.
 */
export class TriangleMesher {
  /** Data from `UphDecoder`, with a surface of kind 'mesh'. */
  constructor(surface: Surface, charts: readonly Chart[])
  seams(chart: number, edge: 0 | 1 | 2 | 3): ChartSeam[]
  frameAngles(chart: number, edge: 0 | 1 | 2 | 3, count: number): Float32Array
  bounds(chart: number): Bounds
  mesh(chart: number): ChartMesh
  /** The triangles on no chart; null if there are none. */
  plainMesh(): ChartMesh | null
}

/**
 * Segments along s and t, powers of two from 1 to 256, with which the mesh stays within `errorPixels` of the surface.
 *
 * `pixelsPerUnit` is the size of the model's unit on the screen at the chart's nearest point.
 */
export function countsFor(
  bounds: Pick<Bounds, 'bendS' | 'bendT'>,
  pixelsPerUnit: number,
  errorPixels: number,
): [number, number]
