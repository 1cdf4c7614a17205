/** Maps of the exemplar, at full size and smaller, as painting reads them [8]. */

import { clamp } from '../numbers.js'
import { ROLES } from '../roles.js'
import { symmetricNormals } from './normals.js'

/** The level that a placement with this centre matrix reads, where there are `ratio` texels for each square step. */
export function pyramidLevel({ height, width }, [a, b, c, d], ratio) {
  const most = 32 - Math.clz32(Math.max(height, width) - 1)
  const determinant = a * d - b * c
  let k = 0
  while (k < most && determinant >= 2 ** 25 * 4 ** k * ratio) k++
  return k
}

/** A map as far as it has come. */
export class MapPyramid {
  #levels = [] // by symmetry

  constructor(picture, role) {
    this.picture = picture
    this.isNormal = role === 'normal'
    this.isSharp = ROLES[role]?.isSharp ?? false
  }

  /** The mean of its pixels. */
  get mean() {
    return (this.average ??= meanOf(this.picture))
  }

  /** A level of it; a normal map is turned by a symmetry before. */
  level(number, symmetry) {
    const turned = this.isNormal ? symmetry : 0
    const levels = (this.#levels[turned] ??= [turned ? symmetricNormals(this.picture, turned) : this.picture])
    while (levels.length <= number) levels.push(halve(levels.at(-1)))
    return levels[number]
  }
}

function meanOf({ channels, data }) {
  const count = data.length / channels
  const out = new data.constructor(channels)
  for (let k = 0; k < channels; k++) {
    let sum = 0
    for (let n = k; n < data.length; n += channels) sum += data[n]
    out[k] = data instanceof Float32Array ? sum / count : Math.floor((2 * sum + count) / (2 * count))
  }
  return out
}

/** The next level: half the size, filtered by (1, 3, 3, 1)/8 down the columns, then along the rows. */
function halve({ height, width, channels, data }) {
  const isFloat = data instanceof Float32Array
  const [halfHeight, halfWidth] = [(height + 1) >> 1, (width + 1) >> 1]
  const down = filterAxis(data, isFloat, 1, height, width * channels)
  const sums = filterAxis(down, isFloat, halfHeight, width, channels)
  const out = new data.constructor(sums.length)
  for (let n = 0; n < out.length; n++) out[n] = isFloat ? sums[n] / 64 : (sums[n] + 32) >> 6
  return { height: halfHeight, width: halfWidth, channels, data: out }
}

/** Filter along an axis of `size`, with `inner` samples a step, `outer` times. */
function filterAxis(from, isFloat, outer, size, inner) {
  const half = (size + 1) >> 1
  const out = new (isFloat ? Float32Array : Int32Array)(outer * half * inner)
  const step = (n) => clamp(n, 0, size - 1) * inner
  for (let o = 0, to = 0; o < outer; o++) {
    for (let n = 0; n < size; n += 2) {
      const [a, b, c, d] = [step(n - 1), step(n), step(n + 1), step(n + 2)]
      for (let k = o * size * inner, end = k + inner; k < end; k++, to++) {
        const [ends, middle] = [from[a + k] + from[d + k], from[b + k] + from[c + k]]
        out[to] = isFloat ? Math.fround(ends) + Math.fround(3 * Math.fround(middle)) : ends + 3 * middle
      }
    }
  }
  return out
}

/** A pixel's place, or of what lies outside that of its mirror image. */
export function mirrored(n, size) {
  if (n >= 0 && n < size) return n
  const m = (n < 0 ? -1 - n : n) % (2 * size)
  return m < size ? m : 2 * size - 1 - m
}

/** Floats between four pixels, each product and each sum rounded to 32 bits. */
export function bilinear(a, b, c, d, p, q, r, s) {
  const { fround } = Math
  const upper = fround(fround(a * (p / 256)) + fround(b * (q / 256)))
  return fround(fround(upper + fround(c * (r / 256))) + fround(d * (s / 256)))
}
