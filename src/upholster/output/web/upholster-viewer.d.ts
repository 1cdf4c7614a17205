/** The model in a viewer: charts of a surface, whose textures and meshes refine while the stream arrives. */
export interface ViewerModel extends EventTarget {
  readonly received: number
  /** Length of the whole stream; null before its header has arrived. */
  readonly total: number | null
  readonly complete: boolean
  /** Whether there is a textured picture. */
  readonly first: boolean
  /** State of the picture on screen: bytes used, shares (0 to 1) of significant coefficients and of placements; 1 when all has come. */
  readonly shown: { bytes: number; coefficients: number; placements: number }
  /** Maps of which some data is known: 'albedo', 'normal' … */
  readonly roles: string[]
  /** A sphere around the whole surface, in the model's units. */
  readonly sphere: { center: [number, number, number]; radius: number }
  /** Texels of all charts' textures, without gutters. */
  readonly texels: number
  /** Triangles of all charts in pairs: their number grows with the size of the model on screen. */
  readonly quads: number
  /** Show only a prefix: a number of bytes, or a share of the coefficients, 0 to 1; null shows all received bytes. */
  setLimit(limit: { bytes: number } | { coefficients: number } | null): void
  /**
   * Show the model with another sample of the same shape; null: the stream's own. Resolves when it is in the textures. Rejects with
   * `RangeError` if the ratio of height to width differs.
   */
  setExemplar(image: CanvasImageSource | Blob | ImageData | null): Promise<void>
  /** Resolves when all received bytes, up to the limit, are in the textures. */
  settled(): Promise<void>
  /** The bytes received so far. */
  bytes(): Uint8Array
  /** Stop receiving: the picture stays. */
  abort(): void
}

/** What an event reports about the picture on screen. */
export interface Shown {
  /** Number of bytes of the stream in the picture. */
  bytes: number
  /** Share of the coefficients, 0 to 1. */
  coefficients: number
  /** Share of the placements, 0 to 1. */
  placements: number
  /** Milliseconds since the stream was requested. */
  milliseconds: number
}

/** The error in words for the user, and the loader's own error. */
export interface Failure {
  message: string
  error: Error
}

export interface UpholsterViewerEventMap {
  /** The first textured picture is on screen. */
  first: CustomEvent<Shown>
  /** The picture on screen has improved. */
  refine: CustomEvent<Shown>
  /** The whole stream has arrived, is valid, and is on screen. */
  complete: CustomEvent<Shown>
  /**
   * The stream has failed, and the picture stays; or the element's environment or sample can not be used, or there is no WebGL 2. Then
   * the poster is seen, or `alt` in words.
   */
  error: CustomEvent<Failure>
}

/**
 * `<upholster-viewer src="ring.uph">`: shows a `.uph` stream while it arrives.
 *
 * Attributes
 * - `src`: address of the stream; it is requested when the element is near the screen.
 * - `alt`: a description of the picture, for users who do not see it.
 * - `exemplar`: address of a picture of the same shape, as another colour of the sample, to show the model with.
 * - `worker`: address of `uph-worker.js`, if it is not next to the module.
 * - `painting`: `card` or `worker` paints charts; by default the graphics card, if there is one.
 * - `limit`: the most texels that a stream may have, as `4M` or `500k`; other limits follow from it. A larger stream is refused.
 * - `maxtexels`: the most texels that are painted, 1 to 64Mi, as `4M`; larger models are painted coarser.
 * - `view`: azimuth and elevation in degrees, "30,30" if not given, as `upholster cover --view`.
 * - `background`: a CSS colour, or "none"; a light or dark studio if not given.
 * - `environment`: address of a picture of surroundings, all round (2:1), that lights the model in place of the studio.
 * - `controls`: "none" leaves only the stage; "lab" adds the laboratory from `upholster-lab.js`.
 * - `autorotate`: turns until the user touches it.
 *
 * A child with `slot="poster"`, such as a picture, is shown until the model is.
 *
 * Parts for `::part()`: canvas, stage, button, note, progress, corner; of the laboratory also panel, slider, card, halves. Custom properties:
 * `--upholster-text`, `-muted`, `-surface`, `-line`, `-track`, `-accent`, `-on-accent` (colours) and `-font` (a family).
 */
export class UpholsterViewer extends HTMLElement {
  /** The attribute `src`. Setting it opens that stream; null, as removing the attribute, shows nothing. */
  get src(): string | null
  set src(address: string | null | undefined)
  /** The attribute `alt`; '' if there is none. */
  alt: string
  /** Open a stream: its address, or the stream itself; null: none. The previous stream is closed. Throws `TypeError` for anything else. */
  open(source: string | Blob | ArrayBuffer | ArrayBufferView | null): void
  /**
   * Replace the stream shown, which stays until the new one is complete and painted; the camera stays. Several streams are
   * parts of one model. Resolves to whether it is shown: false if another call has replaced it. Rejects if a stream is damaged.
   */
  replace(...streams: (Blob | ArrayBuffer | ArrayBufferView)[]): Promise<boolean>
  /** Show other streams, parts of one model, to the right of a line, with the same camera: see `wipe`. Without arguments, stop. Resolves when they are shown. */
  compare(...streams: (Blob | ArrayBuffer | ArrayBufferView)[]): Promise<void>
  /** Position of that line: the share of the width, 0 to 1, to its left. null: show two models side by side. */
  set wipe(share: number | null)
  /** The ray from the eye through a point, in CSS pixels of the element, in the model's own units; null without a model. */
  ray(x: number, y: number): { origin: [number, number, number]; direction: [number, number, number] } | null
  /**
   * Draw lines over any model that is shown: x, y, z of both ends of each, in the model's own units; `color` is linear red, green, blue.
   * null removes the lines of that name.
   */
  overlay(name: string, segments: ArrayLike<number> | null, color?: [number, number, number]): void
  /** The model shown; null if no stream is open. */
  readonly model: ViewerModel | null
  /** Azimuth and elevation in degrees. Setting them frames the whole model. Throws `RangeError` for a wrong view. */
  get view(): [number, number]
  set view(view: [number, number] | string)
  /** A PNG of the canvas, in the screen's pixels. */
  picture(): Promise<Blob>
  /** Resolves when all received bytes, up to the limit, are on screen, as finely as the view needs. */
  settled(): Promise<void>
  /** Whether it fills the screen. Setting it needs a click or key of the user. */
  fullscreen: boolean

  addEventListener<K extends keyof UpholsterViewerEventMap>(
    type: K,
    listener: (this: UpholsterViewer, event: UpholsterViewerEventMap[K]) => unknown,
    options?: boolean | AddEventListenerOptions,
  ): void
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions,
  ): void
}

declare global {
  interface HTMLElementTagNameMap {
    'upholster-viewer': UpholsterViewer
  }
}
