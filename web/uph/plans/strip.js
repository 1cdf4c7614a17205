/** A strip [4]: blocks along an edge of chart a that also lie, by a symmetry, on the chart b beyond it. */

import { SYMMETRIES } from '../symmetry.js'

/** Edges are numbered 0 top, 1 right, 2 bottom, 3 left; 1 and 3 run down. */
export function edgeLength(chart, edge) {
  return edge & 1 ? chart.height : chart.width
}

export class Strip {
  constructor(parts, charts) {
    Object.assign(this, parts)
    this.chartA = charts[this.a]
    this.chartB = charts[this.b]
    // b's step for a's steps down and right; the way back is the transpose.
    const zero = this.#toB(0, 0)
    const [down, right] = [this.#toB(1, 0), this.#toB(0, 1)].map((to) => to.map((x, k) => x - zero[k]))
    Object.assign(this, { down, right })
    this.symmetry = SYMMETRIES.findIndex(
      ([p, q, r, s]) => p === down[0] && q === down[1] && r === right[0] && s === right[1],
    )
  }

  /** Whether it runs down. */
  get isUpright() {
    return (this.edgeA & 1) === 1
  }

  /** Row and column in b's grid of a texel of a's grid. */
  #toB(row, column) {
    const { chartA, chartB, edgeA, edgeB, opposed, start, length, otherStart } = this
    const depth = [-1 - row, column - chartA.width, row - chartA.height, -1 - column][edgeA]
    const along = (edgeA & 1 ? row : column) - start
    const there = otherStart + (opposed ? length - 1 - along : along)
    return [
      [depth, there],
      [there, chartB.width - 1 - depth],
      [chartB.height - 1 - depth, there],
      [there, depth],
    ][edgeB]
  }

  /** Row and column in a's grid of the centre of a block so far along the edge. */
  #centreOnA(along) {
    const line = [0, this.chartA.width, this.chartA.height, 0][this.edgeA]
    return this.isUpright ? [along, line] : [line, along]
  }

  /** The placement on a of a block; its cells are coded along the edge. */
  onA({ along, cells, ...block }) {
    const [row, column] = this.#centreOnA(along)
    return { ...block, row, column, symmetry: 0, cells: this.#cellsOnA(block, cells) }
  }

  #cellsOnA({ height, maskCell }, coded) {
    if (this.isUpright) return coded
    const side = height / maskCell
    const cells = new Uint8Array(side * side)
    for (let i = 0; i < side; i++) for (let j = 0; j < side; j++) cells[i * side + j] = coded[j * side + i]
    return cells
  }

  /** The placement on b of a block: it covers the same texels, and shows the same pixels there. */
  onB({ along, cells, ...block }) {
    const { down, right, symmetry } = this
    const size = block.height
    const half = size >> 1
    const [row, column] = this.#centreOnA(along)
    const near = this.#toB(row - half, column - half)
    const far = this.#toB(row - half + size - 1, column - half + size - 1)
    const [top, left] = [Math.min(near[0], far[0]), Math.min(near[1], far[1])]
    // b's centre, as steps from the texel that is a's top left one, taken back to a's steps.
    const [y, x] = [top + half - near[0], left + half - near[1]]
    return {
      ...block,
      row: top + half,
      column: left + half,
      sourceRow: block.sourceRow + 16 * (down[0] * y + down[1] * x - half),
      sourceColumn: block.sourceColumn + 16 * (right[0] * y + right[1] * x - half),
      symmetry,
      cells: this.#cellsOnB(block, this.#cellsOnA(block, cells), [row - half, column - half], [top, left]),
    }
  }

  #cellsOnB({ height, maskCell }, onA, [topA, leftA], [topB, leftB]) {
    const side = height / maskCell
    const cells = new Uint8Array(side * side)
    for (let i = 0; i < side; i++) {
      for (let j = 0; j < side; j++) {
        const [r, c] = this.#toB(topA + i * maskCell, leftA + j * maskCell)
        cells[Math.floor((r - topB) / maskCell) * side + Math.floor((c - leftB) / maskCell)] = onA[i * side + j]
      }
    }
    return cells
  }
}
