/** Decoded samples: a sample that comes again, in another stream, is not decoded again. */

import { GrowingBytes } from '../uph/bytes.js'
import { ChunkReader } from '../uph/chunks.js'

const MOST = 2 // samples
const MOST_BYTES = 2 ** 25 // of all their pictures; smaller levels are a third more, turned normals up to seven times as much

/** The samples of a worker that were used last. */
export class Samples {
  #kept = [] // {code, maps, size}, the last one first

  /** The maps of a sample, as `UphDecoder` takes them; null if they are not known. */
  find(code) {
    return this.#kept.find((one) => isSame(one.code, code))?.maps ?? null
  }

  keep(code, maps) {
    const size = [...maps.values()].reduce((sum, { pyramid }) => sum + pyramid.picture.data.byteLength, 0)
    const others = this.#kept.filter((one) => !isSame(one.code, code))
    let left = MOST_BYTES
    this.#kept = [{ code, maps, size }, ...others].filter((one) => one.size <= left && (left -= one.size) >= 0).slice(0, MOST)
  }
}

/**
 * What the sample of a whole stream is decoded from, byte for byte: of each map its header, and all that follows. Null where the stream is
 * cut or damaged.
 */
export function codeOf(stream) {
  const maps = []
  // All comes at once: so does each chunk.
  const file = new ChunkReader(({ tag }, payload) => {
    if (tag === 'X' || tag === 'R') maps.push([payload.slice(), new GrowingBytes()])
    else if (tag === 'D') maps[0][1].push(payload)
    else if (tag === 'E') maps[payload[0]]?.[1].push(payload.subarray(1))
  })
  try {
    file.feed(stream)
  } catch {
    return null // decoding will report the error
  }
  return file.complete ? maps.flatMap(([header, { bytes, length }]) => [header, bytes.slice(0, length)]) : null
}

function isSame(one, other) {
  const isEqual = (bytes, n) => bytes.length === other[n].length && bytes.every((byte, k) => byte === other[n][k])
  return one.length === other.length && one.every(isEqual)
}
