// Decodes, paints and tessellates a `.uph` stream beside the page: the module Worker of `uph-three.js`.
//
// In:  open {maxTextureSize, maxTexels}   once, first
//      feed {bytes}                       further bytes of the stream
//      limit {bytes?, coefficients?}      show a prefix only; neither: all that has come
//      counts {counts}                    segments of every chart, along s and along t
//      shown {buffers}                    what the last `textures` brought is on screen; buffers to use again
//      Any may have a `ticket`: states tell the last one that was heard.
// Out: surface {charts, bounds, roles}    sizes of the textures and spheres of the charts, once
//      meshes {pieces}                    geometry of the charts that changed
//      textures {entries, state}          what changed, and what is shown then. An entry has a target (color, normal …)
//                                         and is `data` for a chart; the gutter only, `ring`; that a chart is not known,
//                                         `unknown`; or the exemplar, which such charts repeat, mirrored: `preview`
//      state {state}                      where decoding stands
//      error {message, offset}            the stream is damaged

import { UphDecoder } from './uph.js'
import { edgeLines, makeRing, putRing } from './uph-gutter.js'
import { SurfaceMesher, countsFor } from './uph-mesh.js'

/** What the textures of a material hold: for each, the roles it is made of. */
const TARGETS = {
  color: ['albedo', 'opacity'],
  normal: ['normal'],
  surface: ['ao', 'roughness', 'metallic'], // red, green, blue
  emission: ['emission'],
  height: ['height'],
}
const SLICE = 25 // milliseconds of work before messages are looked at
const PAUSE = 250 // milliseconds between paintings while more is to come
const PIECE = 2048 // bytes fed at once
const COEFFICIENT_PARTS = 400 // as Python counts coefficients
const FIRST_PIXELS = 600 // of the model on screen, before anybody has seen it

/** One stream. `post(message, transfer)` sends to the page. */
export class Session {
  #post
  #bytes = new Uint8Array(1 << 16)
  #length = 0
  #decoder = new UphDecoder()
  #mesher = null
  #limit = {}
  #ticket = 0
  #failed = false
  #counts = null
  #meshed = null // the counts that the page has
  #shrink = 0
  #sizes = [] // of the textures, without gutters
  #lines = {} // per target and chart: the texels along its four edges
  #turns = new Map() // per edge: angles between the frames of either side
  #alpha = [] // per chart: how many texels are see-through, and how many of them are soft
  #dirty = new Map() // per target: charts to paint
  #waiting = false // the page has not shown yet what it got
  #turned = false // work is due
  #busy = false
  #spare = []
  #hurry = false // somebody waits for just this picture
  #painted = -Infinity // when, and how long it took
  #took = 0

  constructor(post) {
    this.#post = post
    this.#turn()
  }

  receive(message) {
    const { kind, ticket = this.#ticket } = message
    this.#ticket = ticket
    if (kind === 'open') {
      this.maxTextureSize = message.maxTextureSize
      this.maxTexels = message.maxTexels
    } else if (kind === 'feed') this.#append(message.bytes)
    else if (kind === 'limit') this.#setLimit(message)
    else if (kind === 'counts') this.#counts = message.counts
    else if (kind === 'shown') {
      this.#waiting = false
      this.#spare = message.buffers
    }
    this.#turn()
  }

  #append(bytes) {
    if (this.#length + bytes.length > this.#bytes.length) {
      const larger = new Uint8Array(Math.max(2 * this.#bytes.length, this.#length + bytes.length))
      larger.set(this.#bytes.subarray(0, this.#length))
      this.#bytes = larger
    }
    this.#bytes.set(bytes, this.#length)
    this.#length += bytes.length
  }

  #setLimit({ bytes, coefficients }) {
    this.#limit = { bytes, coefficients }
    this.#hurry = true
    const decoder = this.#decoder
    // What has been read can not be unread; shares are counted at fixed places, as Python does.
    if ((bytes ?? Infinity) < decoder.received || (coefficients ?? 1) < 1) this.#restart()
  }

  #restart() {
    this.#decoder = new UphDecoder()
    this.#failed = false
    this.#dirty.clear() // the new decoder tells of every map again
  }

  #soil(target, charts = this.#sizes.keys()) {
    const set = this.#dirty.get(target) ?? new Set()
    for (const chart of charts) set.add(chart)
    this.#dirty.set(target, set)
  }

