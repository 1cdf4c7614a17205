// `.uph` streams in three.js: a Group whose textures and geometry refine by themselves.

import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  DoubleSide,
  Group,
  LinearFilter,
  LinearMipmapLinearFilter,
  LineBasicMaterial,
  LineSegments,
  Loader,
  MirroredRepeatWrapping,
  Mesh,
  MeshStandardMaterial,
  NoColorSpace,
  SRGBColorSpace,
  Sphere,
  UnsignedByteType,
  RGBAFormat,
  Vector2,
  Vector3,
} from 'three'
import { putRing } from './uph-gutter.js'
import { countsFor } from './uph-mesh.js'
import { receive } from './uph-receive.js'

const TEXELS_PER_FRAME = 2 ** 22 // handed to the renderer at once
const ANISOTROPY = 8
const LOOK_EVERY = 120 // milliseconds between looks at how large the charts are on screen
const MOST_QUADS = 2 ** 19
const ROUGHNESS = 0.8 // of a material that says nothing about it, as in the GLB

let spare = null // a worker that waits for a stream

const nextFrame = globalThis.requestAnimationFrame?.bind(globalThis) ?? ((work) => setTimeout(work, 16))

/** Loads `.uph` streams, as three.js' loaders do; what it gives goes on refining while bytes come. */
export class UphLoader extends Loader {
  /** Texture side that the graphics card is sure to take; larger charts are halved. */
  maxTextureSize = 4096
  /** Texels of all charts together; models with more are shown at half the size, or a quarter… */
  maxTexels = 2 ** 26
  /** How far the mesh may be from the surface, in pixels. */
  errorPixels = 0.4

  #workerURL = null
  #running = new Set()

  /** Where `uph-worker.js` lies, if not beside this module. */
  setWorkerURL(url) {
    this.#workerURL = url
    return this
  }

  /**
   * Load a stream. `onLoad(model)` comes with the first textured view; the model is returned at once, still empty.
   * A lost connection is taken up again by a range request.
   */
  load(url, onLoad, onProgress, onError) {
    const model = this.#model()
    const path = this.path + url
    this.manager.itemStart(path)
    let open = true
    const end = (error) => {
      if (!open) return
      open = false
      if (error) this.manager.itemError(path)
      this.manager.itemEnd(path)
    }
    this.#running.add(model)
    model.addEventListener('first', () => {
      end()
      onLoad?.(model)
    })
    if (onProgress) model.addEventListener('progress', onProgress)
    model.addEventListener('error', ({ error }) => {
      const early = open
      end(error)
      if (!early) return
      if (onError) onError(error)
      else console.error(`UphLoader: ${error.message}`)
    })
    const options = {
      headers: this.requestHeader,
      credentials: this.crossOrigin === 'anonymous' ? 'same-origin' : 'include',
      cache: this.cache ?? 'default',
    }
    if (this.withCredentials) options.credentials = 'include'
    receive(this.manager.resolveURL(path), model, options)
      .catch((error) => model.signal.aborted || model.fail(error))
      .finally(() => {
        this.#running.delete(model)
        if (model.signal.aborted) end() // else the worker still has to say what the bytes are
      })
    return model
  }

  /** Show a stream that is here already, whole or cut. */
  parse(bytes) {
    const model = this.#model()
    const copy = ArrayBuffer.isView(bytes) ? bytes.slice() : new Uint8Array(bytes.slice(0))
    model.feed(copy)
    model.end()
    return model
  }

