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

/** Turn painted normals, three samples each, by the angles of as many matrices of a field. */
export function turnNormals(samples, matrices) {
  const top = topOf(samples)
  const middle = 0.5 * top
  const rounded = top === 1 ? (x) => x : (x) => clamp(Math.floor(x + 0.5), 0, top)
  for (let at = 0, m = 0; at < samples.length; at += 3, m += 4) {
    const [across, along] = [matrices[m + 1], matrices[m + 3]]
    const length = Math.max(Math.sqrt(across * across + along * along), 1)
    const [sine, cosine] = [across / length, along / length]
    const [x, y] = [samples[at] - middle, samples[at + 1] - middle]
    samples[at] = rounded(middle + (x * cosine - y * sine))
    samples[at + 1] = rounded(middle + (x * sine + y * cosine))
  }
}
