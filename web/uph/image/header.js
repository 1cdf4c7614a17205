/** The header of a coded image [6]. */

import { range } from '../numbers.js'
import { paddedPlaces } from './bands.js'

/** Samples of one image, places of its coefficients with padding, and samples of all maps together. */
const MAX_SAMPLES = 3_200_000
const MAX_PLACES = 3_300_000
export const MAX_MAP_SAMPLES = 4 * MAX_SAMPLES

export function parseImageHeader(reader, maxSide, maxChannels) {
  const start = reader.place
  const height = reader.u16('height of the image', maxSide, 1)
  const width = reader.u16('width of the image', maxSide, 1)
  const channels = reader.u8('number of channels', maxChannels, 1)
  const kind = reader.u8('kind of image')
  const wavelet = reader.within(kind & 3, 'wavelet', 0, 2, start + 5)
  const color = reader.within((kind >> 2) & 3, 'colour transform', 0, 2, start + 5)
  const depth = reader.within(kind >> 4, 'depth', 0, 2, start + 5)
  const levels = reader.u8('levels', 10)
  const plane = reader.u8('first plane', 24) - 1
  const fineness = reader.u8('fineness', 7)
  reader.within(height * width * channels, 'number of samples', 1, MAX_SAMPLES, start)
  if (color && (channels < 3 || (color === 1) !== (wavelet === 0))) {
    reader.fail(`colour transform is ${color}; allowed: 1 with 9/7, 2 with others, of 3 channels or more`, start)
  }
  const means = range(channels).map(() => reader.u16('mean'))
  const matrix = color === 1 ? range(9).map(() => reader.i16('matrix') / 16384) : null
  const thresholds = wavelet === 2 ? range(4).map(() => reader.u32('threshold', 2 ** 24 - 1)) : []
  let low = 0
  let high = 1
  if (depth === 2) {
    low = reader.float('low', 4)
    high = reader.float('high', 4)
    reader.within(low, 'low', -65504, high)
    reader.within(high, 'high', low, 65504)
  }
  const header = { height, width, channels, wavelet, color, depth, levels, plane, fineness, means, matrix, thresholds, low, high }
  reader.within(paddedPlaces(header), 'places with padding', 1, MAX_PLACES, start)
  return header
}
