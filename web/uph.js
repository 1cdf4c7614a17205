/**
 * Decoder of the formats `.uph` (textured surfaces) and `.ezw` (images), version 0, as SPEC.md describes them.
 *
 * One module without dependencies, for browsers, module workers and node. Feed bytes as they come, in pieces of
 * any size; the work is proportional to the new bytes. Numbers in brackets are sections of SPEC.md.
 */

/** A damaged file: `message` says what is wrong and what is allowed, `offset` at which byte. */
export class UphError extends Error {
  constructor(what, offset) {
    super(`byte ${offset}: ${what}`)
    this.name = 'UphError'
    this.offset = offset
  }
}

const MAX_FILE = 2 ** 30
const MAX_PATCHES = 65536
const MAX_POINTS = 2 ** 20
const MAX_BUILT = 2 ** 14
const MAX_CHARTS = 2 ** 18
const MAX_CHART = 16384
const MAX_TEXELS = 2 ** 31
const MAX_TILES = 2 ** 19
const MAX_PLACEMENTS = 2 ** 19
const MAX_CELLS = 2 ** 25
const MAX_SAMPLES = 3_200_000
const MAX_PLACES = 3_300_000
const MAX_MAP_SAMPLES = 4 * MAX_SAMPLES
const MOST_MAPS = 16

const clamp = (x, low, high) => Math.min(Math.max(x, low), high)
const ceilDivide = (a, b) => Math.ceil(a / b)
const indices = (count) => Array.from({ length: count }, (_, n) => n)

// ---------------------------------------------------------------- fields

/** Reads fields one after another; `offset` is where `data` begins in the file. */
class Fields {
  constructor(data, offset) {
    this.data = data
    this.start = offset
    this.place = 0
    this.view = new DataView(data.buffer, data.byteOffset, data.byteLength)
  }

  get left() {
    return this.data.length - this.place
  }

  fail(what, place = this.place) {
    throw new UphError(what, this.start + place)
  }

  /** The place of the next `count` bytes, which are taken. */
  take(count, name) {
    if (count > this.left) this.fail(`${name} takes ${count} bytes; ${this.left} are left`)
    this.place += count
    return this.place - count
  }

  within(value, name, least, most, place) {
    if (!(value >= least && value <= most)) {
      this.fail(`${name} is ${value}; allowed: ${least} to ${most}`, place)
    }
    return value
  }

  u8(name, most = 255, least = 0) {
    const place = this.take(1, name)
    return this.within(this.data[place], name, least, most, place)
  }

  u16(name, most = 65535, least = 0) {
    const place = this.take(2, name)
    return this.within(this.view.getUint16(place, true), name, least, most, place)
  }

  i16(name) {
    return this.view.getInt16(this.take(2, name), true)
  }

  number(name, bytes) {
    const place = this.take(bytes, name)
    const value = bytes === 8 ? this.view.getFloat64(place, true) : this.view.getFloat32(place, true)
    if (!Number.isFinite(value)) this.fail(`${name} is ${value}; allowed: finite numbers`, place)
    return value
  }

  varint(name, most, least = 0) {
    const start = this.place
    let value = 0
    for (let n = 0; ; n++) {
      if (n === 9) this.fail(`${name} is longer than 9 bytes`)
      const byte = this.data[this.take(1, name)]
      value += (byte & 127) * 2 ** (7 * n)
      if (byte < 128) {
        if (byte === 0 && n > 0) this.fail(`${name} is not in its shortest form`)
        return this.within(value, name, least, most, start)
      }
    }
  }

  end(name) {
    if (this.left) this.fail(`${this.left} bytes too many in ${name}`)
  }
}

/** Bytes that grow; `bytes` may be longer than `length`. */
class Growing {
  constructor() {
    this.bytes = new Uint8Array(256)
    this.length = 0
  }

  push(part) {
    const length = this.length + part.length
    if (length > this.bytes.length) {
      const old = this.bytes
      this.bytes = new Uint8Array(Math.max(length, 2 * old.length))
      this.bytes.set(old.subarray(0, this.length))
    }
    this.bytes.set(part, this.length)
    this.length = length
  }

  /** Drop bytes from the front. */
  drop(count) {
    this.bytes.copyWithin(0, count, this.length)
    this.length -= count
  }
}

const CRC = Uint32Array.from(indices(256), (n) => {
  for (let k = 0; k < 8; k++) n = n & 1 ? (n >>> 1) ^ 0xedb88320 : n >>> 1
  return n
})

function crc32(bytes, crc) {
  crc = ~crc
  for (let n = 0; n < bytes.length; n++) crc = CRC[(crc ^ bytes[n]) & 255] ^ (crc >>> 8)
  return ~crc >>> 0
}

// ---------------------------------------------------------------- model and arithmetic coder [5.1]

const STRETCH = Int32Array.from(indices(4096), (p) => {
  const q = (p + 0.5) / 4096
  return clamp(Math.round(256 * Math.log(q / (1 - q))), -2047, 2047)
})
const SQUASH = Int32Array.from(indices(4096), (x) =>
  clamp(Math.round(65536 / (1 + Math.exp(-(x - 2048) / 256))), 16, 65520),
)
const RECIPROCALS = Int32Array.from(indices(1024), (n) => Math.round(16384 / (n + 1.6)))
const MOST_INPUTS = 5

/** Decodes bits. A caller puts counters into `input`, then asks for the bit that they and a mixer predict. */
class BitReader {
  constructor(counters, mixers, weight) {
    this.p = new Int32Array(counters).fill(1 << 19)
    this.n = new Uint16Array(counters)
    // Sums of weights times logits may exceed 32 bits.
    this.weights = new Float64Array(MOST_INPUTS * mixers).fill(weight)
    this.input = new Int32Array(MOST_INPUTS)
    this.logits = new Int32Array(MOST_INPUTS)
    this.data = new Growing()
    this.place = 4 // bytes that code has taken, missing ones included
    this.low = this.code = 0
    this.high = this.slack = 0xffffffff
  }

  /** Bytes that have come and that no bit has needed. */
  get unread() {
    return Math.max(0, this.data.length - this.place)
  }

  feed(part) {
    this.data.push(part)
    this.code = this.slack = 0
    for (let k = this.place - 4; k < this.place; k++) this.shift(k)
  }

  shift(place) {
    const there = place < this.data.length
    this.code = ((this.code << 8) | (there ? this.data.bytes[place] : 0)) >>> 0
    this.slack = ((this.slack << 8) | (there ? 0 : 255)) >>> 0
  }

  /** The next bit, or −1 if the bytes that have come do not determine it; then nothing has changed. */
  bit(count, mixer, limit) {
    const { p, n, weights, input, logits } = this
    const base = mixer * MOST_INPUTS
    let sum = 0
    for (let k = 0; k < count; k++) {
      logits[k] = STRETCH[p[input[k]] >> 8]
      sum += weights[base + k] * logits[k]
    }
    const chance = SQUASH[2048 + clamp(Math.floor(sum / 65536), -2047, 2047)]
    const span = this.high - this.low
    const middle = this.low + (span >>> 16) * chance + (((span & 65535) * chance) >>> 16)
    let bit
    if (this.code + this.slack <= middle) {
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
    const error = (bit << 16) - chance
    const target = bit ? 0xfffff : 0
    for (let k = 0; k < count; k++) {
      const c = input[k]
      weights[base + k] += (logits[k] * error + 8192) >> 14
      p[c] += (((target - p[c]) >> 4) * RECIPROCALS[n[c]]) >> 10
      if (n[c] < limit) n[c]++
    }
    return bit
  }
}

// ---------------------------------------------------------------- image header [6]

function parseImageHeader(fields, mostSide, mostChannels) {
  const start = fields.place
  const height = fields.u16('height of the image', mostSide, 1)
  const width = fields.u16('width of the image', mostSide, 1)
  const channels = fields.u8('number of channels', mostChannels, 1)
  const kind = fields.u8('kind of image')
  const wavelet = fields.within(kind & 3, 'wavelet', 0, 2, start + 5)
  const color = fields.within((kind >> 2) & 3, 'colour transform', 0, 2, start + 5)
  const depth = fields.within(kind >> 4, 'depth', 0, 2, start + 5)
  const levels = fields.u8('levels', 10)
  const plane = fields.u8('first plane', 24) - 1
  const fineness = fields.u8('fineness', 7)
  fields.within(height * width * channels, 'number of samples', 1, MAX_SAMPLES, start)
  if (color && (channels < 3 || (color === 1) !== (wavelet === 0))) {
    fields.fail(`colour transform is ${color}; allowed: 1 with 9/7, 2 with others, of 3 channels or more`, start)
  }
  const means = indices(channels).map(() => fields.u16('mean'))
  const matrix = color === 1 ? indices(9).map(() => fields.i16('matrix') / 16384) : null
  let low = 0
  let high = 1
  if (depth === 2) {
    low = fields.number('low', 4)
    high = fields.number('high', 4)
    if (low > high) fields.fail(`range is ${low} to ${high}; allowed: rising`)
  }
  const header = { height, width, channels, wavelet, color, depth, levels, plane, fineness, means, matrix, low, high }
  layBands(header, (places) => fields.within(places, 'places with padding', 1, MAX_PLACES, start))
  return header
}

// ---------------------------------------------------------------- coefficients [7]

const LL = 0
const HL = 1
const LH = 2
const SIGNIFICANT = 1
const NEGATIVE = 2
const NEWLY = 4
const VISITED = 8
const ZTR = 16
const AWAKE = 32
const PADDING = 128
const DOMINANT = 6 // the queue that stands for the dominant pass
const NOWHERE = 9
const THRESHOLDS = [26214, 13107, 6554, 3277, 1638, 786]
const SIGMA = [0, 1, 0, 2]
const QUANTISED = Uint8Array.from(indices(256), (t) =>
  t ? Math.min(15, 1 + Math.floor(2 * Math.log2(t / 2 + 0.5) + 0.5)) : 0,
)
const POINTS = indices(64).map((o) => {
  const q = Math.min(0.499, (o + 0.5) / 64)
  const r = -2 * Math.log(q / (1 - q))
  return Math.round(64 * clamp(1 / r - 1 / (Math.exp(r) - 1), 0.3, 0.55))
})
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

// Where each context's counters begin.
const [S1, S2, S3, G1, G2, G3, G4, G5, R1, R2, Z1, Z2, Z3, COUNTERS] = (() => {
  const starts = [0]
  for (const size of [1408, 4096, 16384, 243, 243, 243, 81, 81, 192, 512, 704, 128, 1024]) {
    starts.push(starts.at(-1) + size)
  }
  return starts
})()
// Where each mixer set begins.
const SIGNIFICANCE_MIXER = 0
const ZEROTREE_MIXER = 28
const SIGN_MIXER = 32
const REFINEMENT_MIXER = 36
const MIXERS = 39

const sizeAt = (size, level) => ceilDivide(size, 2 ** level)

/**
 * Lay all bands of all channels out in one array, each with two rows of padding above and below and two columns
 * between rows, so that neighbours need no check. The bands of a level have regions of one size: a cousin, or the
 * same place in another channel, lies a fixed distance away. Returns [bands, places, places per channel].
 */
function layBands({ height, width, channels, levels, wavelet }, check) {
  const bands = []
  let place = 2
  for (let channel = 0; channel < channels; channel++) {
    for (let level = levels; level >= Math.min(levels, 1); level--) {
      const rows = sizeAt(height, level)
      const columns = sizeAt(width, level)
      const stride = columns + 2
      const area = stride * (rows + 4)
      const placed = (kind) => {
        const [p, q] = kind === LH ? [stride, 1] : [1, stride]
        return {
          around: Int32Array.of(-p, p, -q, q, -p - q, p - q, q - p, p + q),
          beyond: Int32Array.of(-2 * p, 2 * p, -2 * q, 2 * q),
          cousins: Int32Array.from([[], [area, 2 * area], [-area, area], [-2 * area, -area]][kind]),
        }
      }
      for (let kind = level === levels ? LL : HL; kind < (level ? 4 : 1); kind++) {
        const shift = wavelet && levels ? level + (kind === LL ? 1 : kind < 3 ? 0 : -1) : 0
        bands.push({
          channel,
          level,
          kind,
          rows: kind >= LH ? sizeAt(height, level - 1) - rows : rows,
          columns: kind & 1 ? sizeAt(width, level - 1) - columns : columns,
          top: kind >= LH ? rows : 0,
          left: kind & 1 ? columns : 0,
          lowest: shift,
          scale: wavelet
            ? 1 / 2 ** shift
            : Math.round(2 ** 20 / NORMS[Math.min(level, 7)][kind === LL ? 0 : kind < 3 ? 1 : 2]),
          stride,
          area,
          start: place + 2 * stride,
          childStep: 0,
          awake: false,
          ...placed(kind),
        })
        place += area
      }
    }
    check?.((place - 2) * channels + 4)
  }
  return [bands, place + 2, (place - 2) / channels]
}

/** Decodes an image's coefficients, and from them the image, as its stream comes. */
class ImageDecoder {
  constructor(header) {
    this.header = header
    const [bands, size, channelStep] = layBands(header)
    this.bands = bands
    this.channelStep = channelStep
    this.order = [...bands].sort((a, b) => b.level - a.level || a.kind - b.kind || a.channel - b.channel)
    this.parent = new Int32Array(size) // 0: none
    this.child = new Int32Array(size) // the first one; 0: none
    this.bandOf = new Uint16Array(size)
    this.known = new Int32Array(size)
    this.flags = new Uint8Array(size).fill(PADDING)
    this.below = new Uint8Array(size)
    this.lowestKnown = new Uint8Array(size)
    this.waiting = new Uint8Array(size).fill(NOWHERE)
    this.list = new Int32Array(size)
    this.children = new Int32Array(4)
    this.queues = THRESHOLDS.map(() => [])
    this.refined = new Int32Array(4 * 11 * 2 * 2) // kind, level, first or later bit, value
    for (let n = 0; n < this.refined.length; n++) this.refined[n] = n & 1 ? 7 : 9
    this.roots = this.#link()
    this.bits = new BitReader(COUNTERS, MIXERS, 24030)
    this.bits.weights.fill(14418, SIGN_MIXER * MOST_INPUTS, REFINEMENT_MIXER * MOST_INPUTS)
    this.bits.weights.fill(36045, REFINEMENT_MIXER * MOST_INPUTS)
    this.symbols = 0
    this.significant = 0
    this.complete = false
    this.signDue = false
    this.steps = this.#planes()
    if (header.plane < 0) this.feed(new Uint8Array(0))
  }

  /** Take further bytes; returns whether they changed anything. */
  feed(part) {
    const before = this.symbols
    this.bits.feed(part)
    this.complete = this.steps.next().done
    return this.symbols > before
  }

  // Trees [7.1]; returns the roots.
  #link() {
    const { bands, parent, child, flags, bandOf } = this
    const at = new Map(bands.map((band) => [`${band.channel} ${band.level} ${band.kind}`, band]))
    const roots = []
    for (const band of [...bands].sort((a, b) => b.level - a.level || a.channel - b.channel || a.kind - b.kind)) {
      const above = at.get(`${band.channel} ${band.level + 1} ${band.kind}`)
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
    return roots
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

  // Passes [7.2]. A generator: it waits wherever a bit is not determined yet, and passes go on at `head`.
  *#planes() {
    for (this.plane = this.header.plane; this.plane >= 0; this.plane--) {
      const coded = this.order.filter((band) => this.plane >= band.lowest)
      this.#forget()
      for (const queue of this.queues) queue.length = 0
      this.queue = this.head = 0
      this.count = this.#collect(coded, AWAKE | SIGNIFICANT, AWAKE)
      for (let k = 0; k < this.count; k++) this.#await(this.list[k], 0)
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

  #forget() {
    const { flags } = this
    for (let i = 0; i < flags.length; i++) flags[i] &= ~(NEWLY | VISITED | ZTR)
  }

  #likelyPass() {
    for (; this.queue < DOMINANT; this.queue++, this.head = 0) {
      const queue = this.queues[this.queue]
      for (; this.head < queue.length; this.head++) {
        const i = queue[this.head]
        if (this.waiting[i] !== this.queue) continue // it moved on
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

  #quantise(x) {
    return QUANTISED[Math.min(255, x >> this.plane)]
  }

  /** Set `near` and `score`, which most contexts need. */
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

  /** Let i wait in the queue that its likelihood calls for, from the queue `first` on. */
  #await(i, first) {
    this.#measure(i)
    const chance = this.bits.p[this.#s1(i)] >> 4
    let k = first
    while (k < DOMINANT && chance < THRESHOLDS[k]) k++
    if (k < DOMINANT && k < this.waiting[i]) {
      this.waiting[i] = k
      this.queues[k].push(i)
    }
  }

  #wake(i) {
    const { flags } = this
    if (flags[i] & PADDING) return
    flags[i] |= AWAKE
    this.bands[this.bandOf[i]].awake = true
    if (this.queue === DOMINANT || flags[i] & (SIGNIFICANT | VISITED)) return
    if (this.plane >= this.bands[this.bandOf[i]].lowest) this.#await(i, this.queue)
  }

  /** Signs at some steps from i, each as 0, 1, 2. */
  #signs(i, steps, from, to) {
    let sum = 0
    for (let k = from; k < to; k++) sum = 3 * sum + SIGMA[this.flags[i + steps[k]] & 3]
    return sum
  }

