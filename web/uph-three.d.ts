import type { Group, LineBasicMaterial, LineSegments, BufferGeometry, Loader, LoadingManager, Object3DEventMap, Sphere } from 'three'

export interface UphProgress {
  received: number
  /** Length of the whole stream; null before its header has come. */
  total: number | null
  /** The same as `received`, as three.js' loaders have it. */
  loaded: number
}

/** The event of three.js' loaders, with `total` 0 before the header has arrived; and `received`, the same as `loaded`. */
export interface UphLoadEvent extends ProgressEvent {
  readonly received: number
}

export interface UphModelEvents extends Object3DEventMap {
  progress: UphProgress
  /** There is a textured view. */
  first: object
  /** Textures got better, or the limit changed. */
  refine: object
  /** Charts were tessellated again. */
  geometry: object
  /** All bytes are here, and shown. */
  complete: object
  /** The connection was lost; it is tried again. */
  stalled: { attempt: number; message: string }
  resumed: object
  /** One line; `offset` is the byte where a damaged stream fails. What is shown stays. */
  error: { error: Error & { offset?: number } }
}

/** Loads `.uph` streams as three.js' loaders do; what it gives goes on refining while bytes come. */
export class UphLoader extends Loader<UphModel> {
  constructor(manager?: LoadingManager)
  /** Largest side of a texture in texels; larger charts are halved. 4096 by default. */
  maxTextureSize: number
  /** Texels of all charts together, 2^26 by default; models with more are shown at half the size, or a quarter. */
  maxTexels: number
  /** How far the mesh may be from the surface, in pixels. 0.4 by default. */
  errorPixels: number
  /** Address of `uph-worker.js`, if it is not next to this module. */
  setWorkerURL(url: string | URL): this
  /** Start the worker before there is a stream: it takes longer than the first bytes to arrive. */
  prepare(): this
  /** Returns the model at once, still empty; `onLoad` comes with the first textured view. */
  load(
    url: string,
    onLoad?: (model: UphModel) => void,
    onProgress?: (event: UphLoadEvent) => void,
    onError?: (error: unknown) => void,
  ): UphModel
  /** Resolves with the first textured view. */
  loadAsync(url: string, onProgress?: (event: UphLoadEvent) => void): Promise<UphModel>
  /** Show a stream that is here already, whole or cut. */
  parse(bytes: ArrayBuffer | Uint8Array): UphModel
  /** Stop all that is under way: the models stay as they are. */
  abort(): this
}

/** A textured surface that refines: one mesh per chart. */
export class UphModel extends Group<UphModelEvents> {
  readonly received: number
  readonly total: number | null
  readonly complete: boolean
  /** Whether there is a textured view. */
  readonly first: boolean
  /** What is on screen: bytes used, shares (0 to 1) of significant coefficients and of placements. */
  readonly shown: { bytes: number; coefficients: number; placements: number }
  /** Maps of which something is known: 'albedo', 'normal' … */
  readonly roles: string[]
  /** Round the whole surface. */
  readonly sphere: Sphere
  /** Of all charts' textures, without gutters. */
  readonly texels: number
  /** Triangles of all charts in pairs: ever more, the larger the model is on screen. */
  readonly quads: number
  /** Borders of the charts, invisible at first. */
  readonly outlines: LineSegments<BufferGeometry, LineBasicMaterial>
  wireframe: boolean
  /** Show a prefix only: so many bytes, or a share of the coefficients, 0 to 1; null shows all that has come. */
  setLimit(limit: { bytes: number } | { coefficients: number } | null): void
  /**
   * Show the model with another sample in place of its own, such as another colour of the same cloth: a picture of the same shape, what a
   * canvas draws, a Blob or ImageData; null: the stream's own. Resolves when it is in the textures. Rejects with `RangeError` where the shape,
   * height to width, is another one.
   */
  setExemplar(image: CanvasImageSource | Blob | ImageData | null): Promise<void>
  /** Resolves when all that has come, up to the limit, is in the textures. */
  settled(): Promise<void>
  /**
   * The model as GLB: textures as they are here, as PNG on as few pages as possible; the mesh as fine as `pixels` (2000) across the model
   * show. Loads `uph-glb.js`. Rejects while placements are still to come.
   */
  glb(options?: { name?: string; pixels?: number }): Promise<Uint8Array<ArrayBuffer>>
  /** What has come so far. */
  bytes(): Uint8Array
  /** Stop receiving: what is shown stays. */
  abort(): void
  /** A plain group that shares geometry, materials and textures; its textures refine with this model's. */
  clone(recursive?: boolean): this
  /** Stop, and free textures, geometry and worker. */
  dispose(): void
}
