/** The embedded coefficients of an image, resumable at any bit [7.2]. */

import { BitDecoder } from '../bits.js'
import { clamp, range } from '../numbers.js'
import { HL, LH, PADDING, layOutBands, linkTrees } from './bands.js'

// Flags of a coefficient; PADDING is one as well.
const SIGNIFICANT = 1
export const NEGATIVE = 2
const NEWLY = 4
const VISITED = 8
const ZTR = 16
const AWAKE = 32

// How many bits may be taken: for each byte of the stream, besides, and one a sample, so many of them a byte [7.2].
const SYMBOLS_A_BYTE = 128
const FREE_SYMBOLS = 2 ** 16
const MOST_A_BYTE = 1024

const DOMINANT = 6 // the queue that stands for the dominant pass
const NOWHERE = 9 // no queue
const THRESHOLDS = [26214, 13107, 6554, 3277, 1638, 786]

// A sign by the flags SIGNIFICANT and NEGATIVE: none, positive, negative as 0, 1, 2.
const SIGMA = [0, 1, 0, 2]
// Q(x) by t = min(255, x >> P).
const QUANTISED = Uint8Array.from(range(256), (t) =>
  t ? Math.min(15, 1 + Math.floor(2 * Math.log2(t / 2 + 0.5) + 0.5)) : 0,
)

// Where each context's counters begin.
const [S1, S2, S3, G1, G2, G3, G4, G5, R1, R2, Z1, Z2, Z3, COUNTERS] = (() => {
  const starts = [0]
  for (const size of [1408, 4096, 16384, 243, 243, 243, 81, 81, 192, 512, 704, 128, 1024]) {
    starts.push(starts.at(-1) + size)
  }
  return starts
})()
// Where each set of mixers begins.
const SIGNIFICANCE_MIXER = 0
const ZEROTREE_MIXER = 28
const SIGN_MIXER = 32
const REFINEMENT_MIXER = 36
const MIXERS = 39

/** Decodes coefficients: `known` magnitudes, signs in `flags`, and `lowestKnown`, the lowest plane of each. */
export class CoefficientDecoder {
  constructor(header) {
    const [bands, size, channelStep] = layOutBands(header)
    this.header = header
    this.bands = bands
    this.channelStep = channelStep
    this.order = [...bands].sort((a, b) => b.level - a.level || a.kind - b.kind || a.channel - b.channel)
    Object.assign(this, linkTrees(bands, size))
    this.known = new Int32Array(size)
    this.below = new Uint8Array(size) // 1 + the highest plane at which a descendant became significant
    this.lowestKnown = new Uint8Array(size)
    this.waiting = new Uint8Array(size).fill(NOWHERE) // in which queue
    this.list = new Int32Array(size)
    this.children = new Int32Array(4)
    this.queues = THRESHOLDS.map(() => [])
    this.refined = new Int32Array(4 * 11 * 2 * 2) // kind, level, first or later bit, value
    for (let n = 0; n < this.refined.length; n++) this.refined[n] = n & 1 ? 7 : 9
    this.bits = new BitDecoder(COUNTERS, MIXERS, 24030)
    this.bits.setWeights(SIGN_MIXER, REFINEMENT_MIXER, 14418)
    this.bits.setWeights(REFINEMENT_MIXER, MIXERS, 36045)
    this.symbols = 0 // bits taken
    this.mostSymbols = 0
    this.samples = header.height * header.width * header.channels
    this.significant = 0
    this.signPending = false
    this.plane = header.plane
    this.steps = this.#passes()
  }

  /** Decode as far as the bytes go; returns whether that is all. */
  feed(part) {
    this.bits.feed(part)
    const { length } = this.bits.data
    this.mostSymbols = Math.min(this.samples, MOST_A_BYTE * length) + SYMBOLS_A_BYTE * length + FREE_SYMBOLS
    return this.steps.next().done
  }

