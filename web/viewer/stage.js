/** The stage: a canvas that draws a model, or two side by side, when there is something new to see. */

import { Group, Matrix4, Scene, WebGLRenderer } from 'three'
import { onDrag } from './drag.js'
import { verticesOf } from './frame.js'
import { backdrop, KEY_DIRECTION, placeholderMesh, Studio } from './light.js'
import { Orbit } from './orbit.js'
import { AdaptiveQuality } from './quality.js'
import { letScroll } from './scrolling.js'

const MAX_PIXEL_RATIO = 2

/** Milliseconds after which a still picture is drawn in full: models measure their size on screen every 120 only. */
const SHARPEN_AFTER = 150
const SHARPEN_WHILE_LOADING = 1500 // textures are still getting better

/**
 * The world's unit is the model's radius, its origin the model's middle: the same tolerances do for any model.
 *
 * `onlight` is called when the light was turned by dragging, `onlost` and `onrestored` with the WebGL context.
 */
export class Stage {
  onlight = () => {}
  onlost = () => {}
  onrestored = () => {}
  #parent
  #renderer
  #orbit
  #scene = new Scene()
  #studio = new Studio()
  #world = new Group()
  #models = [] // one or two
  #size = [1, 1]
  #quality
  #frameFence = null // passed when the last frame is drawn
  #ratio = 0
  #frame = 0
  #timer = 0
  #lastTime = 0
  #visible = true
  #waiting = [] // to be told when a frame is drawn
  #background
  #observers
  #listening = new AbortController()

