/** One stream in the worker: what messages ask for, decoded, painted and tessellated in slices. */

import { UphDecoder } from '../uph/decoder.js'
import { TARGETS } from '../uph/roles.js'
import { SurfaceMesher, TriangleMesher, countsFor } from '../uph-mesh.js'
import { hasMap, knownShare } from './maps.js'
import { Samples, codeOf } from './samples.js'
import { SLICE, yieldToMessages } from './schedule.js'
import { ChartTextures, texelsOf } from './textures.js'

const PAUSE = 250 // milliseconds between paintings while more is to come
const PIECE = 2048 // bytes fed at once
const COEFFICIENT_PARTS = 400 // as Python counts coefficients
const FIRST_PIXELS = 300 // of the model on screen, before anybody has seen it
const FIRST_SHARE = 1 / 4 // of the charts: a first picture waits for as many
const GROWTH = 9 / 8 // charts are painted again when there are so many times as many placements
const LEAST_SHARE = 1 / 16 // of a chart's texels, each way, where the page can not show all
const STEPS = 4 // of a density on the way to its half
const TEXELS = 1.1 // of a chart along a pixel, where it is nearest
const MESH_ARRAYS = ['positions', 'normals', 'tangents', 'parameters', 'indices', 'outline']

/** One stream. `post(message, transfer)` sends to the page; messages are listed in `uph-worker.js`. `samples` are those of other streams. */
export class StreamSession {
  #post
  #samples
  #code = null // of the sample, if it is to be kept
  #bytes = new Uint8Array(1 << 16)
  #length = 0
  #decoder = new UphDecoder() // with the limits of the page, once it is open
  #surfaceNumber = 0 // of the surface that the page has
  #mesher = null
  #textures = null
  #nearness = [] // of charts, to who looks
  #density = 0 // texels a step that the stream asks for
  #perUnit = [] // of charts: how many pixels a unit of length takes
  #stepLength = null // in the mean
  #fresh = new Set() // charts with placements, labels or nodes that are not painted for these alone
  #placements = 0 // how many were known when there was none of these
  #substitute = null // a picture instead of the exemplar
  #limit = {}
  #ticket = 0
  #failed = false
  #counts = null
  #meshedCounts = null // the counts that the page has
  #isShown = false // something has been painted
  #isSketching = true // nothing has been painted in full
  #isWaiting = false // the page has not shown yet what it got
  #isScheduled = false // work is due
  #isBusy = false
  #ended = false // all bytes have come
  #isClosed = false // it is no longer wanted
  #isUrgent = false // somebody waits for just this picture
  #paintedAt = performance.now()
  #paintTime = 0

  constructor(post, samples = new Samples()) {
    this.#post = post
    this.#samples = samples
    this.#schedule()
  }

  receive(message) {
    const { kind, ticket = this.#ticket } = message
    this.#ticket = ticket
    if (kind === 'open') {
      Object.assign(this, message)
      this.#decoder = new UphDecoder({ limits: this.limits })
    }     else if (kind === 'feed') this.#append(message.bytes)
    else if (kind === 'end') this.#end()
    else if (kind === 'close') this.#isClosed = true
    else if (kind === 'limit') this.#setLimit(message)
    else if (kind === 'counts' && message.counts.length === this.#counts?.length) this.#counts = message.counts // else they are of another surface
    else if (kind === 'pixels') this.#look(message.perUnit)
    else if (kind === 'paint') this.#paintHere()
    else if (kind === 'exemplar') this.#replaceExemplar(message.picture)
    else if (kind === 'shown') {
      this.#isWaiting = false
      this.#textures?.recycle(message.buffers)
    }
    this.#schedule()
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

  #end() {
    this.#ended = true
    if (!this.whole) return
    this.#code = codeOf(this.#bytes.subarray(0, this.#length))
    if (this.#code) this.#restart(this.#samples.find(this.#code))
  }

  #setLimit({ bytes, coefficients }) {
    const wasCounted = this.#limit.coefficients < 1
    this.#limit = { bytes, coefficients }
    this.#isUrgent = true
    const decoder = this.#decoder
    // What has been read can not be unread, nor what has been left out be read.
    if ((bytes ?? Infinity) < decoder.received || coefficients < 1 || wasCounted) this.#restart()
  }

  #replaceExemplar(picture) {
    this.#substitute = picture
    this.#decoder.replaceExemplar(picture)
    this.#textures?.markDirty('color')
    this.#isUrgent = true
  }

  #restart(maps = null) {
    this.#decoder = new UphDecoder({ limits: this.limits, maps })
    this.#decoder.replaceExemplar(this.#substitute)
    this.#decoder.mostCoefficients = this.#limit.coefficients ?? 1
    this.#failed = false
    this.#placements = 0
    this.#fresh.clear()
    this.#textures?.clearDirty() // the new decoder reports every map again
  }