  /** Decode whether i becomes significant, and its sign; false if bytes are missing. */
  #significance(i) {
    const { flags, known, parent, bits, queue } = this
    const band = this.bands[this.bandOf[i]]
    const { around, beyond, kind, cousins, channel } = band
    const { input } = bits
    if (!this.signDue) {
      this.#measure(i)
      const up = known[parent[i]]
      let neighbours = 0
      for (let k = 0; k < 8; k++) neighbours = 2 * neighbours + (flags[i + around[k]] & SIGNIFICANT)
      input[0] = this.#s1(i)
      input[1] = S2 + ((2 * neighbours + (up > 0 ? 1 : 0)) * 4 + kind) * 2 + (channel > 0 ? 1 : 0)
      const related = this.#quantise(16 * up) * 16 + this.#quantise(8 * this.cousins)
      input[2] = S3 + (this.#quantise(this.near) * 256 + related) * 4 + kind
      const significant = bits.bit(3, SIGNIFICANCE_MIXER + 4 * queue + kind, 255)
      if (significant < 0) return false
      this.symbols++
      if (!significant) {
        flags[i] |= VISITED
        return true
      }
      this.signDue = true
    }
    const last = Math.max(0, kind - 1)
    input[0] = G1 + this.#signs(i, around, 0, 4) * 3 + last
    input[1] = G2 + this.#signs(i, around, 4, 8) * 3 + last
    input[2] = G3 + this.#signs(i, beyond, 0, 4) * 3 + last
    input[3] = G4 + (kind ? 9 * SIGMA[flags[parent[i]] & 3] + this.#signs(i, cousins, 0, 2) : 0) * 3 + last
    let before = 0
    for (let k = 1; k <= 3 && k <= channel; k++) before = 3 * before + SIGMA[flags[i - k * this.channelStep] & 3]
    input[4] = G5 + before * 3 + last
    const negative = bits.bit(5, SIGN_MIXER + kind, 400)
    if (negative < 0) return false
    this.symbols++
    this.significant++
    this.signDue = false
    known[i] = 1 << this.plane
    flags[i] |= SIGNIFICANT | NEWLY | (negative ? NEGATIVE : 0)
    this.lowestKnown[i] = this.plane
    for (let up = parent[i]; up && !this.below[up]; up = parent[up]) this.below[up] = this.plane + 1
    for (let k = 0; k < 8; k++) this.#wake(i + around[k])
    const children = this.#findChildren(i)
    for (let k = 0; k < children; k++) this.#wake(this.children[k])
    for (let k = 0; k < cousins.length; k++) this.#wake(i + cousins[k])
    if (channel + 1 < this.header.channels) this.#wake(i + this.channelStep)
    for (let k = 0; k < 4; k++) flags[i + beyond[k]] |= AWAKE
    band.awake = true
    return true
  }

  #refine(i) {
    const { known, bits, plane } = this
    const { kind, level } = this.bands[this.bandOf[i]]
    const top = known[i] >> (plane + 1)
    const age = Math.min(2, 31 - Math.clz32(top))
    this.#measure(i)
    bits.input[0] = R1 + (this.#quantise(this.score) * 3 + age) * 4 + kind
    bits.input[1] = R2 + Math.min(31, top) * 16 + this.#quantise(this.near)
    const bit = bits.bit(2, REFINEMENT_MIXER + age, 400)
    if (bit < 0) return false
    this.symbols++
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
    const bit = bits.bit(3, ZEROTREE_MIXER + kind, 255)
    if (bit >= 0) this.symbols++
    return bit
  }

  // Reconstruction [7.3]: one channel's coefficients, low-pass ones first along each axis.
  #coefficients(channel) {
    const { height, width, wavelet, fineness } = this.header
    const { flags, known, lowestKnown, refined } = this
    const out = new (wavelet ? Int32Array : Float64Array)(height * width)
    for (const band of this.bands) {
      if (band.channel !== channel) continue
      const points = [0, 2].map((later) => {
        const base = (band.level * 4 + band.kind) * 4 + later
        return POINTS[Math.floor((64 * refined[base + 1]) / (refined[base] + refined[base + 1]))]
      })
      for (let r = 0; r < band.rows; r++) {
        let place = (band.top + r) * width + band.left
        for (let i = band.start + r * band.stride, end = i + band.columns; i < end; i++, place++) {
          if (!known[i]) continue
          const u = lowestKnown[i]
          let value = known[i]
          if (!wavelet || u > band.lowest) value += (points[value >> (u + 1) ? 1 : 0] * 2 ** u) / 64
          value = flags[i] & NEGATIVE ? -value * band.scale : value * band.scale
          out[place] = wavelet ? Math.trunc(value) : value / 2 ** (20 + fineness)
        }
      }
    }
    return out
  }

  /** The image as far as it is known. */
  image() {
    const { height, width, channels, wavelet, color, depth, levels, means, matrix: m, low, high } = this.header
    const planes = indices(channels).map((channel) => {
      const plane = this.#coefficients(channel)
      invert(plane, height, width, levels, LIFTINGS[wavelet])
      return plane
    })
    const data = new [Uint8Array, Uint16Array, Float32Array][depth](height * width * channels)
    const most = depth ? 65535 : 255
    const step = (high - low) / 65535
    const [first, second, third] = planes
    for (let i = 0; i < height * width && color; i++) {
      const [c0, c1, c2] = [first[i], second[i], third[i]]
      if (color === 1) {
        first[i] = c0 * m[0] + c1 * m[1] + c2 * m[2]
        second[i] = c0 * m[3] + c1 * m[4] + c2 * m[5]
        third[i] = c0 * m[6] + c1 * m[7] + c2 * m[8]
      } else {
        const t = c0 - (c2 >> 1)
        second[i] = c2 + t
        third[i] = t - (c1 >> 1)
        first[i] = third[i] + c1
      }
    }
    planes.forEach((plane, k) => {
      const [mean, half] = [means[k], wavelet ? 0 : 0.5]
      for (let i = 0, place = k; i < plane.length; i++, place += channels) {
        const value = clamp(Math.floor(plane[i] + mean + half), 0, most)
        data[place] = depth === 2 ? value * step + low : value
      }
    })
    return { height, width, channels, data }
  }
}

// ---------------------------------------------------------------- transforms [7.4]

const ODD = 1.149604398860241

/** Take `factor` times the sum of its neighbours off every other sample, from `first` on. */
function lift(x, n, first, factor) {
  const last = n - 1
  if (!first) x[0] -= factor * (x[1] + x[1])
  for (let k = 2 - first; k < last; k += 2) x[k] -= factor * (x[k - 1] + x[k + 1])
  if ((last & 1) === first) x[last] -= factor * (x[last - 1] + x[last - 1])
}

// Per wavelet: what low-pass and high-pass samples are multiplied with, then how they are mixed.
const LIFTINGS = [
  {
    scales: [1 / ODD, ODD],
    mix(x, n) {
      lift(x, n, 0, 0.443506852043971)
      lift(x, n, 1, 0.882911075530934)
      lift(x, n, 0, -0.052980118572961)
      lift(x, n, 1, -1.586134342059924)
    },
  },
  {
    scales: [1, 1],
    mix(x, n) {
      for (let k = 0; k < n; k += 2) x[k] -= (x[k ? k - 1 : 1] + x[k + 1 < n ? k + 1 : n - 2] + 2) >> 2
      for (let k = 1; k < n; k += 2) x[k] += (x[k - 1] + x[k + 1 < n ? k + 1 : n - 2]) >> 1
    },
  },
  {
    scales: [1, 1],
    mix(x, n) {
      for (let k = 1; k < n; k += 2) {
        x[k - 1] -= x[k] >> 1
        x[k] += x[k - 1]
      }
    },
  },
]

/** Undo a level of a line of n samples, `step` apart. */
function undo(plane, start, step, n, line, { scales: [even, odd], mix }) {
  const low = (n + 1) >> 1
  for (let k = 0, at = start; k < n; k += 2, at += step) line[k] = plane[at] * even
  for (let k = 1, at = start + step * low; k < n; k += 2, at += step) line[k] = plane[at] * odd
  mix(line, n)
  for (let k = 0, at = start; k < n; k++, at += step) plane[at] = line[k]
}

/** Undo `levels` levels in place: of each, columns first. */
function invert(plane, height, width, levels, lifting) {
  const line = new plane.constructor(Math.max(height, width) + 1)
  for (let level = levels - 1; level >= 0; level--) {
    const rows = sizeAt(height, level)
    const columns = sizeAt(width, level)
    if (rows > 1) for (let c = 0; c < columns; c++) undo(plane, c, width, rows, line, lifting)
    if (columns > 1) for (let r = 0; r < rows; r++) undo(plane, r * width, 1, columns, line, lifting)
  }
}

// ---------------------------------------------------------------- surface and layout [2, 3]

const NUMBER = (fields, name) => fields.number(name, 8)
const asLength = (fields, name, value) => fields.within(value, name, 1e-9, 1e9)
const LENGTH = (fields, name) => asLength(fields, name, NUMBER(fields, name))
const LENGTH_OR_0 = (fields, name) => {
  const value = NUMBER(fields, name)
  return value && asLength(fields, name, value)
}
const SPAN = (fields, name) => fields.varint(name, 256, 3)
const SPANS = (fields, name) => [fields.varint(name, 256, 1), fields.varint(name, 256, 1)]
const EVEN_SPANS = (fields, name) => {
  const spans = SPANS(fields, name)
  if (spans.some((count) => count < 4 || count % 2)) fields.fail(`${name} is ${spans}; allowed: even numbers from 4 to 256`)
  return spans
}
const TILING = (fields, name) => fields.u8(name, 1)
// Per kind: parameters with their defaults and how they are read, and the number of patches.
const BUILT = [
  ['cyclide', { a: [6, LENGTH], c: [2, LENGTH_OR_0], mu: [3, NUMBER], spans: [[4, 4], EVEN_SPANS] }],
  ['torus', { R: [2, LENGTH], r: [0.7, LENGTH], spans: [[4, 4], EVEN_SPANS] }],
  ['sphere', { r: [1, LENGTH], tiling: [0, TILING] }, ({ tiling }) => (tiling ? 8 : 6)],
  ['plane', { width: [1, LENGTH], height: [1, LENGTH], spans: [[1, 1], SPANS] }],
  ['ellipsoid', { rx: [1.5, LENGTH], ry: [1, LENGTH], rz: [0.75, LENGTH] }, () => 8],
  ['cylinder', { r: [1, LENGTH], h: [2, LENGTH], spans: [4, SPAN] }, ({ spans }) => spans],
  ['cone', { r1: [1, LENGTH], r2: [0.4, LENGTH_OR_0], h: [1.5, LENGTH], spans: [4, SPAN] }, ({ spans }) => spans],
  ['vase', { radius: [0.8, LENGTH], height: [2.4, LENGTH], spans: [4, SPAN] }, ({ spans }) => 10 * spans],
]

function parseSurface(fields) {
  const kind = fields.u8('kind of surface', BUILT.length)
  const surface = kind ? parseBuilt(fields, BUILT[kind - 1]) : parseNets(fields)
  fields.end('surface')
  return surface
}

function parseBuilt(fields, [kind, parameters, count = ({ spans }) => spans[0] * spans[1]]) {
  const entries = Object.entries(parameters)
  const present = fields.left ? fields.u8('which parameters follow', 2 ** entries.length - 1) : 0
  const params = {}
  entries.forEach(([name, [value, read]], k) => {
    params[name] = (present >> k) & 1 ? read(fields, name) : value
  })
  const { a, c, mu, R, r } = params
  if (kind === 'cyclide' && !(c < a && c < mu && mu <= a)) fields.fail('a, c and mu are no ring: allowed: c < mu <= a')
  if (kind === 'torus' && !(r < R)) fields.fail(`r is ${r}; allowed: less than R, ${R}`)
  const patchCount = fields.within(count(params), 'number of patches', 1, MAX_BUILT)
  return { kind, params, patchCount }
}

function parseNets(fields) {
  const flags = fields.u8('flags of the nets', 7)
  const length = fields.varint('length of the name', 200)
  const name = new TextDecoder().decode(fields.data.slice(fields.take(length, 'name'), fields.place))
  const tolerance = fields.number('tolerance', 8)
  const count = fields.varint('number of patches', MAX_PATCHES, 1)
  const patches = []
  let total = 0
  for (let n = 0; n < count; n++) {
    const { m, n: k } =
      n && flags & 4 ? patches[0] : { m: fields.u8('degree', 32, 1), n: fields.u8('degree', 32, 1) }
    patches.push({ m, n: k })
    total += (m + 1) * (k + 1)
    if (total > MAX_POINTS) fields.fail(`nets have ${total} control points; allowed: ${MAX_POINTS}`)
  }
  const packed = fields.take(Math.ceil(total / 8), 'list of new points')
  const index = new Int32Array(total)
  let points = 0
  let last = 0
  const earlier = []
  for (let n = 0; n < total; n++) {
    if ((fields.data[packed + (n >> 3)] >> (n & 7)) & 1) index[n] = points++
    else earlier.push([n, points - 1])
  }
  for (const [n, most] of earlier) {
    const code = fields.varint('reference to a point', 2 * MAX_POINTS)
    last += code & 1 ? -(code + 1) / 2 : code / 2
    index[n] = fields.within(last, 'reference to a point', 0, most)
  }
  const [bytes, columns] = [flags & 1 ? 8 : 4, flags & 2 ? 4 : 3]
  if (points * columns * bytes > fields.left) fields.fail(`control points take more bytes than are left`)
  const net = new Float64Array(4 * points)
  for (let n = 0; n < points; n++) {
    for (let k = 0; k < columns; k++) net[4 * n + k] = fields.number('control point', bytes)
    const weight = columns === 4 ? net[4 * n + 3] : (net[4 * n + 3] = 1)
    fields.within(weight, 'weight', 1e-30, 1e30)
    for (let k = 0; k < 3; k++) {
      if (bytes === 4) net[4 * n + k] *= weight
      fields.within(net[4 * n + k], 'control point, times its weight', -1e30, 1e30)
    }
  }
  let place = 0
  for (const patch of patches) {
    const size = (patch.m + 1) * (patch.n + 1)
    patch.net = new Float64Array(4 * size)
    for (let k = 0; k < size; k++, place++) patch.net.set(net.subarray(4 * index[place], 4 * index[place] + 4), 4 * k)
  }
  return { kind: 'nets', name, tolerance, patches, patchCount: count }
}

/** Charts, and the scale at which those without placements show the exemplar. */
function parseLayout(fields, patchCount) {
  const flags = fields.u8('flags of the layout', 63)
  const scale = flags & 32 ? fields.u8('scale') - 128 : 0
  let patches
  if (flags & 1) patches = indices(patchCount)
  else {
    const count = fields.varint('number of charts', MAX_CHARTS, 1)
    if (count > fields.left) fields.fail(`${count} charts take more bytes than are left`)
    patches = indices(count).map(() => fields.varint('patch of a chart', patchCount - 1))
  }
  let texels = 0
  let height, width
  const charts = patches.map((patch, n) => {
    if (n === 0 || !(flags & 4)) {
      height = fields.varint('height of a chart', MAX_CHART, 1)
      width = flags & 8 ? height : fields.varint('width of a chart', MAX_CHART, 1)
    }
    texels += height * width
    return { patch, height, width, s0: 0, s1: 1, t0: 0, t1: 1 }
  })
  if (texels > MAX_TEXELS) fields.fail(`layout has ${texels} texels; allowed: ${MAX_TEXELS}`)
  if (!(flags & 2) && flags & 16) {
    const unit = 2 ** fields.u8('fineness of the charts', 16)
    for (const chart of charts) {
      for (const name of ['s', 't']) {
        const low = fields.varint('start of a chart', unit - 1)
        chart[`${name}0`] = low / unit
        chart[`${name}1`] = (low + 1 + fields.varint('extent of a chart', unit - 1 - low)) / unit
      }
    }
  } else if (!(flags & 2)) {
    for (const chart of charts) {
      for (const name of ['s0', 's1', 't0', 't1']) chart[name] = fields.number(name, 8)
      const { s0, s1, t0, t1 } = chart
      if (!(s0 >= 0 && s0 < s1 && s1 <= 1 && t0 >= 0 && t0 < t1 && t1 <= 1)) {
        fields.fail('a chart covers parameters outside 0 to 1, or none')
      }
    }
  }
  fields.end('layout')
  return [charts, scale]
}

// ---------------------------------------------------------------- M fields [3, 5.7]

const OCTAVE = 32
const ANGLES = 256
const UNIT = 4096
const MAX_NODES = 2 ** 21
const SIZE_LIMIT = 192
const SHEAR_LIMIT = 56
const LONGEST_RUN = 20
const COSINES = indices(ANGLES).map((k) => Math.round(2 ** 14 * Math.cos((2 * Math.PI * k) / ANGLES)))
const POWERS = indices(OCTAVE).map((k) => Math.round(2 ** 14 * 2 ** (k / OCTAVE)))
const PLAIN_FIELD = { margin: 0, rows: 1, columns: 1, matrices: Int32Array.of(UNIT, 0, 0, UNIT) }

/** Matrices of nodes (size down, size along, angle, shear). */
function makeField(nodes, margin, rows, columns) {
  const matrices = new Int32Array(nodes.length)
  for (let n = 0; n < nodes.length; n += 4) {
    const [b, a, angle, shear] = nodes.subarray(n, n + 4)
    for (const [at, steps, turned] of [
      [0, b, angle + shear + ANGLES / 4],
      [1, a, angle],
    ]) {
      const octave = Math.floor(steps / OCTAVE)
      const size = (POWERS[steps - OCTAVE * octave] << (6 + octave)) >> 6
      matrices[n + at] = Math.floor((size * COSINES[(turned - ANGLES / 4) & 255] + 32768) / 65536)
      matrices[n + 2 + at] = Math.floor((size * COSINES[turned & 255] + 32768) / 65536)
    }
  }
  return { margin, rows, columns, matrices }
}

/** M at a texel, written to `out`. */
function matrixAt({ margin, rows, columns, matrices }, row, column, out) {
  let [i, j, down, right] = [margin + (row >> 5), margin + (column >> 5), row & 31, column & 31]
  if (i < 0 || i >= rows - 1) [i, down] = [i < 0 ? 0 : rows - 1, 0]
  if (j < 0 || j >= columns - 1) [j, right] = [j < 0 ? 0 : columns - 1, 0]
  const [below, beside] = [Math.min(i + 1, rows - 1), Math.min(j + 1, columns - 1)]
  const a = 4 * (i * columns + j)
  const b = 4 * (i * columns + beside)
  const c = 4 * (below * columns + j)
  const d = 4 * (below * columns + beside)
  for (let k = 0; k < 4; k++) {
    const upper = (matrices[a + k] * (32 - right) + matrices[b + k] * right) * (32 - down)
    out[k] = (upper + (matrices[c + k] * (32 - right) + matrices[d + k] * right) * down + 512) >> 10
  }
  return out
}

function parseFields(fields, charts) {
  const alike = fields.u8('kinds of fields', 3)
  const margin = fields.u8('margin of the fields', 64)
  const kinds = charts.map(() => (alike === 3 ? fields.u8('kind of a field', 2) : alike))
  let total = 0
  const shapes = charts.map(({ height, width }, n) => {
    if (!kinds[n]) return null
    const covering = (texels) => 2 * margin + ceilDivide(texels, 32) + 1
    const shape =
      kinds[n] === 1
        ? [margin, covering(height), covering(width)]
        : [
            fields.varint('margin of a field', 64),
            fields.varint('rows of nodes', 1024, 1),
            fields.varint('columns of nodes', 1024, 1),
          ]
    total += shape[1] * shape[2]
    return shape
  })
  if (total > MAX_NODES) fields.fail(`fields have ${total} nodes; allowed: ${MAX_NODES}`)
  const bits = new BitReader(3000 + 1800 + 1344 + 1, 13, 24030)
  bits.weights.fill(72090, 12 * MOST_INPUTS)
  bits.feed(fields.data.subarray(fields.place))
  const fail = (what) => fields.fail(what)
  let first = new Int16Array(4)
  const found = shapes.map((shape) => {
    if (!shape) return null
    const nodes = readNodes(bits, shape[1], shape[2], first, fail)
    first = nodes.slice(0, 4)
    return makeField(nodes, ...shape)
  })
  if (bits.unread) fail(`${bits.unread} bytes too many in the fields`)
  return found
}

const folded = (x) => ((x + 128) & 255) - 128

/** Nodes of one chart, each told by how far it lies from where its neighbours lead. */
function readNodes(bits, rows, columns, first, fail) {
  const nodes = new Int16Array(4 * rows * columns)
  const left = new Int16Array(4 * rows * columns)
  const { input } = bits
  const next = (count, mixer) => {
    const bit = bits.bit(count, mixer, 255)
    if (bit < 0) fail('nodes of a field are missing')
    return bit
  }
  const at = (array, i, j, k) => (i < 0 || j < 0 || j >= columns ? 0 : array[4 * (i * columns + j) + k])
  for (let i = 0; i < rows; i++) {
    for (let j = 0; j < columns; j++) {
      for (let k = 0; k < 4; k++) {
        let [guess, x, y, z] = [first[k], 0, 0, 0]
        if (i && j) {
          const [west, north] = [at(nodes, i, j - 1, k), at(nodes, i - 1, j, k)]
          guess = west + north - at(nodes, i - 1, j - 1, k)
          if (j > 1) x = 2 * west - at(nodes, i, j - 2, k) - guess
          if (i > 1) y = 2 * north - at(nodes, i - 2, j, k) - guess
          if (j + 1 < columns) z = west + at(nodes, i - 1, j + 1, k) - north - guess
        } else if (j) {
          guess = at(nodes, 0, j - 1, k)
          if (j > 1) x = guess - at(nodes, 0, j - 2, k)
        } else if (i) {
          guess = at(nodes, i - 1, 0, k)
          if (i > 1) y = guess - at(nodes, i - 2, 0, k)
          if (columns > 1) z = at(nodes, i - 1, 1, k) - guess
        }
        if (k === 2) [x, y, z] = [folded(x), folded(y), folded(z)]
        const [w, n, ne] = [at(left, i, j - 1, k), at(left, i - 1, j, k), at(left, i - 1, j + 1, k)]
        const before = k ? at(left, i, j, k - 1) : 0
        const guesses = (clamp(x, -2, 2) + 2) * 25 + (clamp(y, -2, 2) + 2) * 5 + clamp(z, -2, 2) + 2
        const around = (clamp(w, -2, 2) + 2) * 15 + (clamp(n, -2, 2) + 2) * 3 + clamp(before, -1, 1) + 1
        const spread = Math.min(15, Math.abs(w) + Math.abs(n) + Math.abs(ne))
        let [size, sign] = [0, 1]
        for (let step = 0; step <= LONGEST_RUN; step++) {
          const near = Math.min(step, 5)
          input[0] = (k * 125 + guesses) * 6 + near
          input[1] = 3000 + (k * 75 + around) * 6 + near
          input[2] = 4800 + (k * 16 + spread) * 21 + step
          const bit = next(3, 3 * k + Math.min(step, 2))
          if (step === 1) sign = bit ? -1 : 1
          else if (bit) size++
          else break
        }
        if (size === LONGEST_RUN) {
          input[0] = 6144
          let more = 0
          for (let b = 0; b < 10; b++) more = 2 * more + next(1, 12)
          size += more
        }
        const place = 4 * (i * columns + j) + k
        const value = guess + sign * size
        left[place] = sign * size
        if (k !== 2 && Math.abs(value) > (k < 2 ? SIZE_LIMIT : SHEAR_LIMIT)) fail("a field's node is out of range")
        nodes[place] = k === 2 ? value & 255 : value
      }
    }
  }
  return nodes
}

// ---------------------------------------------------------------- placements [4, 5.2 to 5.4]

const MASK_RAMP = 1
const MASK_CUT = 2
const MOST_BENT = 2048
// Row per row, row per column, column per row, column per column.
const TURNS = [
  [1, 0, 0, 1],
  [0, 1, -1, 0],
  [-1, 0, 0, -1],
  [0, -1, 1, 0],
  [0, 1, 1, 0],
  [1, 0, 0, -1],
  [0, -1, -1, 0],
  [-1, 0, 0, 1],
]

const NO_CELLS = new Uint8Array(0)

const cellCount = ({ height, width, cell }) => ceilDivide(height, cell) * ceilDivide(width, cell)

/** The M field of a chart without placements, and how many texels so many pixels take at it. */
const scaleField = (scale) => (scale ? makeField(Int16Array.of(scale, scale, 0, 0), 0, 1, 1) : null)
const tileOf = (side, unit) => Math.max(1, Math.floor((side * UNIT + (unit >> 1)) / unit))

/** What a chart shows before its placements have come: the exemplar, repeated and mirrored. */
function mirrored(chart, exemplar, unit) {
  const placed = []
  const [height, width] = [tileOf(exemplar.height, unit), tileOf(exemplar.width, unit)]
  const middle = (n, size, side) => {
    const texel = n & 1 ? size - 1 - (size >> 1) : size >> 1
    return clamp((((2 * texel + 1) * unit) >> 9) - 8, 0, 16 * side - 1)
  }
  for (let i = 0; i * height < chart.height; i++) {
    for (let j = 0; j * width < chart.width; j++) {
      placed.push({
        row: i * height + (height >> 1),
        column: j * width + (width >> 1),
        height,
        width,
        sourceRow: middle(i, height, exemplar.height),
        sourceColumn: middle(j, width, exemplar.width),
        turn: [0, 5, 7, 2][2 * (i & 1) + (j & 1)],
        mask: 0,
      })
    }
  }
  return placed
}

/** What all kinds of plan share: two coded streams, sources and masks, each resumed as its bytes come. */
class Placements {
  constructor() {
    this.cells = NO_CELLS
    this.knownCells = 0
    this.masks = null
    this.knownCharts = new Set()
    this.changed = new Set()
  }

