/** The eight symmetries of the square, as a block may show the exemplar. */

/** Of each: pixel rows per row, per column; pixel columns per row, per column. */
export const SYMMETRIES = [
  [1, 0, 0, 1],
  [0, 1, -1, 0],
  [-1, 0, 0, -1],
  [0, -1, 1, 0],
  [0, 1, 1, 0],
  [1, 0, 0, -1],
  [0, -1, -1, 0],
  [-1, 0, 0, 1],
]

export const MIRRORED_COLUMNS = 5
export const MIRRORED_ROWS = 7
export const HALF_TURN = 2

/** The symmetry T · E⁻¹ · B: T turned as E is to give B. */
export function turnedAlike(t, e, b) {
  const [p, q, r, s] = SYMMETRIES[e]
  const inverse = symmetryOf([p, r, q, s])
  return symmetryOf(symmetryTimes(t, symmetryTimes(inverse, SYMMETRIES[b])))
}

/** The number of a symmetry, by its matrix. */
function symmetryOf(matrix) {
  return SYMMETRIES.findIndex((one) => one.every((entry, k) => entry === matrix[k]))
}

/** The symmetry times a 2 × 2 matrix. */
export function symmetryTimes(symmetry, [a, b, c, d]) {
  const [p, q, r, s] = SYMMETRIES[symmetry]
  return [p * a + q * c, p * b + q * d, r * a + s * c, r * b + s * d]
}
