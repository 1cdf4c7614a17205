/** The model that a loader gives: it shows what its worker decodes, paints and tessellates. */

import { BufferGeometry, Group, LineBasicMaterial, LineSegments, Mesh, Sphere, SRGBColorSpace, Vector3 } from 'three'
import { SKETCHED_TEXELS, UphClient } from '../uph-client.js'
import { putGutter } from '../uph-gutter.js'
import { DetailControl } from './detail.js'
import { chartGeometry, outlineGeometry, plainMesh } from './geometry.js'
import { newMaterial, newTexture, setTexels, updateMaterial } from './materials.js'

/**
 * A textured surface that refines: one mesh per chart.
 *
 * Events: `progress` {received, total}, `first`, `refine`, `geometry`, `complete`, `stalled` {attempt, message},
 * `resumed`, `error` {error}. After `first`, `refine` and `geometry` a frame wants to be rendered.
 */
export class UphModel extends Group {
  shown = { bytes: 0, coefficients: 0, charts: 0 }
  roles = []
  sphere = new Sphere(new Vector3(), 0)
  texels = 0
  quads = 0

  #client
  #errorPixels
  #meshes = [] // one per chart
  #materials = [] // as they were made: a mesh may have another one by now
  #textures = [] // of each chart, by what they show
  #bounds = []
  #detail = null
  #plain = null // triangles of a mesh that lie on no chart
  #plainArrays = null
  #drawn = null // the state that is shown

  constructor(worker, { maxTextureSize, maxTexels, errorPixels }) {
    super()
    this.type = 'UphModel'
    this.#errorPixels = errorPixels
    this.outlines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x2266ff }))
    this.outlines.visible = false
    this.outlines.raycast = () => {} // rays hit what is invisible, too
    this.add(this.outlines)
    this.#client = new UphClient(worker, { maxTextureSize, maxTexels, sketches: SKETCHED_TEXELS }, {
      begin: (message) => this.#begin(message),
      takeMeshes: (message) => this.#takeMeshes(message),
      takeTexture: (entry) => this.#takeTexture(entry),
      show: (state, first) => this.#show(state, first),
      notify: (type, detail) => this.dispatchEvent({ type, ...detail }),
    })
  }

  /** What bytes are fed to. */
  get client() {
    return this.#client
  }

  get received() {
    return this.#client.received
  }

  /** Length of the whole stream; null before its header has come. */
  get total() {
    return this.#client.total
  }

  get complete() {
    return this.#client.complete
  }

  /** Whether there is a textured view. */
  get first() {
    return this.#client.first
  }

  /** What has come so far. */
  bytes() {
    return this.#client.bytes()
  }

  /** Show a prefix only: {bytes}, or {coefficients}, a share of 0 to 1; null shows all that has come. */
  setLimit(limit) {
    this.#client.send({ kind: 'limit', ...limit })
  }

  /**
   * Show the model with another sample in place of its own, as `upholster.paint` does: one of the same shape, such as another
   * colour of the same cloth. `image` is what a canvas draws, a Blob or ImageData; null: the stream's own. Nothing is loaded for it.
   * Resolves when it is in the textures, or another call took its place.
   */
  setExemplar(image) {
    return this.#client.setExemplar(image)
  }

  /** Resolves when all that has come, up to the limit, is in the textures. */
  settled() {
    return this.#client.settled()
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
      const { height, width } = textures.color
      return { size: { height: height - 2, width: width - 2 }, geometry, textures }
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
    this.#client.abort()
  }

  /** Stop, and free textures, geometry and worker. */
  dispose() {
    this.#client.dispose()
    const others = this.#plain ? [this.outlines, this.#plain] : [this.outlines]
    for (const { geometry } of [...this.#meshes, ...others]) geometry.dispose()
    for (const material of [...this.#materials, ...others.map((one) => one.material)]) material.dispose()
    for (const texture of this.#textures.flatMap((own) => Object.values(own))) texture.dispose()
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

  #begin({ bounds, sphere, plain }) {
    this.#bounds = bounds
    this.#detail = new DetailControl(bounds, this.#errorPixels, (counts) => this.#client.send({ kind: 'counts', counts }))
    this.sphere.set(new Vector3(...sphere.center), sphere.radius)
    this.#materials = bounds.map(newMaterial)
    this.#textures = bounds.map(() => ({}))
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
      this.#meshes[chart].geometry = chartGeometry(piece, this.#bounds[chart])
    }
    const geometries = this.#meshes.map(({ geometry }) => geometry)
    this.quads = Math.round(geometries.reduce((sum, { userData }) => sum + (userData.quads ?? 0), 0))
    this.outlines.geometry.dispose()
    this.outlines.geometry = outlineGeometry(geometries)
    if (this.first) this.dispatchEvent({ type: 'geometry' })
  }

  // ---------------------------------------------------------------- textures

  /** Let materials have the textures that have come; their models are seen from the first on. */
  #show(state, isFirst) {
    this.#drawn = state
    const { bytes, coefficients, charts, roles, alpha = 'opaque', mean, texels } = state
    Object.assign(this, { roles, texels })
    this.shown = { bytes, coefficients, charts }
    this.#meshes.forEach((mesh, chart) => {
      for (const material of new Set([this.#materials[chart], mesh.material].flat())) {
        updateMaterial(material, this.#textures[chart], roles, alpha, this.sphere.radius)
      }
      mesh.visible ||= isFirst
    })
    this.#plain?.material.color.setRGB(...mean, SRGBColorSpace)
    this.dispatchEvent({ type: isFirst ? 'first' : 'refine' })
  }

  /** Take over one texture; returns the memory of the one before. */
  #takeTexture({ chart, target, height, width, data, gutter }) {
    const texture = (this.#textures[chart][target] ??= newTexture(target))
    const { image } = texture
    if (gutter) {
      putGutter(image.data, { height, width }, data)
      texture.needsUpdate = true
      return null
    }
    setTexels(texture, { height, width, data })
    return image.data?.buffer ?? null
  }
}
