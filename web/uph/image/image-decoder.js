/** An image as its stream comes: from coefficients to samples [7.3, 7.4]. */

import { clamp, range } from '../numbers.js'
import { CoefficientDecoder, NEGATIVE } from './coefficients.js'
import * as exact from './exact.js'
import { NINE_SEVEN, idwt2 } from './wavelets.js'

// Where in its interval a value is expected, in 1/64, by the share of ones among refinement bits.
const POINTS = range(64).map((o) => {
  const q = Math.min(0.499, (o + 0.5) / 64)
  const r = -2 * Math.log(q / (1 - q))
  return Math.round(64 * clamp(1 / r - 1 / (Math.exp(r) - 1), 0.3, 0.55))
})

/** Decodes an image's coefficients, and from them the image, as its stream comes. */
export class ImageDecoder {
  constructor(header) {
    this.header = header
    /** The lossless wavelets; null for 9/7. */
    this.exact = header.wavelet ? exact : null
    this.coefficients = new CoefficientDecoder(header)
    this.complete = false
    if (header.plane < 0) this.feed(new Uint8Array(0))
  }

  /** Take further bytes; returns whether they changed anything. */
  feed(part) {
    const before = this.coefficients.symbols
    this.complete = this.coefficients.feed(part)
    return this.coefficients.symbols > before
  }

  /** How many coefficients are significant so far. */
  get significant() {
    return this.coefficients.significant
  }

  /** The image as far as it is known: {height, width, channels, data}. */
  image() {
    const { height, width, channels, wavelet, color, levels, matrix } = this.header
    const planes = range(channels).map((channel) => {
      const plane = reconstruct(this.coefficients, channel, this.exact)
      idwt2(plane, height, width, levels, this.exact?.transforms[wavelet] ?? NINE_SEVEN)
      return plane
    })
    if (color === 1) inverseKlt(planes, matrix)
    else if (color) this.exact.inverseYcocg(planes)
    return { height, width, channels, data: samplesOf(planes, this.header) }
  }
}

/** One channel's coefficients, low-pass ones first along each axis. */
function reconstruct({ header, bands, flags, known, lowestKnown, refined, plane }, channel, exact) {
  const { height, width, wavelet, levels, fineness, means } = header
  const out = new (wavelet === 1 ? Int32Array : Float64Array)(height * width)
  const passes = wavelet === 2 && exact.passesOf(header)
  // An approximation is near the mean, as far as what is known allows it.
  const mean = passes ? exact.codedMean(means[channel] * 2 ** (levels + fineness), passes) : 0
  const rest = mean >> (plane + 3) ? 0 : Math.min(mean, 2 ** (plane + 1) - 1)
  for (const band of bands) {
    if (band.channel !== channel) continue
    const points = [0, 2].map((later) => {
      const base = (band.level * 4 + band.kind) * 4 + later
      return POINTS[Math.floor((64 * refined[base + 1]) / (refined[base] + refined[base + 1]))]
    })
    for (let r = 0; r < band.rows; r++) {
      let place = (band.top + r) * width + band.left
      for (let i = band.start + r * band.stride, end = i + band.columns; i < end; i++, place++) {
        if (!known[i] && (band.kind || !rest)) continue
        const u = lowestKnown[i]
        let value = known[i] || rest
        if (known[i] && (u > band.lowest || !wavelet)) value += (points[value >> (u + 1) ? 1 : 0] * 2 ** u) / 64
        if (passes) {
          if (mean && known[i] && !band.kind && !(flags[i] & NEGATIVE) && mean >> u === known[i] >> u) value = mean
          const top = 31 - Math.clz32(value)
          value = passes[top].start + Math.floor((value - 2 ** top) / 2 ** passes[top].shift)
        }
        value = flags[i] & NEGATIVE ? -value * band.scale : value * band.scale
        out[place] = wavelet === 1 ? Math.trunc(value) : value / 2 ** (20 + fineness)
      }
    }
  }
  return out
}

function inverseKlt([first, second, third], m) {
  for (let i = 0; i < first.length; i++) {
    const [c0, c1, c2] = [first[i], second[i], third[i]]
    first[i] = c0 * m[0] + c1 * m[1] + c2 * m[2]
    second[i] = c0 * m[3] + c1 * m[4] + c2 * m[5]
    third[i] = c0 * m[6] + c1 * m[7] + c2 * m[8]
  }
}

/** Planes with their means added, rounded, and channels together. */
function samplesOf(planes, { channels, wavelet, depth, means, low, high }) {
  const data = new [Uint8Array, Uint16Array, Float32Array][depth](planes[0].length * channels)
  const most = depth ? 65535 : 255
  const step = (high - low) / 65535
  const half = wavelet === 1 ? 0 : 0.5
  planes.forEach((plane, k) => {
    const mean = wavelet === 2 ? 0 : means[k]
    for (let i = 0, place = k; i < plane.length; i++, place += channels) {
      const value = clamp(Math.floor(plane[i] + mean + half), 0, most)
      data[place] = depth === 2 ? value * step + low : value
    }
  })
  return data
}
