/** Turning, zooming and panning round a model in the unit ball; z is up. */

import { PerspectiveCamera } from 'three'
import { OrbitControls } from 'three/addons/controls/OrbitControls.js'
import { angles, axes, fit, FIELD_OF_VIEW } from './frame.js'

/** How near and far the eye comes to what it looks at, in radii of the model. */
const [NEAREST, FARTHEST] = [0.02, 25]

const UNKNOWN = new Float32Array([-1, -1, -1, 1, 1, 1])

/** A camera and what moves it. `onchange` is called when a frame is due, `onmove` when a person has moved it. */
export class Orbit {
  onchange = () => {}
  camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.1, 10)
  /** Whether somebody has moved the camera: then it is not framed again by itself. */
  touched = false
  #controls
  #points = UNKNOWN
  #view
  #aspect = 1

  /** @param {HTMLCanvasElement} canvas @param {[number, number]} view azimuth and elevation to start with, in degrees */
  constructor(canvas, view) {
    this.#view = view
    this.camera.up.set(0, 0, 1)
    this.#controls = new OrbitControls(this.camera, canvas)
    Object.assign(this.#controls, {
      dampingFactor: 0.12,
      minDistance: NEAREST,
      maxDistance: FARTHEST,
      rotateSpeed: 0.8,
      autoRotateSpeed: 1.2,
      enabled: false,
    })
    this.#controls.addEventListener('change', () => this.onchange())
    this.#controls.addEventListener('start', () => this.#touch())
    this.#frame()
  }

  /** Whether there is anything to turn. */
  set enabled(on) {
    this.#controls.enabled = on
  }

  /** Whether dragging rotates; zooming and panning are always possible. */
  set dragRotates(on) {
    this.#controls.enableRotate = on
  }

  get dragRotates() {
    return this.#controls.enableRotate
  }

  /** Whether zooming goes to the pointer, or to the middle. */
  set zoomToPointer(on) {
    this.#controls.zoomToCursor = on
  }

  /** Whether movements run out, instead of ending at once. */
  set damping(on) {
    this.#controls.enableDamping = on
  }

  set autorotate(on) {
    this.#controls.autoRotate = on
    this.onchange()
  }

  get autorotate() {
    return this.#controls.autoRotate
  }

  /** The model's vertices: what has to be in sight. Null: there is no model. */
  set points(points) {
    this.#points = points ?? UNKNOWN
    if (!this.touched) this.#frame()
  }

  /** Width / height of the picture. A view that somebody chose keeps as much in sight as before. */
  set aspect(aspect) {
    const before = this.#aspect
    if (aspect === before) return
    this.#aspect = this.camera.aspect = aspect
    if (!this.touched) return this.#frame()
    const distance = (a) => {
      const { eye, target } = fit(this.#points, a, this.view)
      return eye.distanceTo(target)
    }
    this.#stand(this.#offset.multiplyScalar(distance(aspect) / distance(before)))
  }

  /** Azimuth and elevation in degrees. Setting them frames the whole model. */
  get view() {
    return angles(this.#offset)
  }

  set view(view) {
    this.#view = view
    this.reset()
  }

  /** Back to the view set last, with the whole model in sight. */
  reset() {
    this.touched = false
    this.#frame()
    this.onchange()
  }

  /** Turn by degrees: round the model, and up. */
  turn(across, up) {
    const [azimuth, elevation] = this.view
    const backward = axes([azimuth - across, Math.min(Math.max(elevation + up, -89.9), 89.9)])[2]
    this.#touch()
    this.#stand(backward.multiplyScalar(this.#offset.length()))
  }

  /** Come nearer by a factor. */
  zoom(factor) {
    const distance = this.#offset.length() / factor
    this.#touch()
    this.#stand(this.#offset.setLength(Math.min(Math.max(distance, NEAREST), FARTHEST)))
  }

  /** Go on with movements under way, by a time in seconds. */
  update(seconds) {
    if (this.#controls.enabled) this.#controls.update(seconds)
  }

  /** Set the camera's limits of depth for a unit ball on a floor. */
  prepare() {
    const distance = this.camera.position.length()
    this.camera.near = Math.max(distance - 1.05, 0.004)
    this.camera.far = distance + 9
    this.camera.updateProjectionMatrix()
  }

  dispose() {
    this.#controls.dispose()
  }

  get #offset() {
    return this.camera.position.clone().sub(this.#controls.target)
  }

  #touch() {
    this.touched = true
    this.#controls.autoRotate = false
  }

  #frame() {
    const { eye, target } = fit(this.#points, this.#aspect, this.#view)
    this.#controls.target.copy(target)
    this.#stand(eye.sub(target))
  }

  /** Stand at an offset from the target, and forget movements under way. */
  #stand(offset) {
    const { enableDamping, autoRotate } = this.#controls
    const target = this.#controls.target.clone()
    Object.assign(this.#controls, { enableDamping: false, autoRotate: false })
    this.#controls.update()
    this.#controls.target.copy(target)
    this.camera.position.copy(target).add(offset)
    this.#controls.update()
    Object.assign(this.#controls, { enableDamping, autoRotate })
    this.onchange()
  }
}
