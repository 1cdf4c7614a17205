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

/** What stands for 1 in sines and cosines. */
export const ONE = 8192

/** Turn painted normals, three samples each, by the angles of as many matrices of a field. */
export function turnNormals(samples, matrices) {
  const top = topOf(samples)
  for (let at = 0, m = 0; at < samples.length; at += 3, m += 4) {
    const [sine, cosine] = angleOf(matrices[m + 1], matrices[m + 3])
    turnNormal(samples, at, top, sine, cosine)
  }
}

/** Sine and cosine, in 1/8192, of the angle of (across, along), by integers of 32 bits. */
function angleOf(across, along) {
  let [v, w] = [across, along]
  while (Math.max(Math.abs(v), Math.abs(w)) > 32767) [v, w] = [v >> 1, w >> 1]
  while ((v || w) && Math.max(Math.abs(v), Math.abs(w)) < 16384) [v, w] = [2 * v, 2 * w]
  const length = Math.max(Math.floor(Math.sqrt(v * v + w * w)), 1)
  return [v, w].map((x) => Math.floor((ONE * x + (length >> 1)) / length))
}

/** Turn the normal at `samples[at]`, of which `top` stands for 1, by an angle of this sine and cosine, in 1/8192. */
export function turnNormal(samples, at, top, sine, cosine) {
  if (top === 1) {
    const [x, y] = [samples[at] - 0.5, samples[at + 1] - 0.5]
    samples[at] = 0.5 + (x * cosine - y * sine) / ONE
    samples[at + 1] = 0.5 + (x * sine + y * cosine) / ONE
    return
  }
  const [x, y] = [2 * samples[at] - top, 2 * samples[at + 1] - top]
  const middle = ONE * (top + 1)
  samples[at] = clamp((x * cosine - y * sine + middle) >> 14, 0, top)
  samples[at + 1] = clamp((x * sine + y * cosine + middle) >> 14, 0, top)
}
