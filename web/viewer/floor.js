/** The floor: shows nothing but how much of the light the model keeps from it. */

import { DataTexture, LinearFilter, Mesh, PlaneGeometry, RedFormat, ShadowMaterial, Vector3 } from 'three'

/** Half a side of the floor, and of the part of it that the model keeps the sky from, in radii of the model. */
const SIDE = 8
const REACH = 2

const SKY_CELLS = 48 // along a side of the texture
const MAX_SURFELS = 1600
const MAX_TRIANGLES = 20_000

/**
 * Surfels are too coarse for what lies just above the floor: they are seen from a little below it, and count a little more. So the
 * result keeps within 0.1 of what rays find under a torus.
 */
const [BELOW, GAIN] = [0.05, 1.15]

/** Rows of cells between pauses, so that the page stays awake. */
const ROWS_AT_ONCE = 8

/** A horizontal plane, seen from above only; `key` and `sky` are how much light either gives it. */
export class Floor extends Mesh {
  #shaded = null
  #uniforms = { lights: { value: [0, 1] }, sky: { value: skyTexture() } }

  constructor() {
    super(new PlaneGeometry(2 * SIDE, 2 * SIDE), new ShadowMaterial())
    this.receiveShadow = true
    this.visible = false
    this.material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.#uniforms)
      shader.vertexShader = `varying vec2 place;\n${shader.vertexShader}`.replace(
        '#include <begin_vertex>',
        `#include <begin_vertex>\nplace = position.xy / ${(2 * REACH).toFixed(1)} + 0.5;`,
      )
      // What is blended are coded colours, not light: hence the power.
      shader.fragmentShader = `varying vec2 place;\nuniform vec2 lights;\nuniform sampler2D sky;\n${shader.fragmentShader}`.replace(
        'opacity * ( 1.0 - getShadowMask() )',
        '1.0 - pow( ( lights.x * getShadowMask() + lights.y * texture2D( sky, place ).r ) / ( lights.x + lights.y ), 1.0 / 2.2 )',
      )
    }
  }

  /** How much light the key and the sky give the floor where nothing is in the way. */
  set lights([key, sky]) {
    this.#uniforms.lights.value = [key, sky]
  }

  /** Lie below a model, and find how much of the sky every place sees past it; `matrix` leads from the model to the world. */
  async shade(model, matrix) {
    this.#shaded = model
    const data = new Uint8Array(SKY_CELLS * SKY_CELLS)
    const surfels = surfelsOf(model, matrix)
    for (let row = 0; row < SKY_CELLS; row++) {
      if (row % ROWS_AT_ONCE === 0) await new Promise((resolve) => setTimeout(resolve))
      if (this.#shaded !== model) return
      for (let column = 0; column < SKY_CELLS; column++) {
        const x = REACH * ((2 * column + 1) / SKY_CELLS - 1)
        const y = REACH * ((2 * row + 1) / SKY_CELLS - 1)
        data[SKY_CELLS * row + column] = Math.round(255 * Math.max(1 - occlusion(surfels, x, y, this.position.z), 0))
      }
    }
    this.#uniforms.sky.value.image.data.set(data)
    this.#uniforms.sky.value.needsUpdate = true
  }

  /** See all of the sky. */
  clear() {
    this.#shaded = null
    this.#uniforms.sky.value.image.data.fill(255)
    this.#uniforms.sky.value.needsUpdate = true
  }

  dispose() {
    this.#shaded = null
    this.geometry.dispose()
    this.material.dispose()
    this.#uniforms.sky.value.dispose()
  }
}

function skyTexture() {
  const texture = new DataTexture(new Uint8Array(SKY_CELLS * SKY_CELLS).fill(255), SKY_CELLS, SKY_CELLS, RedFormat)
  texture.magFilter = texture.minFilter = LinearFilter
  texture.needsUpdate = true
  return texture
}

/** What of a model looks down, in groups of triangles: middle, and normal as long as the area; six numbers each. */
function surfelsOf(model, matrix) {
  const pieces = model.children.filter(({ isMesh, geometry }) => isMesh && geometry.index)
  const total = pieces.reduce((sum, { geometry }) => sum + geometry.index.count / 3, 0)
  const step = Math.max(1, Math.ceil(total / MAX_TRIANGLES)) // one of so many stands for all
  const group = Math.max(1, Math.ceil(total / step / MAX_SURFELS))
  const surfels = []
  const corners = [new Vector3(), new Vector3(), new Vector3()]
  for (const { geometry: { index, attributes } } of pieces) {
    const middle = new Vector3()
    const normal = new Vector3()
    let [area, count] = [0, 0]
    for (let k = 0; k < index.count; k += 3 * step) {
      corners.forEach((corner, i) => corner.fromBufferAttribute(attributes.position, index.getX(k + i)).applyMatrix4(matrix))
      const [a, b, c] = corners
      const center = a.clone().add(b).add(c)
      const cross = b.sub(a).cross(c.sub(a)).multiplyScalar(step / 2)
      if (cross.z < 0) {
        const own = cross.length()
        middle.addScaledVector(center, own / 3)
        normal.add(cross)
        area += own
      }
      count++
      if (count < group && k + 3 * step < index.count) continue
      if (area) surfels.push(...middle.divideScalar(area).toArray(), ...normal.toArray())
      middle.set(0, 0, 0)
      normal.set(0, 0, 0)
      area = count = 0
    }
  }
  return surfels
}

/** The share of the sky's light that surfels keep from a place on the floor: their form factors, as of discs. */
function occlusion(surfels, x, y, z) {
  let sum = 0
  for (let i = 0; i < surfels.length; i += 6) {
    const [dx, dy, dz] = [surfels[i] - x, surfels[i + 1] - y, surfels[i + 2] - z + BELOW]
    const square = dx * dx + dy * dy + dz * dz
    const facing = -(dx * surfels[i + 3] + dy * surfels[i + 4] + dz * surfels[i + 5])
    if (facing <= 0 || square > REACH * REACH) continue
    const area = Math.hypot(surfels[i + 3], surfels[i + 4], surfels[i + 5])
    sum += (facing * Math.max(dz, 0)) / (square * (Math.PI * square + area))
  }
  return GAIN * sum
}
