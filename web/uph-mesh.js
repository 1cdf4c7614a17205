/**
 * Meshes of textured surfaces: rational Bézier patches to triangles, watertight however fine each chart is.
 *
 * Made for what `UphDecoder` gives, without dependencies; frames and numbers of edges are those of CONVENTIONS.md.
 * A chart is a rectangle of a face, across its patches: a grid inside and a ring of vertices round it. Along a seam of
 * two charts both rings have the breaks of either, at positions that one side gives to both; corners that touch share
 * one position.
 */

export { countsFor } from './mesh/bounds.js'
export { SurfaceMesher } from './mesh/mesher.js'
export { TriangleMesher } from './mesh/triangle-mesher.js'
