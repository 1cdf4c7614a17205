/** Maps of the exemplar, at full size and smaller, as painting reads them [8]. */

import { clamp } from '../numbers.js'
import { ROLES } from '../roles.js'
import { symmetricNormals } from './normals.js'

/** The level that a placement with this centre matrix reads, where there are `ratio` texels for each square step. */
export function pyramidLevel({ height, width }, [a, b, c, d], ratio) {
  const most = 2 * (32 - Math.clz32(Math.max(height, width) - 1))
  const determinant = a * d - b * c
  let k = 0
  while (k < most && determinant >= 2 ** 25 * 2 ** k * ratio) k++
  return k
}

/** A map as far as it has come. */
export class MapPyramid {
  #levels = [] // by symmetry, those in use

  constructor(picture, role) {
    this.picture = picture
    this.isNormal = role === 'normal'
    this.isSharp = ROLES[role]?.isSharp ?? false
  }

  /** The mean of its pixels. */
  get mean() {
    return (this.average ??= meanOf(this.picture))
  }

  /** A level of it: 2k is the map halved k times, 2k + 1 the same, softened. A normal map is turned by a symmetry before. */
  level(number, symmetry) {
    const turned = this.isNormal ? symmetry : 0
    const levels = (this.#levels[turned] ??= [turned ? symmetricNormals(this.picture, turned) : this.picture])
    return (levels[number] ??= number % 2 ? softened(this.level(number - 1, symmetry)) : halved(this.level(number - 2, symmetry)))
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

/** A map of half the size, filtered by (1, 3, 3, 1)/8. */
function halved(picture) {
  return filtered(picture, 2)
}

/** A map filtered by (1, 6, 1)/8. */
function softened(picture) {
  return filtered(picture, 1)
}

/** Every `by`th pixel of a map, filtered down the columns, then along the rows. */
function filtered({ height, width, channels, data }, by) {
  const isFloat = data instanceof Float32Array
  const [rows, columns] = [Math.ceil(height / by), Math.ceil(width / by)]
  const down = filterAxis(data, isFloat, by, 1, height, width * channels)
  const sums = filterAxis(down, isFloat, by, rows, width, channels)
  const out = new data.constructor(sums.length)
  for (let n = 0; n < out.length; n++) out[n] = isFloat ? sums[n] / 64 : (sums[n] + 32) >> 6
  return { height: rows, width: columns, channels, data: out }
}

/** Filter along an axis of `size`, with `inner` samples a step, `outer` times: those n … n + by − 1 six times, those before and after once. */
function filterAxis(from, isFloat, by, outer, size, inner) {
  const out = new (isFloat ? Float32Array : Int32Array)(outer * Math.ceil(size / by) * inner)
  const step = (n) => clamp(n, 0, size - 1) * inner
  for (let o = 0, to = 0; o < outer; o++) {
    for (let n = 0; n < size; n += by) {
      const [a, b, c, d] = [step(n - 1), step(n), step(n + 1), step(n + by)]
      for (let k = o * size * inner, end = k + inner; k < end; k++, to++) {
        const [ends, middle] = [from[a + k] + from[d + k], by === 2 ? from[b + k] + from[c + k] : from[b + k]]
        const times = 6 / by
        out[to] = isFloat ? Math.fround(ends) + Math.fround(times * Math.fround(middle)) : ends + times * middle
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