  /** Stop all that is under way: the models stay as they are. */
  abort() {
    for (const model of this.#running) model.abort()
    return this
  }

  /** Start the worker before there is a stream: it takes longer than the first bytes to arrive. */
  prepare() {
    spare ??= { url: this.#workerURL, worker: this.#start() }
    return this
  }

  #start() {
    if (this.#workerURL) return new Worker(this.#workerURL, { type: 'module' })
    return new Worker(new URL('./uph-worker.js', import.meta.url), { type: 'module' })
  }

  #model() {
    const ready = spare?.url === this.#workerURL
    const worker = ready ? spare.worker : this.#start()
    if (ready) spare = null
    const { maxTextureSize, maxTexels, errorPixels } = this
    return new UphModel(worker, { maxTextureSize, maxTexels, errorPixels })
  }
}

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
  #pieces = [] // meshes, one per chart
  #bounds = []
  #sizes = []
  #counts = null // segments that the worker was asked for
  #wanted = null
  #looked = 0
  #preview = null // the exemplar, which charts without placements repeat
  #queue = [] // textures that came and are not shown yet
  #drawing = false
  #ticket = 0
  #state = null
  #settling = []
  #ended = false
  #failed = false

  constructor(worker, { maxTextureSize, maxTexels, errorPixels }) {
    super()
    this.type = 'UphModel'
    this.#worker = worker
    this.#errorPixels = errorPixels
    this.outlines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x2266ff }))
    this.outlines.visible = false
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
    this.#worker.postMessage({ kind: 'feed', ticket: ++this.#ticket, bytes })
    this.dispatchEvent({ type: 'progress', received: this.received, total: this.total, loaded: this.received })
  }

  /** Say that no more bytes will come. */
  end() {
    this.#ended = true
    this.#settle()
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
    this.#worker.postMessage({ kind: 'limit', ticket: ++this.#ticket, ...limit })
  }

  /** Resolves when all that has come, up to the limit, is in the textures. */
  settled() {
    return new Promise((resolve) => {
      this.#settling.push(resolve)
      this.#settle()
    })
  }

  get wireframe() {
    return this.#pieces[0]?.material.wireframe ?? false
  }

  set wireframe(on) {
    for (const { material } of this.#pieces) material.wireframe = on
  }

  /** Stop receiving: what is shown stays. */
  abort() {
    this.#abort.abort()
  }

  /** Stop, and free textures, geometry and worker. */
  dispose() {
    this.abort()
    this.#worker.terminate()
    for (const { geometry, material } of [...this.#pieces, this.outlines]) {
      for (const texture of Object.values(material.userData)) texture.dispose()
      geometry.dispose()
      material.dispose()
    }
    this.#preview?.dispose()
    this.#queue = []
    this.#pieces = []
    this.clear()
  }

  #receive(message) {
    if (message.kind === 'surface') this.#begin(message)
    else if (message.kind === 'meshes') this.#takeMeshes(message)
    else if (message.kind === 'textures') {
      this.#queue.push(...message.entries)
      this.#state = message.state
      this.#draw()
    } else if (message.kind === 'state') {
      this.#state = message.state
      this.total = message.state.total
      this.#settle()
    } else this.fail(Object.assign(new Error(message.message), { offset: message.offset }))
  }

  #begin({ charts, bounds }) {
    this.#sizes = charts
    this.#bounds = bounds
    this.texels = charts.reduce((sum, { height, width }) => sum + height * width, 0)
    const spheres = bounds.map(({ center, radius }) => new Sphere(new Vector3(...center), radius))
    const box = new Box3()
    for (const sphere of spheres) box.union(sphere.getBoundingBox(new Box3()))
    box.getCenter(this.sphere.center)
    this.sphere.radius = Math.max(...spheres.map(({ center, radius }) => center.distanceTo(this.sphere.center) + radius))
    this.#pieces = charts.map((_, chart) => {
      const material = new MeshStandardMaterial({ side: DoubleSide, roughness: ROUGHNESS, metalness: 0 })
      const piece = new Mesh(new BufferGeometry(), material)
      piece.name = `chart ${chart}`
      piece.visible = false // until it has a texture
      piece.onBeforeRender = (renderer, _, camera) => this.#look(renderer, camera, chart)
      return piece
    })
    this.add(...this.#pieces)
  }

  #takeMeshes({ pieces, counts }) {
    this.#counts ??= counts
    for (const { chart, positions, normals, tangents, parameters, indices, outline } of pieces) {
      const { height, width } = this.#sizes[chart]
      const uv = new Float32Array(parameters.length)
      for (let n = 0; n < uv.length; n += 2) {
        uv[n] = (1 + parameters[n + 1] * width) / (width + 2)
        uv[n + 1] = (1 + parameters[n] * height) / (height + 2)
      }
      const geometry = new BufferGeometry()
      geometry.setAttribute('position', new BufferAttribute(positions, 3))
      geometry.setAttribute('normal', new BufferAttribute(normals, 3))
      geometry.setAttribute('tangent', new BufferAttribute(tangents, 4))
      geometry.setAttribute('uv', new BufferAttribute(uv, 2))
      geometry.setIndex(new BufferAttribute(indices, 1))
      const { center, radius } = this.#bounds[chart]
      geometry.boundingSphere = new Sphere(new Vector3(...center), radius)
      geometry.userData = { outline, quads: indices.length / 6 }
      this.#pieces[chart].geometry.dispose()
      this.#pieces[chart].geometry = geometry
    }
    const all = this.#pieces.map(({ geometry }) => geometry.userData)
    this.quads = Math.round(all.reduce((sum, { quads = 0 }) => sum + quads, 0))
    const lines = new Float32Array(all.reduce((sum, { outline }) => sum + (outline?.length ?? 0), 0))
    all.reduce((at, { outline = [] }) => (lines.set(outline, at), at + outline.length), 0)
    this.outlines.geometry.dispose()
    this.outlines.geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(lines, 3))
    if (this.first) this.dispatchEvent({ type: 'geometry' })
  }

  /** Hand textures to the renderer, some per frame, so that no frame takes long. */
  #draw() {
    if (this.#drawing) return
    this.#drawing = true
    nextFrame(() => {
      this.#drawing = false
      if (!this.#pieces.length) return
      const spare = []
      let texels = 0
      while (this.#queue.length && texels < TEXELS_PER_FRAME) {
        const entry = this.#queue.shift()
        const old = this.#put(entry)
        if (old) spare.push(old)
        if (!entry.unknown) texels += entry.height * entry.width
      }
      if (this.#queue.length) {
        if (this.first) this.dispatchEvent({ type: 'refine' })
        this.#draw()
        return
      }
      this.#shape()
      const { bytes, coefficients, charts, total } = this.#state
      this.shown = { bytes, coefficients, charts }
      this.total = total
      for (const piece of this.#pieces) piece.visible = true
      this.#worker.postMessage({ kind: 'shown', buffers: spare }, spare)
      const type = this.first ? 'refine' : 'first'
      this.first = true
      this.dispatchEvent({ type })
    })
  }

  /** Take over one texture; returns the memory of the one before. */
  #put(entry) {
    const { chart, target, height, width, ring, data } = entry
    if (entry.preview) return this.#repeat(entry)
    const { userData } = this.#pieces[chart].material
    if (entry.unknown) {
      userData[target]?.dispose()
      delete userData[target]
      return null
    }
    const texture = (userData[target] ??= newTexture(target))
    const { image } = texture
    texture.needsUpdate = true
    if (ring) {
      putRing(image.data, { height, width }, data)
      return null
    }
    texture.image = { data, width: width + 2, height: height + 2 }
    return image.data?.buffer ?? null
  }

  /** The exemplar itself got better: all charts that repeat it share one texture. */
  #repeat({ height, width, data, repeat }) {
    this.#preview ??= newTexture('color')
    this.#preview.image = { data, height, width }
    this.#preview.wrapS = this.#preview.wrapT = MirroredRepeatWrapping
    this.#preview.needsUpdate = true
    this.#pieces.forEach(({ material: { userData } }, n) => {
      const size = this.#sizes[n]
      userData.preview ??= this.#preview.clone()
      userData.preview.needsUpdate = true
      // From a texture with a gutter to pixels of the exemplar, the chart's first texel on its first pixel.
      userData.preview.repeat.set((repeat * (size.width + 2)) / width, (repeat * (size.height + 2)) / height)
      userData.preview.offset.set(-repeat / width, -repeat / height)
    })
    return null
  }

  /** Let the materials have the maps that are known. */
  #shape() {
    const { roles, alpha = 'opaque' } = this.#state
    this.roles = roles
    const has = (role) => roles.includes(role)
    for (const { material } of this.#pieces) {
      const { color, preview, normal, surface, emission, height } = material.userData
      const maps = {
        map: color ?? preview,
        normalMap: has('normal') ? normal : null,
        aoMap: has('ao') ? surface : null,
        roughnessMap: has('roughness') ? surface : null,
        metalnessMap: has('metallic') ? surface : null,
        emissiveMap: has('emission') ? emission : null,
        bumpMap: has('height') && !has('normal') ? height : null,
      }
      for (const [name, texture] of Object.entries(maps)) {
        if (material[name] === (texture ?? null)) continue
        material[name] = texture ?? null
        material.needsUpdate = true
      }
      material.roughness = maps.roughnessMap ? 1 : ROUGHNESS
      material.metalness = maps.metalnessMap ? 1 : 0
      material.bumpScale = this.sphere.radius / 100
      material.emissive = new Color(maps.emissiveMap ? 0xffffff : 0x000000)
      material.transparent = alpha === 'blend'
      material.alphaTest = alpha === 'mask' ? 0.5 : 0
    }
  }

  /** How many segments a chart needs where it is seen; asked for together, and not at every frame. */
  #look(renderer, camera, chart) {
    if (!this.#counts) return
    if (!this.#wanted) {
      if (performance.now() - this.#looked < LOOK_EVERY) return
      this.#wanted = this.#counts.slice()
      setTimeout(() => this.#ask(), 0)
    }
    const { center, radius } = this.#bounds[chart]
    const scale = this.matrixWorld.getMaxScaleOnAxis()
    const height = renderer.getDrawingBufferSize(SIZE).y
    let perUnit = height / 2 / Math.tan((Math.PI / 360) * (camera.fov ?? 50))
    if (camera.isOrthographicCamera) perUnit = (height * camera.zoom) / (camera.top - camera.bottom)
    else {
      const place = PLACE.set(...center).applyMatrix4(this.matrixWorld)
      const distance = place.distanceTo(EYE.setFromMatrixPosition(camera.matrixWorld)) - scale * radius
      perUnit /= Math.max(distance, camera.near)
    }
    const counts = countsFor(this.#bounds[chart], scale * perUnit, this.#errorPixels)
    for (let k = 0; k < 2; k++) {
      const now = this.#counts[2 * chart + k]
      // Coarser only where it pays, so that turning to and fro changes nothing.
      if (counts[k] > now || counts[k] < now / 2) this.#wanted[2 * chart + k] = counts[k]
    }
  }

  #ask() {
    const wanted = this.#wanted
    this.#wanted = null
    this.#looked = performance.now()
    const quads = () => wanted.reduce((sum, count, n) => (n % 2 ? sum + count * wanted[n - 1] : sum), 0)
    while (quads() > MOST_QUADS && wanted.some((count) => count > 1)) wanted.forEach((count, n) => (wanted[n] = Math.max(1, count >> 1)))
    if (wanted.every((count, n) => count === this.#counts[n])) return
    this.#counts = wanted
    this.#worker.postMessage({ kind: 'counts', ticket: ++this.#ticket, counts: wanted })
  }

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

const SIZE = new Vector2()
const PLACE = new Vector3()
const EYE = new Vector3()

function newTexture(target) {
  const texture = new DataTexture(null, 1, 1, RGBAFormat, UnsignedByteType)
  texture.colorSpace = target === 'color' || target === 'emission' ? SRGBColorSpace : NoColorSpace
  texture.generateMipmaps = true
  texture.minFilter = LinearMipmapLinearFilter
  texture.magFilter = LinearFilter
  texture.anisotropy = ANISOTROPY
  return texture
}