  feedSources(part) {
    this.sources.feed(part)
    this.sourceSteps.next()
  }

  feedMasks(part, fail) {
    if (!this.totalCells || this.known < this.total) fail('masks come where none are due')
    if (!this.masks) {
      this.cells = new Uint8Array(this.totalCells)
      this.masks = this.maskReader()
      this.maskSteps = this.codeMasks()
    }
    this.masks.feed(part)
    this.maskSteps.next()
  }

  maskReader() {
    return new BitReader(CELL_COUNTERS, 2, 24030)
  }

  /** Cells round (i, j) of a mask, as bits: w, n, nw, ne, ww, nn, and the one two to the right above. */
  around(first, i, j, columns) {
    const { cells } = this
    const at = first + i * columns + j
    const above = at - columns
    let found = j > 0 ? cells[at - 1] : 0
    if (j > 1) found += 16 * cells[at - 2]
    if (i > 1) found += 32 * cells[above - columns]
    if (i === 0) return found
    found += 2 * cells[above]
    if (j > 0) found += 4 * cells[above - 1]
    if (j + 1 < columns) found += 8 * cells[above + 1]
    if (j + 2 < columns) found += 64 * cells[above + 2]
    return found
  }

  /** Decode one mask of rows × columns cells [5.4]; `z` is its place in a strip. */
  *codeMask(rows, columns, z) {
    const { masks, cells } = this
    const start = this.knownCells
    const { input } = masks
    for (let i = 0; i < rows; i++) {
      const e = i === 0 ? 0 : i === rows - 1 ? 2 : 1
      for (let j = 0; j < columns; j++) {
        const around = this.around(start, i, j, columns) & 63
        const near = around & 15
        const part = Math.min(15, Math.floor((16 * j) / columns))
        input[0] = ((Math.min(i, 63) * 64 + Math.min(j, 63)) * 4 + z) * 4 + (near & 3)
        input[1] = 65536 + (around * 16 + part) * 2 + (i === 0 ? 1 : 0)
        input[2] = 67584 + (near * 64 + Math.min(j, 63)) * 3 + e
        let cell
        while ((cell = masks.bit(3, i === 0 ? 1 : 0, 400)) < 0) yield
        cells[this.knownCells++] = cell
      }
    }
  }
}

const CELL_COUNTERS = 65536 + 2048 + 3072

const hash = (x, y, z) =>
  (Math.imul(x, 2654435761) + Math.imul(y, 2246822519) + Math.imul(z, 3266489917)) >>> 16
// Where counters by name, and those by hash, begin.
const SOURCE_F = 0
const SOURCE_T = 128
const SOURCE_HASHED = 128 + 4096
const SOURCE_COUNTERS = SOURCE_HASHED + 3 * 65536

const edgeLength = (chart, edge) => (edge & 1 ? chart.height : chart.width)

/** A regular plan (method "paper"): blocks on a raster and along strips; only candidates are coded. */
class RegularPlacements extends Placements {
  constructor(fields, charts, exemplar) {
    super()
    this.charts = charts
    const block = (this.block = fields.varint('block', Math.min(256, exemplar.height, exemplar.width), 2))
    this.overlap = fields.varint('overlap', (block - 1) >> 1, 1)
    this.step = block - this.overlap
    this.half = block >> 1
    this.tile = 2 ** fields.u8('levels', 6)
    this.G = Math.floor((exemplar.height - block) / this.tile) + 1
    this.K = Math.floor((exemplar.width - block) / this.tile) + 1
    this.strips = this.#parseStrips(fields)
    fields.end('plan')
    this.stripsOf = new Map()
    this.strips.forEach((strip, n) => {
      for (const chart of new Set([strip.a, strip.b])) {
        if (!this.stripsOf.has(chart)) this.stripsOf.set(chart, [])
        this.stripsOf.get(chart).push(n)
      }
    })
    // Runs of sources: charts, then strips.
    this.starts = [0]
    for (const { height, width } of charts) this.starts.push(this.starts.at(-1) + this.#n(height) * this.#n(width))
    this.maskStarts = [0]
    for (const { length } of this.strips) {
      this.starts.push(this.starts.at(-1) + this.#n(length))
      this.maskStarts.push(this.maskStarts.at(-1) + this.#n(length) * this.side ** 2)
    }
    this.total = fields.within(this.starts.at(-1), 'number of placements', 0, MAX_PLACEMENTS)
    this.totalCells = fields.within(this.maskStarts.at(-1), 'number of cells', 0, MAX_CELLS / 2)
    this.known = 0
    this.chosen = new Int32Array(this.total)
    this.modes = new Uint8Array(this.total)
    this.sources = new BitReader(SOURCE_COUNTERS, 20, 18022)
    this.sourceSteps = this.#codeSources((what) => fields.fail(what))
  }

  #n(length) {
    return Math.max(1, ceilDivide(length - this.overlap, this.step))
  }

  #parseStrips(fields) {
    const { charts, block } = this
    const count = fields.varint('number of strips', 4 * MAX_PATCHES)
    this.cell = 0
    this.side = 0
    if (count) {
      this.cell = fields.u8('cell')
      this.feather = fields.u8('feather', 16)
      if (!this.cell || block % this.cell || block % 2) {
        fields.fail(`cell is ${this.cell}; allowed: divisors of the block, ${block}, which is even`)
      }
      this.side = block / this.cell
    }
    if (3 * count > fields.left) fields.fail(`${count} strips take more bytes than are left`)
    return indices(count).map(() => {
      const head = fields.u8('strip', 63)
      const a = fields.varint('chart', charts.length - 1)
      const b = fields.varint('chart', charts.length - 1)
      const [edgeA, edgeB] = [head & 3, (head >> 2) & 3]
      const [longA, longB] = [edgeLength(charts[a], edgeA), edgeLength(charts[b], edgeB)]
      let [start, length, other] = [0, longA, 0]
      if (head & 32) {
        start = fields.varint('start of a strip', longA)
        length = fields.varint('length of a strip', longA - start)
        other = fields.varint('start of a strip on its other chart', longB)
      }
      if (length < block || other + length > longB) {
        fields.fail(`strip of ${length} texels at ${other}; allowed: a block, ${block}, to what fits ${longB}`)
      }
      return { a, b, edgeA, edgeB, opposed: (head >> 4) & 1, start, length, other }
    })
  }

  // Sources [5.2].
  *#codeSources(fail) {
    const { charts, strips, starts, chosen, modes, sources, G, K } = this
    const { input } = sources
    const jump = Math.max(1, Math.floor(this.step / this.tile))
    const R = 32 - Math.clz32(G - 1)
    const W = 32 - Math.clz32(K - 1)
    for (let run = 0; run + 1 < starts.length; run++) {
      const s = run < charts.length ? 0 : 1
      const count = starts[run + 1] - starts[run]
      const across = s ? (strips[run - charts.length].edgeA & 1 ? 1 : count) : this.#n(charts[run].width)
      for (let n = 0; n < count; n++) {
        const here = starts[run] + n
        const [leftAt, topAt] = [n % across ? here - 1 : -1, n >= across ? here - across : -1]
        const [left, top] = [leftAt < 0 ? -1 : chosen[leftAt], topAt < 0 ? -1 : chosen[topAt]]
        const [m, m1] = [leftAt < 0 ? 3 : modes[leftAt], topAt < 0 ? 3 : modes[topAt]]
        const onward = left >= 0 && (left % K) + jump < K ? left + jump : -1
        const downward = top >= 0 && top + jump * K < G * K ? top + jump * K : -1
        const equal = onward === downward ? 1 : 0
        let found = -1
        for (let side = 0; side < 2 && found < 0; side++) {
          const guess = side ? downward : onward
          if (guess < 0 || (side && equal)) continue
          input[0] = SOURCE_F + (((s * 2 + side) * 4 + m) * 4 + m1) * 2 + equal
          input[1] = SOURCE_HASHED + 65536 + hash(left, top, 5000 + side)
          let x
          while ((x = sources.bit(2, 2 * s + side, 255)) < 0) yield
          if (x) {
            found = guess
            modes[here] = side + 1
          }
        }
        if (found < 0) {
          let node = 1
          let row = 0
          for (let b = 0; b < R + W; b++) {
            if (b === R) {
              row = node - 2 ** R
              node = 1
            }
            const c = b >= R ? 1 : 0
            const place = c ? node + 4096 * (1 + row) : node
            input[0] = SOURCE_T + c * 2048 + (node & 2047)
            input[1] = SOURCE_HASHED + hash(place, left + 1, s)
            input[2] = SOURCE_HASHED + 65536 + hash(place, top + 1, 7 + s)
            input[3] = SOURCE_HASHED + 131072 + hash(place, left + 1, top + 19)
            const mixer = 4 + ((s * 2 + (onward >= 0 ? 1 : 0)) * 2 + (downward >= 0 ? 1 : 0)) * 2 + c
            let x
            while ((x = sources.bit(4, mixer, 255)) < 0) yield
            node = 2 * node + x
          }
          if (W === 0) {
            row = node - 2 ** R
            node = 1
          }
          const column = node - 2 ** W
          if (row >= G || column >= K) fail(`source of block ${here} lies outside the exemplar`)
          found = row * K + column
        }
        chosen[here] = found
        this.known++
      }
      if (!s) {
        this.knownCharts.add(run)
        this.changed.add(run)
      }
    }
  }

