/** Paints charts on the graphics card, from recipes and samples that the worker makes: texels need not be sent. */

import { ROLES } from '../uph/roles.js'
import { PAINTING } from './painting.js'

export class GpuPainter {
  #gl
  #programs
  #resources
  #made = new Map() // by recipe and sheet: what the card has of it
  #frame
  #tones = [] // per sheet of the target: textures of cells' tones

  constructor(gl, programs, resources) {
    this.#gl = gl
    this.#programs = programs
    programs.add(PAINTING)
    this.#resources = resources
    this.#frame = gl.createFramebuffer()
  }

  /** Whether its programs are there; they are begun. */
  ready() {
    return this.#programs.ready(...Object.keys(PAINTING))
  }

  /** Paint what has changed of a model. @throws {Error} if the card can not */
  paint({ charts }) {
    const fresh = new Set()
    const all = charts.flatMap(({ textures }) => Object.entries(textures).filter(([, source]) => source.recipe))
    for (const [target, source] of all) {
      const made = this.#resources.target(source, target)
      if (!made) continue
      this.#paintChart(source, target, made)
      fresh.add(source)
    }
    if (!fresh.size) return false
    for (const [target, source] of all) {
      const made = this.#resources.known(source)
      let isTouched = fresh.has(source)
      for (const { chart, points, height, width } of source.recipe.gutters) {
        const other = charts[chart].textures[target]
        // Charts that get other sizes are painted one after another.
        const isKnown = other?.recipe && other.height === height + 2 && other.width === width + 2
        if (!isKnown || !(fresh.has(source) || fresh.has(other))) continue
        this.#drawGutter(source, target, made, points, this.#resources.known(other).lines)
        isTouched = true
      }
      if (isTouched) this.#resources.finish(made)
    }
    return true
  }

  /** Free what no model is painted from any more. */
  sweep(models) {
    const sources = models.flatMap(({ charts }) => charts.flatMap(({ textures }) => Object.values(textures)))
    const kept = new Set(sources.flatMap(({ recipe, sheets }) => (recipe ? [recipe, ...Object.values(sheets), ...recipe.gutters.map(({ points }) => points)] : [])))
    for (const [key, { texture, array, buffer }] of this.#made) {
      if (kept.has(key)) continue
      if (texture) this.#gl.deleteTexture(texture)
      if (array) this.#gl.deleteVertexArray(array)
      if (buffer) this.#gl.deleteBuffer(buffer)
      this.#made.delete(key)
    }
  }

