/** Samples of any kind as 8-bit RGBA for the screen, and back. */

import { clamp, range } from '../numbers.js'

/** Maps whose floats are linear light and are shown as sRGB. */
const COLOR_ROLES = ['albedo', 'emission']

/** Write RGBA as so many channels, from out[to] on; returns where it ends. */
export function rgbaToChannels(rgba, channels, out, to) {
  for (let from = 0; from < rgba.length; from += 4, to += channels) {
    out[to] = rgba[from]
    if (channels === 3) {
      out[to + 1] = rgba[from + 1]
      out[to + 2] = rgba[from + 2]
    } else if (channels === 2) out[to + 1] = rgba[from + 3]
  }
  return to
}

/** The 8-bit sRGB codes of 65536 even steps of linear light, made once. */
let srgbCodes = null
function makeSrgbCodes() {
  return Uint8Array.from(range(65536), (n) => {
    const x = n / 65535
    return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055) + 0.5
  })
}

/** Samples of a map as RGBA of 8 bits; grey becomes RGB. */
export function toRgba(samples, channels, role) {
  const isFloat = samples instanceof Float32Array
  const isWide = samples instanceof Uint16Array
  const plain = (x) => (isFloat ? 255 * clamp(x, 0, 1) + 0.5 : isWide ? Math.floor((x + 128) / 257) : x)
  const table = isFloat && COLOR_ROLES.includes(role) ? (srgbCodes ??= makeSrgbCodes()) : null
  const color = table ? (x) => table[Math.fround(65535 * clamp(x, 0, 1)) + 0.5 | 0] : plain
  const [green, blue] = channels < 3 ? [0, 0] : [1, 2]
  const out = new Uint8Array((4 * samples.length) / channels)
  for (let to = 0, at = 0; to < out.length; to += 4, at += channels) {
    out[to] = color(samples[at])
    out[to + 1] = color(samples[at + green])
    out[to + 2] = color(samples[at + blue])
    out[to + 3] = channels & 1 ? 255 : plain(samples[at + channels - 1])
  }
  return out
}
