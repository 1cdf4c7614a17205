/** The decoder of `.uph` streams: reads chunks, and paints from the bytes received. */

import { parseBase } from './base.js'
import { ByteReader, GrowingBytes, UphError } from './bytes.js'
import { ChunkReader } from './chunks.js'
import { FieldDecoder } from './field-nodes.js'
import { IDENTITY_FIELD } from './field.js'
import { ImageDecoder } from './image/image-decoder.js'
import { MAX_MAP_SAMPLES, parseImageHeader } from './image/header.js'
import { parseLayout } from './layout.js'
import { LIMITS, checkCells, checkCharts, checkSamples } from './limits.js'
import { ChartPainter, paintedSize } from './paint/painter.js'
import { MapPyramid } from './paint/pyramid.js'
import { toRgba } from './paint/rgba.js'
import { QuiltDecoder, bareLayers } from './quilt.js'
import { parseSurface } from './surface.js'

const MAX_MAPS = 16
const MAX_DENSITY = 64
const STRIP_ROWS = 64 // painted at once
const CAUTION = 64 // a byte rarely codes more coefficients than this

/** Decodes a `.uph` stream as its bytes arrive. */
export class UphDecoder {
  #file = new ChunkReader((chunk, part, whole) => this.#take(chunk, part, whole))
  #payload = new GrowingBytes() // of a chunk that is read when it is whole
  #exact = { surface: null, charts: [] } // the surface itself
  #base = null // what is shown until it has some placements
  #fields = null // the FieldDecoder, where there are warp fields
  #quilt = null
  #maps = new Map() // ImageDecoders or finished images, by role
  #finished // maps that need no decoding, by role
  #pyramids = new Map() // of the maps as far as they have come, by role
  #substitute = null // painted with instead of the exemplar
  #changed = null
  #isHeld = false
  #failure = null
  #limits

  /**
   * `limits`: the largest demands of a stream, all of `LIMITS`; a stream that exceeds one is refused. `maps`: the result of `finishMaps` for the
   * same bytes of maps; then the maps are available immediately.
   */
  constructor({ limits = LIMITS, maps = null } = {}) {
    this.#limits = limits
    this.#finished = maps
    /** The surface and its charts, or a base, a coarse mesh that is shown before they have come; null and empty before that. */
    this.surface = null
    this.charts = []
    /** How many surfaces there have been: bases, then the surface itself. */
    this.surfaceNumber = 0
    /** Share of the exemplar's coefficients at which its decoding ends, even if more bytes arrive. */
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

  /** Whether `surface` is a base. */
  get isBase() {
    return this.#base !== null
  }

  /** Whether the whole file has come and every chunk's CRC is right. */
  get complete() {
    return this.#file.complete
  }

  /** Number of charts that have a placement of their own; the others show the middle of the exemplar. */
  get chartsKnown() {
    return this.#shownQuilt?.placed ?? 0
  }

  get #shownQuilt() {
    return this.#base ? null : this.#quilt
  }

