import type { Group, LineBasicMaterial, LineSegments, BufferGeometry, Loader, LoadingManager, Object3DEventMap, Sphere } from 'three'
import type { Limits } from './uph.js'

export interface UphProgress {
  received: number
  /** Length of the whole stream; null before its header has arrived. */
  total: number | null
  /** The same as `received`, under the name in three.js' loaders. */
  loaded: number
}

/** The event of three.js' loaders, with `total` 0 before the header has arrived; and `received`, the same as `loaded`. */
export interface UphLoadEvent extends ProgressEvent {
  readonly received: number
}

export interface UphModelEvents extends Object3DEventMap {
  progress: UphProgress
  /** There are other meshes: first of a base, a coarse mesh, then of the charts. */
  surface: object
  /** There is a textured picture. */
  first: object
  /** Textures have improved, or the limit has changed. */
  refine: object
  /** Charts were tessellated again. */
  geometry: object
  /** All bytes have arrived, and are shown. */
  complete: object
  /** The connection was lost; the loader tries again. */
  stalled: { attempt: number; message: string }
  resumed: object
  /** One line; `offset` is the byte where a damaged stream fails. What is shown stays. */
  error: { error: Error & { offset?: number } }
}

/** Loads `.uph` streams like three.js' loaders; the model refines further while bytes arrive. */
export class UphLoader extends Loader<UphModel> {
  constructor(manager?: LoadingManager)
  /** Largest side of a texture in texels; charts that are larger get fewer texels. 4096 by default. */
  maxTextureSize: number
  /** Texels of all charts together, 2^26 by default; models with more are shown at half the size, or a quarter. */
  maxTexels: number
  /** Largest distance of the mesh from the surface, in pixels. 0.4 by default. */
  errorPixels: number
  /** Limits of a stream's demands; a stream that exceeds one is refused. Loading throws `RangeError` for wrong limits. */
  limits: Limits
  /** Address of `uph-worker.js`, if it is not next to this module. */
  setWorkerURL(url: string | URL): this
  /** Start the worker before there is a stream: starting takes longer than receiving the first bytes. */
  prepare(): this
  /** Returns the model immediately, still empty; `onLoad` is called with the first textured picture. */
  load(
    url: string,
    onLoad?: (model: UphModel) => void,
    onProgress?: (event: UphLoadEvent) => void,
    onError?: (error: unknown) => void,
  ): UphModel
  /** Resolves with the first textured picture. */
  loadAsync(url: string, onProgress?: (event: UphLoadEvent) => void): Promise<UphModel>
  /** Show a stream that has been loaded already, complete or cut. */
  parse(bytes: ArrayBuffer | Uint8Array): UphModel
  /** Stop all transfers: the models stay as they are. */
  abort(): this
}

/** A textured surface that refines: one mesh per chart. */
export class UphModel extends Group<UphModelEvents> {
  readonly received: number
  readonly total: number | null
  readonly complete: boolean
  /** Whether there is a textured picture. */
  readonly first: boolean
  /** State of the picture on screen: bytes used, shares (0 to 1) of significant coefficients and of placements; 1 when all has come. */
  readonly shown: { bytes: number; coefficients: number; placements: number }
  /** Maps of which some data is known: 'albedo', 'normal' … */
  readonly roles: string[]
  /** A sphere around the whole surface. */
  readonly sphere: Sphere
  /** Texels of all charts' textures, without gutters. */
  readonly texels: number
  /** Triangles of all charts in pairs: their number grows with the size of the model on screen. */
  readonly quads: number
  /** Borders of the charts, invisible at first. */
  readonly outlines: LineSegments<BufferGeometry, LineBasicMaterial>
  wireframe: boolean
  /** Show only a prefix: a number of bytes, or a share of the coefficients, 0 to 1; null shows all received bytes. */
  setLimit(limit: { bytes: number } | { coefficients: number } | null): void
  /**
   * Show the model with another sample in place of its own, such as another colour of the same cloth: a picture of the same shape, as an
   * image source of a canvas, a Blob or ImageData; null: the stream's own. Resolves when it is in the textures. Rejects with `RangeError` if the
   * ratio of height to width differs.
   */
  setExemplar(image: CanvasImageSource | Blob | ImageData | null): Promise<void>
  /** Resolves when all received bytes, up to the limit, are in the textures. */
  settled(): Promise<void>
  /**
   * The model as GLB: the present textures, as PNG on as few pages as possible; the mesh as fine as a view of `pixels` (2000) across the model
   * needs. Loads `uph-glb.js`. Rejects while placements are missing.
   */
  glb(options?: { name?: string; pixels?: number }): Promise<Uint8Array<ArrayBuffer>>
  /** The bytes received so far. */
  bytes(): Uint8Array
  /** Stop receiving: the picture stays. */
  abort(): void
  /** A plain group that shares geometry, materials and textures; its textures refine with this model's. */
  clone(recursive?: boolean): this
  /** Stop, and free textures, geometry and worker. */
  dispose(): void
}
