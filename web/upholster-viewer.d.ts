import type { UphModel } from './uph-three.js'

/** What an event tells of what is on screen. */
export interface Shown {
  /** Bytes of the stream that are shown. */
  bytes: number
  /** Share of the coefficients, 0 to 1. */
  coefficients: number
  /** Share of the charts whose placements are known, 0 to 1. */
  charts: number
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
  /** The stream ends here; what is shown stays. */
  error: CustomEvent<Failure>
}

/**
 * `<upholster-viewer src="ring.uph">`: shows a `.uph` stream while it comes.
 *
 * Attributes
 * - `src`: address of the stream.
 * - `worker`: address of `uph-worker.js`, if it does not lie beside the module.
 * - `view`: azimuth and elevation in degrees, "30,30" if not given, as `upholster cover --view`.
 * - `background`: a CSS colour, or "none"; a light or dark studio if not given.
 * - `controls`: "none" leaves the bare stage.
 * - `autorotate`: turns until somebody touches it.
 *
 * Parts for `::part()`: canvas, panel, slider, button, card, note, loading, progress, corner, halves. Custom properties:
 * `--upholster-text`, `-muted`, `-surface`, `-line`, `-track`, `-accent`, `-on-accent` (colours) and `-font` (a family).
 */
export class UpholsterViewer extends HTMLElement {
  /** The attribute `src`. Setting it opens that stream; null, as removing the attribute, shows nothing. */
  get src(): string | null
  set src(address: string | null | undefined)
  /** Open a stream: its address, or the stream itself. What was open before is dropped. */
  open(source: string | Uint8Array | ArrayBuffer): void
  /** The model shown; null where nothing is open. */
  readonly model: UphModel | null
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
