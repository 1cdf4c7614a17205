/** What charts are painted on whose samples are of 16 bits, or floats [8]. */

import { BLEND } from './runs.js'

/** As `Canvas.lay`. */
export function laySamples(canvas, kind, to, end, samples, width, places, place, weights, weight) {
  const { out, layers, channels } = canvas
  const below = width * channels
  const isFloat = out instanceof Float32Array
  const isBlend = kind === BLEND
  for (; to < end; to++, place++) {
    const fraction = places[place] & 255
    const d = (fraction >> 4) * (fraction & 15)
    const b = 16 * (fraction & 15) - d
    const c = (fraction & 240) - d
    const a = 256 - b - c - d
    const w = isBlend ? weights[weight++] : 256
    let at = (places[place] >>> 8) * channels
    for (let n = to * channels, last = n + channels; n < last; n++, at++) {
      const [e, f, g, h] = [samples[at], samples[at + channels], samples[at + below], samples[at + below + channels]]
      if (isFloat) {
        let value = e
        if (fraction) {
          value = Math.fround(Math.fround(e * (a / 256)) + Math.fround(f * (b / 256)))
          value = Math.fround(Math.fround(value + Math.fround(g * (c / 256))) + Math.fround(h * (d / 256)))
        }
        if (w < 256) value = Math.fround(layers[n] * ((256 - w) / 256)) + Math.fround(value * (w / 256))
        layers[n] = out[n] = value
      } else {
        let value = (e * a + f * b + g * c + h * d + 2) >> 2
        if (w < 256) value = (layers[n] * (256 - w) + value * w + 128) >> 8
        layers[n] = value
        out[n] = (value + 32) >> 6
      }
    }
  }
}