  *codeMasks() {
    for (const strip of this.strips) {
      const count = this.#n(strip.length)
      for (let n = 0; n < count; n++) {
        yield* this.codeMask(this.side, this.side, (n === 0 ? 1 : 0) + (n === count - 1 ? 2 : 0))
        this.changed.add(strip.a).add(strip.b)
      }
    }
  }

  #source(candidate) {
    const { K, tile, half } = this
    return [16 * (Math.floor(candidate / K) * tile + half), 16 * ((candidate % K) * tile + half)]
  }

  /** The placements of a chart that is known, in painting order. */
  of(chart) {
    const { block, overlap, step, half, chosen, starts } = this
    const placed = []
    const across = this.#n(this.charts[chart].width)
    const own = { height: block, width: block, turn: 0, ramp: overlap }
    for (let n = 0; n < starts[chart + 1] - starts[chart]; n++) {
      const [r, c] = [Math.floor(n / across), n % across]
      const [sourceRow, sourceColumn] = this.#source(chosen[starts[chart] + n])
      const [row, column, mask] = [r * step + half, c * step + half, n ? MASK_RAMP : 0]
      placed.push({ ...own, row, column, mask, sides: (r ? 1 : 0) + (c ? 2 : 0), sourceRow, sourceColumn })
    }
    for (const n of this.stripsOf.get(chart) ?? []) {
      const strip = this.strips[n]
      const both = this.#stripBlocks(n)
      if (strip.a === chart) placed.push(...both.map(([onA]) => onA))
      if (strip.b === chart) placed.push(...both.map(([, onB]) => onB))
    }
    return placed
  }

  /** Row and column in B's grid of a texel of A's grid. */
  #toB({ a, b, edgeA, edgeB, opposed, start, length, other }, row, column) {
    const [chartA, chartB] = [this.charts[a], this.charts[b]]
    const depth = [-1 - row, column - chartA.width, row - chartA.height, -1 - column][edgeA]
    const along = (edgeA & 1 ? row : column) - start
    const there = other + (opposed ? length - 1 - along : along)
    return [
      [depth, there],
      [there, chartB.width - 1 - depth],
      [chartB.height - 1 - depth, there],
      [there, depth],
    ][edgeB]
  }

  /** The blocks of a strip whose cells are known: on A and on B. */
  #stripBlocks(index) {
    const { block, half, side, cell, feather, step, charts } = this
    const strip = this.strips[index]
    const { a, edgeA, start, length } = strip
    const area = side * side
    const upright = edgeA & 1
    const count = clamp(Math.floor((this.knownCells - this.maskStarts[index]) / area), 0, this.#n(length))
    // B's step for A's steps down and right; the way back is the transpose.
    const zero = this.#toB(strip, 0, 0)
    const down = this.#toB(strip, 1, 0).map((x, k) => x - zero[k])
    const right = this.#toB(strip, 0, 1).map((x, k) => x - zero[k])
    const turn = TURNS.findIndex(([p, q, r, s]) => p === down[0] && q === down[1] && r === right[0] && s === right[1])
    return indices(count).map((n) => {
      const along = start + Math.min(n * step, length - block) + half
      const line = [0, charts[a].width, charts[a].height, 0][edgeA]
      const [row, column] = upright ? [along, line] : [line, along]
      const [sourceRow, sourceColumn] = this.#source(this.chosen[this.starts[charts.length + index] + n])
      const coded = this.cells.subarray(this.maskStarts[index] + n * area)
      const cells = new Uint8Array(area)
      const cellsB = new Uint8Array(area)
      const near = this.#toB(strip, row - half, column - half)
      const far = this.#toB(strip, row - half + block - 1, column - half + block - 1)
      const [top, left] = [Math.min(near[0], far[0]), Math.min(near[1], far[1])]
      for (let i = 0; i < side; i++) {
        for (let j = 0; j < side; j++) {
          const value = (cells[i * side + j] = coded[upright ? i * side + j : j * side + i])
          const [r, c] = this.#toB(strip, row - half + i * cell, column - half + j * cell)
          cellsB[Math.floor((r - top) / cell) * side + Math.floor((c - left) / cell)] = value
        }
      }
      const shared = { height: block, width: block, mask: MASK_CUT, cell, feather }
      const onA = { ...shared, row, column, sourceRow, sourceColumn, turn: 0, cells }
      // B's centre, as steps from the texel that is A's top left one, taken back to A's steps.
      const [y, x] = [top + half - near[0], left + half - near[1]]
      const onB = {
        ...shared,
        row: top + half,
        column: left + half,
        sourceRow: sourceRow + 16 * (down[0] * y + down[1] * x - half),
        sourceColumn: sourceColumn + 16 * (right[0] * y + right[1] * x - half),
        turn,
        cells: cellsB,
      }
      return [onA, onB]
    })
  }
}

function checkPlacement(one, chart, field, exemplar, fail) {
  const { row, column, height, width, turn, mask, ramp, sourceRow, sourceColumn } = one
  const [top, left] = [row - (height >> 1), column - (width >> 1)]
  if (top >= chart.height || top + height <= 0 || left >= chart.width || left + width <= 0) {
    fail('does not touch its chart')
  }
  if (mask === MASK_RAMP && ramp < 1) fail('has a ramp 0 texels wide; allowed: 1 to 255')
  if (field) {
    if (Math.max(height, width) > MOST_BENT) fail(`is ${width}×${height}; allowed: ${MOST_BENT} with an M field`)
    return // its source lies in the exemplar, and reads are clamped
  }
  if ((sourceRow | sourceColumn) & 15) fail('has a source that is not on a whole pixel')
  const [p, q, r, s] = TURNS[turn]
  for (const y of [top - row, top + height - 1 - row]) {
    for (const x of [left - column, left + width - 1 - column]) {
      const [i, j] = [sourceRow / 16 + p * y + q * x, sourceColumn / 16 + r * y + s * x]
      if (i < 0 || i >= exemplar.height || j < 0 || j >= exemplar.width) fail('reads outside the exemplar')
    }
  }
}

const FIELD_COUNT = 13
const FIELD_ZERO = 0
const FIELD_SIGN = 4
const FIELD_LONGER = 5
const FIELD_DIGIT = 39
const FIELD_COUNTERS = FIELD_DIGIT + 35 * 64

/** number(f) [5.3]. */
function* readNumber(bits, f, context) {
  const { input } = bits
  const base = f * FIELD_COUNTERS
  let x
  input[0] = base + FIELD_ZERO + context
  while ((x = bits.bit(1, 5 * f, 255)) < 0) yield
  if (!x) return 0
  let length = 0
  while (length < 34) {
    input[0] = base + FIELD_LONGER + length
    while ((x = bits.bit(1, 5 * f + 1, 255)) < 0) yield
    if (!x) break
    length++
  }
  input[0] = base + FIELD_SIGN
  let negative
  while ((negative = bits.bit(1, 5 * f + 2, 255)) < 0) yield
  let number = 1
  for (let b = 0; b < length; b++) {
    input[0] = base + FIELD_DIGIT + length * 64 + (b < 6 ? number : 0)
    while ((x = bits.bit(1, 5 * f + (b < 6 ? 3 : 4), 255)) < 0) yield
    number = 2 * number + x
  }
  return negative ? -number : number
}

/** A general plan: every placement is told field by field; `unit` of a source is a pixel or 1/16 of it. */
class GeneralPlacements extends Placements {
  constructor(fields, charts, exemplar, bent, unit) {
    super()
    this.charts = charts
    this.bent = bent
    this.unit = unit
    this.ends = []
    this.total = 0
    for (let n = 0; n < charts.length; n++) {
      this.total += fields.varint('number of placements', MAX_PLACEMENTS)
      this.ends.push(this.total)
    }
    fields.within(this.total, 'number of placements', 0, MAX_PLACEMENTS)
    this.totalCells = fields.varint('number of cells', MAX_CELLS)
    fields.end('plan')
    this.placed = []
    this.exemplar = exemplar
    this.sources = new BitReader(FIELD_COUNT * FIELD_COUNTERS, FIELD_COUNT * 5, 72090)
    this.sourceSteps = this.#codePlacements((what) => fields.fail(what))
    if (!this.total) this.sourceSteps.next()
    for (let n = 0; this.ends[n] === 0; n++) {
      this.knownCharts.add(n)
      this.changed.add(n)
    }
  }

  get known() {
    return this.placed.length
  }

  // Fields [5.3].
  *#codePlacements(fail) {
    const { charts, sources, placed, ends, exemplar, unit } = this
    const most = (size) => (16 / unit) * size - 1
    const whole = [-(2 ** 31), 2 ** 31 - 1]
    const [size, byte] = [[1, 4096], [0, 255]]
    const limits = [
      ...[whole, whole, size, size, [0, 7], [0, 2], byte, byte, byte, [0, 16]],
      ...[[0, most(exemplar.height)], [0, most(exemplar.width)], whole],
    ]
    let before = new Array(FIELD_COUNT).fill(0)
    let cellsEnd = 0
    for (let chart = 0; chart < charts.length; chart++) {
      while (placed.length < ends[chart]) {
        const n = placed.length
        const values = []
        let differed = [0, 0]
        for (let f = 0; f < FIELD_COUNT; f++) {
          let guess = before[f]
          if (n && (f === 10 || f === 11)) guess += (16 / unit) * (values[f - 10] - before[f - 10])
          if (f === 12) guess = values[5] === MASK_CUT ? cellsEnd : -1
          const number = yield* readNumber(sources, f, 2 * differed[0] + differed[1])
          differed = [differed[1], number ? 1 : 0]
          const value = number + guess
          if (value < limits[f][0] || value > limits[f][1]) fail(`a field of placement ${n} is outside what is allowed`)
          values.push(value)
        }
        before = values
        const [row, column, height, width, turn, mask, sides, ramp, cell, feather] = values
        const [sourceRow, sourceColumn, first] = [unit * values[10], unit * values[11], values[12]]
        const one = { row, column, height, width, turn, mask, sides, ramp, cell, feather, sourceRow, sourceColumn }
        if (mask === MASK_CUT) {
          const count = cell ? cellCount(one) : Infinity
          if (first < 0 || first + count > this.totalCells) fail(`cells of placement ${n} are not there`)
          cellsEnd = first + count
          Object.assign(one, { first, count })
        }
        checkPlacement(one, charts[chart], this.bent[chart], exemplar, (what) => fail(`placement ${n} ${what}`))
        placed.push(one)
      }
      if (!this.knownCharts.has(chart)) {
        this.knownCharts.add(chart)
        this.changed.add(chart)
      }
    }
  }

  *codeMasks() {
    const cut = []
    for (let chart = 0, n = 0; chart < this.charts.length; chart++) {
      for (; n < this.ends[chart]; n++) {
        if (this.placed[n].mask === MASK_CUT) cut.push({ ...this.placed[n], chart })
      }
    }
    cut.sort((a, b) => a.first - b.first)
    const follow = cut.every(({ first }, n) => first === (n ? cut[n - 1].first + cut[n - 1].count : 0))
    if (follow && cut.length && cut.at(-1).first + cut.at(-1).count === this.totalCells) {
      for (const one of cut) {
        yield* this.codeMask(ceilDivide(one.height, one.cell), ceilDivide(one.width, one.cell), 0)
        this.changed.add(one.chart)
      }
    } else {
      const mark = () => cut.forEach(({ chart }) => this.changed.add(chart))
      for (const missing of this.codeMask(1, this.totalCells, 0)) {
        mark()
        yield missing
      }
      mark()
    }
  }

  of(chart) {
    return this.placed.slice(chart ? this.ends[chart - 1] : 0, this.ends[chart]).map((one) => {
      if (one.mask !== MASK_CUT) return one
      const end = one.first + one.count
      if (end > this.knownCells) return { ...one, mask: 0 }
      return { ...one, cells: this.cells.subarray(one.first, end) }
    })
  }
}

// ---------------------------------------------------------------- placements of method "quilt" [4, 5.5, 5.6]

const TOLD = ['rows', 'across', 'firstRow', 'firstColumn', 'height', 'width', 'stepRow', 'stepColumn', 'level', 'cell']
const BEFORE_ALL = {
  ...{ rows: 1, across: 1, firstRow: 20, firstColumn: 20, height: 40, width: 40 },
  ...{ stepRow: 28, stepColumn: 28, level: 0, cell: 2 },
}
const FAR = 2 ** 20
const TOLD_LIMITS = {
  ...{ rows: [1, FAR], across: [1, FAR], firstRow: [-FAR, FAR], firstColumn: [-FAR, FAR], height: [1, 4096] },
  ...{ width: [1, 4096], stepRow: [1, FAR], stepColumn: [1, FAR], level: [0, 12], cell: [1, 255] },
}
const MAX_RASTER_CELLS = 2 ** 26
// The numbers of a carried block, in coded order, and their places in number().
const CARRIED = [
  ...[['turn', 4], ['row', 0], ['column', 1], ['height', 2]],
  ...[['width', 3], ['cut', 5], ['sourceRow', 6], ['sourceColumn', 7]],
]
const NO_MODE = 7
const NEAR = 3
// Where counters begin.
const R_RUN = 10 * FIELD_COUNTERS
const R_SKIP = R_RUN + 2
const R_MASK = R_SKIP + 54
const R_FLAG = R_MASK + 2
const R_DELTA = R_FLAG + 6 * (768 + 12 + 64)
const R_OFF = R_DELTA + 3 * 128
const R_TREE = R_OFF + 41
const R_HASHED = R_TREE + 4096
const R_COUNTERS = R_HASHED + 3 * 65536
const R_MIXERS = [50, 51, 57, 59, 63, 64]
// What is known of a cell.
const [FREE, HELD, NEXT, NEW, UNSEEN] = [0, 1, 2, 3, 4]

