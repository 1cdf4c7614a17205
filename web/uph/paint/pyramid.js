/** Maps of the exemplar, at full size and smaller, as painting reads them [8]. */

import { UNIT } from '../field.js'
import { clamp } from '../numbers.js'
import { symmetricNormals } from './normals.js'

/** The level at which a block reads of which the centre matrix has this determinant. */
export function pyramidLevel({ height, width }, determinant) {
  const most = 32 - Math.clz32(Math.max(height, width) - 1)
  let k = 0
  while (k < most && determinant >= 2 * UNIT * UNIT * 4 ** k) k++
  return k
}

/** A map with the levels of its pyramid, made where they are needed; of a normal map also for each symmetry. */
export class MapPyramid {
  constructor(picture, role) {
    this.picture = picture
    this.isNormal = role === 'normal'
    this.levels = [] // by symmetry
  }

  /** The mean of its pixels. */
  get mean() {
    return (this.average ??= meanOf(this.picture))
  }

  /** A level as painting reads it: its picture, and `samples` with room for a row more. */
  level(number, symmetry) {
    const key = this.isNormal ? symmetry : 0
    const levels = (this.levels[key] ??= [withSamples(key ? symmetricNormals(this.picture, key) : this.picture)])
    while (levels.length <= number) levels.push(withSamples(halve(levels.at(-1))))
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

/** 8-bit samples are packed: two words a pixel of two samples each, red and blue, green and alpha. */
function withSamples(picture) {
  const { height, width, channels, data } = picture
  const size = height * width
  if (!(data instanceof Uint8Array)) {
    const samples = new data.constructor((size + width + 2) * channels)
    samples.set(data)
    return { ...picture, samples }
  }
  const samples = new Int32Array(2 * (size + width + 2))
  const [green, blue] = channels < 3 ? [0, 0] : [1, 2]
  for (let n = 0, at = 0; n < size; n++, at += channels) {
    samples[2 * n] = data[at] | (data[at + blue] << 16)
    samples[2 * n + 1] = data[at + green] | (channels & 1 ? 0 : data[at + channels - 1] << 16)
  }
  return { ...picture, samples }
}

/** The next level: half the size, filtered by (1, 3, 3, 1)/8 down the columns, then along the rows. */
export function halve({ height, width, channels, data }) {
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
