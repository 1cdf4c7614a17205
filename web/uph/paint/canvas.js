/** What is painted on: samples with 6 fractional bits, and the texels that come of them [8]. */

import { part } from '../parts.js'
import { BLEND, FINAL } from './runs.js'

/** Paints strips of charts of one kind of samples; its memory is used again and again. */
export class Canvas {
  constructor(Samples, channels) {
    this.isBytes = Samples === Uint8Array
    this.channels = channels
    this.perTexel = this.isBytes ? 1 : channels
    this.layersPerTexel = this.isBytes ? 2 : channels
    this.opaque = this.isBytes && channels & 1 ? 255 << 24 : 0
    this.out = new (this.isBytes ? Uint32Array : Samples)(0)
    this.layers = new (Samples === Float32Array ? Float32Array : Int32Array)(0)
  }

  /** Clear texels [first, end) of so many. */
  clear(count, first, end) {
    const { out, perTexel, layersPerTexel } = this
    if (count * perTexel > out.length) {
      this.out = new out.constructor(count * perTexel)
      this.layers = new this.layers.constructor(count * layersPerTexel)
    }
    this.out.fill(this.opaque, first * perTexel, end * perTexel)
    this.layers.fill(0, first * layersPerTexel, end * layersPerTexel)
  }

  /** What lies there: RGBA of 8-bit samples, else as many samples as there are channels. */
  painted(first, end) {
    if (this.isBytes) return new Uint8Array(this.out.buffer, 4 * first, 4 * (end - first))
    return this.out.subarray(first * this.perTexel, end * this.perTexel)
  }

  /**
   * Lay samples at `places` on texels [to, end). Of bytes there are two a word, 16 bits each, which weights of 256 in all fill and 6
   * fractional bits leave room in.
   */
  lay(kind, to, end, words, width, places, place, weights, weight) {
    if (!this.isBytes) return part('laySamples')(this, kind, to, end, words, width, places, place, weights, weight)
    const { out, layers, opaque } = this
    const below = 2 * width
    const [isFinal, isBlend] = [kind === FINAL, kind === BLEND]
    for (; to < end; to++, place++) {
      const at = (places[place] >>> 8) * 2
      const fraction = places[place] & 255
      let even, odd
      if (fraction) {
        const d = (fraction >> 4) * (fraction & 15)
        const b = 16 * (fraction & 15) - d
        const c = (fraction & 240) - d
        const a = 256 - b - c - d
        even = Math.imul(words[at], a) + Math.imul(words[at + 2], b)
        even = (even + Math.imul(words[at + below], c) + Math.imul(words[at + below + 2], d)) | 0
        odd = Math.imul(words[at + 1], a) + Math.imul(words[at + 3], b)
        odd = (odd + Math.imul(words[at + below + 1], c) + Math.imul(words[at + below + 3], d)) | 0
      } else if (isFinal) {
        out[to] = words[at] | (words[at + 1] << 8) | opaque
        continue
      } else {
        even = words[at] << 8
        odd = words[at + 1] << 8
      }
      if (isFinal) {
        // Rounding to 6 bits and to none at once.
        out[to] = (((even + 0x820082) >>> 8) & 0xff00ff) | ((odd + 0x820082) & 0xff00ff00) | opaque
        continue
      }
      even = ((even + 0x20002) >>> 2) & 0x3fff3fff
      odd = ((odd + 0x20002) >>> 2) & 0x3fff3fff
      if (isBlend) {
        const w = weights[weight++]
        const rest = 256 - w
        const [e, o] = [layers[2 * to], layers[2 * to + 1]]
        even =
          (((e & 0xffff) * rest + (even & 0xffff) * w + 128) >> 8) |
          ((((e >>> 16) * rest + (even >>> 16) * w + 128) << 8) & 0xffff0000)
        odd =
          (((o & 0xffff) * rest + (odd & 0xffff) * w + 128) >> 8) |
          ((((o >>> 16) * rest + (odd >>> 16) * w + 128) << 8) & 0xffff0000)
      }
      out[to] = (((even + 0x200020) >>> 6) & 0xff00ff) | (((odd + 0x200020) << 2) & 0xff00ff00) | opaque
      layers[2 * to] = even
      layers[2 * to + 1] = odd
    }
  }
}