  /** The next bit; −1 where more bytes are needed, be it only to go on working. */
  #bit(count, mixer, limit) {
    if (this.symbols >= this.mostSymbols) return -1
    const bit = this.bits.bit(count, mixer, limit)
    if (bit >= 0) this.symbols++
    return bit
  }

  // A generator: it waits wherever a bit is not determined yet, and passes go on at `head`.
  *#passes() {
    for (this.plane = this.header.plane; this.plane >= 0; this.plane--) {
      const coded = this.order.filter((band) => this.plane >= band.lowest)
      this.#clearPlaneFlags()
      for (const queue of this.queues) queue.length = 0
      this.queue = this.head = 0
      this.count = this.#collect(coded, AWAKE | SIGNIFICANT, AWAKE)
      for (let k = 0; k < this.count; k++) this.#enqueue(this.list[k], 0)
      while (!this.#likelyPass()) yield
      this.head = 0
      this.count = this.#collect(coded, SIGNIFICANT | NEWLY, SIGNIFICANT)
      while (!this.#subordinatePass()) yield
      this.head = 0
      this.count = this.roots.length
      this.list.set(this.roots)
      while (!this.#dominantPass()) yield
    }
  }

  #clearPlaneFlags() {
    const { flags } = this
    for (let i = 0; i < flags.length; i++) flags[i] &= ~(NEWLY | VISITED | ZTR)
  }

  /** Put the coefficients of some bands that have these of the flags in `mask` into `list`; returns how many. */
  #collect(bands, mask, wanted) {
    const { flags, list } = this
    let count = 0
    for (const { awake, rows, columns, stride, start } of bands) {
      if (!awake) continue
      for (let r = 0; r < rows; r++) {
        for (let i = start + r * stride, end = i + columns; i < end; i++) {
          if ((flags[i] & mask) === wanted) list[count++] = i
        }
      }
    }
    return count
  }

  #likelyPass() {
    for (; this.queue < DOMINANT; this.queue++, this.head = 0) {
      const queue = this.queues[this.queue]
      for (; this.head < queue.length; this.head++) {
        const i = queue[this.head]
        if (this.waiting[i] !== this.queue) continue // it moved to a queue further up
        if (!this.#significance(i)) return false
        this.waiting[i] = NOWHERE
      }
    }
    return true
  }

  #subordinatePass() {
    for (; this.head < this.count; this.head++) if (!this.#refine(this.list[this.head])) return false
    return true
  }

  #dominantPass() {
    const { flags, bands, bandOf, below, list, child, children } = this
    for (; this.head < this.count; this.head++) {
      const i = list[this.head]
      const { kind, lowest } = bands[bandOf[i]]
      if (!(flags[i] & (SIGNIFICANT | VISITED)) && this.plane >= lowest && !this.#significance(i)) return false
      // Approximations have a flag even where all their children lie beyond the image.
      if (!(kind ? child[i] : this.header.levels)) continue
      if (!(flags[i] & SIGNIFICANT) && !below[i]) {
        const zerotree = this.#zerotree(i)
        if (zerotree < 0) return false
        if (zerotree) {
          flags[i] |= ZTR
          continue
        }
      }
      const more = this.#findChildren(i)
      for (let k = 0; k < more; k++) list[this.count++] = children[k]
    }
    return true
  }

  /** Put the children of i that are there into `children`; returns how many. */
  #findChildren(i) {
    const { kind, area, childStep } = this.bands[this.bandOf[i]]
    const first = this.child[i]
    let count = 0
    for (let k = 0; k < 4 && first; k++) {
      const place = kind ? first + (k >> 1) * childStep + (k & 1) : k < 3 ? i + (k + 1) * area : 0
      if (!(this.flags[place] & PADDING)) this.children[count++] = place
    }
    return count
  }

  // ---------------------------------------------------------------- contexts

  #quantise(x) {
    return QUANTISED[Math.min(255, x >> this.plane)]
  }

  /** Set `near`, `cousins` and `score`, which most contexts need. */
  #measure(i) {
    const { known } = this
    const { around, kind, cousins } = this.bands[this.bandOf[i]]
    const [p, q] = [around[1], around[3]]
    const along = known[i - p] + known[i + p]
    const across = known[i - q] + known[i + q]
    const corners = known[i - p - q] + known[i - p + q] + known[i + p - q] + known[i + p + q]
    const far = known[i - 2 * p] + known[i + 2 * p] + known[i - 2 * q] + known[i + 2 * q]
    this.near =
      kind === HL || kind === LH ? 3 * along + 7 * across + 2 * corners : 4 * (along + across) + 3 * corners
    this.cousins = kind ? known[i + cousins[0]] + known[i + cousins[1]] : 0
    this.score = this.near + 3 * known[this.parent[i]] + 2 * far + 2 * this.cousins + 4 * this.#before(i, known)
  }

  /** Sum of the values at the same place in the up to three channels before. */
  #before(i, values) {
    let sum = 0
    const { channel } = this.bands[this.bandOf[i]]
    for (let k = 1; k <= 3 && k <= channel; k++) sum += values[i - k * this.channelStep]
    return sum
  }

  #s1(i) {
    const { level, kind, channel } = this.bands[this.bandOf[i]]
    return S1 + ((this.#quantise(this.score) * 11 + level) * 4 + kind) * 2 + (channel > 0 ? 1 : 0)
  }

  /** Signs at some steps from i, each as 0, 1, 2. */
  #signs(i, steps, from, to) {
    let sum = 0
    for (let k = from; k < to; k++) sum = 3 * sum + SIGMA[this.flags[i + steps[k]] & 3]
    return sum
  }

  // ---------------------------------------------------------------- symbols: each false (or −1) if bytes are missing

  /** Decode whether i becomes significant, and its sign. */
  #significance(i) {
    const band = this.bands[this.bandOf[i]]
    if (!this.signPending) {
      const significant = this.#significanceBit(i, band)
      if (significant < 0) return false
      if (!significant) {
        this.flags[i] |= VISITED
        return true
      }
      this.signPending = true
    }
    const negative = this.#signBit(i, band)
    if (negative < 0) return false
    this.signPending = false
    this.#becomeSignificant(i, band, negative)
    return true
  }

  #significanceBit(i, { around, kind, channel }) {
    const { flags, known, parent, bits } = this
    const { input } = bits
    this.#measure(i)
    const up = known[parent[i]]
    let neighbours = 0
    for (let k = 0; k < 8; k++) neighbours = 2 * neighbours + (flags[i + around[k]] & SIGNIFICANT)
    input[0] = this.#s1(i)
    input[1] = S2 + ((2 * neighbours + (up > 0 ? 1 : 0)) * 4 + kind) * 2 + (channel > 0 ? 1 : 0)
    const related = this.#quantise(16 * up) * 16 + this.#quantise(8 * this.cousins)
    input[2] = S3 + (this.#quantise(this.near) * 256 + related) * 4 + kind
    return this.#bit(3, SIGNIFICANCE_MIXER + 4 * this.queue + kind, 255)
  }

  #signBit(i, { around, beyond, kind, cousins, channel }) {
    const { flags, parent, bits } = this
    const { input } = bits
    const last = Math.max(0, kind - 1)
    input[0] = G1 + this.#signs(i, around, 0, 4) * 3 + last
    input[1] = G2 + this.#signs(i, around, 4, 8) * 3 + last
    input[2] = G3 + this.#signs(i, beyond, 0, 4) * 3 + last
    input[3] = G4 + (kind ? 9 * SIGMA[flags[parent[i]] & 3] + this.#signs(i, cousins, 0, 2) : 0) * 3 + last
    let before = 0
    for (let k = 1; k <= 3 && k <= channel; k++) before = 3 * before + SIGMA[flags[i - k * this.channelStep] & 3]
    input[4] = G5 + before * 3 + last
    return this.#bit(5, SIGN_MIXER + kind, 400)
  }

  /** Enter a coefficient that became significant, and wake those round it. */
  #becomeSignificant(i, band, negative) {
    const { flags, parent, below, plane } = this
    const { around, beyond, cousins, channel } = band
    this.significant++
    this.known[i] = 1 << plane
    flags[i] |= SIGNIFICANT | NEWLY | (negative ? NEGATIVE : 0)
    this.lowestKnown[i] = plane
    for (let up = parent[i]; up && !below[up]; up = parent[up]) below[up] = plane + 1
    for (let k = 0; k < 8; k++) this.#wake(i + around[k])
    const children = this.#findChildren(i)
    for (let k = 0; k < children; k++) this.#wake(this.children[k])
    for (let k = 0; k < cousins.length; k++) this.#wake(i + cousins[k])
    if (channel + 1 < this.header.channels) this.#wake(i + this.channelStep)
    for (let k = 0; k < 4; k++) flags[i + beyond[k]] |= AWAKE
    band.awake = true
  }

  #wake(i) {
    const { flags } = this
    if (flags[i] & PADDING) return
    flags[i] |= AWAKE
    this.bands[this.bandOf[i]].awake = true
    if (this.queue === DOMINANT || flags[i] & (SIGNIFICANT | VISITED)) return
    if (this.plane >= this.bands[this.bandOf[i]].lowest) this.#enqueue(i, this.queue)
  }

  /** Let i wait in the queue that its likelihood calls for, from the queue `first` on. */
  #enqueue(i, first) {
    this.#measure(i)
    const chance = this.bits.counters[this.#s1(i)] >> 14
    let k = first
    while (k < DOMINANT && chance < THRESHOLDS[k]) k++
    if (k < DOMINANT && k < this.waiting[i]) {
      this.waiting[i] = k
      this.queues[k].push(i)
    }
  }

  #refine(i) {
    const { known, bits, plane } = this
    const { kind, level } = this.bands[this.bandOf[i]]
    const top = known[i] >> (plane + 1)
    const age = Math.min(2, 31 - Math.clz32(top))
    this.#measure(i)
    bits.input[0] = R1 + (this.#quantise(this.score) * 3 + age) * 4 + kind
    bits.input[1] = R2 + Math.min(31, top) * 16 + this.#quantise(this.near)
    const bit = this.#bit(2, REFINEMENT_MIXER + age, 400)
    if (bit < 0) return false
    known[i] |= bit << plane
    this.lowestKnown[i] = plane
    this.refined[((level * 4 + kind) * 2 + (age > 0 ? 1 : 0)) * 2 + bit]++
    return true
  }

  #zerotree(i) {
    const { flags, below, bits } = this
    const { around, kind, level, cousins } = this.bands[this.bandOf[i]]
    this.#measure(i)
    let most = 0
    for (let k = 0; k < 4; k++) most = Math.max(most, below[i + around[k]])
    for (let k = 0; k < cousins.length; k++) most = Math.max(most, below[i + cousins[k]])
    most = clamp(most - this.plane, 0, 7)
    const before = (flags[i + around[0]] & ZTR ? 1 : 0) + (flags[i + around[2]] & ZTR ? 2 : 0)
    const score = this.#quantise(this.score)
    bits.input[0] = Z1 + (score * 4 + kind) * 11 + level
    bits.input[1] = Z2 + (most * 4 + before) * 4 + kind
    bits.input[2] = Z3 + ((Math.min(7, score) * 8 + most) * 4 + before) * 4 + kind
    return this.#bit(3, ZEROTREE_MIXER + kind, 255)
  }
}