  /**
   * @param {HTMLElement} parent gets the canvas, which fills it
   * @param {[number, number]} view azimuth and elevation in degrees
   * @throws {Error} where there is no WebGL2
   */
  constructor(parent, view) {
    this.#parent = parent
    this.canvas = document.createElement('canvas')
    this.canvas.className = 'empty'
    const context = this.canvas.getContext('webgl2', { antialias: true, powerPreference: 'high-performance' })
    if (!context) throw new Error('there is no WebGL2')
    this.#renderer = new WebGLRenderer({ canvas: this.canvas, context, alpha: true })
    this.#renderer.shadowMap.enabled = true
    this.#quality = new AdaptiveQuality(context)
    this.#orbit = new Orbit(this.canvas, view)
    this.#orbit.onchange = () => this.invalidate()
    this.#world.matrixAutoUpdate = false
    this.#scene.add(this.#world, this.#studio)
    parent.append(this.canvas)
    letScroll(this.canvas, this.#listening.signal)
    this.#resize()
    this.#listen()
  }

  // ---------------------------------------------------------------- what is seen

  /** Show one model, or two that are compared, or none. */
  show(...models) {
    const fresh = models[0] !== this.#models[0]
    for (const model of this.#models) if (!models.includes(model)) this.#world.remove(model)
    for (const model of models) if (!this.#models.includes(model)) this.#world.add(model)
    this.#models = models
    this.#orbit.enabled = models.length > 0
    this.#orbit.zoomToPointer = !this.split
    this.canvas.classList.toggle('empty', !models.length)
    if (!models.length) this.#studio.floor = null
    else if (fresh) this.#normalize(models[0])
    this.#orbit.aspect = this.#aspect
    this.refresh()
  }

  /** Whether two models are compared. */
  get split() {
    return this.#models.length > 1
  }

  /** Whether they lie above each other, not side by side. */
  get stacked() {
    return this.#size[0] < this.#size[1]
  }

  /** Models have changed: other textures or shapes. With `shape` the whole is framed again, unless somebody has turned it. */
  refresh({ shape = false } = {}) {
    for (const model of this.#models) {
      for (const child of model.children) {
        if (!child.isMesh) continue
        child.castShadow = !child.material.wireframe
        child.receiveShadow = true
      }
    }
    if (this.#models[0]?.roles.includes('metallic')) this.#studio.surround(this.#scene, this.#renderer)
    if (shape && !this.#orbit.touched) this.#measureShape()
    this.invalidate()
  }

  /** As the attribute `background` says; `dark` is the studio's own at night. */
  setBackground(css, dark) {
    const key = `${css} ${dark}`
    if (key === this.#background) return
    this.#background = key
    this.#dropBackground()
    this.#scene.background = backdrop(css, dark)
    this.#parent.style.background = css ?? ''
    this.invalidate()
  }

  // ---------------------------------------------------------------- camera and light

  get view() {
    return this.#orbit.view
  }

  set view(view) {
    this.#orbit.view = view
  }

  reset() {
    this.#orbit.reset()
  }

  turn(across, up) {
    this.#orbit.turn(across, up)
  }

  zoom(factor) {
    this.#orbit.zoom(factor)
  }

  set autorotate(on) {
    this.#orbit.autorotate = on
  }

  set reducedMotion(on) {
    this.#orbit.damping = !on
  }

  /** Where the key light stands, in degrees to the right and up, in the camera's axes; null puts it where it was at first. */
  get light() {
    return [...this.#studio.direction]
  }

  set light(direction) {
    const [across, up] = direction ?? KEY_DIRECTION
    const turned = ((((across + 180) % 360) + 360) % 360) - 180
    this.#studio.direction = [turned, Math.min(Math.max(up, -90), 90)]
    this.invalidate()
  }

  /** Whether dragging turns the light, not the model; with the shift key it does anyway. */
  set dragLight(on) {
    this.#orbit.dragRotates = !on
    this.canvas.classList.toggle('light', on)
  }

  // ---------------------------------------------------------------- drawing

  /** Draw soon. */
  invalidate() {
    if (this.#frame || !this.#visible || !this.#renderer) return
    this.#frame = requestAnimationFrame((time) => this.#tick(time))
  }

  /** Resolves when what was changed before has been drawn; at once where nothing is drawn, because nobody sees it. */
  drawn() {
    if (!this.#visible || document.hidden || !this.#renderer) return Promise.resolve()
    this.invalidate()
    return new Promise((resolve) => this.#waiting.push(resolve))
  }

  /** Draw until the models have measured their size on screen. */
  async settle() {
    for (let n = 0; n < 2; n++) {
      await this.drawn()
      await new Promise((resolve) => setTimeout(resolve, SHARPEN_AFTER))
    }
    this.#draw() // with all its pixels, whether or not anybody sees it
  }

  /** Have the graphics card compile its programs: that takes longer than the first bytes to arrive. */
  precompile() {
    const mesh = placeholderMesh()
    this.#scene.add(mesh)
    if (!this.#models.length) this.#studio.floor = -1
    this.#draw(this.#quality.quality, true)
    if (!this.#models.length) this.#studio.floor = null
    mesh.visible = false
  }

  /** A PNG of the canvas as it is now. */
  picture() {
    this.#draw()
    return new Promise((resolve, reject) => {
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error('there is no picture'))), 'image/png')
    })
  }

  /** Median time of a frame in milliseconds, the graphics card's work included: a few are drawn and waited for. */
  async measure(frames = 9) {
    const pixel = new Uint8Array(4)
    const times = []
    for (let n = 0; n < frames; n++) {
      await new Promise((resolve) => setTimeout(resolve))
      if (!this.#renderer) return NaN
      const context = this.#renderer.getContext()
      const start = performance.now()
      this.#draw()
      context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, pixel)
      times.push(performance.now() - start)
    }
    return times.sort((a, b) => a - b)[frames >> 1]
  }

  /** Give everything back to the browser. The models are not the stage's own. */
  dispose() {
    cancelAnimationFrame(this.#frame)
    clearTimeout(this.#timer)
    this.#listening.abort()
    for (const observer of this.#observers) observer.disconnect()
    this.show()
    this.#orbit.dispose()
    this.#studio.dispose()
    this.#dropBackground()
    const loss = this.#renderer.getContext().getExtension('WEBGL_lose_context')
    this.#renderer.dispose()
    this.#renderer = null
    // A page may hold few contexts: do not wait for the garbage collector.
    loss?.loseContext()
    this.canvas.remove()
    for (const resolve of this.#waiting.splice(0)) resolve()
  }

  #tick(time) {
    this.#frame = 0
    // Another size has to wait for the frame before, and would make the page wait with it.
    if (this.#ratioFor(this.#quality.quality) !== this.#ratio && this.#busy) {
      this.invalidate()
      return
    }
    const seconds = this.#lastTime ? Math.min((time - this.#lastTime) / 1000, 0.1) : 1 / 60
    const waiting = this.#waiting.splice(0)
    // What still moves asks for the next frame.
    this.#orbit.update(seconds)
    if (this.#frame && this.#lastTime) this.#quality.addFrame(time - this.#lastTime)
    this.#lastTime = this.#frame ? time : 0
    this.#draw(this.#quality.quality)
    for (const resolve of waiting) resolve()
    clearTimeout(this.#timer)
    if (!this.#frame) this.#timer = setTimeout(() => this.#sharpen(), this.#loading ? SHARPEN_WHILE_LOADING : SHARPEN_AFTER)
  }

  /** Draw in full once things rest. */
  #sharpen() {
    if (this.#frame || !this.#visible || document.hidden || this.#ratioFor(1) === this.#ratio) return
    if (this.#busy) this.#timer = setTimeout(() => this.#sharpen(), SHARPEN_AFTER / 10)
    else this.#draw()
  }

  /** Whether better textures are still to come. */
  get #loading() {
    return this.#models.some((model) => model.received < model.total)
  }

  /** Whether the graphics card is still at the last frame. */
  get #busy() {
    const context = this.#renderer.getContext()
    if (this.#frameFence && context.getSyncParameter(this.#frameFence, context.SYNC_STATUS) !== context.UNSIGNALED) {
      context.deleteSync(this.#frameFence)
      this.#frameFence = null
    }
    return this.#frameFence !== null
  }

  #ratioFor(quality) {
    return quality * Math.min(devicePixelRatio, MAX_PIXEL_RATIO)
  }

  /** Draw, with a share of the pixels along each side where a full picture would take too long. */
  #draw(quality = 1, empty = false) {
    const renderer = this.#renderer
    if (!renderer || (!this.#models.length && !empty)) return
    const ratio = this.#ratioFor(quality)
    if (ratio !== this.#ratio) {
      this.#ratio = ratio
      renderer.setPixelRatio(ratio)
      renderer.setSize(...this.#size, false)
    }
    this.#studio.follow(this.#orbit.camera)
    this.#orbit.prepare()
    renderer.setScissorTest(this.split)
    for (let n = 0; n < Math.max(this.#models.length, 1); n++) {
      const [x, y, width, height] = this.#viewport(n)
      renderer.setViewport(x, y, width, height)
      renderer.setScissor(x, y, width, height)
      this.#models.forEach((model, k) => (model.visible = k === n))
      renderer.render(this.#scene, this.#orbit.camera)
    }
    for (const model of this.#models) model.visible = true
    const context = renderer.getContext()
    if (this.#frameFence) context.deleteSync(this.#frameFence)
    this.#frameFence = context.fenceSync(context.SYNC_GPU_COMMANDS_COMPLETE, 0)
  }

  /** Left and lower edge, width, height of the first or second half, in CSS pixels. */
  #viewport(n) {
    const [width, height] = this.#size
    if (!this.split) return [0, 0, width, height]
    if (this.stacked) return [0, ((1 - n) * height) / 2, width, height / 2]
    return [(n * width) / 2, 0, width / 2, height]
  }

  get #aspect() {
    const [, , width, height] = this.#viewport(0)
    return width / height
  }

  /** Let the model fill the unit ball. */
  #normalize(model) {
    const { center, radius } = model.sphere
    const scale = 1 / (radius || 1)
    const move = new Matrix4().makeTranslation(-center.x, -center.y, -center.z)
    this.#world.matrix.makeScale(scale, scale, scale).multiply(move)
    this.#world.updateMatrixWorld(true)
    this.#studio.floor = null
    this.#measureShape()
    this.#shadeFloor()
  }

  #measureShape() {
    const { points, lowest } = verticesOf(this.#models[0], this.#world.matrix)
    if (points.length) this.#orbit.points = points
    this.#studio.floor = points.length ? lowest : null
  }

  /** Soften the shadow on the floor, after the first view, which must not wait for it. */
  async #shadeFloor() {
    const [model] = this.#models
    await this.drawn()
    if (this.#models[0] !== model) return
    await this.#studio.shade(model, this.#world.matrix)
    this.invalidate()
  }

  #dropBackground() {
    if (this.#scene.background?.isTexture) this.#scene.background.dispose()
    this.#scene.background = null
  }

  // ---------------------------------------------------------------- the page

  #listen() {
    const { signal } = this.#listening
    const sizes = new ResizeObserver(() => this.#resize())
    const visibility = new IntersectionObserver((entries) => {
      this.#visible = entries.at(-1).isIntersecting
      if (this.#visible) this.invalidate()
      else for (const resolve of this.#waiting.splice(0)) resolve()
    })
    sizes.observe(this.#parent)
    visibility.observe(this.#parent)
    this.#observers = [sizes, visibility]
    this.canvas.addEventListener('dblclick', () => this.reset(), { signal })
    this.canvas.addEventListener('webglcontextlost', () => this.onlost(), { signal })
    this.canvas.addEventListener('webglcontextrestored', () => {
      this.#studio.handleContextLoss(this.#scene)
      this.refresh()
      this.onrestored()
    }, { signal })
    onDrag(this.#parent, this.canvas, {
      signal,
      starts: (event) => this.#models.length > 0 && (event.shiftKey || !this.#orbit.dragRotates),
      moves: (right, down) => {
        const [across, up] = this.light
        this.light = [across + right / 2, up - down / 2]
        this.onlight()
      },
    })
  }

  #resize() {
    this.#size = [Math.max(this.#parent.clientWidth, 1), Math.max(this.#parent.clientHeight, 1)]
    this.#ratio = 0
    this.#orbit.aspect = this.#aspect
    // Sizing clears the canvas: draw in the same frame, or it flashes. While a model is awaited there is time for it.
    if (this.#visible) this.#draw(this.#quality.quality, true)
  }
}
