/** Normal maps [8]: their vectors turn with the texture that they lie on. */

import { clamp } from '../numbers.js'
import { SYMMETRIES } from '../symmetry.js'

/** The sample that stands for 1. */
const topOf = (data) => (data instanceof Float32Array ? 1 : data instanceof Uint8Array ? 255 : 65535)

/** A normal map as a placement with this symmetry shows it. */
export function symmetricNormals(picture, symmetry) {
  const [a, b, c, d] = SYMMETRIES[symmetry]
  const { data, channels } = picture
  const top = topOf(data)
  const out = data.slice()
  for (let n = 0; n < data.length; n += channels) {
    const [x, y] = [data[n], data[n + 1]]
    out[n] = d ? (d > 0 ? x : top - x) : b < 0 ? y : top - y
    out[n + 1] = a ? (a > 0 ? y : top - y) : c < 0 ? x : top - x
  }
  return { ...picture, data: out }
}

/**
 * Turn the vectors of painted normals, texels [first, first + count) of a chart so wide, by the angle of its field;
 * `step` samples from one texel to the next.
 */
export function turnNormals(samples, step, field, width, first, count) {
  const top = topOf(samples)
  const middle = 0.5 * top
  const rounded = top === 1 ? (x) => x : (x) => clamp(Math.floor(x + 0.5), 0, top)
  const m = [0, 0, 0, 0]
  for (let n = 0, at = 0; n < count; n++, at += step) {
    field.at(Math.floor((first + n) / width), (first + n) % width, m)
    const length = Math.max(Math.sqrt(m[1] * m[1] + m[3] * m[3]), 1)
    const [sine, cosine] = [m[1] / length, m[3] / length]
    const [x, y] = [samples[at] - middle, samples[at + 1] - middle]
    samples[at] = rounded(middle + (x * cosine - y * sine))
    samples[at + 1] = rounded(middle + (x * sine + y * cosine))
  }
}
