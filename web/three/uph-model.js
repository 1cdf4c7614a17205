/** The model that a loader returns: its worker decodes, paints and tessellates it. */

import { BufferGeometry, Group, LineBasicMaterial, LineSegments, Mesh, Sphere, SRGBColorSpace, Vector2, Vector3 } from 'three'
import { Model } from '../model/model.js'
import { chartGeometry, outlineGeometry, plainMesh } from './geometry.js'
import { newMaterial, newTexture, setTexels, updateMaterial } from './materials.js'

const EVENTS = ['progress', 'surface', 'first', 'refine', 'geometry', 'complete', 'stalled', 'resumed', 'error']

const [SIZE, PLACE, EYE] = [new Vector2(), new Vector3(), new Vector3()]

/**
 * A textured surface that refines: one mesh per chart.
 *
 * Events: `progress` {received, total}, `surface` (there are other meshes: first those of a base, a coarse mesh, then the charts'), `first`,
 * `refine`, `geometry`, `complete`, `stalled` {attempt, message}, `resumed`, `error` {error}. After `first`, `refine` and `geometry` a frame
 * wants to be rendered.
 */
export class UphModel extends Group {
  sphere = new Sphere(new Vector3(), 0)
  #model
  #meshes = [] // one per chart
  #materials = [] // as they were made: a mesh may have another one by now
  #textures = [] // of each chart, by what they show
  #shown = [] // of each chart, the arrays that its mesh shows
  #plain = null // triangles of a mesh that lie on no chart

