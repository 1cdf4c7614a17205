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

const BYTES = [1, 2, 4]

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
          along: kind === LH ? stride : 1,
          across: kind === LH ? 1 : stride,
          cousins: [[], [area, 2 * area], [-area, area], [-2 * area, -area]][kind],
          childStep: 0,
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

  /** The children of i that are there. */
  #children(i) {
    const band = this.bands[this.bandOf[i]]
    const first = this.child[i]
    if (!first) return []
    const { area, childStep: s } = band
    const places = band.kind ? [first, first + 1, first + s, first + s + 1] : [i + area, i + 2 * area, i + 3 * area]
    return places.filter((place) => !(this.flags[place] & PADDING))
  }

  // Passes [7.2]. A generator: it waits wherever a bit is not determined yet.
  *#planes() {
    const { flags, waiting, order, bands, bandOf, below } = this
    for (let plane = this.header.plane; plane >= 0; plane--) {
      this.plane = plane
      const coded = order.filter((band) => plane >= band.lowest)
      for (let i = 0; i < flags.length; i++) flags[i] &= ~(NEWLY | VISITED | ZTR)
      this.queues = THRESHOLDS.map(() => [])
      for (const { rows, columns, stride, start } of coded) {
        for (let r = 0; r < rows; r++) {
          for (let i = start + r * stride, end = i + columns; i < end; i++) {
            if ((flags[i] & (AWAKE | SIGNIFICANT)) === AWAKE) this.#await(i, 0)
          }
        }
      }
      for (this.queue = 0; this.queue < DOMINANT; this.queue++) {
        const queue = this.queues[this.queue]
        for (let head = 0; head < queue.length; head++) {
          const i = queue[head]
          if (waiting[i] !== this.queue) continue // it moved on
          while (!this.#significance(i)) yield
          waiting[i] = NOWHERE
        }
      }
      for (const { rows, columns, stride, start } of coded) {
        for (let r = 0; r < rows; r++) {
          for (let i = start + r * stride, end = i + columns; i < end; i++) {
            if ((flags[i] & (SIGNIFICANT | NEWLY)) === SIGNIFICANT) while (!this.#refine(i)) yield
          }
        }
      }
      const list = this.roots.slice()
      for (let head = 0; head < list.length; head++) {
        const i = list[head]
        if (!(flags[i] & (SIGNIFICANT | VISITED)) && plane >= bands[bandOf[i]].lowest) {
          while (!this.#significance(i)) yield
        }
        // Approximations have a flag even where all their children lie beyond the image.
        const children = this.#children(i)
        if (!children.length && (bands[bandOf[i]].kind || !this.header.levels)) continue
        if (!(flags[i] & SIGNIFICANT) && !below[i]) {
          let zerotree
          while ((zerotree = this.#zerotree(i)) < 0) yield
          if (zerotree) {
            flags[i] |= ZTR
            continue
          }
        }
        list.push(...children)
      }
    }
  }

  #quantise(x) {
    return QUANTISED[Math.min(255, x >> this.plane)]
  }

  /** Set `near` and `score`, which most contexts need. */
  #measure(i) {
    const { known } = this
    const { along: p, across: q, kind, cousins } = this.bands[this.bandOf[i]]
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
    if (this.queue === DOMINANT || flags[i] & (SIGNIFICANT | VISITED)) return
    if (this.plane >= this.bands[this.bandOf[i]].lowest) this.#await(i, this.queue)
  }

  /** Decode whether i becomes significant, and its sign; false if bytes are missing. */
  #significance(i) {
    const { flags, known, parent, bits, queue } = this
    const band = this.bands[this.bandOf[i]]
    const { along: p, across: q, kind, cousins, channel } = band
    const { input } = bits
    if (!this.signDue) {
      flags[i] |= VISITED
      this.#measure(i)
      const up = known[parent[i]]
      let around = 0
      for (const step of [-p, p, -q, q, -p - q, p - q, q - p, p + q]) around = 2 * around + (flags[i + step] & 1)
      input[0] = this.#s1(i)
      input[1] = S2 + ((2 * around + (up > 0 ? 1 : 0)) * 4 + kind) * 2 + (channel > 0 ? 1 : 0)
      const related = this.#quantise(16 * up) * 16 + this.#quantise(8 * this.cousins)
      input[2] = S3 + (this.#quantise(this.near) * 256 + related) * 4 + kind
      const significant = bits.bit(3, SIGNIFICANCE_MIXER + 4 * queue + kind, 255)
      if (significant < 0) return false
      this.symbols++
      if (!significant) return true
      this.signDue = true
    }
    const sign = (place) => SIGMA[flags[place] & 3]
    const signs = (steps) => steps.reduce((sum, step) => 3 * sum + sign(i + step), 0)
    const last = Math.max(0, kind - 1)
    input[0] = G1 + signs([-p, p, -q, q]) * 3 + last
    input[1] = G2 + signs([-p - q, p - q, q - p, p + q]) * 3 + last
    input[2] = G3 + signs([-2 * p, 2 * p, -2 * q, 2 * q]) * 3 + last
    input[3] = G4 + (kind ? 9 * sign(parent[i]) + signs(cousins) : 0) * 3 + last
    let before = 0
    for (let k = 1; k <= 3 && k <= channel; k++) before = 3 * before + sign(i - k * this.channelStep)
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
    for (const step of [-p, p, -q, q, -p - q, p - q, q - p, p + q]) this.#wake(i + step)
    for (const child of this.#children(i)) this.#wake(child)
    for (const step of cousins) this.#wake(i + step)
    if (channel + 1 < this.header.channels) this.#wake(i + this.channelStep)
    for (const step of [-2 * p, 2 * p, -2 * q, 2 * q]) flags[i + step] |= AWAKE
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
    const { along: p, across: q, kind, level, cousins } = this.bands[this.bandOf[i]]
    this.#measure(i)
    let most = Math.max(below[i - p], below[i + p], below[i - q], below[i + q])
    for (const step of cousins) most = Math.max(most, below[i + step])
    most = clamp(most - this.plane, 0, 7)
    const before = (flags[i - p] & ZTR ? 1 : 0) + (flags[i - q] & ZTR ? 2 : 0)
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
    const pixel = new Float64Array(channels)
    for (let i = 0, place = 0; i < height * width; i++) {
      for (let k = 0; k < channels; k++) pixel[k] = planes[k][i]
      const [c0, c1, c2] = pixel
      if (color === 1) {
        for (let k = 0; k < 3; k++) pixel[k] = c0 * m[3 * k] + c1 * m[3 * k + 1] + c2 * m[3 * k + 2]
      } else if (color === 2) {
        const t = c0 - (c2 >> 1)
        pixel[1] = c2 + t
        pixel[2] = t - (c1 >> 1)
        pixel[0] = pixel[2] + c1
      }
      for (let k = 0; k < channels; k++) {
        const value = clamp(Math.floor(pixel[k] + means[k] + (wavelet ? 0 : 0.5)), 0, most)
        data[place++] = depth === 2 ? value * step + low : value
      }
    }
    return { height, width, channels, data }
  }
}

// ---------------------------------------------------------------- transforms [7.4]

function scale(x, n) {
  const odd = 1.149604398860241
  const even = 1 / odd
  for (let k = 0; k < n; k++) x[k] *= k & 1 ? odd : even
}

/** Take `factor` times the sum of its neighbours off every other sample, from `first` on. */
function lift(x, n, first, factor) {
  for (let k = first; k < n; k += 2) {
    x[k] -= factor * (x[k ? k - 1 : 1] + x[k + 1 < n ? k + 1 : n - 2])
  }
}

const LIFTINGS = [
  (x, n) => {
    scale(x, n)
    lift(x, n, 0, 0.443506852043971)
    lift(x, n, 1, 0.882911075530934)
    lift(x, n, 0, -0.052980118572961)
    lift(x, n, 1, -1.586134342059924)
  },
  (x, n) => {
    for (let k = 0; k < n; k += 2) x[k] -= (x[k ? k - 1 : 1] + x[k + 1 < n ? k + 1 : n - 2] + 2) >> 2
    for (let k = 1; k < n; k += 2) x[k] += (x[k - 1] + x[k + 1 < n ? k + 1 : n - 2]) >> 1
  },
  (x, n) => {
    for (let k = 1; k < n; k += 2) {
      x[k - 1] -= x[k] >> 1
      x[k] += x[k - 1]
    }
  },
]

/** Undo `levels` levels in place: of each, columns first. */
function invert(plane, height, width, levels, lifting) {
  const line = new plane.constructor(Math.max(height, width))
  const undo = (start, step, n) => {
    const low = (n + 1) >> 1
    for (let k = 0; k < n; k++) line[k] = plane[start + step * (k & 1 ? low + (k >> 1) : k >> 1)]
    lifting(line, n)
    for (let k = 0; k < n; k++) plane[start + step * k] = line[k]
  }
  for (let level = levels - 1; level >= 0; level--) {
    const rows = sizeAt(height, level)
    const columns = sizeAt(width, level)
    if (rows > 1) for (let c = 0; c < columns; c++) undo(c, width, rows)
    if (columns > 1) for (let r = 0; r < rows; r++) undo(r * width, 1, columns)
  }
}

// ---------------------------------------------------------------- surface and layout [2, 3]

const LENGTH = (fields, name) => fields.number(name, 8)
const SPAN = (fields, name) => fields.varint(name, 256, 1)
const SPANS = (fields, name) => [SPAN(fields, name), SPAN(fields, name)]
const TILING = (fields, name) => fields.u8(name, 1)
// Per kind: parameters with their defaults and how they are read, and the number of patches.
const BUILT = [
  ['cyclide', { a: [6, LENGTH], c: [2, LENGTH], mu: [3, LENGTH], spans: [[4, 4], SPANS] }],
  ['torus', { R: [2, LENGTH], r: [0.7, LENGTH], spans: [[4, 4], SPANS] }],
  ['sphere', { r: [1, LENGTH], tiling: [0, TILING] }, ({ tiling }) => (tiling ? 8 : 6)],
  ['plane', { width: [1, LENGTH], height: [1, LENGTH], spans: [[1, 1], SPANS] }],
  ['ellipsoid', { rx: [1.5, LENGTH], ry: [1, LENGTH], rz: [0.75, LENGTH] }, () => 8],
  ['cylinder', { r: [1, LENGTH], h: [2, LENGTH], spans: [4, SPAN] }, ({ spans }) => spans],
  ['cone', { r1: [1, LENGTH], r2: [0.4, LENGTH], h: [1.5, LENGTH], spans: [4, SPAN] }, ({ spans }) => spans],
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
    if (bytes === 4) for (let k = 0; k < 3; k++) net[4 * n + k] *= weight
  }
  let place = 0
  for (const patch of patches) {
    const size = (patch.m + 1) * (patch.n + 1)
    patch.net = new Float64Array(4 * size)
    for (let k = 0; k < size; k++, place++) patch.net.set(net.subarray(4 * index[place], 4 * index[place] + 4), 4 * k)
  }
  return { kind: 'nets', name, tolerance, patches, patchCount: count }
}

function parseLayout(fields, patchCount) {
  const flags = fields.u8('flags of the layout', 15)
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
  if (!(flags & 2)) {
    for (const chart of charts) {
      for (const name of ['s0', 's1', 't0', 't1']) chart[name] = fields.number(name, 8)
      const { s0, s1, t0, t1 } = chart
      if (!(s0 >= 0 && s0 < s1 && s1 <= 1 && t0 >= 0 && t0 < t1 && t1 <= 1)) {
        fields.fail('a chart covers parameters outside 0 to 1, or none')
      }
    }
  }
  fields.end('layout')
  return charts
}

// ---------------------------------------------------------------- placements [4, 5.2 to 5.4]

const MASK_RAMP = 1
const MASK_CUT = 2
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

/** What a chart shows before its placements have come: the exemplar, repeated and mirrored. */
function mirrored(chart, { height, width }) {
  const placed = []
  const middle = (n, size) => (n & 1 ? size - 1 - (size >> 1) : size >> 1)
  for (let i = 0; i * height < chart.height; i++) {
    for (let j = 0; j * width < chart.width; j++) {
      placed.push({
        row: i * height + (height >> 1),
        column: j * width + (width >> 1),
        height,
        width,
        sourceRow: middle(i, height),
        sourceColumn: middle(j, width),
        turn: [0, 5, 7, 2][2 * (i & 1) + (j & 1)],
        mask: 0,
      })
    }
  }
  return placed
}

/** What both kinds of plan share: two coded streams, sources and masks, each resumed as its bytes come. */
class Placements {
  constructor() {
    this.cells = NO_CELLS
    this.knownCells = 0
    this.masks = null
    this.changed = new Set()
  }

  feedSources(part) {
    this.sources.feed(part)
    this.sourceSteps.next()
  }

  feedMasks(part, fail) {
    if (!this.totalCells || this.known < this.total) fail('masks come where none are due')
    if (!this.masks) {
      this.masks = new BitReader(CELL_COUNTERS, 2, 24030)
      this.cells = new Uint8Array(this.totalCells)
      this.maskSteps = this.codeMasks()
    }
    this.masks.feed(part)
    this.maskSteps.next()
  }

  get complete() {
    return this.known === this.total && this.knownCells === this.totalCells
  }

  /** Decode one mask of rows × columns cells [5.4]; `z` is its place in a strip. */
  *codeMask(rows, columns, z) {
    const { masks, cells } = this
    const start = this.knownCells
    const { input } = masks
    for (let i = 0; i < rows; i++) {
      const e = i === 0 ? 0 : i === rows - 1 ? 2 : 1
      for (let j = 0; j < columns; j++) {
        const at = (di, dj) =>
          i >= di && j + dj >= 0 && j + dj < columns ? cells[start + (i - di) * columns + j + dj] : 0
        const near = at(0, -1) + 2 * at(1, 0) + 4 * at(1, -1) + 8 * at(1, 1)
        const around = near + 16 * at(0, -2) + 32 * at(2, 0)
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
    this.knownCharts = 0
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
        this.knownCharts++
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
    return [Math.floor(candidate / K) * tile + half, (candidate % K) * tile + half]
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
        sourceRow: sourceRow - half + down[0] * y + down[1] * x,
        sourceColumn: sourceColumn - half + right[0] * y + right[1] * x,
        turn,
        cells: cellsB,
      }
      return [onA, onB]
    })
  }
}

