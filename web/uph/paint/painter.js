/** Paints charts [8]. Runs depend on placements alone, and are kept while the exemplar gets better. */

import { Canvas } from './canvas.js'
import { turnNormals } from './normals.js'
import { PaintRuns } from './runs.js'
import { Scratch } from './weights.js'

const STRIP_TEXELS = 2 ** 18 // painted at once, but at least
const STRIP_ROWS = 64
const KEPT_BYTES = 2 ** 26

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

  /**
   * Paint rows [start, stop) of a chart, and call take(painted, first row, rows) for strip after strip; `painted` is
   * RGBA, a byte each, of 8-bit samples. `placements()` is called where they are needed.
   */
  paint({ index, chart, field, placements, pyramid, start, stop, take }) {
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
