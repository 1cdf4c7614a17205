/** Small arithmetic that all modules share. */

export function clamp(x, low, high) {
  return Math.min(Math.max(x, low), high)
}

export function ceilDivide(a, b) {
  return Math.ceil(a / b)
}

/** 0, 1 … count − 1. */
export function range(count) {
  return Array.from({ length: count }, (_, n) => n)
}

/** The whole number that a zigzag code 0, 1, 2, 3 … stands for: 0, −1, 1, −2 … */
export function fromZigzag(code) {
  return code & 1 ? -(code + 1) / 2 : code / 2
}
