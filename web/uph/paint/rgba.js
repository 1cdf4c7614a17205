/** Samples of any kind as 8-bit RGBA for the screen. */

import { clamp } from '../numbers.js'
import { ROLES } from '../roles.js'
import { srgbCodes } from './srgb.js'

/** Samples of a map as RGBA of 8 bits; grey becomes RGB, and floats of colours, which are linear light, become sRGB. */
export function toRgba(samples, channels, role) {
  const isFloat = samples instanceof Float32Array
  const isWide = samples instanceof Uint16Array
  const plain = (x) => (isFloat ? 255 * clamp(x, 0, 1) + 0.5 : isWide ? Math.floor((x + 128) / 257) : x)
  const table = isFloat && ROLES[role]?.isColor ? srgbCodes() : null
  const color = table ? (x) => table[Math.fround(65535 * clamp(x, 0, 1)) + 0.5 | 0] : plain
  const [green, blue] = channels < 3 ? [0, 0] : [1, 2]
  const out = new Uint8Array((4 * samples.length) / channels)
  if (samples instanceof Uint8Array && channels === 3) return fromColors(samples, out)
  for (let to = 0, at = 0; to < out.length; to += 4, at += channels) {
    out[to] = color(samples[at])
    out[to + 1] = color(samples[at + green])
    out[to + 2] = color(samples[at + blue])
    out[to + 3] = channels & 1 ? 255 : plain(samples[at + channels - 1])
  }
  return out
}

/** The same of 8-bit colours, which most maps are, sooner. */
function fromColors(samples, out) {
  for (let to = 0, at = 0; to < out.length; to += 4, at += 3) {
    out[to] = samples[at]
    out[to + 1] = samples[at + 1]
    out[to + 2] = samples[at + 2]
    out[to + 3] = 255
  }
  return out
}
