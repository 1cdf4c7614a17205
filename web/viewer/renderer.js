/** One WebGL2 context that draws for all viewers of a page, one picture after another. */

import { ROLES } from '../uph/roles.js'
import { dot, plus, radians } from './frame.js'
import { GpuPainter } from './gpu-painter.js'
import { Programs } from './programs.js'
import { AdaptiveQuality } from './quality.js'
import { Resources } from './resources.js'
import { CELLS, LAMPS, UNITS, VERTEX, surfaces } from './shading.js'

const SHADE_UNIT = 6

let shared = null

/** Draws models. Events `lost` and `restored` are the graphics card's. */
export class Renderer extends EventTarget {
  canvas = new OffscreenCanvas(1, 1)
  /** The models that there are: what others had is freed. */
  models = new Set()
  #gl
  #programs
  #resources
  #painter
  #shades = new Map() // for each model, its shadow on the floor
  #fence = null // passed when the last picture is drawn

  /** The page's one renderer. @throws {Error} where there is no WebGL2 */
  static get shared() {
    return (shared ??= new Renderer())
  }

  constructor() {
    super()
    const gl = this.canvas.getContext('webgl2', { powerPreference: 'high-performance' })
    if (!gl) throw new Error('there is no WebGL2')
    this.#gl = gl
    this.quality = new AdaptiveQuality(gl)
    this.#begin()
    this.canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault()
      this.dispatchEvent(new Event('lost'))
    })
    this.canvas.addEventListener('webglcontextrestored', () => {
      this.#begin()
      this.dispatchEvent(new Event('restored'))
    })
  }

  #begin() {
    this.#programs = new Programs(this.#gl)
    this.#resources = new Resources(this.#gl)
    this.#painter = new GpuPainter(this.#gl, this.#programs, this.#resources)
    this.#shades.clear()
    this.#fence = null
    this.#programs.ready('plain', 'backdrop', 'floor', 'height', 'shade')
  }

  /** Whether the graphics card has lost all that it had. */
  get isLost() {
    return this.#gl.isContextLost()
  }

  /** Whether charts are painted here; `wish` is 'card' or 'worker', else it is so where there is a graphics card. */
  paints(wish) {
    const isWanted = wish === 'card' || (wish !== 'worker' && !this.quality.isSoftware)
    if (isWanted) this.#painter.ready() // its programs are made while the stream comes
    return isWanted
  }

  /** Whether the graphics card is still at the last picture, makes the programs for these models, or has not all of them yet. */
  isBusy(models, environment) {
    const gl = this.#gl
    if (this.#fence && gl.getSyncParameter(this.#fence, gl.SYNC_STATUS) !== gl.UNSIGNALED) {
      gl.deleteSync(this.#fence)
      this.#fence = null
    }
    const parts = models.flatMap(partsOf)
    const names = parts.map((model) => this.#programOf(model, environment))
    if (parts.some((model) => model.onPage && !this.#painter.ready())) return true
    if (this.#fence !== null || !this.#programs.ready('backdrop', 'floor', 'height', 'shade', ...names)) return true
    return !this.#resources.upload(parts)
  }

  /** Draw an invisible picture, so that the graphics card prepares everything that a first picture needs. */
  warm() {
    if (this.isBusy([], null) || !this.#programs.ready('plain')) return false
    const empty = new Uint8Array(4)
    const geometry = {
      positions: new Float32Array(9),
      normals: new Float32Array(9),
      tangents: new Float32Array(12),
      parameters: new Float32Array(6),
      indices: new Uint16Array([0, 1, 2]),
    }
    const chart = { geometry, textures: { color: { key: empty, data: empty, width: 1, height: 1, version: 1 } } }
    const sphere = { center: [0, 0, 0], radius: 1 }
    const model = { charts: [chart], geometries: [geometry], roles: [], alpha: 'opaque', sphere, plain: null }
    const camera = { eye: [0, 0, 9], right: [1, 0, 0], up: [0, 1, 0], backward: [0, 0, 1], matrix: new Float32Array(16) }
    this.draw([1, 1], [{ model, viewport: [0, 0, 1, 1] }], { camera, light: [0, 0], background: null, floor: -1, environment: null })
    this.#shades.delete(model)
    this.#resources.sweep([...this.models])
    return true
  }

  /**
   * Draw a picture; it stays on `canvas` until the page's task ends.
   *
   * @param {[number, number]} size in pixels
   * @param {{ model: object, viewport: number[], clip?: number[] }[]} views what stands where: left and lower edge, width, height in pixels; and
   *   what of that is drawn
   * @param {object} scene `camera`, as of `Orbit`; `light`, degrees to the right and up of it; `background`, two linear colours or null;
   *   `floor`, its height or null; and `environment`, of `environment.js`, or null
   */
  draw([width, height], views, scene) {
    const gl = this.#gl
    const { canvas } = this
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height })
    for (const { model } of views) for (const part of partsOf(model)) this.#paint(part)
    for (const { model } of views) if (scene.floor !== null) this.#shade(model, scene.floor)
    gl.bindFramebuffer(gl.FRAMEBUFFER, null)
    gl.enable(gl.SCISSOR_TEST)
    for (const { model, viewport, clip = viewport } of views) {
      gl.viewport(...viewport)
      gl.scissor(...clip)
      gl.clearColor(0, 0, 0, 0)
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT)
      gl.disable(gl.DEPTH_TEST)
      if (scene.background) this.#drawBackground(scene.background)
      gl.enable(gl.DEPTH_TEST)
      for (const part of partsOf(model)) this.#drawModel(part, scene)
      if (scene.floor !== null) this.#drawFloor(model, scene)
    }
    gl.disable(gl.SCISSOR_TEST)
    if (this.#fence) gl.deleteSync(this.#fence)
    this.#fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0)
    gl.flush()
  }

  /** Wait until all is drawn. */
  finish() {
    this.#gl.readPixels(0, 0, 1, 1, this.#gl.RGBA, this.#gl.UNSIGNED_BYTE, new Uint8Array(4))
  }

  /** Free the graphics card's memory of models that are gone, or not visible at present. */
  sweep() {
    this.#resources.sweep([...this.models])
    this.#painter.sweep([...this.models])
    for (const [model, { texture }] of this.#shades) {
      if (this.models.has(model)) continue
      this.#gl.deleteTexture(texture)
      this.#shades.delete(model)
    }
  }

  /** Paint what has changed; where that fails, the worker is to paint. */
  #paint(model) {
    try {
      if (model.onPage && this.#painter.paint(model)) this.#painter.sweep([...this.models, model])
    } catch {
      model.paintInWorker()
    }
  }

  #drawBackground([top, bottom]) {
    const gl = this.#gl
    const uniforms = this.#programs.use('backdrop')
    gl.uniform3fv(uniforms.top, top)
    gl.uniform3fv(uniforms.bottom, bottom)
    gl.disable(gl.BLEND)
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4)
  }

  #drawModel(model, scene) {
    const gl = this.#gl
    const { camera, environment } = scene
    const { edges, borders, ink } = model.lines ?? {}
    const uniforms = edges ? this.#useLines(model.lines.shader, model, camera, model.mean) : this.#programs.use(this.#programOf(model, environment))
    if (!edges) this.#setLight(uniforms, model, scene)
    const isBlended = model.alpha === 'blend'
    gl[isBlended ? 'enable' : 'disable'](gl.BLEND)
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA)
    // Transparent triangles need those behind them: far sides first.
    for (const side of isBlended ? [gl.FRONT, gl.BACK] : [null]) {
      gl[side ? 'enable' : 'disable'](gl.CULL_FACE)
      if (side) gl.cullFace(side)
      for (const chart of model.charts) this.#drawChart(model, chart, uniforms)
    }
    gl.disable(gl.CULL_FACE)
    if (model.plain) this.#drawPlain(model, uniforms)
    if (borders) {
      this.#useLines(model.lines.shader, model, camera, ink)
      for (const { geometry } of model.charts) if (geometry) this.#drawElements(geometry, borders)
    }
    for (const { geometry, shader, ink } of model.overlays ?? []) {
      this.#useLines(shader, model, camera, ink)
      this.#drawElements(geometry, asItIs)
    }
  }

  /** Which program draws a model. */
  #programOf({ roles }, environment) {
    const isFull = roles.some((role) => ROLES[role]?.target !== 'color')
    if (environment) this.#programs.add(surfaces(environment.light, 'Picture'))
    return `${isFull ? 'full' : 'plain'}${environment ? 'Picture' : ''}`
  }

  #drawChart(model, { geometry, textures }, uniforms) {
    if (!geometry) return
    const gl = this.#gl
    UNITS.forEach((unit, n) => this.#resources.texture(n, textures[unit]))
    const { width, height } = textures.color ?? {}
    if (textures.color) gl.uniform4f(uniforms.place, 1 - 2 / width, 1 - 2 / height, 1 / width, 1 / height)
    else gl.uniform4f(uniforms.place, 1, 1, 0, 0)
    if (uniforms.maps) gl.uniform1i(uniforms.maps, mapsOf(model, textures))
    this.#drawElements(geometry, model.lines?.edges)
  }

  #drawPlain(model, uniforms) {
    const gl = this.#gl
    UNITS.forEach((_, n) => this.#resources.texture(n, null))
    gl.activeTexture(gl.TEXTURE0)
    const texture = this.#resources.color(model.mean)
    if (uniforms.maps) gl.uniform1i(uniforms.maps, 0)
    this.#drawElements(model.plain, model.lines?.edges)
    gl.deleteTexture(texture)
  }

  /** Draw triangles, or the lines that `lines` makes of a geometry. */
  #drawElements(geometry, lines) {
    const gl = this.#gl
    const count = this.#resources.bind(geometry, lines)
    gl.drawElements(lines ? gl.LINES : gl.TRIANGLES, count, gl.UNSIGNED_INT, 0)
  }

  #useLines(shader, model, camera, ink) {
    this.#programs.add({ lines: () => [VERTEX, shader] })
    const uniforms = this.#programs.use('lines')
    this.#setWorld(uniforms, model, camera)
    this.#gl.uniform3fv(uniforms.ink, ink)
    return uniforms
  }

  #setWorld(uniforms, { sphere: { center, radius } }, camera) {
    if (camera) this.#gl.uniformMatrix4fv(uniforms.camera, false, camera.matrix)
    this.#gl.uniform4f(uniforms.world, ...center, 1 / radius)
  }

  #setLight(uniforms, model, { camera, light, environment }) {
    const gl = this.#gl
    this.#setWorld(uniforms, model, camera)
    gl.uniform3fv(uniforms.eye, camera.eye)
    gl.uniform1f(uniforms.cut, model.alpha === 'mask' ? 0.5 : 0)
    if (uniforms.bump) gl.uniform1f(uniforms.bump, 0.01)
    if (environment) {
      gl.uniform3fv(uniforms.harmonics, environment.harmonics)
      gl.activeTexture(gl.TEXTURE0 + UNITS.length)
      gl.bindTexture(gl.TEXTURE_CUBE_MAP, environment.textureOf(gl))
      return
    }
    gl.uniform3fv(uniforms.lamps, lampsOf(camera))
    gl.uniform3fv(uniforms.key, towardLight(camera, light))
  }

  #drawFloor(model, { camera, floor }) {
    const gl = this.#gl
    if (camera.eye[2] < floor) return
    const uniforms = this.#programs.use('floor')
    gl.uniformMatrix4fv(uniforms.camera, false, camera.matrix)
    gl.uniform1f(uniforms.floorHeight, floor)
    gl.activeTexture(gl.TEXTURE0 + SHADE_UNIT)
    gl.bindTexture(gl.TEXTURE_2D, this.#shades.get(model).texture)
    gl.uniform1i(uniforms.shade, SHADE_UNIT)
    gl.enable(gl.BLEND)
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA)
    gl.depthMask(false)
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4)
    gl.depthMask(true)
  }

  // ---------------------------------------------------------------- the shadow

  /** Find how much of the sky a model hides from the floor, again where it has another shape. */
  #shade(model, floor) {
    const key = model.geometries.length
    const known = this.#shades.get(model)
    if (known && known.floor === floor && known.key === key) return
    const gl = this.#gl
    gl.disable(gl.BLEND)
    gl.disable(gl.CULL_FACE)
    const heights = this.#drawInto((uniforms) => {
      this.#setWorld(uniforms, model, null)
      gl.uniform1f(uniforms.floorHeight, floor)
      gl.enable(gl.DEPTH_TEST)
      for (const geometry of model.geometries) this.#drawElements(geometry, false)
    }, 'height')
    const texture = this.#drawInto((uniforms) => {
      gl.disable(gl.DEPTH_TEST)
      gl.activeTexture(gl.TEXTURE0 + SHADE_UNIT)
      gl.bindTexture(gl.TEXTURE_2D, heights)
      gl.uniform1i(uniforms.heights, SHADE_UNIT)
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4)
    }, 'shade')
    gl.deleteTexture(heights)
    if (known) gl.deleteTexture(known.texture)
    this.#shades.set(model, { texture, floor, key })
  }

  /** Draw into a new square texture with one of the programs. */
  #drawInto(work, program) {
    const gl = this.#gl
    const texture = gl.createTexture()
    const depth = gl.createRenderbuffer()
    const frame = gl.createFramebuffer()
    gl.activeTexture(gl.TEXTURE0 + SHADE_UNIT)
    gl.bindTexture(gl.TEXTURE_2D, texture)
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, CELLS, CELLS)
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR)
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE)
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth)
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT16, CELLS, CELLS)
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame)
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0)
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth)
    gl.viewport(0, 0, CELLS, CELLS)
    gl.clearColor(1, 1, 1, 1)
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT)
    work(this.#programs.use(program))
    gl.deleteFramebuffer(frame)
    gl.deleteRenderbuffer(depth)
    return texture
  }
}

/** Geometries that are lines already. */
const asItIs = (geometry) => geometry

/** The models that one is made of, see `model/group.js`. */
const partsOf = (model) => model.parts ?? [model]

/** The maps that a chart has, as bits in the order of the roles. */
function mapsOf({ roles }, textures) {
  return Object.entries(ROLES).reduce((bits, [role, { target }], n) => bits | (textures[target] && roles.includes(role) ? 1 << n : 0), 0)
}

/** Unit vectors toward the lamps, which turn with the camera. */
function lampsOf({ right }) {
  const across = [right[1], -right[0], 0] // away from the eye, levelled
  return LAMPS.flatMap(([x, y, z]) => {
    const length = Math.hypot(x, y, z)
    return plus(plus([0, 0, z / length], right, x / length), across, y / length)
  })
}

function towardLight({ right, up, backward }, light) {
  const [azimuth, elevation] = light.map(radians)
  const flat = Math.cos(elevation)
  const own = [Math.sin(azimuth) * flat, Math.sin(elevation), Math.cos(azimuth) * flat]
  return [0, 1, 2].map((k) => dot(own, [right[k], up[k], backward[k]]))
}
