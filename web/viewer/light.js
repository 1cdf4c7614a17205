/**
 * The studio: lights, floor and background as in Python's pictures (upholster.render.light). Lights hang on the camera, so
 * every view is lit alike; white, they sum to about 1 where a surface faces the key light. The model lies in the unit ball.
 */

import {
  BackSide,
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  DirectionalLight,
  DoubleSide,
  Group,
  HemisphereLight,
  LinearFilter,
  LinearMipmapLinearFilter,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  PMREMGenerator,
  Scene,
  SphereGeometry,
  SRGBColorSpace,
  Vector3,
} from 'three'
import { Floor } from './floor.js'

/** Light arriving per light, for a white surface that faces it. */
const [SKY_ABOVE, SKY_BELOW, FILL, KEY] = [0.5, 0.28, 0.1, 0.5]

/** Toward the key light, in degrees in the camera's axes: to the right, and up. */
export const KEY_DIRECTION = [-35.7, 38.2]

/** Linear colours of the background, top and bottom. */
const BACKGROUNDS = {
  light: [[0.8, 0.81, 0.82], [0.92, 0.92, 0.91]],
  dark: [[0.022, 0.024, 0.027], [0.05, 0.05, 0.051]],
}

const radians = (degrees) => (degrees * Math.PI) / 180
const encoded = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055)

/**
 * What lies behind the model, for `Scene.background`.
 *
 * @param {string | null} css a colour; "none" for nothing; null for the studio's own
 * @param {boolean} dark whether the studio is dark
 */
export function backdrop(css, dark) {
  if (css === 'none') return null
  return (css && cssColor(css)) || gradient(dark)
}

/** A texture that runs from one linear colour on top to another at the bottom. */
function gradient(dark) {
  const rows = 256
  const [top, bottom] = BACKGROUNDS[dark ? 'dark' : 'light']
  const data = new Uint8Array(4 * rows)
  for (let row = 0; row < rows; row++) {
    const share = (row + 0.5) / rows
    for (let k = 0; k < 3; k++) data[4 * row + k] = Math.round(255 * encoded(bottom[k] + share * (top[k] - bottom[k])))
    data[4 * row + 3] = 255
  }
  const texture = new DataTexture(data, 1, rows)
  texture.colorSpace = SRGBColorSpace
  texture.magFilter = texture.minFilter = LinearFilter
  texture.needsUpdate = true
  return texture
}

/** The browser's own reading of a CSS colour; null where it is none, or see-through. */
function cssColor(css) {
  const context = new OffscreenCanvas(1, 1).getContext('2d')
  context.fillStyle = 'transparent'
  context.fillStyle = css
  context.fillRect(0, 0, 1, 1)
  const [red, green, blue, alpha] = context.getImageData(0, 0, 1, 1).data
  return alpha === 255 ? new Color().setRGB(red / 255, green / 255, blue / 255, SRGBColorSpace) : null
}

/** A point with the material that a model has before its maps are known. */
export function placeholderMesh() {
  const map = new DataTexture(new Uint8Array(4), 1, 1)
  map.colorSpace = SRGBColorSpace
  map.generateMipmaps = map.needsUpdate = true
  map.minFilter = LinearMipmapLinearFilter
  map.magFilter = LinearFilter
  map.anisotropy = 8 // what the card can do is asked at the first such texture, and takes its time
  const geometry = new BufferGeometry()
  for (const [name, size] of [['position', 3], ['normal', 3], ['uv', 2]]) {
    geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * size), size))
  }
  const mesh = new Mesh(geometry, new MeshStandardMaterial({ map, side: DoubleSide }))
  mesh.castShadow = mesh.receiveShadow = true
  return mesh
}

/** Key, fill and sky, and the floor that shows nothing but the key light's shadow. */
export class Studio extends Group {
  #key = new DirectionalLight(0xffffff, Math.PI * KEY)
  #fill = new DirectionalLight(0xffffff, Math.PI * FILL)
  #sky = new HemisphereLight(0xffffff, 0xffffff, Math.PI)
  #floor = new Floor()
  #environment = null

