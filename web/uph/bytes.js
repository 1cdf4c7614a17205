/** Bytes: reading fields one after another, a buffer that grows, CRC-32, and the error of a damaged file. */

import { range } from './numbers.js'

/** A damaged file: `message` says what is wrong and what is allowed, `offset` at which byte. */
export class UphError extends Error {
  constructor(what, offset) {
    super(`byte ${offset}: ${what}`)
    this.name = 'UphError'
    this.offset = offset
  }
}

/** Reads fields one after another; `offset` is where `data` begins in the file. */
export class ByteReader {
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

  /** Take the next `count` bytes; returns the place of the first. */
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

  u32(name, most = 2 ** 32 - 1, least = 0) {
    const place = this.take(4, name)
    return this.within(this.view.getUint32(place, true), name, least, most, place)
  }

  i16(name) {
    return this.view.getInt16(this.take(2, name), true)
  }

  /** A finite number of 4 or 8 bytes. */
  float(name, bytes) {
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

  /** Check that nothing is left. */
  end(name) {
    if (this.left) this.fail(`${this.left} bytes too many in ${name}`)
  }
}

/** Bytes that grow; `bytes` may be longer than `length`. */
export class GrowingBytes {
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

const CRC_TABLE = Uint32Array.from(range(256), (n) => {
  for (let k = 0; k < 8; k++) n = n & 1 ? (n >>> 1) ^ 0xedb88320 : n >>> 1
  return n
})

/** The CRC-32 of bytes that follow others with this CRC; 0 at first. */
export function crc32(bytes, crc) {
  crc = ~crc
  for (let n = 0; n < bytes.length; n++) crc = CRC_TABLE[(crc ^ bytes[n]) & 255] ^ (crc >>> 8)
  return ~crc >>> 0
}