/** A plan of rasters: on each chart what others' blocks leave on it, then its own. */
class RasterPlacements extends Placements {
  constructor(fields, charts, exemplar, bent) {
    super()
    Object.assign(this, { charts, exemplar, bent })
    this.fail = (what) => fields.fail(what)
    this.feather = fields.u8('feather', 16)
    this.order = indices(charts.length)
    if (fields.u8('whether charts are in another order', 1)) {
      this.order = charts.map(() => fields.varint('number of a chart', charts.length - 1))
      if (new Set(this.order).size < charts.length) this.fail('a chart comes twice in the order')
    }
    this.plans = this.#parsePlans(fields)
    fields.end('plan')
    this.starts = [0]
    for (const n of this.order) this.starts.push(this.starts.at(-1) + this.plans[n].blocks)
    this.total = this.starts.at(-1)
    this.totalCells = 0
    this.everyCell = 0
    this.records = []
    this.sources = new BitReader(R_COUNTERS, 64, 72090)
    for (const [from, to, inputs] of [[51, 57, 3], [59, 63, 4]]) {
      this.sources.weights.fill(Math.floor(72090 / inputs), from * MOST_INPUTS, to * MOST_INPUTS)
    }
    this.sourceSteps = this.#codeSources()
    this.sourceSteps.next()
  }

  get known() {
    return this.records.length
  }

  #parsePlans(fields) {
    let before = BEFORE_ALL
    let [blocks, positions] = [0, 0]
    return this.charts.map((chart) => {
      const changed = fields.varint('which numbers of a raster change', 2 ** TOLD.length - 1)
      const codes = TOLD.map((_, n) => ((changed >> n) & 1 ? fields.varint('change of a raster', 2 ** 24, 1) : 0))
      const plan = {}
      const reach = (length, first, size, step) => Math.max(1, 1 + ceilDivide(length - first + (size >> 1) - size, step))
      for (let n = TOLD.length - 1; n >= 0; n--) {
        const name = TOLD[n]
        let value = before[name]
        if (name === 'rows') value = reach(chart.height, plan.firstRow, plan.height, plan.stepRow)
        if (name === 'across') value = reach(chart.width, plan.firstColumn, plan.width, plan.stepColumn)
        value += codes[n] & 1 ? -(codes[n] + 1) / 2 : codes[n] / 2
        plan[name] = fields.within(value, `${name} of a raster`, ...TOLD_LIMITS[name], fields.place)
      }
      plan.carried = fields.varint('number of carried blocks', MAX_PLACEMENTS)
      plan.positions = plan.rows * plan.across
      plan.own = plan.positions - fields.varint('number of positions skipped', plan.positions)
      plan.blocks = plan.carried + plan.own
      blocks += plan.blocks
      positions += plan.positions
      fields.within(blocks, 'number of blocks', 0, MAX_PLACEMENTS)
      fields.within(positions, 'number of positions', 0, MAX_PLACEMENTS)
      before = plan
      return plan
    })
  }

  // Sources [5.5].
  *#codeSources() {
    for (const [place, n] of this.order.entries()) {
      const plan = this.plans[n]
      const { rows, across, carried, firstRow, firstColumn, stepRow, stepColumn } = plan
      const field = this.bent[n] ?? PLAIN_FIELD
      const base = this.starts[place]
      const wide = across + 2
      const lookup = new Int32Array((rows + 2) * wide).fill(-1)
      const { input } = this.sources
      for (let t = 0; t < carried; t++) {
        const one = yield* this.#codeCarried(place, plan, field)
        const i = Math.floor((one.row - firstRow + (stepRow >> 1)) / stepRow) + 1
        const j = Math.floor((one.column - firstColumn + (stepColumn >> 1)) / stepColumn) + 1
        lookup[clamp(i, 0, rows + 1) * wide + clamp(j, 0, across + 1)] = base + t
        this.records.push(one)
      }
      const owner = (at) => (lookup[at] < 0 ? 0 : lookup[at] < base + carried ? 1 : 2)
      let own = 0
      for (let i = 1; i <= rows; i++) {
        for (let j = 1; j <= across; j++) {
          const at = i * wide + j
          const rim = i === 1 || j === 1 || i === rows || j === across ? 1 : 0
          const beside = (owner(at - 1) * 3 + owner(at - wide)) * 3 + owner(at)
          input[0] = R_SKIP + 2 * beside + rim
          let there
          while ((there = this.sources.bit(1, R_MIXERS[0], 255)) < 0) yield
          if (!there) continue
          if (own === plan.own) this.fail(`chart ${n} has more blocks than its plan says`)
          let third = lookup[at]
          for (const step of [1, wide, wide + 1, 1 - wide, -1 - wide]) if (third < 0) third = lookup[at + step]
          const near = [lookup[at - 1], lookup[at - wide], third, lookup[at - wide - 1], lookup[at - wide + 1]]
          const one = {
            ...{ row: firstRow + (i - 1) * stepRow, column: firstColumn + (j - 1) * stepColumn, turn: 0, link: -1 },
            ...{ height: plan.height, width: plan.width, size: plan.cell },
          }
          yield* this.#codeOwn(one, near.map((k) => this.records[k]), plan, field, carried + own > 0)
          lookup[at] = base + carried + own++
          this.records.push(one)
        }
      }
      if (own !== plan.own) this.fail(`chart ${n} has other blocks than its plan says`)
      for (let k = base; k < this.records.length; k++) {
        const one = this.records[k]
        this.everyCell += (one.count = cellCount({ ...one, cell: one.size }))
        one.first = this.totalCells
        if (one.cut) this.totalCells += one.count
        checkPlacement(one, this.charts[n], this.bent[n], this.exemplar, (what) => this.fail(`block ${k} ${what}`))
      }
      if (this.everyCell > MAX_RASTER_CELLS) this.fail(`blocks have ${this.everyCell} cells; allowed: ${MAX_RASTER_CELLS}`)
      this.knownCharts.add(n)
      this.changed.add(n)
    }
  }

  /** Turn times M at a block's centre. */
  #place(one, field) {
    const m = matrixAt(field, one.row, one.column, [0, 0, 0, 0])
    const [p, q, r, s] = TURNS[one.turn]
    one.m = [p * m[0] + q * m[2], p * m[1] + q * m[3], r * m[0] + s * m[2], r * m[1] + s * m[3]]
  }

  /** Where a placed block would read at a texel. */
  #goingOn(one, field, row, column) {
    const here = matrixAt(field, row, column, [0, 0, 0, 0])
    const there = matrixAt(field, one.row, one.column, [0, 0, 0, 0])
    const [down, right] = [row - one.row, column - one.column]
    const y = Math.floor(((there[0] + here[0]) * down + (there[1] + here[1]) * right + 256) / 512)
    const x = Math.floor(((there[2] + here[2]) * down + (there[3] + here[3]) * right + 256) / 512)
    const [p, q, r, s] = TURNS[one.turn]
    return [one.sourceRow + p * y + q * x, one.sourceColumn + r * y + s * x]
  }

  *#codeLink(place) {
    const { records, starts, sources } = this
    const base = starts[place]
    const n = records.length
    const before = n > base ? records[n - 1].link : -1
    const further = n > base + 1 ? records[n - 2].link : -1
    let chart = 0
    let onward = -1
    if (before >= 0) {
      for (chart = 1; starts[place - chart] > before; ) chart++
      onward = before + 1
      if (further >= starts[place - chart] && further < before) onward = 2 * before - further
      if (onward >= starts[place - chart + 1]) onward = -1
    }
    if (onward >= 0) {
      sources.input[0] = R_RUN + (further >= 0 ? 1 : 0)
      let bit
      while ((bit = sources.bit(1, R_MIXERS[0], 255)) < 0) yield
      if (bit) return onward
    }
    const back = chart + (yield* readNumber(sources, 8, before >= 0 ? 1 : 0))
    if (back === 0) return -1
    if (back < 0 || back > place) this.fail('a block is carried from a chart that is not there')
    const first = starts[place - back]
    const link = (back === chart ? before : first) + (yield* readNumber(sources, 9, back === chart ? 1 : 0))
    if (link < first || link >= starts[place - back + 1]) this.fail('a block is carried that is not there')
    return link
  }

  *#codeCarried(place, plan, field) {
    const { records, exemplar } = this
    const link = yield* this.#codeLink(place)
    const one = { link, mode: NO_MODE, agrees: 0, size: plan.cell }
    let changed = link >= 0 ? 0 : 2
    const limits = { turn: [0, 7], cut: [0, 1], height: [1, 4096], width: [1, 4096] }
    limits.row = limits.column = [-16384 - 4096, 32768]
    limits.sourceRow = [0, 16 * exemplar.height - 1]
    limits.sourceColumn = [0, 16 * exemplar.width - 1]
    const n = records.length
    const before = n > this.starts[place] ? records[n - 1] : null
    const further = n > this.starts[place] + 1 ? records[n - 2] : null
    for (const [name, f] of CARRIED) {
      const value = yield* readNumber(this.sources, f, changed)
      changed = (changed & 2) | (value ? 1 : 0)
      one[name] = value + this.#carriedGuess(name, one, before, further, plan, field)
      if (!(one[name] >= limits[name][0] && one[name] <= limits[name][1])) this.fail(`${name} of block ${n} is out of range`)
      if (name === 'column') this.#place(one, field)
    }
    return one
  }

  /** What is likely for a number of a carried block. */
  #carriedGuess(name, one, before, further, plan, field) {
    const from = one.link < 0 ? null : this.records[one.link]
    const size = name === 'height' || name === 'width'
    if (name === 'cut' && !before) return 1
    if (size && from) {
      const [a, b, c, d] = one.m
      const [y, x] = name === 'height' ? [d, b] : [c, a]
      const tall = Math.abs(y * from.m[0] - x * from.m[2]) * from.height
      const wide = Math.abs(y * from.m[1] - x * from.m[3]) * from.width
      const cells = Math.floor(Math.floor((tall + wide) / Math.max(1, Math.abs(a * d - b * c))) / plan.cell)
      return Math.min((cells + 2) * plan.cell, 4096)
    }
    if (size && !before) return plan[name]
    if (name.startsWith('source')) {
      if (from) return from[name]
      if (!before) return 0
      return this.#goingOn(before, field, one.row, one.column)[name === 'sourceRow' ? 0 : 1]
    }
    if (!before) return 0
    if (name !== 'row' && name !== 'column') return before[name]
    if (from && before.link >= 0) {
      const other = this.records[before.link]
      const [down, right] = [from.row - other.row, from.column - other.column]
      const y = Math.floor((from.m[0] * down + from.m[1] * right) / 16)
      const x = Math.floor((from.m[2] * down + from.m[3] * right) / 16)
      const [a, b, c, d] = before.m
      let area = Math.floor((a * d - b * c) / 16)
      let number = name === 'row' ? d * y - b * x : a * x - c * y
      if (area < 0) [area, number] = [-area, -number]
      return before[name] + (area > 0 ? Math.floor((2 * number + area) / (2 * area)) : 0)
    }
    return further ? 2 * before[name] - further[name] : before[name]
  }

  *#codeOwn(one, near, plan, field, later) {
    const { sources, exemplar } = this
    const { input } = sources
    const { level } = plan
    let bit
    input[0] = R_MASK + (later ? 1 : 0)
    while ((bit = sources.bit(1, R_MIXERS[0], 255)) < 0) yield
    one.cut = bit
    this.#place(one, field)
    const [mostY, mostX] = [16 * exemplar.height - 1, 16 * exemplar.width - 1]
    const extent = (a, b) => Math.floor((Math.abs(a) * plan.height + Math.abs(b) * plan.width) / 512)
    const [tall, wide] = [extent(one.m[0], one.m[1]), extent(one.m[2], one.m[3])]
    const unit = 16 << level
    const pixel = (position) => (position + 8) >> (4 + level)
    const position = (p) => ((16 * p + 8) << level) - 8
    const guesses = [null, null, null]
    for (let g = 0; g < 3; g++) {
      if (!near[g] || near[g].turn) continue
      const [y, x] = this.#goingOn(near[g], field, one.row, one.column)
      if (y < 0 || y > mostY || x < 0 || x > mostX) continue
      if (g === 2 && guesses.some((guess) => guess && guess.y === y && guess.x === x)) continue
      const room = Math.min(y - tall, mostY - 15 - y - tall, x - wide, mostX - 15 - x - wide)
      guesses[g] = { y, x, inside: room >= unit ? 2 : room >= -unit ? 1 : 0 }
    }
    let apart = 3
    if (guesses[0] && guesses[1]) {
      const distance = Math.max(Math.abs(guesses[0].y - guesses[1].y), Math.abs(guesses[0].x - guesses[1].x))
      apart = distance === 0 ? 0 : distance <= NEAR * unit ? 1 : 2
    }
    const mode = (k) => (near[k] ? near[k].mode : NO_MODE)
    const around = mode(0) * 8 + mode(1)
    const upper = mode(3) * 8 + mode(4)
    one.mode = 0
    for (let step = 0; step < 6 && !one.mode; step++) {
      const g = step % 3
      const guess = guesses[g]
      if (!guess || (step === 1 && apart === 0)) continue
      const spot = apart * 3 + guess.inside
      input[0] = R_FLAG + (step * 64 + around) * 12 + spot
      input[1] = R_FLAG + 6 * 768 + step * 12 + spot
      input[2] = R_FLAG + 6 * 780 + step * 64 + upper
      while ((bit = sources.bit(3, R_MIXERS[1] + step, 255)) < 0) yield
      if (!bit) continue
      one.mode = 1 + step
      ;[one.sourceRow, one.sourceColumn] = [guess.y, guess.x]
      if (step < 3) continue
      const off = [0, 0]
      for (let axis = 0; axis < 2; axis++) {
        let node = 1
        while (node < 8) {
          input[0] = R_DELTA + g * 128 + (axis ? 8 + 8 * off[0] : 0) + node
          while ((bit = sources.bit(1, R_MIXERS[2] + axis, 255)) < 0) yield
          node = 2 * node + bit
        }
        off[axis] = node - 8
      }
      one.sourceRow = position(pixel(guess.y) + off[0] - NEAR)
      one.sourceColumn = position(pixel(guess.x) + off[1] - NEAR)
    }
    if (!one.mode) {
      const found = [0, 0]
      input[0] = R_OFF
      while ((bit = sources.bit(1, R_MIXERS[4], 255)) < 0) yield
      if (bit) {
        for (let axis = 0; axis < 2; axis++) {
          for (let b = 19; b >= 0; b--) {
            input[0] = R_OFF + 1 + 20 * axis + b
            while ((bit = sources.bit(1, R_MIXERS[4], 255)) < 0) yield
            found[axis] = 2 * found[axis] + bit
          }
        }
      } else {
        const cell = (guess) => (guess ? 1 + (pixel(guess.y) >> 2) * 1024 + (pixel(guess.x) >> 2) : 0)
        const [left, top] = [cell(guesses[0]), cell(guesses[1])]
        for (let axis = 0; axis < 2; axis++) {
          const bits = 32 - Math.clz32(pixel((axis ? mostX : mostY) - 15))
          let node = 1
          for (let b = 0; b < bits; b++) {
            const place = axis ? node + 4096 * (1 + found[0]) : node
            input[0] = R_TREE + 2048 * axis + (node & 2047)
            input[1] = R_HASHED + hash(place, left, 0)
            input[2] = R_HASHED + 65536 + hash(place, top, 7)
            input[3] = R_HASHED + 131072 + hash(place, left, top + 19)
            const mixer = R_MIXERS[3] + 2 * axis + (left || top ? 1 : 0)
            while ((bit = sources.bit(4, mixer, 255)) < 0) yield
            node = 2 * node + bit
          }
          found[axis] = node - 2 ** bits
        }
        found[0] = position(found[0])
        found[1] = position(found[1])
      }
      ;[one.sourceRow, one.sourceColumn] = found
    }
    if (!(one.sourceRow >= 0 && one.sourceRow <= mostY && one.sourceColumn >= 0 && one.sourceColumn <= mostX)) {
      this.fail('source of a block lies outside the exemplar')
    }
    one.agrees = 0
    for (let g = 0; g < 2; g++) {
      const guess = guesses[g]
      if (!guess) continue
      if (Math.abs(guess.y - one.sourceRow) <= unit && Math.abs(guess.x - one.sourceColumn) <= unit) one.agrees |= 1 << g
    }
  }

  maskReader() {
    const bits = new BitReader(8192 + 32768 + 8192 + 1, 65, 24030)
    bits.weights.fill(72090, 64 * MOST_INPUTS)
    return bits
  }

  // Masks [5.6].
  *codeMasks() {
    const { records, starts } = this
    for (const [place, n] of this.order.entries()) {
      const { height, width } = this.charts[n]
      const covered = new Uint8Array(height * width)
      for (let k = starts[place]; k < starts[place + 1]; k++) {
        const one = records[k]
        const own = k >= starts[place] + this.plans[n].carried
        const sight = one.cut ? this.#judge(one, own, covered, height, width) : null
        if (one.cut) {
          yield* this.#codeMask(one, own, sight)
          this.knownCells += one.count
          this.changed.add(n)
        }
        this.#cover(one, own || !one.cut, sight, covered, height, width)
      }
    }
  }

  /** What is known of each cell before it is coded, and whether its first texel is covered. */
  #judge(one, own, covered, tall, wide) {
    const { height, width, size } = one
    const [top, left] = [one.row - (height >> 1), one.column - (width >> 1)]
    const [rows, columns] = [ceilDivide(height, size), ceilDivide(width, size)]
    const known = new Uint8Array(rows * columns)
    const under = new Uint8Array(rows * columns).fill(1)
    const reach = this.feather
    for (let i = 0, at = 0; i < rows; i++) {
      const [r0, r1] = [top + i * size, top + Math.min(height, (i + 1) * size)]
      for (let j = 0; j < columns; j++, at++) {
        const [c0, c1] = [left + j * size, left + Math.min(width, (j + 1) * size)]
        if (r1 + reach <= 0 || c1 + reach <= 0 || r0 - reach >= tall || c0 - reach >= wide) {
          known[at] = UNSEEN
          continue
        }
        if (r0 >= 0 && r0 < tall && c0 >= 0 && c0 < wide) under[at] = covered[r0 * wide + c0]
        if (!own) continue
        for (let r = Math.max(r0, 0); r < Math.min(r1, tall) && known[at] === FREE; r++) {
          for (let c = Math.max(c0, 0); c < Math.min(c1, wide); c++) if (!covered[r * wide + c]) known[at] = NEW
        }
      }
    }
    if (!own) return { known, under, rows, columns }
    const isCovered = (r, c) => covered[clamp(r, 0, tall - 1) * wide + clamp(c, 0, wide - 1)]
    for (let i = 0, at = 0; i < rows; i++) {
      for (let j = 0; j < columns; j++, at++) {
        if (known[at] !== FREE) continue
        for (let a = Math.max(i - 1, 0); a < Math.min(i + 2, rows); a++) {
          for (let b = Math.max(j - 1, 0); b < Math.min(j + 2, columns); b++) {
            if (known[a * columns + b] === NEW) known[at] = NEXT
          }
        }
        if (known[at] !== FREE) continue
        const [r, c] = [top + i * size, left + j * size]
        if (
          (i === 0 && r > 0 && isCovered(top - 1, c)) ||
          (i === rows - 1 && top + height < tall && isCovered(top + height, c)) ||
          (j === 0 && c > 0 && isCovered(r, left - 1)) ||
          (j === columns - 1 && left + width < wide && isCovered(r, left + width))
        ) {
          known[at] = HELD
        }
      }
    }
    return { known, under, rows, columns }
  }

  /** Whether a point is outside the block that a carried one comes from (0), where that was old or new, or none (3). */
  #seenFrom(one, down, right) {
    if (one.link < 0) return 3
    const from = this.records[one.link]
    const [a, b, c, d] = from.m
    let area = a * d - b * c
    let y = Math.floor((one.m[0] * down + one.m[1] * right) / 16)
    let x = Math.floor((one.m[2] * down + one.m[3] * right) / 16)
    if (area < 0) [area, y, x] = [-area, -y, -x]
    area = Math.floor(area / 16)
    if (area === 0) return 3
    const row = Math.floor((d * y - b * x + area) / (2 * area)) + (from.height >> 1)
    const column = Math.floor((a * x - c * y + area) / (2 * area)) + (from.width >> 1)
    if (row < 0 || column < 0 || row >= from.height || column >= from.width) return 0
    if (!from.cut) return 2
    const across = ceilDivide(from.width, from.size)
    return 1 + this.cells[from.first + Math.floor(row / from.size) * across + Math.floor(column / from.size)]
  }

  *#codeMask(one, own, { known, under, rows, columns }) {
    const { masks, cells } = this
    const { input } = masks
    const { first, size } = one
    const [top, left] = [one.row - (one.height >> 1), one.column - (one.width >> 1)]
    let plain = 0
    if (own) {
      input[0] = 49152
      while ((plain = masks.bit(1, 64, 400)) < 0) yield
    }
    const told = (at) => known[at] !== UNSEEN && (plain || known[at] < NEXT)
    for (let at = 0; at < one.count; at++) if (!told(at)) cells[first + at] = 1
    const kind = own ? 0 : 1
    for (let i = 0, at = 0; i < rows; i++) {
      for (let j = 0; j < columns; j++, at++) {
        if (!told(at)) continue
        const shape = this.around(first, i, j, columns)
        const near = shape & 15
        const east = j + 1 < columns && known[at + 1] >= NEXT ? 1 : 0
        const south = i + 1 < rows && known[at + columns] >= NEXT ? 2 : 0
        const aslant = i + 1 < rows && j > 0 && known[at + columns - 1] >= NEXT ? 4 : 0
        const held = known[at] === HELD || (kind && under[at]) ? 1 : 0
        let [right, down] = [0, 0]
        while (right < 7 && j + right + 1 < columns && known[at + right + 1] < NEXT) right++
        while (down < 7 && i + down + 1 < rows && known[at + (down + 1) * columns] < NEXT) down++
        const sort = kind
          ? this.#seenFrom(one, 2 * (top + i * size - one.row) + size - 1, 2 * (left + j * size - one.column) + size - 1)
          : one.agrees
        input[0] = ((kind * 128 + shape) * 8 + east + south + aslant) * 4 + sort
        input[1] = 8192 + ((kind * 1024 + Math.min(i, 31) * 32 + Math.min(j, 31)) * 4 + (near & 3)) * 4 + sort
        input[2] = 40960 + (((kind * 8 + right) * 8 + down) * 16 + near) * 4 + sort
        const mixer = (kind * 16 + near) * 2 + held
        let bit
        while ((bit = masks.bit(3, mixer, 400)) < 0) yield
        cells[first + at] = bit
      }
    }
  }

  /** Enter what a block covers: its rectangle, or of a carried one the cells that are new with all round them. */
  #cover(one, whole, sight, covered, tall, wide) {
    const { height, width, size, first } = one
    const [top, left] = [one.row - (height >> 1), one.column - (width >> 1)]
    const [rows, columns] = [ceilDivide(height, size), ceilDivide(width, size)]
    const { cells } = this
    if (whole) {
      const [c0, c1] = [Math.max(left, 0), Math.min(left + width, wide)]
      for (let r = Math.max(top, 0); r < Math.min(top + height, tall); r++) covered.fill(1, r * wide + c0, r * wide + c1)
      return
    }
    for (let i = 0; i < rows; i++) {
      const [r0, r1] = [Math.max(top + i * size, 0), Math.min(top + Math.min(height, (i + 1) * size), tall)]
      for (let j = 0; j < columns; j++) {
        const [c0, c1] = [Math.max(left + j * size, 0), Math.min(left + Math.min(width, (j + 1) * size), wide)]
        if (r0 >= r1 || c0 >= c1) continue
        let good = cells[first + i * columns + j] === 1
        for (let k = 0; k < 9 && good; k++) {
          const [a, b] = [i + Math.floor(k / 3) - 1, j + (k % 3) - 1]
          const at = a * columns + b
          good = a >= 0 && b >= 0 && a < rows && b < columns && (cells[first + at] === 1 || sight.under[at] === 1)
        }
        if (!good) continue
        for (let r = r0; r < r1; r++) for (let c = c0; c < c1; c++) covered[r * wide + c] = 1
      }
    }
  }

  of(chart) {
    const place = this.order.indexOf(chart)
    return this.records.slice(this.starts[place], this.starts[place + 1]).map((one) => {
      const end = one.first + one.count
      if (!one.cut || end > this.knownCells) return { ...one, mask: 0 }
      const cells = this.cells.subarray(one.first, end)
      return { ...one, mask: MASK_CUT, cell: one.size, feather: this.feather, cells }
    })
  }
}

