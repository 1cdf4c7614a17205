/** Counters and mixers of the sources of grid plans [5.5]. */

import { BitDecoder } from '../bits.js'
import { INTEGER_COUNTERS, INTEGER_MIXERS } from './integers.js'

/** Numbers of a transferred block, in coded order, each with its f of number(f). */
export const TRANSFERRED_NUMBERS = [
  ...[['symmetry', 4], ['row', 0], ['column', 1]],
  ...[['sourceRow', 6], ['sourceColumn', 7], ['height', 2], ['width', 3], ['cut', 5]],
]
export const CHART_NUMBER = 8
export const LINK_NUMBER = 9
export const MATRIX_NUMBER = 10
/** What is added to f of a transferred block to which no other one leads. */
export const ALONE = 11
const NUMBERS = 19

/** Where counters begin: of runs of links, of centre matrices, of positions without block, of blocks with a mask … */
export const RUN = NUMBERS * INTEGER_COUNTERS
export const CENTRED = RUN + 9
export const SKIP = CENTRED + 1
export const CUT = SKIP + 54
/** … of flags that say where a source continues a neighbour's: by modes and guesses, guesses, modes above … */
export const FLAG = CUT + 2
export const FLAG_BY_GUESS = FLAG + 6 * 768
export const FLAG_BY_UPPER = FLAG_BY_GUESS + 6 * 12
/** … of small offsets from there, of sources off the pixels of their level, and of pixels, bit by bit, and by hash. */
export const OFFSET = FLAG_BY_UPPER + 6 * 64
export const OFF_PIXEL = OFFSET + 3 * 128
export const TREE = OFF_PIXEL + 41
export const HASHED = TREE + 4096
/** … of symmetries that are those of the block to the left or above, and of others, bit by bit. */
export const AS_BESIDE = HASHED + 3 * 65536
export const TURN = AS_BESIDE + 4
const COUNTERS = TURN + 8

/** Mixers. */
export const ONE_MIXER = NUMBERS * INTEGER_MIXERS
export const FLAG_MIXER = ONE_MIXER + 1
export const OFFSET_MIXER = FLAG_MIXER + 6
export const TREE_MIXER = OFFSET_MIXER + 2
export const OFF_PIXEL_MIXER = TREE_MIXER + 4
const MIXERS = OFF_PIXEL_MIXER + 1

export const LIMIT = 255

/** A decoder of the bits of such sources. */
export function gridBits() {
  const bits = new BitDecoder(COUNTERS, MIXERS, 72090)
  for (const [first, end, inputs] of [
    [FLAG_MIXER, OFFSET_MIXER, 3],
    [TREE_MIXER, OFF_PIXEL_MIXER, 4],
  ]) {
    bits.setWeights(first, end, Math.floor(72090 / inputs))
  }
  return bits
}

/** The mode of a block that continues none of its neighbours in a way that is told. */
export const NO_MODE = 7