const FIELD_COUNT = 13
const FIELD_ZERO = 0
const FIELD_SIGN = 4
const FIELD_LONGER = 5
const FIELD_DIGIT = 39
const FIELD_COUNTERS = FIELD_DIGIT + 35 * 64

/** A general plan: every placement is told field by field. */
class GeneralPlacements extends Placements {
  constructor(fields, charts, exemplar) {
    super()
    this.charts = charts
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
    this.knownCharts = 0
    this.exemplar = exemplar
    this.sources = new BitReader(FIELD_COUNT * FIELD_COUNTERS, FIELD_COUNT * 5, 72090)
    this.sourceSteps = this.#codePlacements((what) => fields.fail(what))
    if (!this.total) this.sourceSteps.next()
    while (this.ends[this.knownCharts] === 0) this.changed.add(this.knownCharts++)
  }

  get known() {
    return this.placed.length
  }

  // Fields [5.3].
  *#codePlacements(fail) {
    const { charts, sources, placed, ends, exemplar } = this
    const { input } = sources
    const whole = [-(2 ** 31), 2 ** 31 - 1]
    const [size, byte] = [[1, 4096], [0, 255]]
    const limits = [
      ...[whole, whole, size, size, [0, 7], [0, 2], byte, byte, byte, [0, 16]],
      ...[[0, exemplar.height - 1], [0, exemplar.width - 1], whole],
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
          if (n && (f === 10 || f === 11)) guess += values[f - 10] - before[f - 10]
          if (f === 12) guess = values[5] === MASK_CUT ? cellsEnd : -1
          // number(f)
          const base = f * FIELD_COUNTERS
          let number = 0
          let x
          input[0] = base + FIELD_ZERO + 2 * differed[0] + differed[1]
          while ((x = sources.bit(1, 5 * f, 255)) < 0) yield
          if (x) {
            let length = 0
            while (length < 34) {
              input[0] = base + FIELD_LONGER + length
              while ((x = sources.bit(1, 5 * f + 1, 255)) < 0) yield
              if (!x) break
              length++
            }
            input[0] = base + FIELD_SIGN
            let negative
            while ((negative = sources.bit(1, 5 * f + 2, 255)) < 0) yield
            number = 1
            for (let b = 0; b < length; b++) {
              input[0] = base + FIELD_DIGIT + length * 64 + (b < 6 ? number : 0)
              while ((x = sources.bit(1, 5 * f + (b < 6 ? 3 : 4), 255)) < 0) yield
              number = 2 * number + x
            }
            if (negative) number = -number
          }
          differed = [differed[1], number ? 1 : 0]
          const value = number + guess
          if (value < limits[f][0] || value > limits[f][1]) fail(`a field of placement ${n} is outside what is allowed`)
          values.push(value)
        }
        before = values
        const [row, column, height, width, turn, mask, sides, ramp, cell, feather, sourceRow, sourceColumn, first] =
          values
        const one = { row, column, height, width, turn, mask, sides, ramp, cell, feather, sourceRow, sourceColumn }
        if (mask === MASK_CUT) {
          const count = cell ? cellCount(one) : Infinity
          if (first < 0 || first + count > this.totalCells) fail(`cells of placement ${n} are not there`)
          cellsEnd = first + count
          Object.assign(one, { first, count })
        }
        this.#check(one, charts[chart], (what) => fail(`placement ${n} ${what}`))
        placed.push(one)
      }
      if (chart >= this.knownCharts) {
        this.knownCharts = chart + 1
        this.changed.add(chart)
      }
    }
  }

  #check({ row, column, height, width, turn, mask, ramp, sourceRow, sourceColumn }, chart, fail) {
    const [top, left] = [row - (height >> 1), column - (width >> 1)]
    if (top >= chart.height || top + height <= 0 || left >= chart.width || left + width <= 0) {
      fail('does not touch its chart')
    }
    if (mask === MASK_RAMP && ramp < 1) fail('has a ramp 0 texels wide; allowed: 1 to 255')
    const [p, q, r, s] = TURNS[turn]
    for (const y of [top - row, top + height - 1 - row]) {
      for (const x of [left - column, left + width - 1 - column]) {
        const [i, j] = [sourceRow + p * y + q * x, sourceColumn + r * y + s * x]
        if (i < 0 || i >= this.exemplar.height || j < 0 || j >= this.exemplar.width) fail('reads outside the exemplar')
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
      yield* this.codeMask(1, this.totalCells, 0)
      for (const { chart } of cut) this.changed.add(chart)
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

// ---------------------------------------------------------------- painting [8]

/** Weights of a placement, 0 to 256: height × width. */
function weigh({ height, width, mask, sides, ramp, cell, feather, cells }) {
  let weights = new Int32Array(height * width).fill(256)
  if (mask === MASK_RAMP) {
    for (let i = 0; i < height; i++) {
      const down = sides & 1 && i < ramp ? Math.floor(((2 * i + 1) * 128) / ramp) : 256
      for (let j = 0; j < width; j++) {
        const factor = sides & 2 && j < ramp ? Math.floor(((2 * j + 1) * 128) / ramp) : 256
        weights[i * width + j] = (down * factor) >> 8
      }
    }
  } else if (mask === MASK_CUT) {
    const across = ceilDivide(width, cell)
    for (let i = 0, k = 0; i < height; i++) {
      const part = Math.floor(i / cell) * across
      for (let j = 0; j < width; j++) weights[k++] = cells[part + Math.floor(j / cell)] << 8
    }
    let spare = new Int32Array(height * width)
    for (let pass = 0; pass < 2 * feather; pass++) {
      const down = pass % 2 === 0
      const step = down ? width : 1
      for (let i = 0, k = 0; i < height; i++) {
        for (let j = 0; j < width; j++, k++) {
          const [at, last] = down ? [i, height - 1] : [j, width - 1]
          const sum = weights[at > 0 ? k - step : k] + weights[at < last ? k + step : k]
          spare[k] = (51 * sum + 154 * weights[k] + 128) >> 8
        }
      }
      ;[weights, spare] = [spare, weights]
    }
  }
  return weights
}

/** Paint rows [start, stop) of a chart. */
function paint(chart, placed, exemplar, start, stop) {
  const { channels, data, width: wide } = exemplar
  const real = data instanceof Float32Array
  const columns = chart.width
  const canvas = new (real ? Float32Array : Int32Array)((stop - start) * columns * channels)
  for (const one of placed) {
    const top = one.row - (one.height >> 1)
    const left = one.column - (one.width >> 1)
    const [row0, row1] = [Math.max(top, start), Math.min(top + one.height, stop)]
    const [column0, column1] = [Math.max(left, 0), Math.min(left + one.width, columns)]
    if (row0 >= row1 || column0 >= column1) continue
    const weights = one.mask ? weigh(one) : null
    const [p, q, r, s] = TURNS[one.turn]
    const step = (q * wide + s) * channels
    for (let row = row0; row < row1; row++) {
      const [y, x] = [row - one.row, column0 - one.column]
      let from = ((one.sourceRow + p * y + q * x) * wide + one.sourceColumn + r * y + s * x) * channels
      let to = ((row - start) * columns + column0) * channels
      let at = (row - top) * one.width + column0 - left
      for (let n = column0; n < column1; n++, from += step, to += channels, at++) {
        const w = weights ? weights[at] : 256
        if (w === 0) continue
        for (let k = 0; k < channels; k++) {
          if (real) {
            const kept = Math.fround(canvas[to + k] * ((256 - w) / 256))
            canvas[to + k] = kept + Math.fround(data[from + k] * (w / 256))
          } else if (w === 256) canvas[to + k] = data[from + k] << 6
          else canvas[to + k] = (canvas[to + k] * (256 - w) + (data[from + k] << 6) * w + 128) >> 8
        }
      }
    }
  }
  if (real) return canvas
  const out = new data.constructor(canvas.length)
  for (let n = 0; n < out.length; n++) out[n] = (canvas[n] + 32) >> 6
  return out
}

// ---------------------------------------------------------------- files [1]

const MAGIC = [117, 112, 104, 0] // "uph", version
const NEEDS = { S: '', L: 'S', X: 'L', D: 'X', Q: 'X', P: 'Q', M: 'P' }
const LONGEST = { S: 2 ** 26, L: 2 ** 24, X: 2 ** 12, Q: 2 ** 23 }

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
    this.image = null
    this.placements = null
    this.picture = null
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
    return this.placements ? this.placements.knownCharts : 0
  }

  /**
   * Take further bytes. Returns what changed: whether the surface has come, whether the exemplar got better (and
   * with it every chart), and which charts got other placements.
   */
  feed(bytes) {
    if (this.failure) throw this.failure
    this.changed = { surface: false, exemplar: false, charts: [] }
    try {
      this.#feed(bytes)
    } catch (error) {
      this.failure = error
      throw error
    }
    const marked = this.placements?.changed
    if (marked) {
      // What lies on a chart shows from when its own blocks are known.
      this.changed.charts = [...marked].filter((n) => n < this.chartsKnown).sort((a, b) => a - b)
      marked.clear()
    }
    if (this.changed.exemplar) this.picture = null
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
      this.#checkOrder(tag, length, offset)
      this.chunk = { tag, length, payload, left: length, crc: crc32(head.subarray(0, fields.place), 0) }
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

  #checkOrder(tag, length, offset) {
    if (!(tag in NEEDS)) {
      if (tag < 'a') this.fail(`unknown chunk ${tag}`, offset)
      return
    }
    if (tag !== 'D' && this.seen.includes(tag)) this.fail(`chunk ${tag} comes twice`, offset)
    if (!this.seen.includes(NEEDS[tag])) this.fail(`chunk ${tag} comes before ${NEEDS[tag]}`, offset)
    if (length > LONGEST[tag]) this.fail(`chunk ${tag} has ${length} bytes; allowed: ${LONGEST[tag]}`, offset)
    this.seen += tag
  }

  #take({ tag, payload }, part, whole) {
    if (tag === 'D') {
      if (this.image.feed(part)) this.changed.exemplar = true
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

  #takeWhole(tag, fields) {
    if (tag === 'S') {
      this.surface = parseSurface(fields)
      this.changed.surface = true
    } else if (tag === 'L') this.charts = parseLayout(fields, this.surface.patchCount)
    else if (tag === 'X') {
      const header = parseImageHeader(fields, 4096, 4)
      fields.end('image header')
      let tiles = 0
      for (const { height, width } of this.charts) {
        tiles += ceilDivide(height, header.height) * ceilDivide(width, header.width)
      }
      fields.within(tiles, 'repeats of the exemplar', 1, MAX_TILES)
      if (this.view !== fields.start + fields.data.length + 4) {
        fields.fail(`first view ends here; the file says at ${this.view}`)
      }
      this.image = new ImageDecoder(header)
      this.changed.exemplar = true
    } else {
      const regular = fields.u8('kind of plan', 1)
      this.placements = new (regular ? RegularPlacements : GeneralPlacements)(fields, this.charts, this.image.header)
    }
  }

  /** The exemplar as far as it has come: {height, width, channels, data}. */
  exemplar() {
    if (!this.image) throw new RangeError(`stream needs ${this.needed} more bytes`)
    this.picture ??= this.image.image()
    return this.picture
  }

  /** Texels of a chart as far as they can be painted, rows [start, stop) of it, as the exemplar's `data`. */
  texels(index, start = 0, stop = this.charts[index]?.height) {
    const exemplar = this.exemplar()
    const chart = this.charts[index]
    if (!chart) throw new RangeError(`chart is ${index}; allowed: 0 to ${this.charts.length - 1}`)
    if (!(start >= 0 && start <= stop && stop <= chart.height)) {
      throw new RangeError(`rows are ${start} to ${stop}; allowed: 0 to ${chart.height}`)
    }
    const placed = index < this.chartsKnown ? this.placements.of(index) : mirrored(chart, exemplar)
    return paint(chart, placed, exemplar, start, stop)
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