// ---------------------------------------------------------------- painting [8]

// How a run of texels is painted: opaque with nothing above, opaque below something, or over what is there.
const FINAL = 1
const BASE = 2
const BLEND = 3
// What lies above a texel: nothing, something that is blended, something opaque.
const [BARE, VEILED, HIDDEN] = [0, 1, 2]
const STRIP = 2 ** 18 // texels painted at once, but at least 64 rows
const MOST_LAYERS = 12 // on average; more are painted one by one
const KEPT_BYTES = 2 ** 26

/** Arrays that are used again and again, by name: at least so long, what is in them counts for nothing. */
class Scratch {
  take(name, Kind, length) {
    if (!(this[name]?.length >= length)) this[name] = new Kind(length)
    return this[name]
  }
}

/** Weights of a placement, 0 to 256: height × width; null if all are 256. */
function weigh(one, scratch) {
  if (!one.mask) return null
  const weights = scratch.take('weights', Uint16Array, one.height * one.width)
  if (one.mask === MASK_RAMP) slope(one, weights)
  else feather(one, weights, scratch.take('feathered', Uint16Array, one.height * one.width))
  return weights
}

function slope({ height, width, sides, ramp }, weights) {
  const factor = (n, side) => (sides & side && n < ramp ? Math.floor(((2 * n + 1) * 128) / ramp) : 256)
  const factors = indices(width).map((j) => factor(j, 2))
  for (let i = 0, k = 0; i < height; i++) {
    const down = factor(i, 1)
    for (let j = 0; j < width; j++) weights[k++] = (down * factors[j]) >> 8
  }
}

function feather({ height, width, cell, feather, cells }, weights, spare) {
  for (let i = 0, at = 0; i < height; i++) {
    const start = i * width
    if (i % cell) {
      weights.copyWithin(start, start - width, start)
      continue
    }
    for (let k = start; k < start + width; at++) {
      for (const end = Math.min(k + cell, start + width); k < end; k++) weights[k] = cells[at] << 8
    }
  }
  spare.set(weights.subarray(0, height * width))
  const spans = mixedSpans(height, width, cell, feather, cells)
  for (let pass = 0; pass < feather; pass++) {
    for (const [i, start, end] of spans) {
      const k = i * width
      smooth(weights, spare, k + start, k + end, i ? -width : 0, i < height - 1 ? width : 0)
    }
    for (const [i, start, end] of spans) {
      const k = i * width
      const last = width - 1
      if (start === 0) smooth(spare, weights, k, k + 1, 0, last ? 1 : 0)
      if (end === width && last) smooth(spare, weights, k + last, k + width, -1, 0)
      smooth(spare, weights, k + Math.max(start, 1), k + Math.min(end, last), -1, 1)
    }
  }
}

/** One step of feathering for the weights [k, end), whose neighbours lie `before` and `behind`. */
function smooth(from, to, k, end, before, behind) {
  for (; k < end; k++) to[k] = (51 * (from[k + before] + from[k + behind]) + 154 * from[k] + 128) >> 8
}

/** Rows of texels [row, start, end) that feathering may change: those of cells not far from one that differs. */
function mixedSpans(height, width, cell, feather, cells) {
  const reach = ceilDivide(feather, cell)
  const [rows, across] = [ceilDivide(height, cell), ceilDivide(width, cell)]
  const mixed = new Uint8Array(rows * across)
  for (let a = 0, at = 0; a < rows; a++) {
    for (let b = 0; b < across; b++, at++) {
      const beside = b + 1 < across && cells[at] !== cells[at + 1]
      const below = a + 1 < rows && cells[at] !== cells[at + across]
      if (!beside && !below) continue
      for (let i = Math.max(a - reach, 0); i <= Math.min(a + 1 + reach, rows - 1); i++) {
        mixed.fill(1, i * across + Math.max(b - reach, 0), i * across + Math.min(b + 2 + reach, across))
      }
    }
  }
  const spans = []
  for (let i = 0; i < height; i++) {
    const line = Math.floor(i / cell) * across
    for (let b = 0; b < across; b++) {
      const start = b
      while (b < across && mixed[line + b]) b++
      if (b > start) spans.push([i, start * cell, Math.min(b * cell, width)])
    }
  }
  return spans
}

/** The next level of a pyramid: half the size, prefiltered by (1, 3, 3, 1)/8. */
function halve({ height, width, channels, data }) {
  const real = data instanceof Float32Array
  // Along an axis of `size`, with `inner` samples a step, `outer` times.
  const filter = (from, outer, size, inner) => {
    const half = (size + 1) >> 1
    const out = new (real ? Float32Array : Int32Array)(outer * half * inner)
    const step = (n) => clamp(n, 0, size - 1) * inner
    for (let o = 0, to = 0; o < outer; o++) {
      for (let n = 0; n < size; n += 2) {
        const [a, b, c, d] = [step(n - 1), step(n), step(n + 1), step(n + 2)]
        for (let k = o * size * inner, end = k + inner; k < end; k++, to++) {
          const [ends, middle] = [from[a + k] + from[d + k], from[b + k] + from[c + k]]
          out[to] = real ? Math.fround(ends) + Math.fround(3 * Math.fround(middle)) : ends + 3 * middle
        }
      }
    }
    return out
  }
  const [high, wide] = [(height + 1) >> 1, (width + 1) >> 1]
  const sums = filter(filter(data, 1, height, width * channels), high, width, channels)
  const out = new data.constructor(sums.length)
  for (let n = 0; n < out.length; n++) out[n] = real ? sums[n] / 64 : (sums[n] + 32) >> 6
  return { height: high, width: wide, channels, data: out }
}

const topOf = (data) => (data instanceof Float32Array ? 1 : data instanceof Uint8Array ? 255 : 65535)

