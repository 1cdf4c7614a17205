/** How many pixels a frame may have, so that movement stays fluid on slow machines. */

/** Milliseconds between frames: too many, and few enough to try more pixels. */
const [SLOW, FAST] = [45, 22]

/** Least share of the pixels along each side of the picture. */
const LEAST = 0.35

/** Software rasterisers, by what they call themselves. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i

/** Follows the time between frames. `quality` is the share of pixels along each side, up to 1. */
export class Pace {
  quality = 1
  #slow = 0
  #fast = 0

  /** @param {WebGL2RenderingContext} context tells a software rasteriser, which starts with fewer pixels */
  constructor(context) {
    const info = context.getExtension('WEBGL_debug_renderer_info')
    if (SOFTWARE.test(context.getParameter(info?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER))) this.quality = 0.4
  }

  /** Take note of the time in milliseconds between two frames of one movement. */
  note(milliseconds) {
    this.#slow = milliseconds > SLOW ? this.#slow + 1 : 0
    this.#fast = milliseconds < FAST ? this.#fast + 1 : 0
    // One slow frame says little, and trying more pixels may be wrong: be quick with less, slow with more.
    if (this.#slow >= 2) this.#set(this.quality * 0.71)
    else if (this.#fast >= 30) this.#set(this.quality * 1.41)
  }

  #set(quality) {
    this.quality = Math.min(Math.max(quality, LEAST), 1)
    this.#slow = this.#fast = 0
  }
}
