/** The model that a loader gives: it shows what its worker decodes, paints and tessellates. */

import { BufferGeometry, Group, LineBasicMaterial, LineSegments, Mesh, Sphere, SRGBColorSpace, Vector3 } from 'three'
import { putGutter } from '../uph-gutter.js'
import { readPicture } from '../uph-picture.js'
import { DetailControl } from './detail.js'
import { chartGeometry, enclose, outlineGeometry, plainMesh } from './geometry.js'
import { Preview, newMaterial, newTexture, updateMaterial } from './materials.js'

const TEXELS_PER_FRAME = 2 ** 22 // handed to the renderer at once

const nextFrame = globalThis.requestAnimationFrame?.bind(globalThis) ?? ((work) => setTimeout(work, 16))

/**
 * A textured surface that refines: one mesh per chart.
 *
 * Events: `progress` {received, total}, `first`, `refine`, `geometry`, `complete`, `stalled` {attempt, message},
 * `resumed`, `error` {error}. After `first`, `refine` and `geometry` a frame wants to be rendered.
 */
export class UphModel extends Group {
  received = 0
  total = null
  complete = false
  first = false
  shown = { bytes: 0, coefficients: 0, charts: 0 }
  roles = []
  sphere = new Sphere(new Vector3(), 0)
  texels = 0
  quads = 0

  #worker
  #abort = new AbortController()
  #errorPixels
  #parts = [] // pieces of the stream
  #meshes = [] // one per chart
  #materials = [] // as they were made: a mesh may have another one by now
  #textures = [] // of each chart, by what they show
  #bounds = []
  #sizes = []
  #detail = null
  #preview = null
  #plain = null // triangles of a mesh that lie on no chart
  #queue = [] // textures that came and are not shown yet
  #isDrawing = false
  #ticket = 0
  #state = null
  #drawn = null // the state that is shown
  #plainArrays = null
  #settling = [] // to be told when all is shown
  #ended = false
  #failed = false
  #foundSize
  #size = new Promise((resolve) => (this.#foundSize = resolve)) // the exemplar's height and width
  #exemplarCalls = 0

