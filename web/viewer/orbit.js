/** Turning, zooming and panning round a model in the unit ball; z is up. */

import { axes, FIELD_OF_VIEW, fit, plus, radians, SLOPE } from './frame.js'

/** How near and far the eye comes to what it looks at, in radii of the model. */
const [NEAREST, FARTHEST] = [0.02, 25]

/** Turns per height of the canvas that is dragged over, degrees per second of turning by itself, how fast movements run out. */
const [DRAG_DEGREES, AUTO_DEGREES, DECAY] = [290, 7.2, 8]

const MOST_CHANGE = 4 // of the radius of a model's sphere, while it counts as the same model
const WHEEL = 0.0016 // of the zoom's logarithm, per pixel
const UNKNOWN = new Float32Array([-1, -1, -1, 1, 1, 1])
const limit = (x, low, high) => Math.min(Math.max(x, low), high)

/** Whether two spheres may be of one model: then each has the middle of the other in it, and none is many times larger. */
function overlap(a, b) {
  const apart = Math.hypot(...a.center.map((x, k) => x - b.center[k]))
  return apart < Math.min(a.radius, b.radius) && Math.max(a.radius / b.radius, b.radius / a.radius) < MOST_CHANGE
}

/** A camera and what moves it. `onchange` is called when a frame is due. */
export class Orbit {
  onchange = () => {}
  /** Whether somebody has moved the camera: then it is not framed again by itself. */
  touched = false
  /** Whether there is anything to turn. */
  enabled = false
  /** Whether dragging rotates; zooming and panning are always possible. */
  dragRotates = true
  /** Whether zooming goes to the pointer, or to the middle. */
  zoomToPointer = true
  /** Whether movements run out, instead of ending at once. */
  damping = true
  #canvas
  #points = UNKNOWN
  #start
  #aspect = 1
  #target
  #angles
  #distance
  #turning = [0, 0] // degrees per second
  #auto = false
  #pointers = new Map()

