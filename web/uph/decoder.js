/** The decoder of `.uph` streams: what chunks bring, and what can be painted of it. */

import { ByteReader, GrowingBytes, UphError } from './bytes.js'
import { ChunkReader } from './chunks.js'
import { FieldDecoder } from './field-nodes.js'
import { IDENTITY_FIELD } from './field.js'
import { ImageDecoder } from './image/decoder.js'
import { MAX_MAP_SAMPLES, parseImageHeader } from './image/header.js'
import { parseLayout } from './layout.js'
import { LIMITS, PaintBudget, checkCharts, checkSamples } from './limits.js'
import { MapPyramid } from './paint/pyramid.js'
import { toRgba } from './paint/rgba.js'
import { part } from './parts.js'
import { parsePlan } from './plans/parse.js'
import { parseSurface } from './surface.js'

const MAX_MAPS = 16
const CAUTION = 64 // coefficients that a byte hardly ever tells of

/** Decodes a `.uph` stream as its bytes come. */
export class UphDecoder {
  #file = new ChunkReader((chunk, part, whole) => this.#take(chunk, part, whole))
  #payload = new GrowingBytes() // of a chunk that is read when it is whole
  #fields = null // the FieldDecoder, where there are warp fields
  #plan = null
  #budget = null // of the plan
  #maps = new Map() // ImageDecoders, by role
  #pyramids = new Map() // of the maps as far as they have come, by role and how often they are halved
  #substitute = null // painted with instead of the exemplar
  #painter = null // made when something is painted here
  #changed = null
  #isHeld = false
  #failure = null
  #limits

  /** `limits`: what the stream may ask for, all of `LIMITS`; one that asks for more is refused. */
  constructor({ limits = LIMITS } = {}) {
    this.#limits = limits
    /** The surface and its charts; null and empty before they have come. */
    this.surface = null
    this.charts = []
    /** Share of the exemplar's coefficients at which its decoding ends, whatever else comes. */
    this.mostCoefficients = 1
  }

  // ---------------------------------------------------------------- reading

  /** Bytes fed so far. */
  get received() {
    return this.#file.received
  }

  /** Length of the whole file; null before its header has come. */
  get total() {
    return this.#file.total
  }

  /** Length of the first view; 0 before the header has come. */
  get view() {
    return this.#file.view
  }

  /** How many bytes are missing until something can be shown: 0 from then on. */
  get needed() {
    return this.#maps.size ? 0 : Math.max(1, (this.view || 6) - this.received)
  }

  /** Whether the whole file has come and every chunk's CRC is right. */
  get complete() {
    return this.#file.complete
  }

  /** How many charts have their placements; the others show the exemplar's mean. */
  get chartsKnown() {
    return this.#plan ? this.#plan.knownCharts.size : 0
  }

  /** Whether every placement and every mask has come. */
  get placed() {
    return this.#plan?.complete ?? false
  }

  /**
   * Take further bytes. Returns what changed: whether the surface has come, whether the exemplar got better (and
   * with it every chart), and which charts got other placements.
   */
  feed(bytes) {
    if (this.#failure) throw this.#failure
    this.#changed = { surface: false, exemplar: false, roles: [], charts: [] }
    try {
      this.#file.feed(bytes)
    } catch (error) {
      this.#failure = error
      throw error
    }
    const changed = this.#plan?.changed
    if (changed) {
      // What lies on a chart shows from when its own blocks are known.
      this.#changed.charts = [...changed].filter((n) => this.isPlaced(n)).sort((a, b) => a - b)
      for (const n of changed) this.#painter?.forget(n)
      changed.clear()
    }
    return this.#changed
  }

  /** Take a part of a chunk's payload. */
  #take(chunk, part, whole) {
    const { tag, payload } = chunk
    if (tag === 'D') this.#feedExemplar(part)
    else if (tag === 'E') this.#feedFurtherMap(chunk, part)
    else if (tag === 'P') this.#plan.feedSources(part)
    else if (tag === 'N' || tag === 'M') {
      const fail = (what) => {
        throw new UphError(what, payload)
      }
      if (tag === 'M') this.#plan.feedMasks(part, fail)
      else this.#feedNodes(part, fail)
    } else {
      this.#payload.push(part)
      if (!whole) return
      this.#takeWhole(tag, new ByteReader(this.#payload.bytes.subarray(0, this.#payload.length), payload))
      this.#payload = new GrowingBytes()
    }
  }

