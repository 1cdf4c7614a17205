/** The stage: a canvas that shows a model, or two side by side, drawn when there is something new to see. */

import { plus, SLOPE, verticesOf } from './frame.js'
import { Orbit } from './orbit.js'
import { Renderer } from './renderer.js'
import { letScroll } from './scrolling.js'
import { BACKGROUNDS, KEY_DIRECTION } from './shading.js'

const MAX_PIXEL_RATIO = 2

/** Milliseconds after which a still picture is drawn in full: models ask for what they need every 120. */
const SHARPEN_AFTER = 150
const SHARPEN_WHILE_LOADING = 4000 // textures are still getting better, and a full picture may hold up the page

/** How far from the screen a stage counts as seen. */
const NEAR_BY = '50%'

/**
 * The world's unit is the model's radius, its origin the model's middle.
 *
 * `onlost` is called when the graphics card has lost all that it had, and when it is back; `onseen` when the stage comes near the screen.
 */
export class Stage {
  onlost = () => {}
  onseen = () => {}
  #parent
  #renderer
  #context
  #orbit
  #models = [] // one or two
  #wipe = null
  #size = [1, 1]
  #pixels = [0, 0]
  #frame = 0
  #timer = 0
  #lastTime = 0
  #visible = false
  #waiting = [] // callbacks for when a frame is drawn
  #background = BACKGROUNDS.light
  #floor = null
  #light = [...KEY_DIRECTION]
  #environment = null
  #observers
  #listening = new AbortController()

  /**
   * @param {HTMLElement} parent gets the canvas, which fills it
   * @param {[number, number]} view azimuth and elevation in degrees
   * @throws {Error} where there is no WebGL2
   */
  constructor(parent, view) {
    this.#parent = parent
    this.#renderer = Renderer.shared
    this.canvas = document.createElement('canvas')
    this.canvas.className = 'empty'
    this.#context = this.canvas.getContext('bitmaprenderer')
    const { signal } = this.#listening
    letScroll(this.canvas, signal)
    this.#orbit = new Orbit(this.canvas, view, signal)
    this.#orbit.onchange = () => this.invalidate()
    parent.append(this.canvas)
    this.#resize()
    this.#listen(signal)
  }

  // ---------------------------------------------------------------- what is seen

