/** The container [1]: a header, then chunks, each with its CRC, read as bytes come. */

import { ByteReader, GrowingBytes, UphError, crc32 } from './bytes.js'

const MAGIC = [117, 112, 104, 3] // "uph", version
const MAX_FILE = 2 ** 30
const MAX_CHUNKS = 4096
const CRC_BYTES = 4

// What each chunk comes after (of each group one), how long it may be, and which may come more than once.
const NEEDS = { B: [], S: [], L: ['S'], X: ['LB'], D: ['X'], F: ['X', 'L'], Q: ['X', 'L'], t: ['Q'], N: ['F'], P: ['Q'], M: ['P'], R: ['X'], E: ['R'] }
const LONGEST = { B: 2 ** 26, S: 2 ** 26, L: 2 ** 24, X: 2 ** 12, F: 2 ** 23, Q: 2 ** 23, t: 0, R: 2 ** 12 }
const ANY_NUMBER = 'BDNPMRE'
const MOST_BASES = 4

const fail = (what, offset) => {
  throw new UphError(what, offset)
}

/**
 * Reads a file; take(chunk, part, whole) gets the known chunks' payloads part by part, `whole` with the last one. Errors in a chunk name the byte
 * at which it begins: up to there the file can be used.
 */
export class ChunkReader {
  constructor(take) {
    this.take = take
    this.received = 0
    this.total = null // length of the file; null before its header has come
    this.view = 0 // where the first view is complete
    this.start = 0 // how many bytes are used
    this.chunk = null
    this.count = 0 // of chunks begun
    this.seen = ''
    this.buffer = new GrowingBytes() // bytes not used yet
  }

  get complete() {
    return this.total !== null && this.start === this.total
  }

  feed(bytes) {
    this.received += bytes.length
    this.buffer.push(bytes)
    if (this.total === null && !this.#readHeader()) return
    let used = 0
    while (this.start + used < this.total) {
      const rest = this.buffer.bytes.subarray(used, this.buffer.length)
      const took = this.#readChunk(rest, this.start + used)
      used += took
      if (!took) break
    }
    this.buffer.drop(used)
    this.start += used
    if (this.received > this.total) fail(`${this.received - this.total} bytes after the end of the file`, this.total)
  }

  #readHeader() {
    const head = this.buffer.bytes.subarray(0, Math.min(this.buffer.length, 14))
    head.subarray(0, 4).forEach((byte, n) => {
      if (byte === MAGIC[n]) return
      if (n < 3) fail('this is no .uph stream', 0)
      fail(`version is ${byte}; allowed: ${MAGIC[3]}; ${byte > MAGIC[3] ? 'a newer decoder reads it' : 'it was never released: make the file again'}`, n)
    })
    if (head.subarray(4).filter((byte) => byte < 128).length < 2 && head.length < 14) return false
    const reader = new ByteReader(head.subarray(4), 4)
    this.total = reader.varint('length of the file', MAX_FILE, 6)
    this.view = reader.varint('length of the first view', this.total)
    this.start = 4 + reader.place
    this.buffer.drop(this.start)
    return true
  }

  /** Use some of the bytes at `offset`; returns how many. */
  #readChunk(rest, offset) {
    if (!this.chunk) return this.#readChunkHeader(rest, offset)
    const { chunk } = this
    const part = rest.subarray(0, chunk.left)
    const whole = part.length === chunk.left && rest.length >= part.length + CRC_BYTES
    const isFirst = chunk.left === chunk.length
    chunk.crc = crc32(part, chunk.crc)
    chunk.left -= part.length
    if (whole) {
      const stored = new DataView(rest.buffer, rest.byteOffset + part.length, CRC_BYTES).getUint32(0, true)
      if (stored !== chunk.crc) fail(`chunk ${chunk.tag} does not have the CRC it says`, chunk.offset)
      this.chunk = null
    }
    if (part.length || whole) {
      if (isFirst) this.#checkOrder(chunk)
      if (chunk.tag in NEEDS) this.#pass(chunk, part, whole)
    }
    return part.length + (whole ? CRC_BYTES : 0)
  }

  #pass(chunk, part, whole) {
    try {
      this.take(chunk, part, whole)
    } catch (error) {
      if (!(error instanceof UphError)) throw error
      fail(`chunk ${chunk.tag}: ${error.message}`, chunk.offset)
    }
  }

  #readChunkHeader(rest, offset) {
    const head = rest.subarray(0, 10)
    if (head.length < 10 && !head.subarray(1).some((byte) => byte < 128)) return 0
    const reader = new ByteReader(head, offset)
    const tag = String.fromCharCode(reader.u8('tag'))
    if (!/[A-Za-z]/.test(tag)) fail(`tag is byte ${tag.charCodeAt(0)}; allowed: letters`, offset)
    const length = reader.varint(`length of chunk ${tag}`, Math.max(0, this.total - offset - 6))
    const payload = offset + reader.place
    if (payload + length + CRC_BYTES > this.total) fail(`chunk ${tag} ends after the end of the file`, offset)
    if (++this.count > MAX_CHUNKS) fail(`chunk ${this.count}; allowed: ${MAX_CHUNKS} in a file`, offset)
    this.chunk = { tag, length, offset, payload, left: length, crc: crc32(head.subarray(0, reader.place), 0) }
    return reader.place
  }

  #checkOrder({ tag, length, offset }) {
    if (!(tag in NEEDS)) {
      if (tag < 'a') fail(`unknown chunk ${tag}`, offset)
      return
    }
    for (const [early, late] of ['FQ', 'tP']) if (tag === early && this.seen.includes(late)) fail(`chunk ${early} comes after ${late}`, offset)
    if (!ANY_NUMBER.includes(tag) && this.seen.includes(tag)) fail(`chunk ${tag} comes twice`, offset)
    if (tag === 'B' && (this.seen.includes('S') || this.seen.split('B').length > MOST_BASES)) fail(`chunk B comes after S, or after ${MOST_BASES} others`, offset)
    for (const group of NEEDS[tag]) {
      if (![...group].some((one) => this.seen.includes(one))) fail(`chunk ${tag} comes before ${group[0]}`, offset)
    }
    if (length > LONGEST[tag]) fail(`chunk ${tag} has ${length} bytes; allowed: ${LONGEST[tag]}`, offset)
    this.seen += tag
  }
}
