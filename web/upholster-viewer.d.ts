/** What a viewer shows: charts of a surface, whose textures and meshes refine while the stream comes. */
export interface ViewerModel extends EventTarget {
  readonly received: number
  /** Length of the whole stream; null before its header has come. */
  readonly total: number | null
  readonly complete: boolean
  /** Whether there is a textured view. */
  readonly first: boolean
  /** What is on screen: bytes used, shares (0 to 1) of significant coefficients and of placements. */
  readonly shown: { bytes: number; coefficients: number; placements: number }
  /** Maps of which something is known: 'albedo', 'normal' … */
  readonly roles: string[]
  /** Round the whole surface, in the model's units. */
  readonly sphere: { center: [number, number, number]; radius: number }
  /** Of all charts' textures, without gutters. */
  readonly texels: number
  /** Triangles of all charts in pairs: ever more, the larger the model is on screen. */
  readonly quads: number
  /** Show a prefix only: so many bytes, or a share of the coefficients, 0 to 1; null shows all that has come. */
  setLimit(limit: { bytes: number } | { coefficients: number } | null): void
  /**
   * Show the model with another sample of the same shape; null: the stream's own. Resolves when it is in the textures. Rejects with
   * `RangeError` where the shape, height to width, is another one.
   */
  setExemplar(image: CanvasImageSource | Blob | ImageData | null): Promise<void>
  /** Resolves when all that has come, up to the limit, is in the textures. */
  settled(): Promise<void>
  /** What has come so far. */
  bytes(): Uint8Array
  /** Stop receiving: what is shown stays. */
  abort(): void
}

/** What an event reports about the picture on screen. */
export interface Shown {
  /** Bytes of the stream that are shown. */
  bytes: number
  /** Share of the coefficients, 0 to 1. */
  coefficients: number
  /** Share of the placements, 0 to 1. */
  placements: number
  /** Milliseconds since the stream was asked for. */
  milliseconds: number
}

/** What went wrong, in words for the person in front of the screen, and the loader's error. */
export interface Failure {
  message: string
  error: Error
}

export interface UpholsterViewerEventMap {
  /** The first textured view is on screen. */
  first: CustomEvent<Shown>
  /** What is on screen got better. */
  refine: CustomEvent<Shown>
  /** The whole stream has come, is right, and is on screen. */
  complete: CustomEvent<Shown>
  /**
   * The stream ends here, and what is shown stays; or the element's environment or sample can not be used, or there is no WebGL 2. Then
   * the poster is seen, or `alt` in words.
   */
  error: CustomEvent<Failure>
}

/**
 * `<upholster-viewer src="ring.uph">`: shows a `.uph` stream while it comes.
 *
 * Attributes
 * - `src`: address of the stream; it is asked for when the element is near the screen.
 * - `alt`: what the picture shows, for those who do not see it.
 * - `exemplar`: address of a picture of the same shape, as another colour of the sample, to show the model with.
 * - `worker`: address of `uph-worker.js`, if it is not next to the module.
 * - `painting`: who paints charts, `card` or `worker`; otherwise the graphics card, where there is one.
 * - `view`: azimuth and elevation in degrees, "30,30" if not given, as `upholster cover --view`.
 * - `background`: a CSS colour, or "none"; a light or dark studio if not given.
 * - `environment`: address of a picture of surroundings, all round (2:1), that lights the model in place of the studio.
 * - `controls`: "none" leaves the bare stage; "lab" adds the laboratory, which `upholster-lab.js` has.
 * - `autorotate`: turns until somebody touches it.
 *
 * A child with `slot="poster"`, as a picture, is seen until the model is.
 *
 * Parts for `::part()`: canvas, stage, button, note, progress, corner; of the laboratory also panel, slider, card, halves. Custom properties:
 * `--upholster-text`, `-muted`, `-surface`, `-line`, `-track`, `-accent`, `-on-accent` (colours) and `-font` (a family).
 */
export class UpholsterViewer extends HTMLElement {
  /** The attribute `src`. Setting it opens that stream; null, as removing the attribute, shows nothing. */
  get src(): string | null
  set src(address: string | null | undefined)
  /** The attribute `alt`; '' where there is none. */
  alt: string
  /** Open a stream: its address, or the stream itself; null: none. What was open before is dropped. Throws `TypeError` for anything else. */
  open(source: string | Blob | ArrayBuffer | ArrayBufferView | null): void
  /**
   * Open a stream in place of the one that is shown, which stays until the new one is whole and painted; the camera stays. Several streams are
   * parts of one model. Resolves to whether it is shown: false where another call came first. Rejects where a stream is damaged.
   */
  replace(...streams: (Blob | ArrayBuffer | ArrayBufferView)[]): Promise<boolean>
  /** Show other streams, parts of one model, right of a line, with the same camera: see `wipe`. None: no more. Resolves when they are shown. */
  compare(...streams: (Blob | ArrayBuffer | ArrayBufferView)[]): Promise<void>
  /** Where that line is: the share of the width, 0 to 1, left of it. null: two models stand side by side. */
  set wipe(share: number | null)
  /** The ray from the eye through a point, in CSS pixels of the element, in the model's own units; null without a model. */
  ray(x: number, y: number): { origin: [number, number, number]; direction: [number, number, number] } | null
  /**
   * Draw lines over the model, whichever is shown: x, y, z of both ends of each, in the model's own units; `color` is linear red, green, blue.
   * null: none of that name any more.
   */
  overlay(name: string, segments: ArrayLike<number> | null, color?: [number, number, number]): void
  /** The model shown; null where nothing is open. */
  readonly model: ViewerModel | null
  /** Azimuth and elevation in degrees. Setting them frames the whole model. Throws `RangeError` for what is no view. */
  get view(): [number, number]
  set view(view: [number, number] | string)
  /** A PNG of what the canvas shows, in the screen's pixels. */
  picture(): Promise<Blob>
  /** Resolves when all that has come, up to the limit, is on screen, and as finely as the view needs it. */
  settled(): Promise<void>
  /** Whether it fills the screen. Setting it needs a person's click or key. */
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