  /** Do what is due, in slices, so that messages are heard in between. */
  #turn() {
    if (this.#turned) return
    this.#turned = true
    breath().then(async () => {
      this.#turned = false
      if (this.#busy) return
      this.#busy = true
      try {
        await this.#work()
      } catch (error) {
        this.#fail(error) // a fault of ours, or of the machine: memory, say
        this.#dirty.clear()
      }
      this.#busy = false
      this.#post({ kind: 'state', state: this.#state(true) })
    })
  }

  async #work() {
    for (;;) {
      const more = this.#feed()
      if (this.#mesher) this.#mesh()
      const due = this.#isDirty && !this.#waiting
      // While more is to come, now and then is enough: painting takes at most half of the time.
      const wait = this.#painted + Math.max(PAUSE, this.#took) - performance.now()
      const last = !more && (this.#decoder.complete || this.#hurry)
      if (due && (wait <= 0 || last)) {
        if (last) this.#hurry = false
        await this.#paint()
      } else if (!more) {
        if (due) setTimeout(() => this.#turn(), wait)
        break
      }
      await breath()
    }
  }

  get #isDirty() {
    return !this.#decoder.needed && [...this.#dirty.values()].some((charts) => charts.size)
  }

  /** Read on for a slice; returns whether there is more. */
  #feed() {
    const until = performance.now() + SLICE
    const decoder = this.#decoder
    const { bytes = Infinity, coefficients = 1 } = this.#limit
    // A limit below the first view is overrun.
    const end = () => Math.min(this.#length, decoder.needed ? Math.max(bytes, decoder.received + decoder.needed) : bytes)
    const counted = coefficients < 1
    const part = counted ? Math.max(16, Math.floor((decoder.total ?? this.#length) / COEFFICIENT_PARTS)) : PIECE
    const left = () =>
      !this.#failed &&
      decoder.received < end() &&
      (decoder.needed > 0 || !counted || share(decoder) < coefficients)
    while (left()) {
      const { received, needed } = decoder
      const size = Math.min(needed || part, end() - received)
      try {
        this.#take(decoder.feed(this.#bytes.subarray(received, received + size)))
      } catch (error) {
        this.#fail(error)
      }
      if (performance.now() > until) break
    }
    return left()
  }

  #fail(error) {
    this.#failed = true
    this.#post({ kind: 'error', message: error.message, offset: error.offset })
  }

  #take({ roles, charts }) {
    const decoder = this.#decoder
    if (decoder.needed) return
    if (!this.#mesher) this.#begin()
    for (const [target, parts] of Object.entries(TARGETS)) {
      const known = parts.filter((role) => has(decoder, role))
      if (known.some((role) => roles.includes(role))) this.#soil(target)
      else if (charts.length && known.length) this.#soil(target, charts)
    }
  }

  /** Surface and charts are known: tell the page. */
  #begin() {
    const { surface, charts } = this.#decoder
    const texels = charts.reduce((sum, { height, width }) => sum + height * width, 0)
    const side = charts.reduce((most, { height, width }) => Math.max(most, height, width), 0)
    while (side >> this.#shrink > this.maxTextureSize - 2 || texels > this.maxTexels * 4 ** this.#shrink) this.#shrink++
    if (this.#shrink > 4) throw new Error(`model has ${texels} texels; allowed here: ${this.maxTexels * 4 ** 4}`)
    const shrunk = (size) => Math.max(1, size >> this.#shrink)
    this.#sizes = charts.map(({ height, width }) => ({ height: shrunk(height), width: shrunk(width) }))
    this.#alpha = charts.map(() => ({ clear: 0, soft: 0 }))
    this.#mesher = new SurfaceMesher(surface, charts)
    const bounds = charts.map((_, n) => this.#mesher.bounds(n))
    const radius = span(bounds)
    this.#counts = new Uint16Array(bounds.flatMap((one) => countsFor(one, FIRST_PIXELS / 2 / radius, 0.5)))
    this.#post({ kind: 'surface', charts: this.#sizes, bounds })
  }

  #mesh() {
    const counts = this.#counts
    const changed = (n) => counts[2 * n] !== this.#meshed?.[2 * n] || counts[2 * n + 1] !== this.#meshed[2 * n + 1]
    const pieces = []
    for (const chart of this.#sizes.keys()) {
      const touched = () => [0, 1, 2, 3].some((edge) => this.#mesher.seams(chart, edge).some((one) => changed(one.chart)))
      if (changed(chart) || touched()) pieces.push({ chart, ...this.#mesher.mesh(chart, counts) })
    }
    this.#meshed = counts.slice()
    if (!pieces.length) return
    const parts = ['positions', 'normals', 'tangents', 'parameters', 'indices', 'outline']
    this.#post({ kind: 'meshes', pieces, counts: this.#meshed }, pieces.flatMap((piece) => parts.map((part) => piece[part].buffer)))
  }

  /** Paint all that changed, and hand it over. */
  async #paint() {
    const begun = performance.now()
    const state = this.#state(false)
    const jobs = [...this.#dirty].filter(([, charts]) => charts.size)
    for (const [target] of jobs) this.#dirty.set(target, new Set())
    const decoder = this.#decoder
    const entries = []
    let until = begun + SLICE
    for (const [target, charts] of jobs) {
      const fresh = new Map()
      const known = [...charts].filter((chart) => decoder.isPlaced(chart))
      entries.push(...this.#await(target, [...charts].filter((chart) => !decoder.isPlaced(chart)), decoder))
      for (const chart of known) {
        fresh.set(chart, this.#paintChart(decoder, target, chart))
        if (performance.now() > until) {
          await breath()
          until = performance.now() + SLICE
        }
      }
      entries.push(...this.#close(target, fresh))
    }
    this.#waiting = true
    this.#post({ kind: 'textures', entries, state: { ...state, alpha: this.#alphaMode() } }, entries.flatMap((entry) => entry.data?.buffer ?? []))
    this.#painted = performance.now()
    this.#took = this.#painted - begun
  }

  /** Charts whose placements have not come: what the page does with them. */
  #await(target, charts, decoder) {
    const lines = (this.#lines[target] ??= [])
    for (const chart of charts) delete lines[chart]
    const entries = charts.map((chart) => ({ chart, target, unknown: true }))
    if (target === 'color' && charts.length) {
      const picture = decoder.exemplarRgba()
      if (has(decoder, 'opacity')) {
        const opacity = decoder.exemplarRgba('opacity').data
        for (let n = 0; n < opacity.length; n += 4) picture.data[n + 3] = opacity[n]
      }
      entries.unshift({ target, preview: true, repeat: decoder.repeat * 2 ** this.#shrink, ...picture })
    }
    return entries
  }

  /** RGBA texels of a chart with room for a gutter of one texel round it. */
  #paintChart(decoder, target, chart) {
    const { height, width } = this.#sizes[chart]
    const stride = width + 2
    const data = this.#buffer(4 * stride * (height + 2))
    const paint = (role, into) => paintRole(decoder, chart, role, into, stride, this.#shrink)
    const roles = TARGETS[target].filter((role) => has(decoder, role))
    if (target === 'surface' || roles.length > 1) {
      data.fill(255)
      const one = new Uint8Array(data.length)
      for (const role of roles) {
        const channel = role === 'opacity' ? 3 : TARGETS.surface.indexOf(role)
        if (channel < 0) paint(role, data)
        else {
          paint(role, one)
          for (let n = channel, m = 0; n < data.length; n += 4, m += 4) data[n] = one[m]
        }
      }
    } else if (roles.length) paint(roles[0], data)
    if (target === 'color') this.#countAlpha(chart, data, stride)
    return data
  }

  #countAlpha(chart, data, stride) {
    const { height, width } = this.#sizes[chart]
    const found = { clear: 0, soft: 0 }
    for (let row = 1; row <= height; row++) {
      for (let n = 4 * (row * stride + 1) + 3, end = n + 4 * width; n < end; n += 4) {
        if (data[n] < 255) found.clear++
        if (data[n] > 25 && data[n] < 230) found.soft++
      }
    }
    this.#alpha[chart] = found
  }

  /** As glTF has it, and as the Python side decides. */
  #alphaMode() {
    const sum = (key) => this.#alpha.reduce((total, one) => total + one[key], 0)
    if (!sum('clear')) return 'opaque'
    const texels = this.#sizes.reduce((total, { height, width }) => total + height * width, 0)
    return sum('soft') < texels / 20 ? 'mask' : 'blend'
  }

  /** Fill the gutters of fresh charts, and of those that they touch; returns what the page must take over. */
  #close(target, fresh) {
    const lines = (this.#lines[target] ??= [])
    for (const [chart, data] of fresh) lines[chart] = edgeLines(data, this.#sizes[chart])
    const touched = new Set()
    for (const chart of fresh.keys()) {
      for (let edge = 0; edge < 4; edge++) {
        for (const { chart: other } of this.#mesher.seams(chart, edge)) {
          if (!fresh.has(other) && lines[other]) touched.add(other)
        }
      }
    }
    const entries = []
    for (const [chart, data] of fresh) {
      putRing(data, this.#sizes[chart], this.#ring(target, chart))
      entries.push({ chart, target, ...this.#sizes[chart], data })
    }
    for (const chart of touched) {
      entries.push({ chart, target, ...this.#sizes[chart], ring: true, data: this.#ring(target, chart) })
    }
    return entries
  }

  #ring(target, chart) {
    const lines = this.#lines[target]
    return makeRing(lines[chart], this.#sizes[chart], (edge) => ({
      meetings: this.#mesher.seams(chart, edge).flatMap((there) => {
        const line = lines[there.chart]?.[there.edge]
        return line ? [{ ...there, line }] : []
      }),
      turns: target === 'normal' ? this.#turnsOf(chart, edge) : null,
    }))
  }

  /** By which angle the frame beyond an edge is turned, texel after texel. */
  #turnsOf(chart, edge) {
    const key = 4 * chart + edge
    if (!this.#turns.has(key)) {
      const { height, width } = this.#sizes[chart]
      this.#turns.set(key, this.#mesher.frameAngles(chart, edge, edge % 2 ? height : width))
    }
    return this.#turns.get(key)
  }

  #buffer(length) {
    const at = this.#spare.findIndex((buffer) => buffer.byteLength === length)
    if (at < 0) return new Uint8Array(length)
    return new Uint8Array(this.#spare.splice(at, 1)[0])
  }

  #state(idle) {
    const decoder = this.#decoder
    return {
      ticket: this.#ticket,
      idle: idle && !this.#waiting && !this.#isDirty,
      bytes: decoder.received,
      total: decoder.total,
      needed: decoder.needed,
      complete: decoder.complete,
      roles: decoder.roles.filter((role) => has(decoder, role)),
      coefficients: share(decoder),
      charts: decoder.charts.length ? decoder.chartsKnown / decoder.charts.length : 0,
    }
  }
}

/** Share of the exemplar's coefficients that are known. */
function share(decoder) {
  const { known, count } = decoder.coefficients()
  return known / Math.max(1, count)
}

/** Whether there is something of a map: a normal map of which nothing is known would be no normals at all. */
function has(decoder, role) {
  const { known, complete } = decoder.coefficients(role)
  return role === 'albedo' || known > 0 || complete
}

/** Let messages in. */
function breath() {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel()
    port1.onmessage = () => {
      port1.close()
      resolve()
    }
    port2.postMessage(null)
  })
}

/** Radius of a sphere round all charts' spheres. */
function span(bounds) {
  const low = [0, 1, 2].map((k) => Math.min(...bounds.map(({ center, radius }) => center[k] - radius)))
  const high = [0, 1, 2].map((k) => Math.max(...bounds.map(({ center, radius }) => center[k] + radius)))
  return Math.hypot(...low.map((x, k) => high[k] - x)) / 2 || 1
}

/** Paint a chart's role as RGBA into `into`, a gutter left free; 2^shrink texels each way become one. */
function paintRole(decoder, chart, role, into, stride, shrink) {
  const inside = 4 * (stride + 1)
  if (!shrink) return decoder.rgba(chart, { role, into, stride, offset: inside })
  const { height, width } = decoder.charts[chart]
  const step = 2 ** shrink
  const [high, wide] = [Math.max(1, height >> shrink), Math.max(1, width >> shrink)]
  const rows = Math.min(step, height)
  const columns = Math.min(step, width)
  const band = new Uint8Array(4 * rows * width)
  for (let row = 0; row < high; row++) {
    decoder.rgba(chart, { role, into: band, stride: width, start: row * rows, stop: (row + 1) * rows })
    for (let column = 0; column < wide; column++) {
      for (let k = 0; k < 4; k++) {
        let sum = 0
        for (let i = 0; i < rows; i++) {
          for (let j = 0; j < columns; j++) sum += band[4 * (i * width + column * columns + j) + k]
        }
        into[inside + 4 * (row * stride + column) + k] = Math.round(sum / (rows * columns))
      }
    }
  }
}

if (typeof WorkerGlobalScope !== 'undefined') {
  const session = new Session((message, transfer = []) => postMessage(message, transfer))
  onmessage = ({ data }) => session.receive(data)
}