  /** How many placements are known, and how many there are; 0 before chunk Q. */
  get placements() {
    return { known: this.#quilt?.known ?? 0, count: this.#quilt?.total ?? 0 }
  }

  /** Whether all placements and labels have arrived. */
  get placed() {
    return this.#quilt?.complete ?? false
  }

  /**
   * Take further bytes. Returns what changed: whether another surface has come, with its charts, whether the exemplar got better (and
   * with it every chart), and which charts got placements, labels or nodes of their warp field.
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
    const changed = new Set([...(this.#fields?.changed ?? []), ...(this.#quilt?.changed ?? [])])
    this.#changed.charts = this.#base ? [] : [...changed].sort((a, b) => a - b)
    this.#fields?.changed.clear()
    this.#quilt?.changed.clear()
    return this.#changed
  }

  /** Take a part of a chunk's payload. */
  #take(chunk, part, whole) {
    const { tag, payload } = chunk
    if (tag === 'D') this.#feedExemplar(part)
    else if (tag === 'E') this.#feedFurtherMap(chunk, part)
    else if (tag === 'P') {
      this.#quilt.feedPlacements(part)
      if (this.#base && this.#quilt.isSpread) this.#showExact()
    }
    else if (tag === 'N' || tag === 'M') {
      const fail = (what) => {
        throw new UphError(what, payload)
      }
      if (tag === 'M') this.#quilt.feedLabels(part, fail)
      else this.#fields.feed(part, fail)
    } else {
      this.#payload.push(part)
      if (!whole) return
      this.#takeWhole(tag, new ByteReader(this.#payload.bytes.subarray(0, this.#payload.length), payload))
      this.#payload = new GrowingBytes()
    }
  }

  #takeWhole(tag, reader) {
    if (tag === 'B') {
      this.#base = parseBase(reader, this.#limits.triangles)
      checkCharts(reader, this.#base.charts, this.#limits)
      this.#show(this.#base)
    }
    else if (tag === 'S') this.#exact.surface = parseSurface(reader, this.#limits.triangles)
    else if (tag === 'L') {
      this.#exact.charts = parseLayout(reader, this.#exact.surface)
      checkCharts(reader, this.#exact.charts, this.#limits)
      if (!this.#base) this.#showExact()
    } else if (tag === 'X') this.#takeExemplarHeader(reader)
    else if (tag === 'R') this.#takeMapHeader(reader)
    else if (tag === 'F') this.#fields = new FieldDecoder(reader, this.#exact.charts)
    else if (tag === 'Q') {
      const { charts } = this.#exact
      this.#quilt = new QuiltDecoder(reader, charts, this.exemplarSize)
      checkCharts(reader, charts.map((chart) => paintedSize(chart, this.#quilt.density)), this.#limits)
      checkCells(reader, this.#quilt.cells, this.#limits)
    } else if (tag === 't') this.#quilt.addTones(reader)
    else reader.fail(`chunk ${tag} has no reader here`, 0)
  }

  #showExact() {
    this.#base = null
    this.#show(this.#exact)
  }

  #show({ surface, charts }) {
    Object.assign(this, { surface, charts })
    this.surfaceNumber++
    this.#changed.surface = true
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
    this.#addMap(role, header)
  }

  #addMap(role, header) {
    this.#maps.set(role, this.#finished?.get(role) ?? new ImageDecoder(header))
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

  /** Take a part of a map; the first byte of the payload is its number. */
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

  /** The stream is complete: keep its maps without what decoded them. Returns them by role. */
  finishMaps() {
    for (const [role, map] of this.#maps) this.#maps.set(role, map.pyramid ? map : finished(map, role))
    return this.#maps
  }

  #newPyramid(role) {
    const map = this.#maps.get(role)
    const other = role === 'albedo' ? this.#substitute : null
    if (!other) return map.pyramid ?? new MapPyramid(map.image(), role)
    const { height, width } = map.header
    if (other.height !== height || other.width !== width) {
      throw new RangeError(`picture has ${other.height} × ${other.width} pixels; allowed: ${height} × ${width}`)
    }
    return new MapPyramid(other, role)
  }

  /** Whether maps stay as they were at the last request, even if more bytes arrive: for a painting in progress. */
  set isHeld(on) {
    this.#isHeld = on
    if (!on) this.#pyramids.clear()
  }

  /** A map of the exemplar from the bytes received: {height, width, channels, data}. */
  exemplar(role = 'albedo') {
    return this.#pyramid(role).picture
  }

  #pyramid(role) {
    if (this.needed) throw new RangeError(`stream needs ${this.needed} more bytes`)
    if (!this.#maps.has(role)) throw new RangeError(`map is ${role}; allowed: ${this.roles.join(', ')}`)
    if (!this.#pyramids.has(role)) this.#pyramids.set(role, this.#newPyramid(role))
    return this.#pyramids.get(role)
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

  /** The mean of a map as 8-bit RGBA. */
  meanRgba(role = 'albedo') {
    const { mean, picture } = this.#pyramid(role)
    return toRgba(mean, picture.channels, role)
  }

  /** Default density of painting charts, in texels per step each way. */
  get density() {
    return this.#shownQuilt?.density ?? 1
  }

  /** Height and width in texels of a chart that is painted with so many texels a step. */
  paintedSize(index, density = this.density) {
    const chart = this.charts[index]
    if (!chart) throw new RangeError(`chart is ${index}; allowed: 0 to ${this.charts.length - 1}`)
    if (!(density >= 1 / MAX_DENSITY && density <= MAX_DENSITY)) throw new RangeError(`density is ${density}; allowed: 1/${MAX_DENSITY} to ${MAX_DENSITY}`)
    return paintedSize(chart, density)
  }

  /** Texels of a chart as far as it is known, rows [start, stop) of it, as the map's `data`; `density` of them a step. */
  texels(index, { role = 'albedo', density, start = 0, stop } = {}) {
    const job = this.#job(index, role, density)
    return new ChartPainter(job).rows(start, checkedRows(start, stop, job.size))
  }

  /**
   * The same as 8-bit RGBA for the screen, written from `into[offset]` on with `stride` texels from row to row; returns
   * `into`. Grey becomes RGB; floats become sRGB where a map is a colour.
   */
  rgba(index, { role = 'albedo', density, start = 0, stop, into, stride, offset = 0 } = {}) {
    const job = this.#job(index, role, density)
    const end = checkedRows(start, stop, job.size)
    const wide = 4 * job.size.width
    const step = stride === undefined ? wide : 4 * stride
    into ??= new Uint8ClampedArray((end - start) * wide)
    if (!(offset >= 0 && step >= wide && offset + (end - start - 1) * step + wide <= into.length)) {
      throw new RangeError(`texels do not fit ${into.length} bytes`)
    }
    const painter = new ChartPainter(job)
    for (let row = start, to = offset; row < end; row += STRIP_ROWS) {
      const painted = toRgba(painter.rows(row, Math.min(end, row + STRIP_ROWS)), job.pyramid.picture.channels, role)
      for (let at = 0; at < painted.length; at += wide, to += step) into.set(painted.subarray(at, at + wide), to)
    }
    return into
  }

  /** The inputs for painting a chart, see `ChartPainter`, without the map: `chart`, `size`, `field`, `layers` and `hasTones`. */
  recipe(index, density) {
    const size = this.paintedSize(index, density)
    const chart = this.charts[index]
    const field = this.#base?.fields[index] ?? this.#fields?.field(index) ?? IDENTITY_FIELD
    const layers = this.#shownQuilt?.layersOf(index) ?? bareLayers(chart, this.exemplarSize)
    return { chart, size, field, layers: layers.map((layer) => centred(layer, field)), hasTones: this.#shownQuilt?.hasTones ?? false }
  }

  #job(index, role, density) {
    const pyramid = this.#pyramid(role)
    const { channels } = pyramid.picture
    if (role === 'normal' && channels !== 3) throw new RangeError(`normal map has ${channels} channels; allowed: 3`)
    return { ...this.recipe(index, density), pyramid }
  }
}

/** A complete image with the interface of an `ImageDecoder`: further bytes change nothing. */
function finished(map, role) {
  const { header, significant, complete } = map
  return { header, significant, complete, pyramid: new MapPyramid(map.image(), role), feed: () => false }
}

/** A layer whose placements have their centre matrices: the field's there, and the offset. */
function centred({ placements, ...layer }, field) {
  const there = [0, 0, 0, 0]
  const withCenter = (one) => ({ ...one, center: field.at(one.row, one.column, there).map((entry, k) => entry + one.offset[k]) })
  return { ...layer, placements: placements.map(withCenter) }
}

/** The end of rows; the last row if it is not given. */
function checkedRows(start, stop, { height }) {
  const end = stop ?? height
  if (!(start >= 0 && start <= end && end <= height)) throw new RangeError(`rows are ${start} to ${end}; allowed: 0 to ${height}`)
  return end
}
