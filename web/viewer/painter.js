/** Paints charts on the graphics card, from recipes and samples that the worker makes: texels need not be sent. */

import { PAINTING } from './painting.js'

const INTEGERS = [4, 4, 4, 2] // of a block, by attribute
const POINT_NUMBERS = [4, 1]

export class ChartPainter {
  #gl
  #programs
  #resources
  #made = new Map() // by recipe and sheet: what the card has of it
  #layer = { height: 0, width: 0, texture: null }
  #frame

  constructor(gl, programs, resources) {
    this.#gl = gl
    this.#programs = programs
    programs.add(PAINTING)
    this.#resources = resources
    // Switched on anew for each context, as after a loss.
    gl.getExtension('EXT_color_buffer_float') ?? gl.getExtension('EXT_color_buffer_half_float')
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
      for (const { chart, points } of source.recipe.gutters) {
        const other = charts[chart].textures[target]
        if (!other?.recipe || !(fresh.has(source) || fresh.has(other))) continue
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
    const kept = new Set(sources.flatMap(({ recipe, sheet }) => (recipe ? [recipe, sheet, ...recipe.gutters.map(({ points }) => points)] : [])))
    for (const [key, { textures = [], array, buffer }] of this.#made) {
      if (kept.has(key)) continue
      for (const texture of textures) this.#gl.deleteTexture(texture)
      if (array) this.#gl.deleteVertexArray(array)
      if (buffer) this.#gl.deleteBuffer(buffer)
      this.#made.delete(key)
    }
  }

  #paintChart({ recipe, sheet, height, width }, target, made) {
    const gl = this.#gl
    const isNormal = target === 'normal'
    const size = [height - 2, width - 2]
    const list = this.#once(recipe, () => this.#newList(recipe))
    const [sample] = this.#once(sheet, () => ({ textures: [this.#newTexture(gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, sheet)] })).textures
    const [weights, nodes] = list.textures
    const place = (uniforms, turns) => {
      gl.uniform2i(uniforms.size, ...size)
      gl.uniform1i(uniforms.margin, recipe.margin)
      gl.uniform1i(uniforms.isNormal, turns)
      this.#bind(2, nodes, uniforms.nodes)
    }
    const length = Math.max(...size)
    made.lines ??= this.#newTexture(gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, { width: length, height: 4, data: null })
    this.#growLayer(...size)
    this.#drawOn(this.#layer.texture, size[1], size[0])
    gl.clearColor(0, 0, 0, 1)
    gl.clear(gl.COLOR_BUFFER_BIT)
    const blocks = this.#programs.use('blocks')
    place(blocks, isNormal)
    gl.uniform2i(blocks.sheetSize, ...sheet.size)
    this.#bind(0, sample, blocks.sheet)
    this.#bind(1, weights, blocks.weights)
    gl.enable(gl.BLEND)
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE)
    gl.bindVertexArray(list.array)
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, list.count)
    gl.disable(gl.BLEND)
    gl.bindVertexArray(null)
    const texels = this.#programs.use('texels')
    place(texels, isNormal && !recipe.isIdentity)
    this.#bind(0, this.#layer.texture, texels.layer)
    for (const isLines of [0, 1]) {
      this.#drawOn(isLines ? made.lines : made.texture, isLines ? length : width, isLines ? 4 : height)
      gl.uniform1i(texels.isLines, isLines)
      gl.uniform1i(texels.isColor, !isLines && made.isColor)
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4)
    }
  }

  #drawGutter({ height, width }, target, made, points, lines) {
    const gl = this.#gl
    const { array } = this.#once(points, () => this.#newArray(points, POINT_NUMBERS, 0))
    this.#drawOn(made.texture, width, height)
    const uniforms = this.#programs.use('gutter')
    gl.uniform2i(uniforms.size, height, width)
    gl.uniform1i(uniforms.isColor, made.isColor)
    this.#bind(0, lines, uniforms.lines)
    gl.bindVertexArray(array)
    gl.drawArrays(gl.POINTS, 0, points.length / 5)
    gl.bindVertexArray(null)
  }

  #once(key, make) {
    if (!this.#made.has(key)) this.#made.set(key, make())
    return this.#made.get(key)
  }

  #newList({ blocks, weights, nodes, columns }) {
    const gl = this.#gl
    const rows = (data, width) => ({ data, width, height: data.length / width })
    const field = this.#newTexture(gl.RGBA32I, gl.RGBA_INTEGER, gl.INT, { data: nodes, width: columns, height: nodes.length / 4 / columns })
    const textures = [this.#newTexture(gl.R8, gl.RED, gl.UNSIGNED_BYTE, rows(weights, 4096)), field]
    return { textures, count: blocks.length / 14, ...this.#newArray(blocks, INTEGERS, 1) }
  }

  /** Vertex arrays of numbers that follow each other, so many for each attribute. */
  #newArray(data, counts, divisor) {
    const gl = this.#gl
    const array = gl.createVertexArray()
    const buffer = gl.createBuffer()
    gl.bindVertexArray(array)
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer)
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW)
    const stride = 4 * counts.reduce((sum, count) => sum + count)
    counts.reduce((offset, count, place) => {
      gl.enableVertexAttribArray(place)
      if (divisor) gl.vertexAttribIPointer(place, count, gl.INT, stride, offset)
      else gl.vertexAttribPointer(place, count, gl.FLOAT, false, stride, offset)
      gl.vertexAttribDivisor(place, divisor)
      return offset + 4 * count
    }, 0)
    gl.bindVertexArray(null)
    return { array, buffer }
  }

  #newTexture(inside, format, type, { width, height, data }) {
    const gl = this.#gl
    const texture = gl.createTexture()
    this.#bind(0, texture)
    gl.texImage2D(gl.TEXTURE_2D, 0, inside, width, height, 0, format, type, data)
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST)
    return texture
  }

  #bind(unit, texture, uniform) {
    const gl = this.#gl
    gl.activeTexture(gl.TEXTURE0 + unit)
    gl.bindTexture(gl.TEXTURE_2D, texture)
    if (uniform) gl.uniform1i(uniform, unit)
  }

  /** What charts are added up on, block after block, with more than 8 bits. */
  #growLayer(height, width) {
    const gl = this.#gl
    const layer = this.#layer
    if (layer.height >= height && layer.width >= width) return
    gl.deleteTexture(layer.texture)
    Object.assign(layer, { height: Math.max(height, layer.height), width: Math.max(width, layer.width) })
    layer.texture = this.#newTexture(gl.RGBA16F, gl.RGBA, gl.HALF_FLOAT, { ...layer, data: null })
  }

  #drawOn(texture, width, height) {
    const gl = this.#gl
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.#frame)
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0)
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE && !gl.isContextLost()) throw new Error('the card can not paint')
    gl.viewport(0, 0, width, height)
  }
}