/** A normal map as a placement with this turn shows it: its vectors turn as well. */
function turnPicture(picture, turn) {
  const [a, b, c, d] = TURNS[turn]
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

/** Turn the vectors of painted normals, texels [first, first + count) of a chart, by the angle of its field. */
function turnVectors(samples, step, field, width, first, count) {
  const top = topOf(samples)
  const middle = 0.5 * top
  const settle = top === 1 ? (x) => x : (x) => clamp(Math.floor(x + 0.5), 0, top)
  const m = [0, 0, 0, 0]
  for (let n = 0, at = 0; n < count; n++, at += step) {
    matrixAt(field, Math.floor((first + n) / width), (first + n) % width, m)
    const length = Math.max(Math.sqrt(m[1] * m[1] + m[3] * m[3]), 1)
    const [sine, cosine] = [m[1] / length, m[3] / length]
    const [x, y] = [samples[at] - middle, samples[at + 1] - middle]
    samples[at] = settle(middle + (x * cosine - y * sine))
    samples[at + 1] = settle(middle + (x * sine + y * cosine))
  }
}

/** A map as it is painted from: levels of its pyramid, made where they are needed, with samples for a row more. */
class Source {
  constructor(picture, role) {
    this.picture = picture
    this.normal = role === 'normal'
    this.turned = []
  }

  level(number, turn) {
    const key = this.normal ? turn : 0
    const levels = (this.turned[key] ??= [this.#prepare(key ? turnPicture(this.picture, key) : this.picture)])
    while (levels.length <= number) levels.push(this.#prepare(halve(levels.at(-1))))
    return levels[number]
  }

  #prepare(picture) {
    const { height, width, channels, data } = picture
    const size = height * width
    if (!(data instanceof Uint8Array)) {
      const samples = new data.constructor((size + width + 2) * channels)
      samples.set(data)
      return { ...picture, samples }
    }
    // Two words a pixel of two samples each: red and blue, green and alpha.
    const samples = new Int32Array(2 * (size + width + 2))
    const [green, blue] = channels < 3 ? [0, 0] : [1, 2]
    for (let n = 0, at = 0; n < size; n++, at += channels) {
      samples[2 * n] = data[at] | (data[at + blue] << 16)
      samples[2 * n + 1] = data[at + green] | (channels & 1 ? 0 : data[at + channels - 1] << 16)
    }
    return { ...picture, samples }
  }
}

/** Where a placement reads its texels from. */
class Reading {
  constructor(one, field, exemplar) {
    this.field = field
    this.centre = matrixAt(field, one.row, one.column, [0, 0, 0, 0])
    const [a, b, c, d] = this.centre
    this.level = levelAt(exemplar, a * d - b * c)
    this.wide = sizeAt(exemplar.width, this.level)
    this.mostRow = 16 * (sizeAt(exemplar.height, this.level) - 1)
    this.turn = TURNS[one.turn]
    this.one = one
  }

  /** Write the places of `count` texels from (row, column) on. */
  trace(row, column, count, places, place) {
    const { margin, rows, columns, matrices } = this.field
    const { centre, level, wide, mostRow, one } = this
    const mostColumn = 16 * (wide - 1)
    const [c0, c1, c2, c3] = centre
    const [p, q, r, s] = this.turn
    const [sourceRow, sourceColumn] = [one.sourceRow + 8, one.sourceColumn + 8]
    const y = row - one.row
    const upper = 4 * columns * Math.min(margin + (row >> 5), rows - 1)
    const lower = 4 * columns * Math.min(margin + (row >> 5) + 1, rows - 1)
    const low = row & 31
    const up = 32 - low
    for (const last = column + count; column < last; ) {
      // Between two nodes M is linear along the row.
      const end = Math.min(last, (column | 31) + 1)
      const j = 4 * Math.min(margin + (column >> 5), columns - 1)
      const k = 4 * Math.min(margin + (column >> 5) + 1, columns - 1)
      const left0 = matrices[upper + j] * up + matrices[lower + j] * low
      const left1 = matrices[upper + j + 1] * up + matrices[lower + j + 1] * low
      const left2 = matrices[upper + j + 2] * up + matrices[lower + j + 2] * low
      const left3 = matrices[upper + j + 3] * up + matrices[lower + j + 3] * low
      const step0 = matrices[upper + k] * up + matrices[lower + k] * low - left0
      const step1 = matrices[upper + k + 1] * up + matrices[lower + k + 1] * low - left1
      const step2 = matrices[upper + k + 2] * up + matrices[lower + k + 2] * low - left2
      const step3 = matrices[upper + k + 3] * up + matrices[lower + k + 3] * low - left3
      for (; column < end; column++, place++) {
        const x = column - one.column
        const along = column & 31
        const a0 = ((left0 * 32 + step0 * along + 512) >> 10) + c0
        const a1 = ((left1 * 32 + step1 * along + 512) >> 10) + c1
        const a2 = ((left2 * 32 + step2 * along + 512) >> 10) + c2
        const a3 = ((left3 * 32 + step3 * along + 512) >> 10) + c3
        const v = (Math.imul(a0, y) + Math.imul(a1, x) + 256) >> 9
        const w = (Math.imul(a2, y) + Math.imul(a3, x) + 256) >> 9
        const i = clamp(((sourceRow + p * v + q * w) >> level) - 8, 0, mostRow)
        const h = clamp(((sourceColumn + r * v + s * w) >> level) - 8, 0, mostColumn)
        places[place] = (((i >> 4) * wide + (h >> 4)) << 8) | ((i & 15) << 4) | (h & 15)
      }
    }
  }
}

/**
 * Where the texels of some rows of a chart come from: runs of (kind, level and turn; first texel; texels), of each
 * texel its place in that level (pixel << 8 | fraction of rows << 4 | fraction of columns), and weights of those
 * that are blended. Runs are added from the topmost placement down, and painted from the last one up.
 */
class Recipe {
  constructor(runs = new Int32Array(0), places = new Uint32Array(0), weights = new Uint8Array(0)) {
    Object.assign(this, { runs, places, weights })
    Object.assign(this, { runCount: runs.length, placeCount: places.length, weightCount: weights.length })
    Object.assign(this, { chart: null, exemplar: null, start: 0, stop: 0, scratch: null, field: null })
    Object.assign(this, { texels: 0, above: null })
  }

  /** Begin anew, for rows [start, stop) of a chart; `scratch` is used while placements are added. */
  begin(chart, field, exemplar, start, stop, scratch) {
    Object.assign(this, { chart, exemplar, start, stop, scratch, field: field ?? PLAIN_FIELD })
    this.texels = (stop - start) * chart.width
    this.above = scratch.take('above', Uint8Array, this.texels).fill(BARE)
    this.clear()
  }

  clear() {
    this.runCount = this.placeCount = this.weightCount = 0
  }

  get bytes() {
    return 4 * this.runCount + 4 * this.placeCount + this.weightCount
  }

  /** A copy to keep, which takes no more room than it needs. */
  copy() {
    const { runs, places, weights, runCount, placeCount, weightCount } = this
    return new Recipe(runs.slice(0, runCount), places.slice(0, placeCount), weights.slice(0, weightCount))
  }

  /** Where the rectangle of a placement lies in these rows: its top left and the rows and columns within. */
  clip({ row, column, height, width }) {
    const [top, left] = [row - (height >> 1), column - (width >> 1)]
    return {
      ...{ top, left, row0: Math.max(top, this.start), row1: Math.min(top + height, this.stop) },
      ...{ column0: Math.max(left, 0), column1: Math.min(left + width, this.chart.width) },
    }
  }

  /** Whether placements cover these rows so often that all of them may be too many to remember. */
  isDeep(placed) {
    let area = 0
    for (const one of placed) {
      const { row0, row1, column0, column1 } = this.clip(one)
      area += Math.max(0, row1 - row0) * Math.max(0, column1 - column0)
    }
    return area > MOST_LAYERS * this.texels
  }

  /** Make room for a row more. */
  #reserve(count) {
    const grown = (array, length) => {
      if (length <= array.length) return array
      const more = new array.constructor(2 * length)
      more.set(array)
      return more
    }
    this.runs = grown(this.runs, this.runCount + 3 * count)
    this.places = grown(this.places, this.placeCount + count)
    this.weights = grown(this.weights, this.weightCount + count)
  }

  /** Add a placement below all before; with `alone` as if something were above it everywhere. */
  add(one, alone) {
    const { chart, above } = this
    const { top, left, row0, row1, column0, column1 } = this.clip(one)
    if (row0 >= row1 || column0 >= column1) return
    const reading = new Reading(one, this.field, this.exemplar)
    const tag = (reading.level << 5) | (one.turn << 2)
    const weights = weigh(one, this.scratch)
    for (let row = row0; row < row1; row++) {
      this.#reserve(column1 - column0)
      const { runs } = this
      const firstRun = this.runCount
      let { runCount } = this
      let open = 0
      const start = (row - this.start) * chart.width
      let at = (row - top) * one.width + column0 - left
      for (let texel = start + column0, end = start + column1; texel < end; texel++, at++) {
        const weight = weights ? weights[at] : 256
        const cover = alone ? VEILED : above[texel]
        let kind = 0
        if (weight > 0 && cover !== HIDDEN) {
          kind = weight < 256 ? BLEND : cover === BARE ? FINAL : BASE
          above[texel] = weight < 256 ? VEILED : HIDDEN
          if (kind === BLEND) this.weights[this.weightCount++] = weight
        }
        if (kind !== open) {
          if (open) runs[runCount - 1] = texel - runs[runCount - 2]
          open = kind
          if (open) {
            runs[runCount] = tag | kind
            runs[runCount + 1] = texel
            runCount += 3
          }
        }
      }
      if (open) runs[runCount - 1] = start + column1 - runs[runCount - 2]
      this.runCount = runCount
      for (let run = firstRun; run < runCount; run += 3) {
        reading.trace(row, runs[run + 1] - start, runs[run + 2], this.places, this.placeCount)
        this.placeCount += runs[run + 2]
      }
    }
  }

  /** Paint all runs in texels [first, end), bottom up. */
  paint(source, first, end, canvas) {
    const { runs, places, weights } = this
    let place = this.placeCount
    let weight = this.weightCount
    let last = -1
    let level
    for (let run = this.runCount - 3; run >= 0; run -= 3) {
      const tag = runs[run]
      place -= runs[run + 2]
      if ((tag & 3) === BLEND) weight -= runs[run + 2]
      if (runs[run + 1] < first || runs[run + 1] >= end) continue
      if (tag >> 2 !== last) {
        last = tag >> 2
        level = source.level(last >> 3, last & 7)
      }
      const [to, stop] = [runs[run + 1], runs[run + 1] + runs[run + 2]]
      canvas.lay(tag & 3, to, stop, level.samples, level.width, places, place, weights, weight)
    }
  }
}

/** The level of the pyramid for a block of which M has this determinant at its centre. */
function levelAt({ height, width }, area) {
  const most = 32 - Math.clz32(Math.max(height, width) - 1)
  let k = 0
  while (k < most && area >= 2 * UNIT * UNIT * 4 ** k) k++
  return k
}

/** Paints strips of charts of one kind of samples; its canvas is used again and again. */
class Canvas {
  constructor(Samples, channels) {
    const bytes = (this.bytes = Samples === Uint8Array)
    this.channels = channels
    this.perTexel = bytes ? 1 : channels
    this.layersPerTexel = bytes ? 2 : channels
    this.opaque = bytes && channels & 1 ? 255 << 24 : 0
    this.out = new (bytes ? Uint32Array : Samples)(0)
    this.layers = new (Samples === Float32Array ? Float32Array : Int32Array)(0)
  }

  /** Clear texels [first, end) of so many. */
  clear(count, first, end) {
    const { out, perTexel, layersPerTexel } = this
    if (count * perTexel > out.length) {
      this.out = new out.constructor(count * perTexel)
      this.layers = new this.layers.constructor(count * layersPerTexel)
    }
    this.out.fill(this.opaque, first * perTexel, end * perTexel)
    this.layers.fill(0, first * layersPerTexel, end * layersPerTexel)
  }

  /** What lies there: RGBA of 8-bit samples, else as many samples as there are channels. */
  painted(first, end) {
    if (this.bytes) return new Uint8Array(this.out.buffer, 4 * first, 4 * (end - first))
    return this.out.subarray(first * this.perTexel, end * this.perTexel)
  }

  /** Lay samples at `places` on texels [to, end). */
  lay(kind, to, end, samples, width, places, place, weights, weight) {
    if (this.bytes) this.#layBytes(kind, to, end, samples, 2 * width, places, place, weights, weight)
    else this.#laySamples(kind, to, end, samples, width * this.channels, places, place, weights, weight)
  }

  // Two samples a word, 16 bits each, which weights of 256 in all fill and 6 fractional bits leave room in.
  #layBytes(kind, to, end, words, below, places, place, weights, weight) {
    const { out, layers, opaque } = this
    for (; to < end; to++, place++) {
      const at = (places[place] >>> 8) * 2
      const fraction = places[place] & 255
      let even, odd
      if (fraction) {
        const d = (fraction >> 4) * (fraction & 15)
        const b = 16 * (fraction & 15) - d
        const c = (fraction & 240) - d
        const a = 256 - b - c - d
        even = Math.imul(words[at], a) + Math.imul(words[at + 2], b)
        even = (even + Math.imul(words[at + below], c) + Math.imul(words[at + below + 2], d)) | 0
        odd = Math.imul(words[at + 1], a) + Math.imul(words[at + 3], b)
        odd = (odd + Math.imul(words[at + below + 1], c) + Math.imul(words[at + below + 3], d)) | 0
      } else if (kind === FINAL) {
        out[to] = words[at] | (words[at + 1] << 8) | opaque
        continue
      } else {
        even = words[at] << 8
        odd = words[at + 1] << 8
      }
      if (kind === FINAL) {
        // Rounding to 6 bits and to none at once.
        out[to] = (((even + 0x820082) >>> 8) & 0xff00ff) | ((odd + 0x820082) & 0xff00ff00) | opaque
        continue
      }
      even = ((even + 0x20002) >>> 2) & 0x3fff3fff
      odd = ((odd + 0x20002) >>> 2) & 0x3fff3fff
      if (kind === BLEND) {
        const w = weights[weight++]
        const rest = 256 - w
        const [e, o] = [layers[2 * to], layers[2 * to + 1]]
        even =
          (((e & 0xffff) * rest + (even & 0xffff) * w + 128) >> 8) |
          ((((e >>> 16) * rest + (even >>> 16) * w + 128) << 8) & 0xffff0000)
        odd =
          (((o & 0xffff) * rest + (odd & 0xffff) * w + 128) >> 8) |
          ((((o >>> 16) * rest + (odd >>> 16) * w + 128) << 8) & 0xffff0000)
      }
      out[to] = (((even + 0x200020) >>> 6) & 0xff00ff) | (((odd + 0x200020) << 2) & 0xff00ff00) | opaque
      layers[2 * to] = even
      layers[2 * to + 1] = odd
    }
  }

  #laySamples(kind, to, end, samples, below, places, place, weights, weight) {
    const { out, layers, channels } = this
    const real = out instanceof Float32Array
    for (; to < end; to++, place++) {
      const fraction = places[place] & 255
      const d = (fraction >> 4) * (fraction & 15)
      const b = 16 * (fraction & 15) - d
      const c = (fraction & 240) - d
      const a = 256 - b - c - d
      const w = kind === BLEND ? weights[weight++] : 256
      let at = (places[place] >>> 8) * channels
      for (let n = to * channels, last = n + channels; n < last; n++, at++) {
        const [e, f, g, h] = [samples[at], samples[at + channels], samples[at + below], samples[at + below + channels]]
        if (real) {
          let value = e
          if (fraction) {
            value = Math.fround(Math.fround(e * (a / 256)) + Math.fround(f * (b / 256)))
            value = Math.fround(Math.fround(value + Math.fround(g * (c / 256))) + Math.fround(h * (d / 256)))
          }
          if (w < 256) value = Math.fround(layers[n] * ((256 - w) / 256)) + Math.fround(value * (w / 256))
          layers[n] = out[n] = value
        } else {
          let value = (e * a + f * b + g * c + h * d + 2) >> 2
          if (w < 256) value = (layers[n] * (256 - w) + value * w + 128) >> 8
          layers[n] = value
          out[n] = (value + 32) >> 6
        }
      }
    }
  }
}

/** Paints charts. What lies where depends on placements alone, and is kept while the exemplar gets better. */
class Painter {
  constructor() {
    this.recipes = new Map() // by chart: those of its strips, and how many bytes they are
    this.room = KEPT_BYTES
    this.recipe = new Recipe()
    this.scratch = new Scratch()
    this.canvases = {}
  }

  forget(chart) {
    this.room += this.recipes.get(chart)?.bytes ?? 0
    this.recipes.delete(chart)
  }

  /**
   * Paint rows [start, stop) of a chart, and call take(painted, first row, rows) for strip after strip; `painted` is
   * RGBA, a byte each, of 8-bit samples.
   */
  paint({ index, chart, field, placed, source, start, stop, take }) {
    const { data, channels } = source.picture
    const canvas = (this.canvases[data.constructor.name + channels] ??= new Canvas(data.constructor, channels))
    if (!this.recipes.has(index)) this.recipes.set(index, { strips: [], bytes: 0 })
    const kept = this.recipes.get(index)
    const { width } = chart
    const most = Math.max(64, Math.floor(STRIP / width))
    let all
    for (let strip = Math.floor(start / most); strip * most < stop; strip++) {
      const top = strip * most
      const bottom = Math.min(top + most, chart.height)
      const [row0, row1] = [Math.max(start, top), Math.min(stop, bottom)]
      const [first, end] = [(row0 - top) * width, (row1 - top) * width]
      canvas.clear((bottom - top) * width, first, end)
      const known = kept.strips[strip]
      const recipe = known ?? this.recipe
      if (!known) {
        recipe.begin(chart, field, source.picture, top, bottom, this.scratch)
        all ??= placed()
        if (recipe.isDeep(all)) {
          for (const one of all) {
            recipe.clear()
            recipe.add(one, true)
            recipe.paint(source, first, end, canvas)
          }
          recipe.clear()
        } else {
          for (let n = all.length - 1; n >= 0; n--) recipe.add(all[n], false)
          if (recipe.bytes <= this.room) {
            kept.strips[strip] = recipe.copy()
            kept.bytes += recipe.bytes
            this.room -= recipe.bytes
          }
        }
      }
      recipe.paint(source, first, end, canvas)
      const painted = canvas.painted(first, end)
      const count = end - first
      if (source.normal && field) turnVectors(painted, painted.length / count, field, width, row0 * width, count)
      take(painted, row0, row1 - row0)
    }
  }
}

/** Write RGBA as so many channels. */
function narrow(painted, channels, out, to) {
  for (let from = 0; from < painted.length; from += 4, to += channels) {
    out[to] = painted[from]
    if (channels === 3) {
      out[to + 1] = painted[from + 1]
      out[to + 2] = painted[from + 2]
    } else if (channels === 2) out[to + 1] = painted[from + 3]
  }
  return to
}

const SRGB_ROLES = ['albedo', 'emission']

/** The 8-bit sRGB codes of 65536 even steps of linear light. */
let codes = null
function srgbCodes() {
  return (codes ??= Uint8Array.from(indices(65536), (n) => {
    const x = n / 65535
    return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055) + 0.5
  }))
}

