/** Levels of a map's pyramid, as painting reads them [8]. */

import { symmetricNormals } from './normals.js'
import { halve } from './pyramid.js'

/** A level of a `MapPyramid`: its picture, and `samples` with room for a row more; of a normal map one for each symmetry. */
export function levelOf({ picture, isNormal, levels: all }, number, symmetry) {
  const key = isNormal ? symmetry : 0
  const levels = (all[key] ??= [withSamples(key ? symmetricNormals(picture, key) : picture)])
  while (levels.length <= number) levels.push(withSamples(halve(levels.at(-1))))
  return levels[number]
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