  #paintChart({ recipe, sheets, height, width }, target, made) {
    const gl = this.#gl
    const length = Math.max(height, width) - 2
    if (made.length !== length) {
      gl.deleteTexture(made.lines)
      made.lines = this.#newTexture(gl.TEXTURE_2D)
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, length, 4, 0, gl.RGBA, gl.UNSIGNED_BYTE, null)
      made.length = length
    }
    const { texture } = this.#once(recipe, () => this.#newNumbers(recipe.numbers))
    gl.disable(gl.BLEND)
    const tones = Object.values(sheets).map((sheet, n) => this.#tonesOf(recipe, texture, sheet, target, n))
    const uniforms = this.#programs.use('chart')
    gl.uniform2i(uniforms.size, height - 2, width - 2)
    gl.uniform1i(uniforms.isNormal, target === 'normal')
    this.#bind(0, gl.TEXTURE_2D, texture, uniforms.numbers)
    for (const isLines of [0, 1]) {
      this.#drawOn(isLines ? made.lines : made.texture, isLines ? length : width, isLines ? 4 : height)
      gl.uniform1i(uniforms.isLines, isLines)
      gl.uniform1i(uniforms.isColor, !isLines && made.isColor)
      gl.clearColor(1, 1, 1, 1)
      gl.clear(gl.COLOR_BUFFER_BIT)
      for (const [n, [role, sheet]] of Object.entries(sheets).entries()) {
        this.#useSheet(sheet, uniforms)
        this.#bind(2, gl.TEXTURE_2D, tones[n], uniforms.tones)
        gl.uniform1i(uniforms.isSharp, Boolean(ROLES[role].isSharp))
        gl.colorMask(...[0, 1, 2].map((k) => (ROLES[role].channel ?? k) === k), true)
        gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4)
      }
      gl.colorMask(true, true, true, true)
    }
  }

  /** A texture of the tones of a chart's cells, for its n-th sheet; it stays as it is until another chart's are asked for. */
  #tonesOf({ numbers }, texture, sheet, target, n) {
    const gl = this.#gl
    const [rows, columns] = [numbers[8], numbers[8] && numbers[11]]
    const made = (this.#tones[n] ??= { texture: this.#newTexture(gl.TEXTURE_2D), size: '' })
    const size = [Math.max(columns, 1), Math.max(rows, 1)]
    if (made.size !== `${size}`) {
      this.#bind(0, gl.TEXTURE_2D, made.texture)
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32I, ...size, 0, gl.RGBA_INTEGER, gl.INT, null)
      made.size = `${size}`
    }
    if (!rows) return made.texture
    const uniforms = this.#programs.use('tones')
    this.#drawOn(made.texture, ...size)
    gl.uniform2i(uniforms.cells, rows, columns)
    gl.uniform1i(uniforms.isNormal, target === 'normal')
    this.#bind(0, gl.TEXTURE_2D, texture, uniforms.numbers)
    this.#useSheet(sheet, uniforms)
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4)
    return made.texture
  }

  #useSheet(sheet, uniforms) {
    const gl = this.#gl
    this.#bind(1, gl.TEXTURE_2D_ARRAY, this.#once(sheet, () => this.#newSheet(sheet)).texture, uniforms.sheet)
    gl.uniform2i(uniforms.sheetSize, ...sheet.size)
    gl.uniform1i(uniforms.isWide, sheet.data instanceof Uint16Array)
  }

  #drawGutter({ height, width }, target, made, points, lines) {
    const gl = this.#gl
    const { array } = this.#once(points, () => this.#newArray(points))
    this.#drawOn(made.texture, width, height)
    const uniforms = this.#programs.use('gutter')
    gl.uniform2i(uniforms.size, height, width)
    gl.uniform1i(uniforms.isColor, made.isColor)
    this.#bind(0, gl.TEXTURE_2D, lines, uniforms.lines)
    gl.bindVertexArray(array)
    gl.drawArrays(gl.POINTS, 0, points.length / 6)
    gl.bindVertexArray(null)
  }

  #once(key, make) {
    if (!this.#made.has(key)) this.#made.set(key, make())
    return this.#made.get(key)
  }

  /** A chart's numbers, in rows of 4096. */
  #newNumbers(numbers) {
    const gl = this.#gl
    const texture = this.#newTexture(gl.TEXTURE_2D)
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R32I, 4096, numbers.length / 4096, 0, gl.RED_INTEGER, gl.INT, numbers)
    return { texture }
  }

  #newSheet({ data, width, height, count }) {
    const gl = this.#gl
    const texture = this.#newTexture(gl.TEXTURE_2D_ARRAY)
    const [inside, type] = data instanceof Uint16Array ? [gl.RGBA16UI, gl.UNSIGNED_SHORT] : [gl.RGBA8UI, gl.UNSIGNED_BYTE]
    gl.texImage3D(gl.TEXTURE_2D_ARRAY, 0, inside, width, height, count, 0, gl.RGBA_INTEGER, type, data)
    return { texture }
  }

  /** Points of a gutter: of each four numbers, and an angle's sine and cosine. */
  #newArray(points) {
    const gl = this.#gl
    const array = gl.createVertexArray()
    const buffer = gl.createBuffer()
    gl.bindVertexArray(array)
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer)
    gl.bufferData(gl.ARRAY_BUFFER, points, gl.STATIC_DRAW)
    for (const [place, count] of [4, 2].entries()) {
      gl.enableVertexAttribArray(place)
      gl.vertexAttribPointer(place, count, gl.FLOAT, false, 24, 16 * place)
    }
    gl.bindVertexArray(null)
    return { array, buffer }
  }

  /** A new texture, bound. */
  #newTexture(kind) {
    const gl = this.#gl
    const texture = gl.createTexture()
    this.#bind(0, kind, texture)
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(kind, filter, gl.NEAREST)
    return texture
  }

  #bind(unit, kind, texture, uniform) {
    const gl = this.#gl
    gl.activeTexture(gl.TEXTURE0 + unit)
    gl.bindTexture(kind, texture)
    if (uniform) gl.uniform1i(uniform, unit)
  }

  #drawOn(texture, width, height) {
    const gl = this.#gl
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame)
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0)
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE && !gl.isContextLost()) throw new Error('the card can not paint')
    gl.viewport(0, 0, width, height)
  }
}
