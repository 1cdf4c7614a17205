/** Bands of coefficients: how they lie in memory, and the trees that they form [7.1]. */

import { ceilDivide } from '../numbers.js'

/** Kinds of bands; HH is 3. */
export const LL = 0
export const HL = 1
export const LH = 2

/** Flag of a place that belongs to no coefficient. */
export const PADDING = 128

// What a coded value is divided by, per level from 0 on: LL, HL and LH, HH of the 9/7 wavelet [7.1].
const NORMS = [
  [1, 1, 1],
  [0.983, 1.0113, 1.0404],
  [1.0306, 0.9984, 0.9672],
  [1.0521, 1.0458, 1.0396],
  [1.0585, 1.0668, 1.0751],
  [1.0602, 1.0729, 1.0858],
  [1.0606, 1.0745, 1.0887],
  [1.0607, 1.0749, 1.0894],
]

/** How many low-pass samples there are of `size` after `level` levels. */
export function sizeAt(size, level) {
  return ceilDivide(size, 2 ** level)
}

/** How many places `layOutBands` takes for an image. */
export function paddedPlaces({ height, width, channels, levels }) {
  let area = 0
  for (let level = levels; level >= Math.min(levels, 1); level--) {
    const bands = level === levels ? (level ? 4 : 1) : 3
    area += bands * (sizeAt(width, level) + 2) * (sizeAt(height, level) + 4)
  }
  return area * channels + 4
}

/** Steps from a coefficient to those round it; p is along the high-pass, q across it. */
function neighbourSteps(kind, stride, area) {
  const [p, q] = kind === LH ? [stride, 1] : [1, stride]
  return {
    around: Int32Array.of(-p, p, -q, q, -p - q, p - q, q - p, p + q),
    beyond: Int32Array.of(-2 * p, 2 * p, -2 * q, 2 * q),
    cousins: Int32Array.from([[], [area, 2 * area], [-area, area], [-2 * area, -area]][kind]),
  }
}

/** Lowest plane of a band that holds bits, and what turns its coded values into coefficients. */
function scaleOf(wavelet, levels, level, kind) {
  if (wavelet === 2) return { lowest: 0, scale: 2 ** (20 - level) }
  if (!wavelet) {
    const norm = NORMS[Math.min(level, 7)][kind === LL ? 0 : kind < 3 ? 1 : 2]
    return { lowest: 0, scale: Math.round(2 ** 20 / norm) }
  }
  const lowest = levels ? level + (kind === LL ? 1 : kind < 3 ? 0 : -1) : 0
  return { lowest, scale: 1 / 2 ** lowest }
}

/**
 * Lay all bands of all channels out in one array, each with two rows of padding above and below and two columns
 * between rows, so that neighbours need no check. The bands of a level have regions of one size: a cousin, or the
 * same place in another channel, lies a fixed distance away. Returns [bands, places, places per channel].
 */
export function layOutBands({ height, width, channels, levels, wavelet }) {
  const bands = []
  let place = 2
  for (let channel = 0; channel < channels; channel++) {
    for (let level = levels; level >= Math.min(levels, 1); level--) {
      const rows = sizeAt(height, level)
      const columns = sizeAt(width, level)
      const stride = columns + 2
      const area = stride * (rows + 4)
      for (let kind = level === levels ? LL : HL; kind < (level ? 4 : 1); kind++) {
        bands.push({
          channel,
          level,
          kind,
          rows: kind >= LH ? sizeAt(height, level - 1) - rows : rows,
          columns: kind & 1 ? sizeAt(width, level - 1) - columns : columns,
          top: kind >= LH ? rows : 0,
          left: kind & 1 ? columns : 0,
          ...scaleOf(wavelet, levels, level, kind),
          stride,
          area,
          start: place + 2 * stride,
          childStep: 0, // from a row of children to the next
          awake: false,
          ...neighbourSteps(kind, stride, area),
        })
        place += area
      }
    }
  }
  return [bands, place + 2, (place - 2) / channels]
}

/**
 * The trees of coefficients: per place the parent, the first child (0: none) and the number of its band; flags, 0 at
 * coefficients and `PADDING` elsewhere; and the roots, in the order in which they are visited.
 */
export function linkTrees(bands, size) {
  const parent = new Int32Array(size)
  const child = new Int32Array(size)
  const bandOf = new Uint16Array(size)
  const flags = new Uint8Array(size).fill(PADDING)
  const roots = []
  const byKey = new Map(bands.map((band) => [`${band.channel} ${band.level} ${band.kind}`, band]))
  for (const band of [...bands].sort((a, b) => b.level - a.level || a.channel - b.channel || a.kind - b.kind)) {
    const above = byKey.get(`${band.channel} ${band.level + 1} ${band.kind}`)
    const n = bands.indexOf(band)
    if (above) above.childStep = band.stride
    for (let r = 0; r < band.rows; r++) {
      for (let c = 0; c < band.columns; c++) {
        const i = band.start + r * band.stride + c
        flags[i] = 0
        bandOf[i] = n
        if (above && r >> 1 < above.rows && c >> 1 < above.columns) {
          const up = above.start + (r >> 1) * above.stride + (c >> 1)
          parent[i] = up
          if (!child[up]) child[up] = i
        } else if (!above && band.kind) {
          parent[i] = i - band.kind * band.area
          child[parent[i]] = i
        } else roots.push(i)
      }
    }
  }
  return { parent, child, bandOf, flags, roots }
}
