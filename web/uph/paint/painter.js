/** Paints charts [8]. Runs depend on placements alone, and are kept while the exemplar gets better. */

import { Canvas } from './canvas.js'
import { turnNormals } from './normals.js'
import { toRgba } from './rgba.js'
import { PaintRuns } from './runs.js'
import { Scratch } from './weights.js'

const STRIP_TEXELS = 2 ** 18 // painted at once, but at least
const STRIP_ROWS = 64
const KEPT_BYTES = 2 ** 26
const MEAN_ROWS = 64 // of charts without placements, painted at once

export class Painter {
  constructor() {
    this.kept = new Map() // by chart: the runs of its strips, and how many bytes they are
    this.room = KEPT_BYTES
    this.runs = new PaintRuns()
    this.scratch = new Scratch()
    this.canvases = {}
  }

  /** Drop what is kept of a chart: its placements have changed. */
  forget(chart) {
    this.room += this.kept.get(chart)?.bytes ?? 0
    this.kept.delete(chart)
  }

  /** As of `UphDecoder`, which makes the job. */
  texels(job) {
    const { data, channels } = job.pyramid.picture
    const out = new data.constructor((job.stop - job.start) * job.chart.width * channels)
    let to = 0
    this.#paint(job, (painted) => {
      if (painted.constructor === Uint8Array && channels < 4) to = rgbaToChannels(painted, channels, out, to)
      else {
        out.set(painted, to)
        to += painted.length
      }
    })
    return out
  }

  rgba(job, into, stride, offset) {
    const { start, stop, role, pyramid } = job
    const wide = 4 * job.chart.width
    into ??= new Uint8ClampedArray((stop - start) * wide)
    const step = stride === undefined ? wide : 4 * stride
    if (!(offset >= 0 && step >= wide && offset + (stop - start - 1) * step + wide <= into.length)) {
      throw new RangeError(`texels do not fit ${into.length} bytes`)
    }
    this.#paint(job, (painted, row, rows) => {
      let to = offset + (row - start) * step
      if (painted.constructor !== Uint8Array) painted = toRgba(painted, pyramid.picture.channels, role)
      for (let i = 0; i < rows; i++, to += step) into.set(painted.subarray(wide * i, wide * (i + 1)), to)
    })
    return into
  }

  /**
   * Paint rows [start, stop) of a chart, and call take(painted, first row, rows) for strip after strip; `painted` is
   * RGBA, a byte each, of 8-bit samples. `placements()` is called where they are needed; null: there are none.
   */
  #paint(job, take) {
    if (job.placements) this.#paintBlocks(job, take)
    else paintMean(job, take)
  }

  #paintBlocks({ index, chart, field, placements, pyramid, start, stop }, take) {
    const { data, channels } = pyramid.picture
    const canvas = (this.canvases[data.constructor.name + channels] ??= new Canvas(data.constructor, channels))
    if (!this.kept.has(index)) this.kept.set(index, { strips: [], bytes: 0 })
    const kept = this.kept.get(index)
    const { width } = chart
    const rows = Math.max(STRIP_ROWS, Math.floor(STRIP_TEXELS / width))
    let all
    for (let strip = Math.floor(start / rows); strip * rows < stop; strip++) {
      const top = strip * rows
      const bottom = Math.min(top + rows, chart.height)
      const [row0, row1] = [Math.max(start, top), Math.min(stop, bottom)]
      const [first, end] = [(row0 - top) * width, (row1 - top) * width]
      canvas.clear((bottom - top) * width, first, end)
      if (kept.strips[strip]) kept.strips[strip].paint(pyramid, first, end, canvas)
      else {
        this.runs.begin(chart, field, pyramid.picture, top, bottom, this.scratch)
        all ??= placements()
        this.#paintAnew(all, pyramid, first, end, canvas, kept, strip)
      }
      const painted = canvas.painted(first, end)
      const count = end - first
      if (pyramid.isNormal && !field.isIdentity) {
        turnNormals(painted, painted.length / count, field, width, row0 * width, count)
      }
      take(painted, row0, row1 - row0)
    }
  }

  /** Find the runs of a strip, paint them, and keep them if there is room. */
  #paintAnew(placements, pyramid, first, end, canvas, kept, strip) {
    const { runs } = this
    if (runs.isDeep(placements)) {
      for (const placement of placements) {
        runs.clear()
        runs.add(placement, true)
        runs.paint(pyramid, first, end, canvas)
      }
      return
    }
    for (let n = placements.length - 1; n >= 0; n--) runs.add(placements[n], false)
    if (runs.bytes <= this.room) {
      kept.strips[strip] = runs.copy()
      kept.bytes += runs.bytes
      this.room -= runs.bytes
    }
    runs.paint(pyramid, first, end, canvas)
  }
}

function paintMean({ chart: { width }, pyramid: { mean, picture }, start, stop }, take) {
  const pixel = mean instanceof Uint8Array ? toRgba(mean, picture.channels) : mean
  for (let row = start; row < stop; row += MEAN_ROWS) {
    const rows = Math.min(MEAN_ROWS, stop - row)
    const painted = new pixel.constructor(rows * width * pixel.length)
    for (let at = 0; at < painted.length; at += pixel.length) painted.set(pixel, at)
    take(painted, row, rows)
  }
}

/** Write RGBA as so many channels, from out[to] on; returns where it ends. */
function rgbaToChannels(rgba, channels, out, to) {
  for (let from = 0; from < rgba.length; from += 4, to += channels) {
    out[to] = rgba[from]
    if (channels === 3) {
      out[to + 1] = rgba[from + 1]
      out[to + 2] = rgba[from + 2]
    } else if (channels === 2) out[to + 1] = rgba[from + 3]
  }
  return to
}