  /** @param {Worker} worker @param {{ maxTextureSize: number, maxTexels: number, errorPixels: number, limits: object }} options */
  constructor(worker, options) {
    super()
    this.type = 'UphModel'
    this.outlines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x2266ff }))
    this.outlines.visible = false
    this.outlines.raycast = () => {} // rays would hit invisible objects, too
    this.add(this.outlines)
    this.#model = new Model(worker, options)
    for (const type of EVENTS) {
      this.#model.addEventListener(type, ({ detail }) => {
        if (type === 'surface') this.#begin()
        if (type === 'surface' || type === 'geometry') this.#takeMeshes()
        if (type === 'first' || type === 'refine') this.#takeTextures()
        this.dispatchEvent({ type, ...detail })
      })
    }
  }

  /** The receiver of bytes. */
  get client() {
    return this.#model.client
  }

  get received() {
    return this.#model.received
  }

  /** Length of the whole stream; null before its header has arrived. */
  get total() {
    return this.#model.total
  }

  get complete() {
    return this.#model.complete
  }

  /** Whether there is a textured picture. */
  get first() {
    return this.#model.first
  }

  get shown() {
    return this.#model.shown
  }

  get roles() {
    return this.#model.roles
  }

  get texels() {
    return this.#model.texels
  }

  get quads() {
    return this.#model.quads
  }

  /** The bytes received so far. */
  bytes() {
    return this.#model.bytes()
  }

  /** Show a prefix only: {bytes}, or {coefficients}, a share of 0 to 1; null shows all received bytes. */
  setLimit(limit) {
    this.#model.setLimit(limit)
  }

  /**
   * Show the model with another sample in place of its own, as `upholster.paint` does: one of the same shape, such as another
   * colour of the same cloth. `image` is an image source of a canvas, a Blob or ImageData; null: the stream's own. Nothing is loaded for it.
   * Resolves when it is in the textures, or another call has replaced it.
   */
  setExemplar(image) {
    return this.#model.setExemplar(image)
  }

  /** Resolves when all received bytes, up to the limit, are in the textures. */
  settled() {
    return this.#model.settled()
  }

  /**
   * The model as GLB, as fine as `pixels` across the whole of it show; resolves with the file's bytes. Texels are those shown here, 8 bits
   * a sample, without loss. Needs every chart's placements.
   */
  async glb({ name = this.name || 'upholster', pixels = 2000 } = {}) {
    const { writeGlb } = await import('../uph-glb.js')
    await this.settled()
    if (this.shown.placements < 1) throw new Error('the model is not complete: placements are still to come')
    await this.#model.refineTo(pixels / 2 / this.sphere.radius)
    const { plain, metres, alpha, mean, roles } = this.#model
    const charts = this.#model.charts.map(({ geometry, textures }) => {
      const { height, width } = textures.color
      return { size: { height: height - 2, width: width - 2 }, geometry, textures }
    })
    return writeGlb({ name, charts, plain, metres, alpha, mean, roles })
  }

  get wireframe() {
    return this.#materials[0]?.wireframe ?? false
  }

  set wireframe(on) {
    for (const material of this.#materials) material.wireframe = on
  }

  /** Stop receiving: the picture stays. */
  abort() {
    this.#model.abort()
  }

  /** Stop, and free textures, geometry and worker. */
  dispose() {
    this.#model.dispose()
    this.#clear()
    this.outlines.geometry.dispose()
    this.outlines.material.dispose()
    this.clear()
  }

  /** Free the meshes. */
  #clear() {
    const meshes = this.#plain ? [...this.#meshes, this.#plain] : this.#meshes
    for (const { geometry } of meshes) geometry.dispose()
    for (const material of this.#plain ? [...this.#materials, this.#plain.material] : this.#materials) material.dispose()
    for (const texture of this.#textures.flatMap((own) => Object.values(own))) texture.dispose()
    this.remove(...meshes)
    this.#meshes = []
    this.#shown = []
    this.#plain = null
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

  // ---------------------------------------------------------------- what the worker makes

  #begin() {
    const { charts, plain, sphere } = this.#model
    this.#clear()
    this.sphere.set(new Vector3(...sphere.center), sphere.radius)
    this.#materials = charts.map(newMaterial)
    this.#textures = charts.map(() => ({}))
    this.#meshes = this.#materials.map((material, chart) => {
      const mesh = new Mesh(new BufferGeometry(), material)
      mesh.name = `chart ${chart}`
      mesh.onBeforeRender = (renderer, _, camera) =>
        this.#model.measureChart(chart, pixelsPerUnit(charts[chart].bounds, this.matrixWorld, renderer, camera))
      return mesh
    })
    this.add(...this.#meshes)
    if (plain) this.add((this.#plain = plainMesh(plain)))
  }

  #takeMeshes() {
    const { charts } = this.#model
    charts.forEach(({ geometry, bounds }, chart) => {
      if (geometry === this.#shown[chart]) return
      this.#shown[chart] = geometry
      this.#meshes[chart].geometry.dispose()
      this.#meshes[chart].geometry = chartGeometry(geometry, bounds)
    })
    this.outlines.geometry.dispose()
    this.outlines.geometry = outlineGeometry(charts.map(({ geometry }) => geometry))
  }

  /** Give materials the received textures. */
  #takeTextures() {
    const { charts, roles, alpha, mean } = this.#model
    this.#meshes.forEach((mesh, chart) => {
      const own = this.#textures[chart]
      for (const [target, source] of Object.entries(charts[chart].textures)) setTexels((own[target] ??= newTexture(target)), source)
      for (const material of new Set([this.#materials[chart], mesh.material].flat())) {
        updateMaterial(material, own, roles, alpha, this.sphere.radius)
      }
    })
    this.#plain?.material.color.setRGB(...mean, SRGBColorSpace)
  }
}

/** Pixels that the unit of length of a sphere's own space takes at its nearest point. */
function pixelsPerUnit({ center, radius }, matrixWorld, renderer, camera) {
  const height = renderer.getDrawingBufferSize(SIZE).y
  const scale = matrixWorld.getMaxScaleOnAxis()
  if (camera.isOrthographicCamera) return (scale * height * camera.zoom) / (camera.top - camera.bottom)
  const place = PLACE.set(...center).applyMatrix4(matrixWorld)
  const distance = place.distanceTo(EYE.setFromMatrixPosition(camera.matrixWorld)) - scale * radius
  return (scale * height) / 2 / Math.tan((Math.PI / 360) * (camera.fov ?? 50)) / Math.max(distance, camera.near)
}
