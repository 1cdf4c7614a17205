/** The wavelets of lossless images, 5/3 and Haar, and their colour transform [7]. */

import { range } from '../numbers.js'

const FIVE_THREE = {
  scales: [1, 1],
  mix(x, n) {
    for (let k = 0; k < n; k += 2) x[k] -= (x[k ? k - 1 : 1] + x[k + 1 < n ? k + 1 : n - 2] + 2) >> 2
    for (let k = 1; k < n; k += 2) x[k] += (x[k - 1] + x[k + 1 < n ? k + 1 : n - 2]) >> 1
  },
}

const HAAR = {
  scales: [1, 1],
  mix(x, n) {
    for (let k = 1; k < n; k += 2) {
      const odd = x[k - 1] - x[k]
      x[k - 1] += x[k]
      x[k] = odd
    }
  },
}

/** As `NINE_SEVEN`, by the number of the wavelet. */
export const transforms = [null, FIVE_THREE, HAAR]

/** The passes of Haar [7.1]: per plane the threshold, and the power of two that a step above it takes. */
export function passesOf({ thresholds }) {
  const starts = [...new Set([...range(25).map((k) => 2 ** k), ...thresholds])].filter(Boolean).sort((a, b) => a - b)
  return starts.map((start, plane) => ({ start, shift: plane - 32 + Math.clz32(starts[plane + 1] - start - 1) }))
}

/** A mean as it would be coded; 0 for one that can not be. */
export function codedMean(mean, passes) {
  if (mean >= 2 ** 24) return 0
  const top = passes.findLastIndex(({ start }) => start <= mean)
  return top < 0 ? 0 : 2 ** top + (mean - passes[top].start) * 2 ** passes[top].shift
}

/** Undo YCoCg-R. */
export function inverseYcocg([first, second, third]) {
  for (let i = 0; i < first.length; i++) {
    const [luma, orange, green] = [first[i], second[i], third[i]]
    const t = luma - (green >> 1)
    second[i] = green + t
    third[i] = t - (orange >> 1)
    first[i] = third[i] + orange
  }
}
