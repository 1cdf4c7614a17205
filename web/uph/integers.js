/** Whole numbers of plans and meshes, each kind with counters of its own: number(k, c) [5.2]. */

const CONTEXTS = 8
const MAX_LENGTH = 34
const LONGER = CONTEXTS
const SIGN = LONGER + CONTEXTS * (MAX_LENGTH + 1)
const DIGIT = SIGN + CONTEXTS

/** Counters that each kind takes. */
export const INTEGER_COUNTERS = DIGIT + (MAX_LENGTH + 1) * 64

/** Decode the next number of a kind; waits where bytes are missing. */
export function* decodeInteger(bits, kind, context) {
  const base = kind * INTEGER_COUNTERS
  let bit
  while ((bit = bits.told(base + context)) < 0) yield
  if (!bit) return 0
  const longer = base + LONGER + context * (MAX_LENGTH + 1)
  let length = 0
  while (length < MAX_LENGTH) {
    while ((bit = bits.told(longer + length)) < 0) yield
    if (!bit) break
    length++
  }
  let negative
  while ((negative = bits.told(base + SIGN + context)) < 0) yield
  let number = 1
  for (let b = 0; b < length; b++) {
    while ((bit = bits.told(base + DIGIT + length * 64 + (b < 6 ? number : 0))) < 0) yield
    number = 2 * number + bit
  }
  return negative ? -number : number
}
