/** The part of a face that a chart covers: shares, 0 to 1 over the chart each way, to parameters of its patches. */

import { basis, distance, evaluate, tabulate } from './bezier.js'

/** Parameters closer than this are one. */
export const EPS = 1e-6

const ROUNDING = 1e-12 // a parameter so near a border of patches is meant to lie on it
const JUMP = 0.05 // derivatives jump if they differ by more than this part of the longer one
const INSIDE = [0.1, 0.3, 0.5, 0.7, 0.9] // where along a border that is looked at: its ends may be poles

/** Where low to high lies on `count` patches: `first` and `last` are the outermost of those it covers. */
function axisOf(low, high, count) {
  const first = Math.min(Math.floor(low + EPS), count - 1)
  const last = Math.max(first, Math.min(Math.ceil(high - EPS), count) - 1)
  return { low, high, count, first, last }
}

export class ChartPart {
  #patches
  #face
  #jumps

  constructor(patches, face, { s0, s1, t0, t1 }) {
    this.#patches = patches
    this.#face = face
    /** Along s and along t. */
    this.axes = [axisOf(s0, s1, face.rows), axisOf(t0, t1, face.columns)]
  }

  #number(row, column) {
    return this.#face.firstPatch + row * this.#face.columns + column
  }

  /** Shares along an axis as runs on one patch each: {index, start, places}, its own parameters. */
  runs({ low, high, first, last }, shares) {
    const runs = []
    shares.forEach((u, start) => {
      let x = low * (1 - u) + high * u
      if (Math.abs(x - Math.round(x)) < ROUNDING) x = Math.round(x)
      const index = Math.min(Math.max(Math.floor(x), first), last)
      if (runs.at(-1)?.index !== index) runs.push({ index, start, places: [] })
      runs.at(-1).places.push(x - index)
    })
    return runs
  }

  /** All pairs of shares along s and along t, patch by patch: {patch, S, T}, the runs on it. */
  blocks(us, vs) {
    return this.#pairs(this.runs(this.axes[0], us), this.runs(this.axes[1], vs))
  }

  /** The same for `cells` even cells of each patch, or of what the chart covers of it, along s and along t. */
  samples(cells) {
    return this.#pairs(
      ...this.axes.map(({ low, high, first, last }, axis) =>
        tabulate(last - first + 1, (k) => {
          const index = first + k
          const [from, to] = [Math.max(low - index, 0), Math.min(high - index, 1)]
          return { index, places: tabulate(cells[axis] + 1, (n) => from + ((to - from) * n) / cells[axis]) }
        }),
      ),
    )
  }

  #pairs(down, across) {
    return down.flatMap((S) =>
      across.map((T) => ({ patch: this.#patches[this.#number(S.index, T.index)], S, T })),
    )
  }

  /** Points and derivatives by the face's parameters, nine numbers each, at all pairs of shares. */
  evaluate(us, vs) {
    const out = new Float64Array(9 * us.length * vs.length)
    for (const { patch, S, T } of this.blocks(us, vs)) {
      const v = evaluate(patch, basis(patch.m, S.places), basis(patch.n, T.places))
      const width = 9 * T.places.length
      S.places.forEach((_, r) => {
        out.set(v.subarray(r * width, (r + 1) * width), 9 * ((S.start + r) * vs.length + T.start))
      })
    }
    return out
  }

  /** Along s and along t: shares at which derivatives jump from one of the chart's patches to the next. */
  get jumps() {
    this.#jumps ??= [0, 1].map((axis) => {
      const { low, high, first, last } = this.axes[axis]
      const lines = tabulate(last - first, (k) => first + 1 + k).filter((line) => this.#isJump(axis, line))
      return lines.map((line) => (line - low) / (high - low))
    })
    return this.#jumps
  }

  /** Whether derivatives across a line differ on its two sides. */
  #isJump(axis, line) {
    const { first, last } = this.axes[1 - axis]
    return tabulate(last - first + 1, (k) => first + k).some((along) => {
      const [before, after] = [line - 1, line].map((at, side) => {
        const patch = this.#patches[axis ? this.#number(along, at) : this.#number(at, along)]
        const [us, vs] = axis ? [INSIDE, [1 - side]] : [[1 - side], INSIDE]
        return evaluate(patch, basis(patch.m, us), basis(patch.n, vs))
      })
      const zero = new Float64Array(3)
      return INSIDE.some((_, k) => {
        const at = 9 * k + 3 + 3 * axis
        const longer = Math.max(distance(before, at, zero, 0), distance(after, at, zero, 0))
        return distance(before, at, after, at) > JUMP * longer
      })
    })
  }
}
