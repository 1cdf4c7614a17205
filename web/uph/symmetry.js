/** The eight symmetries of the square, as a placement may show the exemplar. */

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