  /** @param {HTMLElement} canvas @param {[number, number]} view azimuth and elevation to start with, in degrees */
  constructor(canvas, view, signal) {
    this.#canvas = canvas
    this.#start = view
    this.#frame()
    const listen = (type, work) => canvas.addEventListener(type, work, { signal })
    listen('pointerdown', (event) => this.#press(event))
    listen('pointermove', (event) => this.#move(event))
    listen('pointercancel', (event) => this.#cancel(event))
    for (const type of ['pointerup', 'lostpointercapture']) listen(type, ({ pointerId }) => this.#pointers.delete(pointerId))
    listen('contextmenu', (event) => event.preventDefault())
    canvas.addEventListener('wheel', (event) => this.#wheel(event), { signal, passive: false })
  }

  /** Degrees from the middle of one frame to the next; only while nobody touches it. */
  set autorotate(on) {
    this.#auto = on
    this.onchange()
  }

  /** The model's vertices: what has to be in sight. */
  set points(points) {
    this.#points = points
    if (!this.touched) this.#frame()
  }

  /** Width / height of the picture. A view that somebody chose keeps as much in sight as before. */
  set aspect(aspect) {
    const before = this.#aspect
    if (aspect === before) return
    this.#aspect = aspect
    if (!this.touched) return this.#frame()
    const distance = (a) => fit(this.#points, a, this.#angles).distance
    this.#distance *= distance(aspect) / distance(before)
  }

  /** Azimuth and elevation in degrees. Setting them frames the whole model. */
  get view() {
    return [((((this.#angles[0] + 180) % 360) + 360) % 360) - 180, this.#angles[1]]
  }

  set view(view) {
    this.#start = view
    this.reset()
  }

  /** Back to the view set last, with the whole model in sight. */
  reset() {
    this.touched = false
    this.#frame()
    this.onchange()
  }

  /**
   * Another sphere of the world becomes the unit ball: a view that somebody chose stays where it is in the world, if the model does.
   * @param {{ center: number[], radius: number }} before @param {{ center: number[], radius: number }} after
   */
  keep(before, after) {
    if (!this.touched || !overlap(before, after)) return
    const scale = before.radius / after.radius
    this.#target = this.#target.map((x, k) => scale * x + (before.center[k] - after.center[k]) / after.radius)
    this.#distance *= scale
  }

  /** Turn by degrees: round the model, and up. */
  turn(across, up) {
    this.#touch()
    this.#rotate(-across, up)
  }

  /** Come nearer by a factor; `toward` is a place on the canvas, from the middle, in its half height. */
  zoom(factor, toward = [0, 0]) {
    this.#touch()
    const before = this.#distance
    this.#distance = limit(before / factor, NEAREST, FARTHEST)
    if (this.zoomToPointer) this.#pan(toward[0] * (before - this.#distance), toward[1] * (before - this.#distance))
    this.onchange()
  }

  /** Go on with movements under way, by a time in seconds. */
  update(seconds) {
    if (!this.enabled) return
    if (this.#auto) this.#rotate(-AUTO_DEGREES * seconds, 0)
    const [across, up] = this.#turning
    if (this.#pointers.size || Math.hypot(across, up) < 1) return
    this.#rotate(across * seconds, up * seconds)
    const share = Math.exp(-DECAY * seconds)
    this.#turning = [across * share, up * share]
  }

  /** The camera: its eye and axes, and the matrix (column by column) from the world to the clip space. */
  camera() {
    const [right, up, backward] = axes(this.#angles)
    const eye = plus(this.#target, backward, this.#distance)
    const far = Math.hypot(...eye) + 9
    const near = Math.max(Math.hypot(...eye) - 1.05, 0.004)
    const [sx, sy] = [1 / (SLOPE * this.#aspect), 1 / SLOPE]
    const [sz, tz] = [(near + far) / (far - near), (-2 * near * far) / (far - near)]
    const away = (axis) => -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2])
    const column = (n) => [sx * right[n], sy * up[n], -sz * backward[n], -backward[n]]
    const last = [sx * away(right), sy * away(up), -sz * away(backward) + tz, -away(backward)]
    return { eye, right, up, backward, near, matrix: [...column(0), ...column(1), ...column(2), ...last] }
  }

  #frame() {
    Object.assign(this, { touched: false })
    const { target, distance } = fit(this.#points, this.#aspect, this.#start)
    this.#target = target
    this.#distance = distance
    this.#angles = [...this.#start]
    this.#turning = [0, 0]
    this.onchange()
  }

  #touch() {
    this.touched = true
    this.#auto = false
    this.#turning = [0, 0]
  }

  #rotate(across, up) {
    this.#angles = [this.#angles[0] + across, limit(this.#angles[1] + up, -89.9, 89.9)]
    this.onchange()
  }

  /** Move what is looked at, in the picture's plane. */
  #pan(right, up) {
    const [x, y] = axes(this.#angles)
    this.#target = plus(plus(this.#target, x, right * SLOPE), y, up * SLOPE)
  }

  /** A place on the canvas, from its middle, in its half height; up is positive. */
  #place({ clientX, clientY }) {
    const { left, top, width, height } = this.#canvas.getBoundingClientRect()
    return [(2 * (clientX - left) - width) / height, (height - 2 * (clientY - top)) / height]
  }

  #press(event) {
    if (!this.enabled) return
    this.#canvas.setPointerCapture(event.pointerId)
    this.#pointers.set(event.pointerId, { place: this.#place(event), time: event.timeStamp, angles: [...this.#angles] })
    this.#touch()
    this.onchange()
  }

  /** The browser takes a finger to scroll the page: as if it had not moved the model. */
  #cancel({ pointerId }) {
    const own = this.#pointers.get(pointerId)
    if (!own || !this.#pointers.delete(pointerId)) return
    this.#angles = own.angles
    this.#turning = [0, 0]
    this.onchange()
  }

  #move(event) {
    const own = this.#pointers.get(event.pointerId)
    if (!own) return
    const place = this.#place(event)
    const [dx, dy] = [place[0] - own.place[0], place[1] - own.place[1]]
    const seconds = Math.max(event.timeStamp - own.time, 1) / 1000
    const others = [...this.#pointers].filter(([id]) => id !== event.pointerId).map(([, { place: other }]) => other)
    Object.assign(own, { place, time: event.timeStamp })
    if (others.length) this.#pinch(others[0], place, [dx, dy])
    else if (event.buttons > 1 || event.ctrlKey || event.metaKey) this.#pan(-dx * this.#distance, -dy * this.#distance)
    else if (this.dragRotates) {
      const [across, up] = [(-dx * DRAG_DEGREES) / 2, (-dy * DRAG_DEGREES) / 2]
      this.#rotate(across, up)
      if (this.damping) this.#turning = [across / seconds, up / seconds].map((speed) => limit(speed, -400, 400))
    }
    this.onchange()
  }

  /** Two fingers: one stays, the other has moved by (dx, dy) to a place. */
  #pinch(other, place, [dx, dy]) {
    const apart = Math.hypot(place[0] - other[0], place[1] - other[1])
    const before = Math.hypot(place[0] - dx - other[0], place[1] - dy - other[1])
    this.#pan((-dx / 2) * this.#distance, (-dy / 2) * this.#distance)
    if (before > 0) this.zoom(apart / before, [(place[0] + other[0]) / 2, (place[1] + other[1]) / 2])
  }

  #wheel(event) {
    if (!this.enabled) return
    event.preventDefault()
    const pixels = event.deltaY * [1, 16, 400][event.deltaMode]
    // A touchpad's pinch comes as a wheel with Ctrl, in smaller steps.
    this.zoom(Math.exp(-WHEEL * limit(event.ctrlKey ? 4 * pixels : pixels, -400, 400)), this.#place(event))
  }
}

export { FIELD_OF_VIEW, radians }
