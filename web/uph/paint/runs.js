/** What painting some rows of a chart reads and writes: runs of texels, kept while the exemplar gets better. */

import { MASK_NONE, topLeft } from '../plans/placement.js'
import { levelOf } from './levels.js'
import { SourceTracer } from './tracer.js'
import { placementWeights } from './weights.js'

/** How a run of texels is painted: opaque with nothing above, opaque below something, or over what is there. */
export const FINAL = 1
export const BASE = 2
export const BLEND = 3

// What lies above a texel.
const NOTHING = 0
const BLENDED = 1
const OPAQUE = 2

const MAX_LAYERS = 12 // on average; more are painted one by one

/**
 * Runs are added from the topmost placement down, and painted from the last one up. A run is (level, symmetry and
 * kind; first texel; texels); of each of its texels there is a place in that level of the exemplar, and, if it is
 * blended, a weight.
 */
export class PaintRuns {
  constructor(runs = new Int32Array(0), places = new Uint32Array(0), weights = new Uint8Array(0)) {
    Object.assign(this, { runs, places, weights })
    Object.assign(this, { runCount: runs.length, placeCount: places.length, weightCount: weights.length })
    Object.assign(this, { chart: null, exemplar: null, start: 0, stop: 0, scratch: null, field: null })
    Object.assign(this, { texels: 0, above: null })
  }

  /** Begin anew, for rows [start, stop) of a chart; `scratch` is used while placements are added. */
  begin(chart, field, exemplar, start, stop, scratch) {
    Object.assign(this, { chart, field, exemplar, start, stop, scratch })
    this.texels = (stop - start) * chart.width
    this.above = scratch.take('above', Uint8Array, this.texels).fill(NOTHING)
    this.clear()
  }

  clear() {
    this.runCount = this.placeCount = this.weightCount = 0
  }

  get bytes() {
    return 4 * this.runCount + 4 * this.placeCount + this.weightCount
  }

  /** A copy to keep, which takes no more room than it needs. */
  copy() {
    const { runs, places, weights, runCount, placeCount, weightCount } = this
    return new PaintRuns(runs.slice(0, runCount), places.slice(0, placeCount), weights.slice(0, weightCount))
  }

  /** Where the rectangle of a placement lies in these rows: its top left and the rows and columns within. */
  #clip(placement) {
    const [top, left] = topLeft(placement)
    return {
      ...{ top, left, row0: Math.max(top, this.start), row1: Math.min(top + placement.height, this.stop) },
      ...{ column0: Math.max(left, 0), column1: Math.min(left + placement.width, this.chart.width) },
    }
  }

  /** Whether placements cover these rows so often that all of them may be too many to remember. */
  isDeep(placements) {
    let area = 0
    for (const placement of placements) {
      const { row0, row1, column0, column1 } = this.#clip(placement)
      area += Math.max(0, row1 - row0) * Math.max(0, column1 - column0)
    }
    return area > MAX_LAYERS * this.texels
  }

  /** Make room for a row more. */
  #reserve(count) {
    this.runs = grown(this.runs, this.runCount + 3 * count)
    this.places = grown(this.places, this.placeCount + count)
    this.weights = grown(this.weights, this.weightCount + count)
  }

  /** Add a placement below all before; with `alone` as if something were above it everywhere. */
  add(placement, alone) {
    const clip = this.#clip(placement)
    const { row0, row1, column0, column1 } = clip
    if (row0 >= row1 || column0 >= column1) return
    const tracer = new SourceTracer(placement, this.field, this.exemplar)
    const tag = (tracer.level << 5) | (placement.symmetry << 2)
    const { top } = clip
    const weights =
      placement.mask === MASK_NONE ? null : placementWeights(placement, this.scratch, row0 - top, row1 - top)
    for (let row = row0; row < row1; row++) {
      this.#reserve(column1 - column0)
      const { runs, runCount: firstRun } = this
      const start = (row - this.start) * this.chart.width
      const at = weights && (row - clip.top - weights.top) * weights.width + column0 - clip.left - weights.left
      this.#addRow(tag, clip, start, weights?.values, at, alone)
      for (let run = firstRun; run < this.runCount; run += 3) {
        tracer.trace(row, runs[run + 1] - start, runs[run + 2], this.places, this.placeCount)
        this.placeCount += runs[run + 2]
      }
    }
  }

  /** Add the runs of one row, whose texels begin at `start`, and the weights of what is blended. */
  #addRow(tag, { column0, column1 }, start, weights, at, alone) {
    const { runs, above } = this
    let { runCount, weightCount } = this
    let open = 0
    for (let texel = start + column0, end = start + column1; texel < end; texel++, at++) {
      const weight = weights ? weights[at] : 256
      const cover = alone ? BLENDED : above[texel]
      let kind = 0
      if (weight > 0 && cover !== OPAQUE) {
        kind = weight < 256 ? BLEND : cover === NOTHING ? FINAL : BASE
        above[texel] = weight < 256 ? BLENDED : OPAQUE
        if (kind === BLEND) this.weights[weightCount++] = weight
      }
      if (kind !== open) {
        if (open) runs[runCount - 1] = texel - runs[runCount - 2]
        open = kind
        if (open) {
          runs[runCount] = tag | kind
          runs[runCount + 1] = texel
          runCount += 3
        }
      }
    }
    if (open) runs[runCount - 1] = start + column1 - runs[runCount - 2]
    this.runCount = runCount
    this.weightCount = weightCount
  }

  /** Paint all runs in texels [first, end), bottom up. */
  paint(pyramid, first, end, canvas) {
    const { runs, places, weights } = this
    let place = this.placeCount
    let weight = this.weightCount
    let last = -1
    let level
    for (let run = this.runCount - 3; run >= 0; run -= 3) {
      const tag = runs[run]
      place -= runs[run + 2]
      if ((tag & 3) === BLEND) weight -= runs[run + 2]
      if (runs[run + 1] < first || runs[run + 1] >= end) continue
      if (tag >> 2 !== last) {
        last = tag >> 2
        level = levelOf(pyramid, last >> 3, last & 7)
      }
      const [to, stop] = [runs[run + 1], runs[run + 1] + runs[run + 2]]
      canvas.lay(tag & 3, to, stop, level.samples, level.width, places, place, weights, weight)
    }
  }
}

/** An array with room for `length`, twice as much where it has to be copied. */
function grown(array, length) {
  if (length <= array.length) return array
  const more = new array.constructor(2 * length)
  more.set(array)
  return more
}
