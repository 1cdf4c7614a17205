/** Numbers and flags of a mesh [5.4]. */

import { BitDecoder } from '../bits.js'
import { INTEGER_COUNTERS, INTEGER_MIXERS, decodeInteger } from '../integers.js'

const PLAIN_KINDS = 6
const AXES = 5
const LONGEST = 32
const CONTEXTS = 512
const SIGNS = 256
const MODELLED = 3 // bits behind the first one

// Where counters begin.
const LENGTH = PLAIN_KINDS * INTEGER_COUNTERS
const SIGN = LENGTH + AXES * 4 * CONTEXTS * LONGEST
const DIGIT = SIGN + AXES * 2 * SIGNS
const DEEP = DIGIT + AXES * 2 * LONGEST * 64
const OPERATION = DEEP + LONGEST
const CHOICE = OPERATION + 28672
const COUNTERS = CHOICE + 512

// Where mixers begin; an axis has six for lengths, one for signs, one for digits.
const AXIS_MIXER = PLAIN_KINDS * INTEGER_MIXERS
const OPERATION_MIXER = AXIS_MIXER + 8 * AXES
const CHOICE_MIXER = OPERATION_MIXER + 8

/** How many bits a magnitude below 2^31 has. */
export const bitLength = (x) => 32 - Math.clz32(Math.abs(x))

/** A magnitude in half octaves. */
export function sizeClass(x) {
  const size = Math.abs(x)
  const length = bitLength(Math.min(size, 2 ** 31))
  return length < 2 ? length : 2 * length - 2 + (Math.floor(size / 2 ** (length - 2)) & 1)
}

/** 0, 1, 2 for 0, positive, negative. */
export const signOf = (x) => (x > 0 ? 1 : x < 0 ? 2 : 0)

export class MeshNumbers {
  constructor(reader) {
    this.reader = reader
    this.bits = new BitDecoder(COUNTERS, CHOICE_MIXER + 4, 36045)
    this.bits.setWeights(0, AXIS_MIXER, 72090)
    for (let axis = 0; axis < AXES; axis++) {
      this.bits.setWeights(AXIS_MIXER + 8 * axis, AXIS_MIXER + 8 * axis + 6, 18022)
    }
    this.bits.setWeights(OPERATION_MIXER, CHOICE_MIXER, 24030)
    this.bits.feed(reader.data.subarray(reader.place))
  }

  /** A bit from so many counters. */
  bit(count, mixer) {
    const bit = this.bits.bit(count, mixer, 255)
    if (bit < 0) this.reader.fail('triangles are missing')
    return bit
  }

  wrong() {
    this.reader.fail('a number of the mesh is outside what is allowed')
  }

  /** Check a number. */
  within(value, least, most) {
    if (value < least || value > most) this.wrong()
    return value
  }

  /** A number without a guess. */
  plain(kind) {
    const { done, value } = decodeInteger(this.bits, kind, 0).next()
    if (!done) this.reader.fail('triangles are missing')
    return value
  }

  choice(kind, first, second) {
    const { input } = this.bits
    input[0] = CHOICE + kind * 32 + first
    input[1] = CHOICE + 256 + kind * 32 + second
    return this.bit(2, CHOICE_MIXER + kind)
  }

  operation(k, places) {
    const { input } = this.bits
    input[0] = OPERATION + places[0] + k
    input[1] = OPERATION + 4096 + places[1] + k
    input[2] = OPERATION + 20480 + places[2] + k
    return this.bit(3, OPERATION_MIXER + k)
  }

  /** What a guess leaves over: its length, from four contexts; its sign, from two; its bits. */
  leftover(axis, places, signs) {
    const { input } = this.bits
    const mixer = AXIS_MIXER + 8 * axis
    let length = 0
    for (; length < LONGEST - 1; length++) {
      for (let k = 0; k < 4; k++) input[k] = LENGTH + ((axis * 4 + k) * CONTEXTS + places[k]) * LONGEST + length
      if (!this.bit(4, mixer + Math.min(5, length))) break
    }
    if (!length) return 0
    for (let k = 0; k < 2; k++) input[k] = SIGN + (axis * 2 + k) * SIGNS + signs[k]
    const negative = this.bit(2, mixer + 6)
    const low = Math.min(7, places[0] >> 2)
    const place = DIGIT + (axis * LONGEST + length) * 64
    let found = 1
    for (let b = length - 2; b >= 0; b--) {
      const isModelled = length - 2 - b < MODELLED
      input[0] = isModelled ? place + found : DEEP + b
      if (isModelled) input[1] = place + AXES * LONGEST * 64 + low * 8 + found
      found = 2 * found + this.bit(isModelled ? 2 : 1, mixer + 7)
    }
    return negative ? -found : found
  }
}