  // ---------------------------------------------------------------- work

  /** Do what is due, in slices, so that messages are heard in between. */
  #schedule() {
    if (this.#isScheduled) return
    this.#isScheduled = true
    yieldToMessages().then(async () => {
      this.#isScheduled = false
      if (this.#isBusy || this.#isClosed) return
      this.#isBusy = true
      try {
        await this.#work()
      } catch (error) {
        this.#fail(error) // of ours, or of the machine: memory, say
        this.#textures?.clearDirty()
      }
      this.#isBusy = false
      this.#post({ kind: 'state', state: this.#state(true) })
    })
  }

  async #work() {
    for (;;) {
      const more = this.#feed()
      if (this.#code && this.#decoder.complete) this.#keepSample()
      // Only what belongs together is on its way to the page; while a prefix is read again, the page keeps what it has.
      const isBack = more && this.#decoder.surfaceNumber < this.#surfaceNumber
      if (this.#isOtherSurface && !this.#isWaiting && !isBack) this.#begin()
      if (this.#mesher && !this.#isOtherSurface) this.#mesh()
      if (!more && this.#isAll && this.#fresh.size) this.#markFresh()
      const isDue = this.#isDirty && !this.#isWaiting && !this.#isOtherSurface && this.#isWorthwhile
      // While more is to come, now and then is enough: painting takes at most half of the time, and a fifth while bytes wait to be read.
      const wait = this.#paintedAt + Math.max(PAUSE, (more ? 4 : 1) * this.#paintTime) - performance.now()
      const isFirst = !this.#isShown && (!more || this.#decoder.chartsKnown >= FIRST_SHARE * this.#nearness.length)
      const isLast = !more && (this.#decoder.complete || this.#isUrgent)
      if (isDue && (wait <= 0 || isFirst || isLast)) {
        if (isLast) this.#isUrgent = false
        await this.#paint(isLast)
      } else if (!more) {
        if (isDue) setTimeout(() => this.#schedule(), wait)
        break
      }
      await this.#pause()
    }
  }

  /** Let messages in. Behind one that closes this stream nothing is done any more. */
  async #pause() {
    await yieldToMessages()
    if (this.#isClosed) await new Promise(() => {})
  }

  #keepSample() {
    this.#samples.keep(this.#code, this.#decoder.finishMaps())
    this.#code = null
  }

  /** Whether somebody waits for what there is, or no more will come. */
  get #isAll() {
    const { received } = this.#decoder
    return this.#isUrgent || received >= this.#limit.bytes || (this.#ended && received === this.#length)
  }

  /** Whether there is texture to be seen, or will be none: a first picture of one colour is none. */
  get #isWorthwhile() {
    return this.#isShown || this.#isAll || (!this.whole && knownShare(this.#decoder) > 0)
  }

  /** Whether the page has no surface yet, or another one than the decoder. */
  get #isOtherSurface() {
    return !this.#decoder.needed && this.#decoder.surfaceNumber !== this.#surfaceNumber
  }

  get #isDirty() {
    return !this.#decoder.needed && Boolean(this.#textures?.isDirty)
  }

  /** Read on for a slice; returns whether there is more. */
  #feed() {
    if (this.whole && !this.#ended) return false
    const until = performance.now() + SLICE
    const decoder = this.#decoder
    const { bytes = Infinity, coefficients = 1 } = this.#limit
    // A limit below the first view is overrun.
    const end = () => Math.min(this.#length, decoder.needed ? Math.max(bytes, decoder.received + decoder.needed) : bytes)
    const isCounted = coefficients < 1
    const part = isCounted ? Math.max(16, Math.floor((decoder.total ?? this.#length) / COEFFICIENT_PARTS)) : PIECE
    const isLeft = () =>
      !this.#failed &&
      decoder.received < end() &&
      (decoder.needed > 0 || !isCounted || !decoder.placed || knownShare(decoder) < coefficients)
    while (isLeft()) {
      const { received, needed } = decoder
      const size = Math.min(needed || part, end() - received)
      try {
        this.#noteChanges(decoder.feed(this.#bytes.subarray(received, received + size)))
      } catch (error) {
        this.#fail(error)
      }
      if (performance.now() > until) break
    }
    return isLeft()
  }

  /** From now on, paint in the worker. */
  #paintHere() {
    this.onPage = false
    this.#textures?.paintHere()
  }

  #fail(error) {
    this.#failed = true
    this.#post({ kind: 'error', message: error.message, offset: error.offset })
  }

  #noteChanges({ roles, charts }) {
    const decoder = this.#decoder
    if (decoder.needed || this.#isOtherSurface) return // all is painted when the surface is known
    if (this.#density !== decoder.density) {
      this.#sizeTextures()
      roles = decoder.roles
    }
    this.#textures.forget(charts)
    for (const chart of charts) this.#fresh.add(chart)
    for (const target of Object.keys(TARGETS)) this.#markDirty(target, roles)
    const { known, count } = decoder.placements
    if (known >= GROWTH * this.#placements || known === count) this.#markFresh()
  }

  /** Have all charts painted whose texture shows one of these maps. */
  #markDirty(target, roles) {
    if (TARGETS[target].some((role) => roles.includes(role) && hasMap(this.#decoder, role))) this.#textures.markDirty(target)
  }

  /** Have charts painted that have other placements, labels or nodes. */
  #markFresh() {
    for (const [target, parts] of Object.entries(TARGETS)) {
      if (parts.some((role) => hasMap(this.#decoder, role))) this.#textures.markDirty(target, this.#fresh)
    }
    this.#fresh.clear()
    this.#placements = this.#decoder.placements.known
  }

  /** Surface and charts are known, or others: send them to the page. */
  #begin() {
    const { surface, charts, exemplarSize, surfaceNumber } = this.#decoder
    this.#surfaceNumber = surfaceNumber
    this.#meshedCounts = this.#stepLength = null
    this.#fresh.clear()
    this.#mesher = surface.kind === 'mesh' ? new TriangleMesher(surface, charts) : new SurfaceMesher(surface, charts)
    const bounds = charts.map((_, n) => this.#mesher.bounds(n))
    this.#nearness = bounds.map(({ center }) => center.reduce((sum, x, k) => sum + x * (this.eye?.[k] ?? 0), 0))
    const sphere = enclosing(bounds)
    this.#counts = new Uint16Array(bounds.flatMap((one) => countsFor(one, FIRST_PIXELS / 2 / sphere.radius, 0.5)))
    const plain = this.#mesher.plainMesh?.() ?? null
    this.#post({ kind: 'surface', bounds, sphere, plain, metres: surface.metres ?? null, exemplar: exemplarSize })
    this.#perUnit = bounds.map(() => (this.pixels ?? Infinity) / sphere.radius)
    this.#mesh()
    this.#sizeTextures()
    for (const target of Object.keys(TARGETS)) this.#markDirty(target, this.#decoder.roles)
    this.#placements = this.#decoder.placements.known
  }

  /** It is known with how many texels a step the stream is to be painted. */
  #sizeTextures() {
    const decoder = this.#decoder
    this.#density = decoder.density
    const sizesAt = (densities) => this.#sizesAt(densities)
    this.#textures = new ChartTextures(this.#mesher, sizesAt, this.#densities(), this.#nearness, this.onPage, this.sketches)
  }

  #sizesAt(densities) {
    return densities.map((density, n) => this.#decoder.paintedSize(n, density))
  }

  /** The page shows charts so large. */
  #look(perUnit) {
    if (perUnit.length !== this.#perUnit.length) return // of another surface
    this.#perUnit = perUnit
    if (this.#textures) this.#textures.densities = this.#densities()
  }

  /**
   * With how many texels a step the page can show each chart: as many as the stream asks for, or fewer, in `STEPS` to the half, and hardly more
   * than `TEXELS` a pixel.
   */
  #densities() {
    const most = STEPS * Math.log2(1 / LEAST_SHARE)
    const enough = Array.from(this.#perUnit, (pixels) => Math.floor(STEPS * Math.log2(this.#density / (TEXELS * pixels * this.#stepLength))))
    for (let coarsest = 0; coarsest <= most; coarsest++) {
      const densities = enough.map((k) => this.#density * 2 ** (-Math.min(Math.max(k, coarsest), most) / STEPS))
      const sizes = this.#sizesAt(densities)
      const fits = ({ height, width }) => Math.max(height, width) <= this.maxTextureSize - 2
      if (texelsOf(sizes) <= this.maxTexels && sizes.every(fits)) return densities
    }
    const texels = texelsOf(this.#sizesAt(this.#perUnit.map(() => this.#density)))
    throw new Error(`model has ${texels} texels; allowed here: ${this.maxTexels / LEAST_SHARE ** 2}`)
  }

  #mesh() {
    const counts = this.#counts
    const before = this.#meshedCounts
    const changed = (n) => counts[2 * n] !== before?.[2 * n] || counts[2 * n + 1] !== before[2 * n + 1]
    const besideChanged = (chart) =>
      [0, 1, 2, 3].some((edge) => this.#mesher.seams(chart, edge).some((seam) => changed(seam.chart)))
    const pieces = []
    for (let chart = 0; chart < this.#nearness.length; chart++) {
      if (changed(chart) || besideChanged(chart)) pieces.push({ chart, ...this.#mesher.mesh(chart, counts) })
    }
    this.#meshedCounts = counts.slice()
    if (!pieces.length) return
    this.#stepLength ??= stepLength(this.#decoder.charts, pieces)
    const buffers = pieces.flatMap((piece) => MESH_ARRAYS.map((name) => piece[name].buffer))
    this.#post({ kind: 'meshes', pieces, counts: this.#meshedCounts }, buffers)
  }

  /** Paint all that changed, and hand it over: sketched while labels are still to come, but in full when nothing comes. */
  async #paint(isLast) {
    const begun = performance.now()
    const state = this.#state(false)
    this.#isSketching &&= !isLast && !this.#decoder.placed && this.#textures.hasNews
    const decoder = this.#decoder
    // Where no placement changes any more, reading goes on between the slices of painting.
    decoder.isHeld = decoder.placed
    const pause = async () => {
      await this.#pause()
      if (decoder.placed) this.#feed()
    }
    const entries = await this.#textures.paint(decoder, this.#isSketching, pause)
    const alpha = this.#textures.alphaMode
    const mean = Array.from(decoder.meanRgba().subarray(0, 3), (x) => x / 255)
    decoder.isHeld = false
    this.#isWaiting = this.#isShown = true
    this.#post(
      { kind: 'textures', entries, state: { ...state, alpha, mean, texels: this.#textures.texels } },
      entries.flatMap((entry) => entry.data?.buffer ?? []),
    )
    this.#paintedAt = performance.now()
    this.#paintTime = this.#paintedAt - begun
  }

  #state(isIdle) {
    const decoder = this.#decoder
    const { known, count } = decoder.placements
    return {
      ticket: this.#ticket,
      idle: isIdle && !this.#isWaiting && !(this.#isDirty && this.#isWorthwhile),
      bytes: decoder.received,
      total: decoder.total,
      needed: decoder.needed,
      complete: decoder.complete,
      roles: decoder.roles.filter((role) => hasMap(decoder, role)),
      coefficients: decoder.complete ? 1 : knownShare(decoder),
      placements: known / (count || 1),
      isBase: decoder.isBase,
    }
  }
}

/** A sphere round all of `bounds`. */
function enclosing(bounds) {
  const side = (sign) => [0, 1, 2].map((k) => Math.max(...bounds.map((one) => sign * one.center[k] + one.radius)))
  const [high, low] = [side(1), side(-1)]
  const center = high.map((x, k) => (x - low[k]) / 2)
  const reach = (one) => Math.hypot(...center.map((x, k) => x - one.center[k])) + one.radius
  return { center, radius: Math.max(...bounds.map(reach)) || 1 }
}

/** The mean length of charts' steps on their meshes. */
function stepLength(charts, pieces) {
  let [area, steps] = [0, 0]
  for (const { chart, positions, parameters, indices } of pieces) {
    const whole = charts[chart].height * charts[chart].width
    /** Twice what a triangle covers in the plane of coordinates i and j. */
    const covered = (list, size, n, i, j) => {
      const [a, b, c] = [size * indices[n], size * indices[n + 1], size * indices[n + 2]]
      return (list[b + i] - list[a + i]) * (list[c + j] - list[a + j]) - (list[b + j] - list[a + j]) * (list[c + i] - list[a + i])
    }
    for (let n = 0; n < indices.length; n += 3) {
      area += Math.hypot(covered(positions, 3, n, 1, 2), covered(positions, 3, n, 2, 0), covered(positions, 3, n, 0, 1))
      steps += Math.abs(covered(parameters, 2, n, 0, 1)) * whole
    }
  }
  return Math.sqrt(area / steps)
}
