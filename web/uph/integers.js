/** Whole numbers of plans and meshes, each kind with counters of its own: number(k, c) [5.2]. */

const CONTEXTS = 8
const MAX_LENGTH = 34
const LONGER = CONTEXTS
const SIGN = LONGER + CONTEXTS * (MAX_LENGTH + 1)
const DIGIT = SIGN + CONTEXTS

/** Counters that each kind takes. */
export const INTEGER_COUNTERS = DIGIT + (MAX_LENGTH + 1) * 64

/** The next number of a kind in a context; waits where bytes are missing. */
export function* decodeInteger(bits, kind, context) {
  const base = kind * INTEGER_COUNTERS
  if (!(yield* bits.wait(base + context))) return 0
  const longer = base + LONGER + context * (MAX_LENGTH + 1)
  let length = 0
  while (length < MAX_LENGTH && (yield* bits.wait(longer + length))) length++
  const isNegative = yield* bits.wait(base + SIGN + context)
  let value = 1
  for (let b = 0; b < length; b++) value = 2 * value + (yield* bits.wait(base + DIGIT + length * 64 + (b < 6 ? value : 0)))
  return isNegative ? -value : value
}
