/** A texture with a gutter of one texel around it: RGBA, (height + 2) × (width + 2). */
export interface ChartTexture {
  height: number
  width: number
  data: Uint8Array
}

/** The model to write, as `uph-worker.js` makes it. */
export interface GlbModel {
  name: string
  charts: {
    /** Size of its textures, without gutters. */
    size: { height: number; width: number }
    geometry: {
      positions: Float32Array
      normals: Float32Array
      tangents: Float32Array
      /** s, t of each vertex on its chart, 0 to 1. */
      parameters: Float32Array
      indices: Uint16Array | Uint32Array
    }
    textures: { color?: ChartTexture; normal?: ChartTexture; surface?: ChartTexture; emission?: ChartTexture }
  }[]
  /** Triangles on no chart. */
  plain: { positions: Float32Array; normals: Float32Array; indices: Uint16Array | Uint32Array } | null
  /** Length of the model's unit; it is taken as a metre if it is not known. */
  metres?: number | null
  /** The colour of triangles on no chart, 0 to 1, sRGB. */
  mean: [number, number, number]
  roles: string[]
  alpha: 'opaque' | 'mask' | 'blend'
}

/** Write a model as GLB, textures as PNG; resolves with the file's bytes. `UphModel.glb()` calls it. */
export function writeGlb(model: GlbModel): Promise<Uint8Array<ArrayBuffer>>
