/** Whole numbers of plans, each kind with counters of its own: number(k) [5.2]. */

const ZERO = 0
const SIGN = 4
const LONGER = 5
const DIGIT = 39
const MAX_LENGTH = 34
const LIMIT = 255

/** Counters and mixers that each f takes. */
export const INTEGER_COUNTERS = DIGIT + 35 * 64
export const INTEGER_MIXERS = 5

/** Decode the next number of kind f; waits where bytes are missing. */
export function* decodeInteger(bits, f, context) {
  const { input } = bits
  const base = f * INTEGER_COUNTERS
  const mixer = f * INTEGER_MIXERS
  let bit
  input[0] = base + ZERO + context
  while ((bit = bits.bit(1, mixer, LIMIT)) < 0) yield
  if (!bit) return 0
  let length = 0
  while (length < MAX_LENGTH) {
    input[0] = base + LONGER + length
    while ((bit = bits.bit(1, mixer + 1, LIMIT)) < 0) yield
    if (!bit) break
    length++
  }
  input[0] = base + SIGN
  let negative
  while ((negative = bits.bit(1, mixer + 2, LIMIT)) < 0) yield
  let number = 1
  for (let b = 0; b < length; b++) {
    input[0] = base + DIGIT + length * 64 + (b < 6 ? number : 0)
    while ((bit = bits.bit(1, mixer + (b < 6 ? 3 : 4), LIMIT)) < 0) yield
    number = 2 * number + bit
  }
  return negative ? -number : number
}
