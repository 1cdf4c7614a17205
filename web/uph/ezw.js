/** The decoder of `.ezw` images [6]. */

import { ByteReader, GrowingBytes, UphError } from './bytes.js'
import { ImageDecoder } from './image/image-decoder.js'
import { parseImageHeader } from './image/header.js'
import { checkSamples, fillLimits } from './limits.js'

const MAGIC = [69, 90, 87, 49] // "EZW1", 1 the version
const FIXED_BYTES = 13 // of the header with the magic, before the means

/** Decodes an `.ezw` image as its bytes come. */
export class EzwDecoder {
  #head = new GrowingBytes()
  #image = null
  #failure = null
  #limits

  /** `limits`: how many samples the image may have. */
  constructor({ limits } = {}) {
    this.#limits = fillLimits(limits)
    /** Bytes fed so far. */
    this.received = 0
  }

  /** How many bytes are missing at least until there is an image: 0 from then on. */
  get needed() {
    if (this.#image) return 0
    const { bytes, length } = this.#head
    if (length < FIXED_BYTES) return FIXED_BYTES - length
    const [channels, kind] = [bytes[8], bytes[9]]
    return FIXED_BYTES + 2 * channels + (((kind >> 2) & 3) === 1 ? 18 : 0) + ((kind & 3) === 2 ? 16 : 0) + (kind >> 4 === 2 ? 8 : 0) - length
  }

  /** Whether the image is as good as it gets. */
  get complete() {
    return this.#image?.complete ?? false
  }

  /** Take further bytes; returns whether the image changed. */
  feed(bytes) {
    if (this.#failure) throw this.#failure
    this.received += bytes.length
    try {
      if (this.#image) return this.#image.feed(bytes)
      const used = this.#readHead(bytes)
      if (this.needed) return false
      const reader = new ByteReader(this.#head.bytes.subarray(MAGIC.length, this.#head.length), MAGIC.length)
      const header = parseImageHeader(reader, 65535, 64)
      checkSamples(reader, [header], this.#limits)
      this.#image = new ImageDecoder(header)
      this.#image.feed(bytes.subarray(used))
      return true
    } catch (error) {
      this.#failure = error
      throw error
    }
  }

  /** Use bytes for the header; returns how many. */
  #readHead(bytes) {
    let used = 0
    while (this.needed && used < bytes.length) {
      const part = bytes.subarray(used, used + this.needed)
      this.#head.push(part)
      used += part.length
      MAGIC.slice(0, this.#head.length).forEach((byte, n) => {
        const here = this.#head.bytes[n]
        if (here === byte) return
        const version = n === 3 && here >= 48 && here < 58 ? here - 48 : -1
        if (version < 0) throw new UphError('this is no .ezw image', n)
        const who = version ? 'a newer decoder reads it' : 'it was never released: make the file again'
        throw new UphError(`version is ${version}; allowed: 1; ${who}`, n)
      })
    }
    return used
  }

  /** The image as far as it has come: {height, width, channels, data}. */
  image() {
    if (!this.#image) throw new RangeError(`image needs ${this.needed} more bytes`)
    return this.#image.image()
  }
}
