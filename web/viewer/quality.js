/** How many pixels a frame has, so that movement stays fluid on slow machines. */

/** Milliseconds between frames: too many, and few enough to try more pixels. */
const [SLOW_FRAME, FAST_FRAME] = [45, 22]

/** Least share of the pixels along each side of the picture. */
const MIN_QUALITY = 0.35

/** Software rasterisers, by what they call themselves. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i

/** Follows the time between frames. `quality` is the share of pixels along each side, up to 1. */
export class AdaptiveQuality {
  quality = 1
  /** Whether the graphics card is none, but the processor. */
  isSoftware
  #slowFrames = 0
  #fastFrames = 0

  /** @param {WebGL2RenderingContext} context shows whether it is a software rasteriser, which starts with fewer pixels */
  constructor(context) {
    const info = context.getExtension('WEBGL_debug_renderer_info')
    this.isSoftware = SOFTWARE.test(context.getParameter(info?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER))
    if (this.isSoftware) this.quality = 0.4
  }

  /** Take note of the time in milliseconds between two frames of one movement. */
  addFrame(milliseconds) {
    this.#slowFrames = milliseconds > SLOW_FRAME ? this.#slowFrames + 1 : 0
    this.#fastFrames = milliseconds < FAST_FRAME ? this.#fastFrames + 1 : 0
    // One slow frame says little, and trying more pixels may be wrong: be quick with less, slow with more.
    if (this.#slowFrames >= 2) this.#set(this.quality * 0.71)
    else if (this.#fastFrames >= 30) this.#set(this.quality * 1.41)
  }

  #set(quality) {
    this.quality = Math.min(Math.max(quality, MIN_QUALITY), 1)
    this.#slowFrames = this.#fastFrames = 0
  }
}
