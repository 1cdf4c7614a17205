/** What models have on the graphics card: made when first drawn, made again when their data has changed or the card has lost it. */

import { isColorTarget } from '../uph/roles.js'
import { UNITS } from './shading.js'

const ANISOTROPY = 8
const MOST_UPLOAD = 8 // milliseconds of a frame

/** Attributes in the order of their places, and how many numbers each has. */
const ATTRIBUTES = [['positions', 3], ['normals', 3], ['tangents', 4], ['parameters', 2]]

export class Resources {
  #gl
  #geometries = new Map()
  #textures = new Map()
  #owners = new Map() // for each model, the geometries and textures that it was drawn with last
  #anisotropic
  #blank

  constructor(gl) {
    this.#gl = gl
    this.#anisotropic = gl.getExtension('EXT_texture_filter_anisotropic')
    this.#blank = this.color([1, 1, 1])
  }

  /** Take over what has changed of models, as much as a frame may take; returns whether that was all. */
  upload(models) {
    const until = performance.now() + MOST_UPLOAD
    for (const { charts, geometries } of models) {
      for (const geometry of geometries) {
        if (this.#geometries.has(geometry)) continue
        if (performance.now() > until) return false
        this.bind(geometry)
      }
      for (const { textures } of charts) {
        for (const [n, unit] of UNITS.entries()) {
          if (!textures[unit]?.data || this.known(textures[unit]).version === textures[unit].version) continue
          if (performance.now() > until) return false
          this.texture(n, textures[unit])
        }
      }
    }
    return true
  }

  /** Bind a geometry's vertex arrays, or of what `part` makes of it, see `lines.js`. Returns how many numbers to draw. */
  bind(geometry, part = null) {
    let made = this.#geometries.get(geometry)
    if (!made) this.#geometries.set(geometry, (made = { arrays: new Map(), buffers: [] }))
    if (!made.arrays.has(part)) made.arrays.set(part, this.#arrays(part ? part(geometry) : geometry, made.buffers))
    const { array, count } = made.arrays.get(part)
    this.#gl.bindVertexArray(array)
    return count
  }

  /** Bind a texture to a unit. A chart's texture and the exemplar are taken over when they have changed. */
  texture(unit, source) {
    if (!source) return this.#bind({ texture: this.#blank }, unit)
    const made = this.known(source)
    this.#bind(made, unit)
    if (source.data && made.version !== source.version) this.#upload(made, source, UNITS[unit])
  }

  /** What there is of a texture so far. */
  known({ key }) {
    if (!this.#textures.has(key)) this.#textures.set(key, { texture: this.#gl.createTexture(), version: 0, width: 0, height: 0, lines: null })
    return this.#textures.get(key)
  }

  /** A texture that is to be painted on, with room for it; null if it has been. */
  target(source, unit) {
    const made = this.known(source)
    if (made.version === source.version) return null
    this.#bind(made)
    this.#makeRoom(made, source, unit)
    made.version = source.version
    return made
  }

  /** It has been painted on. */
  finish(made) {
    this.#bind(made)
    this.#gl.generateMipmap(this.#gl.TEXTURE_2D)
  }

  #bind({ texture }, unit = 0) {
    this.#gl.activeTexture(this.#gl.TEXTURE0 + unit)
    this.#gl.bindTexture(this.#gl.TEXTURE_2D, texture)
  }

  /** A texture of one linear colour. */
  color(rgb) {
    const gl = this.#gl
    const texture = gl.createTexture()
    gl.bindTexture(gl.TEXTURE_2D, texture)
    const pixel = new Uint8Array([...rgb.map((x) => Math.round(255 * x)), 255])
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixel)
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR)
    return texture
  }

  /** Free what models no longer have; `models` are those that there are. */
  sweep(models) {
    const kept = new Set(models.flatMap((model) => keysOf(model)))
    for (const [key, made] of this.#textures) {
      if (kept.has(key)) continue
      this.#gl.deleteTexture(made.texture)
      this.#gl.deleteTexture(made.lines)
      this.#textures.delete(key)
    }
    for (const [key, { arrays, buffers }] of this.#geometries) {
      if (kept.has(key)) continue
      for (const { array } of arrays.values()) this.#gl.deleteVertexArray(array)
      for (const buffer of buffers) this.#gl.deleteBuffer(buffer)
      this.#geometries.delete(key)
    }
  }

  #arrays(geometry, buffers) {
    const gl = this.#gl
    const array = gl.createVertexArray()
    gl.bindVertexArray(array)
    const fill = (target, data) => {
      const buffer = gl.createBuffer()
      buffers.push(buffer)
      gl.bindBuffer(target, buffer)
      gl.bufferData(target, data, gl.STATIC_DRAW)
    }
    const attribute = (place, data, size) => {
      fill(gl.ARRAY_BUFFER, data)
      gl.enableVertexAttribArray(place)
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0)
    }
    ATTRIBUTES.forEach(([name, size], place) => geometry[name] && attribute(place, geometry[name], size))
    fill(gl.ELEMENT_ARRAY_BUFFER, Uint32Array.from(geometry.indices))
    return { array, count: geometry.indices.length }
  }

  #upload(made, source, unit) {
    const gl = this.#gl
    this.#makeRoom(made, source, unit)
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, made.width, made.height, gl.RGBA, gl.UNSIGNED_BYTE, source.data)
    gl.generateMipmap(gl.TEXTURE_2D)
    made.version = source.version
  }

  #makeRoom(made, { width, height }, unit) {
    if (made.width === width && made.height === height) return
    const gl = this.#gl
    const isColor = isColorTarget(unit)
    gl.texImage2D(gl.TEXTURE_2D, 0, isColor ? gl.SRGB8_ALPHA8 : gl.RGBA8, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, null)
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE)
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR)
    const way = this.#anisotropic
    if (way) gl.texParameterf(gl.TEXTURE_2D, way.TEXTURE_MAX_ANISOTROPY_EXT, ANISOTROPY)
    Object.assign(made, { width, height, isColor })
  }
}

/** By what a model's textures and geometries are known. */
function keysOf({ charts, geometries, overlays = [] }) {
  const textures = charts.flatMap((chart) => Object.values(chart.textures).map((texture) => texture.key))
  return [...geometries, ...overlays.map(({ geometry }) => geometry), ...textures]
}
