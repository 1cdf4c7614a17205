/** Flags and numbers of a mesh [5.4]. */

import { BitDecoder } from '../bits.js'
import { INTEGER_COUNTERS, decodeInteger } from '../integers.js'

export const [VERTEX, ISLAND, PART, PLAIN] = [0, 1, 2, 3] // kinds of numbers; PLAIN: coordinates and parameters without a guess
const LEFTOVER = 4 // the first kind of what guesses leave over
const LONGEST = 8
const KINDS = LEFTOVER + 2 * (LONGEST + 1)

// Where flags begin; those of what lies beyond an edge are the first.
const FLAGS = KINDS * INTEGER_COUNTERS
export const SEAM = 64
export const START_VERTEX = SEAM + 1
const COUNTERS = FLAGS + START_VERTEX + 1

export class MeshNumbers {
  constructor(reader) {
    this.reader = reader
    this.bits = new BitDecoder(COUNTERS)
    this.bits.feed(reader.data.subarray(reader.place))
  }

  wrong() {
    this.reader.fail('a number of the mesh is outside what is allowed')
  }

  flag(place) {
    const bit = this.bits.coded(FLAGS + place)
    if (bit < 0) this.reader.fail('triangles are missing')
    return bit
  }

  /** A number from `least` to `most`, coded as its difference from a guess. */
  within(kind, guess, least, most) {
    const { done, value } = decodeInteger(this.bits, kind, 0).next()
    if (!done) this.reader.fail('triangles are missing')
    if (guess + value < least || guess + value > most) this.wrong()
    return guess + value
  }

  /** A coordinate (`what` 0) or a parameter (1) whose guess is good; `others` is the sum of the residuals of two others. */
  leftover(what, others, guess, least, most) {
    return this.within(LEFTOVER + what * (LONGEST + 1) + Math.min(LONGEST, 32 - Math.clz32(others)), guess, least, most)
  }
}

/** The corner that comes next in a triangle. */
export const nextCorner = (corner) => (corner % 3 === 2 ? corner - 2 : corner + 1)