  constructor(worker, { maxTextureSize, maxTexels, errorPixels }) {
    super()
    this.type = 'UphModel'
    this.#worker = worker
    this.#errorPixels = errorPixels
    this.outlines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x2266ff }))
    this.outlines.visible = false
    this.outlines.raycast = () => {} // rays hit what is invisible, too
    this.add(this.outlines)
    worker.onmessage = ({ data }) => this.#receive(data)
    worker.onerror = (event) => this.fail(new Error(event.message || 'the worker uph-worker.js does not start'))
    worker.postMessage({ kind: 'open', maxTextureSize, maxTexels })
  }

  /** Aborted when the model is. */
  get signal() {
    return this.#abort.signal
  }

  /** Take further bytes of the stream. */
  feed(bytes) {
    if (this.signal.aborted) return
    this.#parts.push(bytes)
    this.received += bytes.length
    this.#send({ kind: 'feed', bytes })
    this.dispatchEvent({ type: 'progress', received: this.received, total: this.total, loaded: this.received })
  }

  /** Say that no more bytes will come. */
  end() {
    this.#ended = true
    this.#send({ kind: 'end' })
  }

  /** Report an error; what is shown stays. */
  fail(error) {
    this.#failed = true
    this.dispatchEvent({ type: 'error', error })
  }

  /** What has come so far. */
  bytes() {
    const all = new Uint8Array(this.received)
    let at = 0
    for (const part of this.#parts) {
      all.set(part, at)
      at += part.length
    }
    return all
  }

  /** Show a prefix only: {bytes}, or {coefficients}, a share of 0 to 1; null shows all that has come. */
  setLimit(limit) {
    this.#send({ kind: 'limit', ...limit })
  }

  /**
   * Show the model with another sample in place of its own, as `upholster.paint` does: one of the same shape, such as another
   * colour of the same cloth. `image` is what a canvas draws, a Blob or ImageData; null: the stream's own. Nothing is loaded for it.
   * Resolves when it is in the textures, or another call took its place.
   */
  async setExemplar(image) {
    const call = ++this.#exemplarCalls
    const picture = image === null ? null : await readPicture(image, await this.#size)
    if (call !== this.#exemplarCalls) return
    this.#send({ kind: 'exemplar', picture })
    await this.settled()
  }

  /** Resolves when all that has come, up to the limit, is in the textures. */
  settled() {
    return new Promise((resolve) => {
      this.#settling.push(resolve)
      this.#settle()
    })
  }

  /**
   * The model as GLB, as fine as `pixels` across the whole of it show; resolves with the file's bytes. Texels are those shown here, 8 bits
   * a sample, without loss. Needs every chart's placements.
   */
  async glb({ name = this.name || 'upholster', pixels = 2000 } = {}) {
    const { writeGlb } = await import('../uph-glb.js')
    await this.settled()
    if (!(this.shown.charts === 1)) throw new Error('the model is not complete: some charts have no placements yet')
    const detail = this.#detail
    detail.leastPerUnit = pixels / 2 / this.sphere.radius
    detail.askForLeast()
    await this.settled()
    detail.leastPerUnit = 0
    const charts = this.#meshes.map(({ geometry: { attributes, index, userData } }, chart) => {
      const [positions, normals, tangents] = ['position', 'normal', 'tangent'].map((key) => attributes[key].array)
      const geometry = { positions, normals, tangents, parameters: userData.parameters, indices: index.array }
      const textures = Object.fromEntries(Object.entries(this.#textures[chart]).map(([key, { image }]) => [key, image]))
      return { size: this.#sizes[chart], geometry, textures }
    })
    const { alpha = 'opaque', mean } = this.#drawn
    return writeGlb({ name, charts, plain: this.#plainArrays, alpha, mean, roles: this.roles })
  }

  get wireframe() {
    return this.#materials[0]?.wireframe ?? false
  }

  set wireframe(on) {
    for (const material of this.#materials) material.wireframe = on
  }

  /** Stop receiving: what is shown stays. */
  abort() {
    this.#abort.abort()
  }

  /** Stop, and free textures, geometry and worker. */
  dispose() {
    this.abort()
    this.#worker.terminate()
    const others = this.#plain ? [this.outlines, this.#plain] : [this.outlines]
    for (const { geometry } of [...this.#meshes, ...others]) geometry.dispose()
    for (const material of [...this.#materials, ...others.map((one) => one.material)]) material.dispose()
    for (const texture of this.#textures.flatMap((own) => Object.values(own))) texture.dispose()
    this.#preview?.dispose()
    this.#queue = []
    this.#meshes = []
    this.clear()
  }

  /**
   * A group of the same meshes, which shares geometry, materials and textures, as clones in three.js do. Its textures refine with
   * this model's; its geometry stays as fine as it is now.
   */
  clone(recursive = true) {
    const copy = new Group().copy(this, false)
    if (recursive) for (const child of this.children) if (child !== this.outlines) copy.add(child.clone())
    return copy
  }

  // ---------------------------------------------------------------- messages

  /** Send with a new ticket: states tell when it was heard. */
  #send(message) {
    this.#worker.postMessage({ ...message, ticket: ++this.#ticket })
  }

  #receive(message) {
    if (message.kind === 'surface') this.#begin(message)
    else if (message.kind === 'meshes') this.#takeMeshes(message)
    else if (message.kind === 'textures') {
      this.#queue.push(...message.entries)
      this.#state = message.state
      this.#drawSoon()
    } else if (message.kind === 'state') {
      this.#state = message.state
      this.total = message.state.total
      this.#settle()
    } else this.fail(Object.assign(new Error(message.message), { offset: message.offset }))
  }

  #begin({ charts, bounds, plain, exemplar }) {
    this.#foundSize(exemplar)
    this.#sizes = charts
    this.#bounds = bounds
    this.#detail = new DetailControl(bounds, this.#errorPixels, (counts) => this.#send({ kind: 'counts', counts }))
    this.texels = charts.reduce((sum, { height, width }) => sum + height * width, 0)
    enclose(bounds, this.sphere)
    this.#materials = charts.map(newMaterial)
    this.#textures = charts.map(() => ({}))
    this.#meshes = this.#materials.map((material, chart) => {
      const mesh = new Mesh(new BufferGeometry(), material)
      mesh.name = `chart ${chart}`
      mesh.visible = false // until it has a texture
      mesh.onBeforeRender = (renderer, _, camera) => this.#detail.measure(chart, this.matrixWorld, renderer, camera)
      return mesh
    })
    this.add(...this.#meshes)
    this.#plainArrays = plain
    if (plain) this.add((this.#plain = plainMesh(plain)))
  }

  #takeMeshes({ pieces, counts }) {
    this.#detail.counts ??= counts
    for (const piece of pieces) {
      const { chart } = piece
      this.#meshes[chart].geometry.dispose()
      this.#meshes[chart].geometry = chartGeometry(piece, this.#sizes[chart], this.#bounds[chart])
    }
    const geometries = this.#meshes.map(({ geometry }) => geometry)
    this.quads = Math.round(geometries.reduce((sum, { userData }) => sum + (userData.quads ?? 0), 0))
    this.outlines.geometry.dispose()
    this.outlines.geometry = outlineGeometry(geometries)
    if (this.first) this.dispatchEvent({ type: 'geometry' })
  }

  // ---------------------------------------------------------------- textures

  #drawSoon() {
    if (this.#isDrawing) return
    this.#isDrawing = true
    nextFrame(() => {
      this.#isDrawing = false
      if (this.#meshes.length) this.#draw()
    })
  }

  /** Hand textures to the renderer, some per frame, so that no frame takes long. */
  #draw() {
    const buffers = []
    let texels = 0
    while (this.#queue.length && texels < TEXELS_PER_FRAME) {
      const entry = this.#queue.shift()
      const old = this.#takeTexture(entry)
      if (old) buffers.push(old)
      if (!entry.unplaced) texels += entry.height * entry.width
    }
    if (this.#queue.length) {
      if (this.first) this.dispatchEvent({ type: 'refine' })
      this.#drawSoon()
      return
    }
    this.#drawn = this.#state
    const { bytes, coefficients, charts, total, roles, alpha = 'opaque', mean } = this.#state
    this.roles = roles
    this.shown = { bytes, coefficients, charts }
    this.total = total
    this.#meshes.forEach((mesh, chart) => {
      for (const material of new Set([this.#materials[chart], mesh.material].flat())) {
        updateMaterial(material, this.#textures[chart], roles, alpha, this.sphere.radius)
      }
      if (!this.first) mesh.visible = true
    })
    this.#plain?.material.color.setRGB(...mean, SRGBColorSpace)
    this.#worker.postMessage({ kind: 'shown', buffers }, buffers)
    if (!this.first && !charts) return // there is no texture to be seen yet
    const type = this.first ? 'refine' : 'first'
    this.first = true
    this.dispatchEvent({ type })
  }

  /** Take over one texture; returns the memory of the one before. */
  #takeTexture(entry) {
    const { chart, target, height, width, data } = entry
    if (entry.preview) {
      this.#preview ??= new Preview()
      this.#preview.update(entry, this.#textures)
      return null
    }
    const textures = this.#textures[chart]
    if (entry.unplaced) {
      textures[target]?.dispose()
      delete textures[target]
      return null
    }
    const texture = (textures[target] ??= newTexture(target))
    const { image } = texture
    texture.needsUpdate = true
    if (entry.gutter) {
      putGutter(image.data, { height, width }, data)
      return null
    }
    texture.image = { data, width: width + 2, height: height + 2 }
    return image.data?.buffer ?? null
  }

  /** Tell those who wait if all that was sent is shown. */
  #settle() {
    const state = this.#state
    if (!state?.idle || state.ticket !== this.#ticket || this.#queue.length) return
    if (this.#ended && !this.complete && !this.#failed) {
      if (this.received === this.total) {
        this.complete = true
        this.dispatchEvent({ type: 'complete' })
      } else {
        const whole = this.total ? ` of ${this.total.toLocaleString('en')}` : ''
        this.fail(new Error(`the stream is cut: ${this.received.toLocaleString('en')}${whole} bytes have come`))
      }
    }
    for (const resolve of this.#settling.splice(0)) resolve()
  }
}