  /** Show one model, or two that are compared, or none. */
  show(...models) {
    const fresh = models[0] !== this.#models[0]
    if (fresh && models[0] && this.#models[0]) this.#orbit.keep(this.#models[0].sphere, models[0].sphere)
    for (const model of this.#models) this.#renderer.models.delete(model)
    for (const model of models) this.#renderer.models.add(model)
    this.#models = models
    this.#renderer.sweep()
    this.#orbit.enabled = models.length > 0
    this.#orbit.zoomToPointer = !this.split
    this.canvas.classList.toggle('empty', !models.length)
    if (!models.length) this.#floor = null
    else if (fresh) this.#measureShape()
    this.#orbit.aspect = this.#aspect
    this.invalidate()
  }

  /** Whether two models are compared side by side. */
  get split() {
    return this.#models.length > 1 && this.#wipe === null
  }

  /** Of two models, the share of the picture's width, from the left, that shows the first; the other shows the rest. null: side by side. */
  set wipe(share) {
    this.#wipe = share
    this.invalidate()
  }

  /** Whether they lie above each other, not side by side. */
  get stacked() {
    return this.#size[0] < this.#size[1]
  }

  /**
   * Models have changed: other textures or shapes. With `shape` the whole is framed again, unless somebody has turned it. `before` is the sphere
   * of the first model's shape before.
   */
  refresh({ shape = false, before = null } = {}) {
    const [model] = this.#models
    if (!model) return
    if (before) this.#orbit.keep(before, model.sphere)
    if (shape) {
      if (!this.#orbit.touched) this.#measureShape()
      this.#renderer.sweep()
    }
    this.invalidate()
  }

  /** As the attribute `background` says; `dark` is the studio's own at night. */
  setBackground(css, dark) {
    this.#background = css === 'none' ? null : ((css && cssColor(css)) ?? BACKGROUNDS[dark ? 'dark' : 'light'])
    this.#parent.style.background = css ?? ''
    this.invalidate()
  }

  /** Surroundings that light the model, as of `environment.js`; null for the studio. */
  set environment(environment) {
    this.#environment = environment
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
    return [...this.#light]
  }

  set light(direction) {
    const [across, up] = direction ?? KEY_DIRECTION
    const turned = ((((across + 180) % 360) + 360) % 360) - 180
    this.#light = [turned, Math.min(Math.max(up, -90), 90)]
    this.invalidate()
  }

  /** Whether dragging turns the model. */
  set dragRotates(on) {
    this.#orbit.dragRotates = on
  }

  // ---------------------------------------------------------------- drawing

  /** How many pixels a model's radius is long where it is nearest. */
  get pixels() {
    const { eye, near } = this.#orbit.camera()
    return this.#viewport(0, this.#pixelsFor(1))[3] / 2 / SLOPE / Math.max(Math.hypot(...eye) - 1, near)
  }

  /** The ray from the eye through a point of the canvas, in CSS pixels, in the first model's own units; null without one. */
  ray(x, y) {
    const [model] = this.#models
    if (!model) return null
    const { eye, right, up, backward } = this.#orbit.camera()
    const [width, height] = this.#size
    const [across, above] = [((2 * x) / width - 1) * SLOPE * (width / height), (1 - (2 * y) / height) * SLOPE]
    const { center, radius } = model.sphere
    return {
      origin: center.map((c, k) => c + radius * eye[k]),
      direction: [0, 1, 2].map((k) => across * right[k] + above * up[k] - backward[k]),
    }
  }

  /** Whether the graphics card can draw nothing at the moment. */
  get isLost() {
    return this.#renderer.isLost
  }

  /** Draw soon. */
  invalidate() {
    if (this.#frame || !this.#visible || !this.#models.length) return
    this.#frame = requestAnimationFrame((time) => this.#tick(time))
  }

  /** Resolves when what was changed before has been drawn; immediately if nothing is drawn, because the stage is not visible. */
  drawn() {
    if (!this.#visible || document.hidden || !this.#models.length) return Promise.resolve()
    this.invalidate()
    return new Promise((resolve) => this.#waiting.push(resolve))
  }

  /** Have a model as fine as it has to be in the place of the first one. */
  async refine(model) {
    this.#measure(model, 0, this.#orbit.camera())
    await new Promise((resolve) => setTimeout(resolve)) // by then it has asked for what it wants
    await model.settled()
  }

  /** Draw until the models have measured their size on screen. */
  async settle() {
    for (let n = 0; n < 2; n++) {
      await this.drawn()
      await new Promise((resolve) => setTimeout(resolve, SHARPEN_AFTER))
    }
    this.#draw() // with all its pixels, whether or not anybody sees it
  }

  /** Have the graphics card prepare itself: that takes longer than the first bytes to arrive. */
  precompile() {
    if (!this.#models.length && !this.#renderer.warm()) setTimeout(() => this.precompile(), 20)
  }

  /** A PNG of the canvas as it is now. */
  picture() {
    this.#render(this.#pixelsFor(1))
    return this.#renderer.canvas.convertToBlob({ type: 'image/png' })
  }

  /** Draw, and wait until the graphics card is done. */
  finish() {
    this.#draw()
    this.#renderer.finish()
  }

  /** Free all resources, except the models, which the stage does not own. */
  dispose() {
    this.show()
    cancelAnimationFrame(this.#frame)
    clearTimeout(this.#timer)
    this.#listening.abort()
    for (const observer of this.#observers) observer.disconnect()
    this.canvas.remove()
    this.#tellWaiting()
  }

  #tick(time) {
    this.#frame = 0
    if (this.isLost) return // it is drawn when the card is back
    // Another picture would have to wait for the one before, and make the page wait with it.
    if (this.#renderer.isBusy(this.#models, this.#environment)) return this.invalidate()
    const { quality } = this.#renderer
    const seconds = this.#lastTime ? Math.min((time - this.#lastTime) / 1000, 0.1) : 1 / 60
    // What still moves asks for the next frame.
    this.#orbit.update(seconds)
    if (this.#frame && this.#lastTime) quality.addFrame(time - this.#lastTime)
    this.#lastTime = this.#frame ? time : 0
    // What is whole and rests is drawn in full at once.
    this.#draw(this.#pixelsFor(this.#frame || !this.#whole ? quality.quality : 1))
    this.#tellWaiting()
    clearTimeout(this.#timer)
    if (!this.#frame) this.#timer = setTimeout(() => this.#sharpen(), this.#loading ? SHARPEN_WHILE_LOADING : SHARPEN_AFTER)
  }

  #tellWaiting() {
    for (const resolve of this.#waiting.splice(0)) resolve()
  }

  /** Draw in full once things rest. */
  #sharpen() {
    const pixels = this.#pixelsFor(1)
    if (this.#frame || !this.#visible || document.hidden || pixels.every((count, n) => count === this.#pixels[n])) return
    if (this.#renderer.isBusy(this.#models, this.#environment)) this.#timer = setTimeout(() => this.#sharpen(), SHARPEN_AFTER / 10)
    else this.#draw()
  }

  /** Whether better textures are still to come. */
  get #loading() {
    return this.#models.some((model) => model.received < model.total)
  }

  /** Whether the models show all of their streams. */
  get #whole() {
    return this.#models.every(({ shown }) => shown.coefficients === 1)
  }

  /** Pixels of the picture, with a share of them along each side where a full picture would take too long. */
  #pixelsFor(quality) {
    const ratio = quality * Math.min(devicePixelRatio, MAX_PIXEL_RATIO)
    return this.#size.map((length) => Math.max(1, Math.round(length * ratio)))
  }

  #draw(pixels = this.#pixelsFor(1)) {
    if (!this.#models.length || this.isLost) return
    this.#render(pixels)
    this.#pixels = pixels
    this.#context.transferFromImageBitmap(this.#renderer.canvas.transferToImageBitmap())
  }

  #render(pixels) {
    const camera = this.#orbit.camera()
    const views = this.#models.map((model, n) => ({ model, viewport: this.#viewport(n, pixels), clip: this.#clip(n, pixels) }))
    this.#models.forEach((model, n) => this.#measure(model, n, camera))
    this.#renderer.draw(pixels, views, {
      camera,
      light: this.#light,
      background: this.#background,
      floor: this.#floor,
      environment: this.#environment,
    })
  }

  /** By all pixels, even where a picture has fewer: nothing is tessellated or painted twice. */
  #measure(model, n, { eye, near }) {
    const { center, radius } = model.sphere
    const [, , , height] = this.#viewport(n, this.#pixelsFor(1))
    model.measure(plus(center, eye, radius), height / 2 / SLOPE, near * radius)
  }

  /** What is drawn of a model's view, where two share it; undefined: all. */
  #clip(n, [width, height]) {
    if (this.#models.length < 2 || this.#wipe === null) return undefined
    const at = Math.round(this.#wipe * width)
    return n ? [at, 0, width - at, height] : [0, 0, at, height]
  }

  /** Left and lower edge, width, height of the first or second half. */
  #viewport(n, [width, height]) {
    if (!this.split) return [0, 0, width, height]
    const half = this.stacked ? height >> 1 : width >> 1
    if (this.stacked) return [0, n ? 0 : height - half, width, half]
    return [n ? width - half : 0, 0, half, height]
  }

  get #aspect() {
    const [, , width, height] = this.#viewport(0, this.#size)
    return width / height
  }

  #measureShape() {
    const { points, lowest } = verticesOf(this.#models[0])
    if (points.length) this.#orbit.points = points
    this.#floor = points.length ? lowest - 0.002 : null // what lies flat hides it
  }

  // ---------------------------------------------------------------- the page

  #listen(signal) {
    const sizes = new ResizeObserver(() => this.#resize())
    const visibility = new IntersectionObserver((entries) => this.#setVisible(entries.at(-1).isIntersecting), { rootMargin: NEAR_BY })
    sizes.observe(this.#parent)
    visibility.observe(this.#parent)
    this.#observers = [sizes, visibility]
    this.canvas.addEventListener('dblclick', () => this.reset(), { signal })
    const look = () => {
      this.invalidate()
      this.onlost()
    }
    for (const type of ['lost', 'restored']) this.#renderer.addEventListener(type, look, { signal })
  }

  /** Far from the screen the picture stays, but the graphics card's memory is for what is seen. */
  #setVisible(visible) {
    this.#visible = visible
    for (const model of this.#models) this.#renderer.models[visible ? 'add' : 'delete'](model)
    if (visible) {
      this.onseen()
      this.invalidate()
    } else {
      this.#renderer.sweep()
      this.#tellWaiting()
    }
  }

  #resize() {
    this.#size = [Math.max(this.#parent.clientWidth, 1), Math.max(this.#parent.clientHeight, 1)]
    this.#orbit.aspect = this.#aspect
    this.invalidate()
  }
}

/** The browser's own reading of a CSS colour, twice (top and bottom), linear; null where it is none, or see-through. */
function cssColor(css) {
  const context = new OffscreenCanvas(1, 1).getContext('2d')
  context.fillStyle = 'transparent'
  context.fillStyle = css
  context.fillRect(0, 0, 1, 1)
  const [red, green, blue, alpha] = context.getImageData(0, 0, 1, 1).data
  if (alpha < 255) return null
  const color = [red, green, blue].map((x) => (x <= 10 ? x / 3294.6 : ((x / 255 + 0.055) / 1.055) ** 2.4))
  return [color, color]
}