  #takeWhole(tag, reader) {
    if (tag === 'S') {
      this.surface = parseSurface(reader, this.#limits.triangles)
      this.#changed.surface = true
    } else if (tag === 'L') {
      this.charts = parseLayout(reader, this.surface)
      checkCharts(reader, this.charts, this.#limits)
    } else if (tag === 'X') this.#takeExemplarHeader(reader)
    else if (tag === 'R') this.#takeMapHeader(reader)
    else if (tag === 'F') this.#fields = new FieldDecoder(reader, this.charts)
    else {
      const fields = this.#fields?.fields ?? this.charts.map(() => IDENTITY_FIELD)
      const budget = new PaintBudget(this.charts, this.#limits)
      for (const { header } of this.#maps.values()) budget.addMap(header.channels, (what) => reader.fail(what, 0))
      this.#budget = budget
      this.#plan = parsePlan(reader, this.charts, fields, this.#maps.get('albedo').header, budget)
      this.#fields?.begin(this.#plan.order)
    }
  }

  #feedNodes(part, fail) {
    if (!this.#fields) fail('nodes come without warp fields')
    this.#fields.feed(part, fail)
    this.#plan.goOn()
  }

  // ---------------------------------------------------------------- maps

  #takeExemplarHeader(reader) {
    const header = parseImageHeader(reader, 4096, 4)
    reader.end('image header')
    if (this.view !== reader.start + reader.data.length + 4) {
      reader.fail(`first view ends here; the file says at ${this.view}`)
    }
    checkSamples(reader, [header], this.#limits)
    this.#addMap('albedo', header)
  }

  #takeMapHeader(reader) {
    const length = reader.varint('length of a role', 32, 1)
    const start = reader.take(length, 'role')
    const role = String.fromCharCode(...reader.data.subarray(start, start + length))
    if (!/^[a-z0-9_]+$/.test(role) || this.#maps.has(role) || this.#maps.size >= MAX_MAPS) {
      reader.fail('a map is not allowed, comes twice or is one too many', 0)
    }
    const header = parseImageHeader(reader, 4096, 4)
    reader.end("a map's header")
    const first = this.#maps.get('albedo').header
    if (header.height !== first.height || header.width !== first.width) reader.fail('a map has another size', 0)
    if (role === 'normal') reader.within(header.channels, 'number of channels of map normal', 3, 3, 0)
    let samples = header.height * header.width * header.channels
    for (const { header: one } of this.#maps.values()) samples += one.height * one.width * one.channels
    reader.within(samples, 'number of samples of all maps', 1, MAX_MAP_SAMPLES, 0)
    checkSamples(reader, [...[...this.#maps.values()].map((map) => map.header), header], this.#limits)
    this.#budget?.addMap(header.channels, (what) => reader.fail(what, 0))
    this.#addMap(role, header)
  }

  #addMap(role, header) {
    this.#maps.set(role, new ImageDecoder(header))
    this.#noteBetter(role)
  }

  #feedExemplar(part) {
    for (let place = 0; place < part.length; ) {
      const { known, count } = this.coefficients()
      const missing = this.mostCoefficients < 1 ? this.mostCoefficients * count - known : Infinity
      if (missing <= 0) break
      const start = place
      place += Math.max(1, Math.min(part.length, Math.floor(missing / CAUTION)))
      this.#feedMap('albedo', part.subarray(start, place))
    }
  }

  #feedMap(role, part) {
    if (this.#maps.get(role).feed(part)) this.#noteBetter(role)
  }

  /** Take a part of a map of which the first byte of the payload tells the number. */
  #feedFurtherMap(chunk, part) {
    if (!chunk.role) {
      if (!part.length) throw new UphError('a part of a map is empty', chunk.payload)
      chunk.role = this.roles[part[0]]
      if (!part[0] || !chunk.role) {
        throw new UphError(`number of a map is ${part[0]}; allowed: 1 to ${this.#maps.size - 1}`, chunk.payload)
      }
      part = part.subarray(1)
    }
    this.#feedMap(chunk.role, part)
  }

  #noteBetter(role) {
    if (role === 'albedo') this.#changed.exemplar = true
    if (!this.#changed.roles.includes(role)) this.#changed.roles.push(role)
    if (!this.#isHeld) this.#pyramids.delete(role)
  }

  /** Roles of the maps that have been announced: 'albedo', the exemplar's, is the first. */
  get roles() {
    return [...this.#maps.keys()]
  }

  /** How many of a map's coefficients are significant so far, of how many, and whether these are all. */
  coefficients(role = 'albedo') {
    const map = this.#maps.get(role)
    if (!map) return { known: 0, count: 0, complete: false }
    const { height, width, channels } = map.header
    return { known: map.significant, count: height * width * channels, complete: map.complete }
  }

  /**
   * Paint with another picture of the exemplar's height and width, {height, width, channels, data}; null: with the exemplar again.
   * May be called before anything has come; where the sizes differ, painting throws `RangeError`.
   */
  replaceExemplar(picture) {
    this.#substitute = picture
    this.#pyramids.delete('albedo')
  }

  #image(role, shrink) {
    const map = this.#maps.get(role)
    const other = role === 'albedo' ? this.#substitute : null
    if (!other) return map.image(shrink)
    const { height, width } = map.header
    if (other.height !== height || other.width !== width) {
      throw new RangeError(`picture has ${other.height} × ${other.width} pixels; allowed: ${height} × ${width}`)
    }
    return other
  }

  /** Whether maps stay as they were when somebody asked for them, whatever else comes: for a painting that goes on meanwhile. */
  set isHeld(on) {
    this.#isHeld = on
    if (!on) this.#pyramids.clear()
  }

  /** A map of the exemplar as far as it has come: {height, width, channels, data}. */
  exemplar(role = 'albedo') {
    return this.#pyramid(role).picture
  }

  /** A map, of which the finest levels may be left out. */
  #pyramid(role, shrink = 0) {
    if (this.needed) throw new RangeError(`stream needs ${this.needed} more bytes`)
    if (!this.#maps.has(role)) throw new RangeError(`map is ${role}; allowed: ${this.roles.join(', ')}`)
    if (!this.#pyramids.has(role)) this.#pyramids.set(role, [])
    return (this.#pyramids.get(role)[shrink] ??= new MapPyramid(this.#image(role, shrink), role))
  }

  /** Height and width of the exemplar, and so of every map. */
  get exemplarSize() {
    const { height, width } = this.#maps.get('albedo').header
    return { height, width }
  }

  /** A map of the exemplar as 8-bit RGBA for the screen, see `rgba`. */
  exemplarRgba(role = 'albedo') {
    const { height, width, channels, data } = this.exemplar(role)
    return { height, width, data: toRgba(data, channels, role) }
  }

  // ---------------------------------------------------------------- painting

  /** Whether a chart has its placements; before, it shows the exemplar's mean. */
  isPlaced(index) {
    return this.#plan?.knownCharts.has(index) ?? false
  }

  /** The mean of a map as 8-bit RGBA; with `shrink` about that, and sooner. */
  meanRgba(role = 'albedo', shrink = 0) {
    const { mean, picture } = this.#pyramid(role, shrink)
    return toRgba(mean, picture.channels, role)
  }

  /** Texels of a chart as far as they can be painted, rows [start, stop) of it, as the map's `data`. */
  texels(index, start = 0, stop = this.charts[index]?.height, role = 'albedo') {
    const job = this.#job(index, start, stop, role)
    return this.#painter.texels(job)
  }

  /**
   * The same as 8-bit RGBA for the screen, written from `into[offset]` on with `stride` texels from row to row; returns
   * `into`. Grey becomes RGB; floats become sRGB where a map is a colour.
   */
  rgba(index, { role = 'albedo', start = 0, stop = this.charts[index]?.height, into, stride, offset = 0 } = {}) {
    const job = this.#job(index, start, stop, role)
    return this.#painter.rgba(job, into, stride, offset)
  }

  /** A sketch of a chart as RGBA, see `sketch.js`: shrunk 2^shrink times each way, and of maps that are no normals. */
  sketchRgba(index, role, shrink) {
    const pyramid = this.#pyramid(role, shrink)
    const placements = this.#hasBlocks(index) ? this.#plan.placements(index, true) : []
    const samples = part('sketch')({ chart: this.charts[index], field: this.#fieldOf(index), placements, pyramid, shrink })
    return toRgba(samples, pyramid.picture.channels, role)
  }

  /** What a chart is painted from: its placements, in order, and its warp field; null where it shows the mean. */
  recipe(index) {
    return this.#hasBlocks(index) ? { placements: this.#plan.placements(index), field: this.#fieldOf(index) } : null
  }

  #hasBlocks(index) {
    return this.isPlaced(index) && !this.#plan.isEmpty(index)
  }

  #fieldOf(index) {
    return this.#fields?.fields[index] ?? IDENTITY_FIELD
  }

  /** What is to be painted: rows of a chart, and of what; `placements` is null where it shows the mean. */
  #job(index, start, stop, role) {
    const { channels } = this.exemplar(role)
    const chart = this.charts[index]
    if (!chart) throw new RangeError(`chart is ${index}; allowed: 0 to ${this.charts.length - 1}`)
    if (!(start >= 0 && start <= stop && stop <= chart.height)) {
      throw new RangeError(`rows are ${start} to ${stop}; allowed: 0 to ${chart.height}`)
    }
    if (role === 'normal' && channels !== 3) throw new RangeError(`normal map has ${channels} channels; allowed: 3`)
    this.#painter ??= new (part('Painter'))()
    const placements = this.#hasBlocks(index) ? () => this.#plan.placements(index) : null
    return { index, chart, start, stop, role, placements, field: this.#fieldOf(index), pyramid: this.#pyramid(role) }
  }
}