/** Samples as RGBA of 8 bits. */
function toRGBA(samples, channels, colored) {
  const real = samples instanceof Float32Array
  const wide = samples instanceof Uint16Array
  const plain = (x) => (real ? 255 * clamp(x, 0, 1) + 0.5 : wide ? Math.floor((x + 128) / 257) : x)
  const table = colored && real ? srgbCodes() : null
  const color = table ? (x) => table[Math.fround(65535 * clamp(x, 0, 1)) + 0.5 | 0] : plain
  const [green, blue] = channels < 3 ? [0, 0] : [1, 2]
  const out = new Uint8Array((4 * samples.length) / channels)
  for (let to = 0, at = 0; to < out.length; to += 4, at += channels) {
    out[to] = color(samples[at])
    out[to + 1] = color(samples[at + green])
    out[to + 2] = color(samples[at + blue])
    out[to + 3] = channels & 1 ? 255 : plain(samples[at + channels - 1])
  }
  return out
}

// ---------------------------------------------------------------- files [1]

const MAGIC = [117, 112, 104, 0] // "uph", version
const NEEDS = { S: '', L: 'S', X: 'L', D: 'X', F: 'X', Q: 'X', P: 'Q', M: 'P', R: 'X', E: 'R' }
const LONGEST = { S: 2 ** 26, L: 2 ** 24, X: 2 ** 12, F: 2 ** 23, Q: 2 ** 23, R: 2 ** 12 }
const ANY_NUMBER = 'DRE'

/** Decodes a `.uph` stream as its bytes come. */
export class UphDecoder {
  constructor() {
    /** Bytes fed so far. */
    this.received = 0
    /** Length of the whole file; null before its header has come. */
    this.total = null
    /** The surface and its charts; null and empty before they have come. */
    this.surface = null
    this.charts = []
    this.scale = 0
    this.fields = []
    this.image = null
    this.placements = null
    this.maps = new Map() // by role
    this.pictures = new Map()
    this.painter = new Painter()
    this.view = 0
    this.seen = ''
    this.chunk = null
    this.buffer = new Growing() // bytes not used yet
    this.start = 0 // where they begin
    this.whole = new Growing() // payload of a chunk that is read when it is whole
    this.failure = null
    this.fail = (what, offset) => {
      throw new UphError(what, offset)
    }
  }

  /** How many bytes are missing until something can be shown: 0 from then on. */
  get needed() {
    return this.image ? 0 : Math.max(1, (this.view || 6) - this.received)
  }

  /** Whether the whole file has come and every chunk's CRC is right. */
  get complete() {
    return this.total !== null && this.start === this.total
  }

  /** How many charts have their placements; the others repeat the exemplar. */
  get chartsKnown() {
    return this.placements ? this.placements.knownCharts.size : 0
  }

  /**
   * Take further bytes. Returns what changed: whether the surface has come, whether the exemplar got better (and
   * with it every chart), and which charts got other placements.
   */
  feed(bytes) {
    if (this.failure) throw this.failure
    this.changed = { surface: false, exemplar: false, roles: [], charts: [] }
    try {
      this.#feed(bytes)
    } catch (error) {
      this.failure = error
      throw error
    }
    const marked = this.placements?.changed
    if (marked) {
      // What lies on a chart shows from when its own blocks are known.
      this.changed.charts = [...marked].filter((n) => this.placements.knownCharts.has(n)).sort((a, b) => a - b)
      for (const n of marked) this.painter.forget(n)
      marked.clear()
    }
    return this.changed
  }

  #feed(bytes) {
    this.received += bytes.length
    if (this.total !== null && this.received > this.total) this.#behind()
    this.buffer.push(bytes)
    if (this.total === null && !this.#readHeader()) return
    if (this.received > this.total) this.#behind()
    let used = 0
    while (this.start + used < this.total) {
      const rest = this.buffer.bytes.subarray(used, this.buffer.length)
      const took = this.#readChunk(rest, this.start + used)
      used += took
      if (!took) break
    }
    this.buffer.drop(used)
    this.start += used
  }

  #behind() {
    this.fail(`${this.received - this.total} bytes behind the end of the file`, this.total)
  }

  #readHeader() {
    const head = this.buffer.bytes.subarray(0, Math.min(this.buffer.length, 14))
    head.subarray(0, 4).forEach((byte, n) => {
      if (byte !== MAGIC[n]) this.fail(n < 3 ? 'this is no .uph stream' : `version is ${byte}; allowed: 0`, n)
    })
    if (head.subarray(4).filter((byte) => byte < 128).length < 2 && head.length < 14) return false
    const fields = new Fields(head.subarray(4), 4)
    this.total = fields.varint('length of the file', MAX_FILE, 6)
    this.view = fields.varint('length of the first view', this.total)
    this.start = 4 + fields.place
    this.buffer.drop(this.start)
    return true
  }

  /** Use some of the bytes at `offset`; returns how many. */
  #readChunk(rest, offset) {
    if (!this.chunk) {
      const head = rest.subarray(0, 10)
      if (head.length < 10 && !head.subarray(1).some((byte) => byte < 128)) return 0
      const fields = new Fields(head, offset)
      const tag = String.fromCharCode(fields.u8('tag'))
      if (!/[A-Za-z]/.test(tag)) this.fail(`tag is byte ${tag.charCodeAt(0)}; allowed: letters`, offset)
      const length = fields.varint(`length of chunk ${tag}`, Math.max(0, this.total - offset - 6))
      const payload = offset + fields.place
      if (payload + length + 4 > this.total) this.fail(`chunk ${tag} ends behind the end of the file`, offset)
      this.chunk = { tag, length, offset, payload, left: length, crc: crc32(head.subarray(0, fields.place), 0) }
      return fields.place
    }
    const { chunk } = this
    const part = rest.subarray(0, chunk.left)
    const whole = part.length === chunk.left && rest.length >= part.length + 4
    chunk.crc = crc32(part, chunk.crc)
    chunk.left -= part.length
    if (whole) {
      const stored = new DataView(rest.buffer, rest.byteOffset + part.length, 4).getUint32(0, true)
      if (stored !== chunk.crc) this.fail(`chunk ${chunk.tag} does not have the CRC it says`, offset + part.length)
      this.chunk = null
    }
    if (part.length || whole) this.#take(chunk, part, whole)
    return part.length + (whole ? 4 : 0)
  }

  #checkOrder({ tag, length, offset }) {
    if (!(tag in NEEDS)) {
      if (tag < 'a') this.fail(`unknown chunk ${tag}`, offset)
      return
    }
    if (tag === 'F' && this.seen.includes('Q')) this.fail('chunk F comes behind Q', offset)
    if (!ANY_NUMBER.includes(tag) && this.seen.includes(tag)) this.fail(`chunk ${tag} comes twice`, offset)
    if (!this.seen.includes(NEEDS[tag])) this.fail(`chunk ${tag} comes before ${NEEDS[tag]}`, offset)
    if (length > LONGEST[tag]) this.fail(`chunk ${tag} has ${length} bytes; allowed: ${LONGEST[tag]}`, offset)
    this.seen += tag
  }

  #take(chunk, part, whole) {
    const { tag, payload } = chunk
    if (part.length === chunk.length - chunk.left) this.#checkOrder(chunk) // its first bytes
    if (tag === 'D') {
      if (this.image.feed(part)) this.#better('albedo')
    } else if (tag === 'E') {
      if (!chunk.role) {
        if (!part.length) this.fail('a part of a map is empty', payload)
        chunk.role = [...this.maps.keys()][part[0]]
        if (!part[0] || !chunk.role) this.fail(`number of a map is ${part[0]}; allowed: 1 to ${this.maps.size - 1}`, payload)
        part = part.subarray(1)
      }
      if (this.maps.get(chunk.role).feed(part)) this.#better(chunk.role)
    } else if (tag === 'P') this.placements.feedSources(part)
    else if (tag === 'M') this.placements.feedMasks(part, (what) => this.fail(what, payload))
    else if (tag in NEEDS) {
      this.whole.push(part)
      if (whole) {
        this.#takeWhole(tag, new Fields(this.whole.bytes.subarray(0, this.whole.length), payload))
        this.whole = new Growing()
      }
    }
  }

  #better(role) {
    if (role === 'albedo') this.changed.exemplar = true
    if (!this.changed.roles.includes(role)) this.changed.roles.push(role)
    this.pictures.delete(role)
  }

  #addMap(fields) {
    const length = fields.varint('length of a role', 32, 1)
    const start = fields.take(length, 'role')
    const role = String.fromCharCode(...fields.data.subarray(start, start + length))
    if (!/^[a-z0-9_]+$/.test(role) || this.maps.has(role) || this.maps.size >= MOST_MAPS) {
      fields.fail('a map is not allowed, comes twice or is one too many', 0)
    }
    const header = parseImageHeader(fields, 4096, 4)
    fields.end("a map's header")
    const first = this.image.header
    if (header.height !== first.height || header.width !== first.width) fields.fail('a map has another size', 0)
    let samples = 0
    for (const { header: { height, width, channels } } of [{ header }, ...this.maps.values()]) {
      samples += height * width * channels
    }
    fields.within(samples, 'number of samples of all maps', 1, MAX_MAP_SAMPLES, 0)
    this.maps.set(role, new ImageDecoder(header))
    this.#better(role)
  }

  #takeWhole(tag, fields) {
    if (tag === 'S') {
      this.surface = parseSurface(fields)
      this.changed.surface = true
    } else if (tag === 'L') [this.charts, this.scale] = parseLayout(fields, this.surface.patchCount)
    else if (tag === 'R') this.#addMap(fields)
    else if (tag === 'F') this.fields = parseFields(fields, this.charts)
    else if (tag === 'X') {
      const header = parseImageHeader(fields, 4096, 4)
      fields.end('image header')
      const unit = scaleField(this.scale)?.matrices[0] ?? UNIT
      const [high, wide] = [tileOf(header.height, unit), tileOf(header.width, unit)]
      let tiles = 0
      for (const { height, width } of this.charts) tiles += ceilDivide(height, high) * ceilDivide(width, wide)
      fields.within(Math.max(high, wide), 'repeat of the exemplar', 1, this.scale ? MOST_BENT : 4096)
      fields.within(tiles, 'repeats of the exemplar', 1, MAX_TILES)
      if (this.view !== fields.start + fields.data.length + 4) {
        fields.fail(`first view ends here; the file says at ${this.view}`)
      }
      this.image = new ImageDecoder(header)
      this.maps.set('albedo', this.image)
      this.#better('albedo')
    } else {
      const kind = fields.u8('kind of plan', 3)
      const Plan = [GeneralPlacements, RegularPlacements, RasterPlacements, GeneralPlacements][kind]
      if (kind === 1 && this.fields.length) fields.fail('plan is regular where charts have M fields')
      this.placements = new Plan(fields, this.charts, this.image.header, this.fields, kind === 3 ? 1 : 16)
    }
  }

  /** Roles of the maps that have been announced: 'albedo', the exemplar's, is the first. */
  get roles() {
    return [...this.maps.keys()]
  }

  /** How many of a map's coefficients are significant so far, of how many, and whether these are all. */
  coefficients(role = 'albedo') {
    const map = this.maps.get(role)
    if (!map) return { known: 0, count: 0, complete: false }
    const { height, width, channels } = map.header
    return { known: map.significant, count: height * width * channels, complete: map.complete }
  }

  /** A map of the exemplar as far as it has come: {height, width, channels, data}. */
  exemplar(role = 'albedo') {
    if (!this.image) throw new RangeError(`stream needs ${this.needed} more bytes`)
    if (!this.maps.has(role)) throw new RangeError(`map is ${role}; allowed: ${this.roles.join(', ')}`)
    if (!this.pictures.has(role)) {
      const picture = this.maps.get(role).image()
      this.pictures.set(role, { picture, source: new Source(picture, role) })
    }
    return this.pictures.get(role).picture
  }

  /** A map of the exemplar as 8-bit RGBA for the screen, see `rgba`. */
  exemplarRgba(role = 'albedo') {
    const { height, width, channels, data } = this.exemplar(role)
    return { height, width, data: toRGBA(data, channels, SRGB_ROLES.includes(role)) }
  }

  /** Whether a chart has its placements; before, it repeats the exemplar, mirrored, `repeat` of its pixels to a texel. */
  knows(index) {
    return this.placements?.knownCharts.has(index) ?? false
  }

  get repeat() {
    return (scaleField(this.scale)?.matrices[0] ?? UNIT) / UNIT
  }

  /** Texels of a chart as far as they can be painted, rows [start, stop) of it, as the map's `data`. */
  texels(index, start = 0, stop = this.charts[index]?.height, role = 'albedo') {
    const { data, channels } = this.exemplar(role)
    const { width } = this.#checkRows(index, start, stop)
    const out = new data.constructor((stop - start) * width * channels)
    let to = 0
    this.#paint(index, start, stop, role, (painted) => {
      if (painted.constructor !== Uint8Array || channels === 4) {
        out.set(painted, to)
        to += painted.length
        return
      }
      to = narrow(painted, channels, out, to)
    })
    return out
  }

  /**
   * The same as 8-bit RGBA for the screen, written from `into[offset]` on with `stride` texels from row to row; returns
   * `into`. Grey becomes RGB; floats become sRGB where a map is a colour.
   */
  rgba(index, { role = 'albedo', start = 0, stop = this.charts[index]?.height, into, stride, offset = 0 } = {}) {
    const { channels } = this.exemplar(role)
    const { width } = this.#checkRows(index, start, stop)
    into ??= new Uint8ClampedArray(4 * (stop - start) * width)
    const step = 4 * (stride ?? width)
    if (!(offset >= 0 && step >= 4 * width && offset + (stop - start - 1) * step + 4 * width <= into.length)) {
      throw new RangeError(`texels do not fit ${into.length} bytes`)
    }
    this.#paint(index, start, stop, role, (painted, row, rows) => {
      let to = offset + (row - start) * step
      if (painted.constructor !== Uint8Array) painted = toRGBA(painted, channels, SRGB_ROLES.includes(role))
      for (let i = 0; i < rows; i++, to += step) into.set(painted.subarray(4 * width * i, 4 * width * (i + 1)), to)
    })
    return into
  }

  #checkRows(index, start, stop) {
    const chart = this.charts[index]
    if (!chart) throw new RangeError(`chart is ${index}; allowed: 0 to ${this.charts.length - 1}`)
    if (!(start >= 0 && start <= stop && stop <= chart.height)) {
      throw new RangeError(`rows are ${start} to ${stop}; allowed: 0 to ${chart.height}`)
    }
    return chart
  }

  #paint(index, start, stop, role, take) {
    const { picture, source } = this.pictures.get(role)
    const chart = this.charts[index]
    if (role === 'normal' && picture.channels !== 3) {
      throw new RangeError(`normal map has ${picture.channels} channels; allowed: 3`)
    }
    const known = this.knows(index)
    const field = known ? this.fields[index] : scaleField(this.scale)
    const placed = () =>
      known ? this.placements.of(index) : mirrored(chart, picture, field ? field.matrices[0] : UNIT)
    this.painter.paint({ index, chart, field, placed, source, start, stop, take })
  }
}

/** Decodes an `.ezw` image as its bytes come. */
export class EzwDecoder {
  constructor() {
    this.received = 0
    this.head = new Growing()
    this.decoder = null
    this.failure = null
  }

  /** How many bytes are missing at least until there is an image: 0 from then on. */
  get needed() {
    if (this.decoder) return 0
    const { bytes, length } = this.head
    if (length < 13) return 13 - length
    return 13 + 2 * bytes[8] + (((bytes[9] >> 2) & 3) === 1 ? 18 : 0) + (bytes[9] >> 4 === 2 ? 8 : 0) - length
  }

  /** Whether the image is as good as it gets. */
  get complete() {
    return this.decoder?.complete ?? false
  }

  /** Take further bytes; returns whether the image changed. */
  feed(bytes) {
    if (this.failure) throw this.failure
    this.received += bytes.length
    try {
      if (this.decoder) return this.decoder.feed(bytes)
      let used = 0
      while (this.needed && used < bytes.length) {
        const part = bytes.subarray(used, used + this.needed)
        this.head.push(part)
        used += part.length
        const magic = [69, 90, 87, 48].slice(0, this.head.length)
        magic.forEach((byte, n) => {
          if (this.head.bytes[n] !== byte) throw new UphError('this is no .ezw image', n)
        })
      }
      if (this.needed) return false
      this.decoder = new ImageDecoder(
        parseImageHeader(new Fields(this.head.bytes.subarray(4, this.head.length), 4), 65535, 64),
      )
      this.decoder.feed(bytes.subarray(used))
      return true
    } catch (error) {
      this.failure = error
      throw error
    }
  }

  /** The image as far as it has come: {height, width, channels, data}. */
  image() {
    if (!this.decoder) throw new RangeError(`image needs ${this.needed} more bytes`)
    return this.decoder.image()
  }
}
