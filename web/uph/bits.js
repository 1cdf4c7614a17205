/** The model and the arithmetic decoder of all coded bits [5.1]. */

import { GrowingBytes } from './bytes.js'
import { clamp, range } from './numbers.js'

const STRETCH = Int32Array.from(range(4096), (p) => {
  const q = (p + 0.5) / 4096
  return clamp(Math.round(256 * Math.log(q / (1 - q))), -2047, 2047)
})
const SQUASH = Int32Array.from(range(4096), (x) =>
  clamp(Math.round(65536 / (1 + Math.exp(-(x - 2048) / 256))), 16, 65520),
)
const RECIPROCALS = Int32Array.from(range(1024), (n) => Math.round(16384 / (n + 1.6)))

/** The most counters that one bit is predicted from. */
export const MAX_INPUTS = 5

const CODED_LIMIT = 255

/** Decodes bits. A caller puts counters into `input`, then asks for the bit that they and a mixer predict. */
export class BitDecoder {
  /** So many counters and mixers; the mixers' weights in 1/65536 at first. */
  constructor(counters, mixers = 0, weight = 0) {
    // Of each counter p, and n in the lowest ten bits: they are read together.
    this.counters = new Int32Array(counters).fill(1 << 29)
    // Sums of weights times logits may exceed 32 bits.
    this.weights = new Float64Array(MAX_INPUTS * mixers).fill(weight)
    this.input = new Int32Array(MAX_INPUTS)
    this.logits = new Int32Array(MAX_INPUTS)
    this.data = new GrowingBytes()
    this.place = 4 // bytes that code has taken, missing ones included
    this.low = this.code = 0
    this.high = this.unknownBits = 0xffffffff // unknownBits: where bytes of code are missing
  }

  /** Let mixers [first, end) start with another weight. */
  setWeights(first, end, weight) {
    this.weights.fill(weight, first * MAX_INPUTS, end * MAX_INPUTS)
  }

  /** How many bytes have come that no bit has needed. */
  get unread() {
    return Math.max(0, this.data.length - this.place)
  }

  /** Take further bytes. */
  feed(part) {
    this.data.push(part)
    this.code = this.unknownBits = 0
    for (let k = this.place - 4; k < this.place; k++) this.shift(k)
  }

  /** Shift the byte at a place into the code. */
  shift(place) {
    const there = place < this.data.length
    this.code = ((this.code << 8) | (there ? this.data.bytes[place] : 0)) >>> 0
    this.unknownBits = ((this.unknownBits << 8) | (there ? 0 : 255)) >>> 0
  }

  /** The next bit by counters in `input` and a mixer, or −1 if the bytes that have come do not determine it; then nothing has changed. */
  bit(count, mixer, limit) {
    const { counters, weights, input, logits } = this
    const base = mixer * MAX_INPUTS
    let sum = 0
    for (let k = 0; k < count; k++) {
      const logit = STRETCH[counters[input[k]] >> 18]
      logits[k] = logit
      sum += weights[base + k] * logit
    }
    const chance = SQUASH[2048 + clamp(Math.floor(sum / 65536), -2047, 2047)]
    const bit = this.#settle(chance)
    if (bit < 0) return bit
    const error = (bit << 16) - chance
    for (let k = 0; k < count; k++) {
      weights[base + k] += (logits[k] * error + 8192) >> 14
      this.#adapt(input[k], bit, limit)
    }
    return bit
  }

  /** The next bit, coded with a single counter; −1 as above. */
  coded(counter) {
    const bit = this.#settle(clamp(this.counters[counter] >> 14, 16, 65520))
    if (bit >= 0) this.#adapt(counter, bit, CODED_LIMIT)
    return bit
  }

  /** The same, waiting where bytes are missing. */
  *wait(counter) {
    let bit
    while ((bit = this.coded(counter)) < 0) yield
    return bit
  }

  /** The next bit, of which a 1 has a chance in 1/65536. */
  #settle(chance) {
    const span = this.high - this.low
    const middle = this.low + (span >>> 16) * chance + (((span & 65535) * chance) >>> 16)
    let bit
    if (this.code + this.unknownBits <= middle) {
      this.high = middle
      bit = 1
    } else if (this.code > middle) {
      this.low = middle + 1
      bit = 0
    } else return -1
    while ((this.low ^ this.high) >>> 24 === 0) {
      this.low = (this.low << 8) >>> 0
      this.high = ((this.high << 8) | 255) >>> 0
      this.shift(this.place++)
    }
    return bit
  }

  #adapt(counter, bit, limit) {
    const p = this.counters[counter] >> 10
    const n = this.counters[counter] & 1023
    const target = bit ? 0xfffff : 0
    this.counters[counter] = ((p + ((((target - p) >> 4) * RECIPROCALS[n]) >> 10)) << 10) | Math.min(n + 1, limit)
  }
}