  constructor() {
    super()
    this.direction = [...KEY_DIRECTION]
    this.#sky.position.set(0, 0, 1)
    this.#sky.color.setScalar(SKY_ABOVE)
    this.#sky.groundColor.setScalar(SKY_BELOW)
    const { shadow } = this.#key
    this.#key.castShadow = true
    shadow.mapSize.set(1024, 1024)
    shadow.radius = 9
    shadow.normalBias = 0.03
    shadow.bias = -0.0005
    Object.assign(shadow.camera, { left: -1.05, right: 1.05, top: 1.05, bottom: -1.05, near: 1, far: 12 })
    this.add(this.#key, this.#key.target, this.#fill, this.#fill.target, this.#sky, this.#floor)
  }

  /** Stand on this height; null takes the floor away. */
  set floor(height) {
    this.#floor.visible = height !== null
    this.#floor.position.z = height ?? 0
    if (height === null) this.#floor.clear()
  }

  /** Let a model keep the sky from the floor; `matrix` leads from the model to the world. */
  shade(model, matrix) {
    return this.#floor.shade(model, matrix)
  }

  /** Hang the lights on a camera, which looks along its own -z. */
  follow(camera) {
    const [azimuth, elevation] = this.direction.map(radians)
    const flat = Math.cos(elevation)
    const direction = new Vector3(Math.sin(azimuth) * flat, Math.sin(elevation), Math.cos(azimuth) * flat)
    this.#key.position.copy(direction.applyQuaternion(camera.quaternion).multiplyScalar(3))
    this.#fill.position.set(0, 0, 1).applyQuaternion(camera.quaternion)
    this.#floor.lights = [KEY * Math.max(direction.z / 3, 0), SKY_ABOVE]
  }

  /**
   * Light metals, which show nothing but what they mirror: the sky light becomes a picture of a sky, with soft lamps, that
   * lights everything else alike.
   */
  surround(scene, renderer) {
    if (this.#environment) return
    const generator = new PMREMGenerator(renderer)
    const sky = new Mesh(new SphereGeometry(10, 96, 64), new MeshBasicMaterial({ vertexColors: true, side: BackSide }))
    const { position } = sky.geometry.attributes
    const colors = new Float32Array(3 * position.count)
    for (let i = 0; i < position.count; i++) {
      colors.fill(radiance(position.getX(i) / 10, position.getY(i) / 10, position.getZ(i) / 10), 3 * i, 3 * i + 3)
    }
    sky.geometry.setAttribute('color', new BufferAttribute(colors, 3))
    this.#environment = generator.fromScene(new Scene().add(sky))
    generator.dispose()
    sky.geometry.dispose()
    sky.material.dispose()
    scene.environment = this.#environment.texture
    this.#sky.intensity = 0
  }

  /** Drop what the graphics card has lost; `surround` makes it again. */
  handleContextLoss(scene) {
    this.#environment = null
    scene.environment = null
    this.#sky.intensity = Math.PI
  }

  dispose() {
    this.#key.dispose()
    this.#floor.dispose()
    this.#environment?.dispose()
  }
}

/** Brightness of the sky toward a unit vector: its mean and slope give the light of SKY_ABOVE and SKY_BELOW. */
function radiance(x, y, z) {
  const mean = (SKY_ABOVE + SKY_BELOW) / 2
  const slope = (3 / 4) * (SKY_ABOVE - SKY_BELOW)
  const lamps = Math.max(Math.cos(3 * Math.atan2(y, x)), 0) ** 4 * Math.exp(-(((z - 0.55) / 0.22) ** 2))
  const horizon = Math.exp(-((z / 0.12) ** 2))
  return Math.max(mean + slope * z + 1.1 * lamps - 0.18 * horizon - 0.05, 0)
}
