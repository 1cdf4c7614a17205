/** Programs of the graphics card, compiled ahead of time if it can compile them in the background. */

import { SOURCES, UNITS } from './shading.js'

const ATTRIBUTES = ['position', 'normal', 'tangent', 'parameter']

export class Programs {
  #gl
  #parallel
  #made = new Map()
  #sources = { ...SOURCES }

  constructor(gl) {
    this.#gl = gl
    this.#parallel = gl.getExtension('KHR_parallel_shader_compile')
  }

  /** Have more programs: vertex and fragment shader, by name. */
  add(sources) {
    Object.assign(this.#sources, sources)
  }

  /** Whether programs can be used without waiting for them; those that are new are begun. */
  ready(...names) {
    for (const name of names) if (!this.#made.has(name)) this.#made.set(name, this.#begin(name))
    if (!this.#parallel) return true
    return names.every((name) => this.#gl.getProgramParameter(this.#made.get(name).program, this.#parallel.COMPLETION_STATUS_KHR))
  }

  /** Use a program; returns places of its uniforms by name. */
  use(name) {
    this.ready(name)
    const made = this.#made.get(name)
    this.#gl.useProgram(made.program)
    made.uniforms ??= this.#uniforms(made.program)
    return made.uniforms
  }

  #begin(name) {
    const gl = this.#gl
    const program = gl.createProgram()
    this.#sources[name]().forEach((source, n) => {
      const shader = gl.createShader(n ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER)
      gl.shaderSource(shader, source)
      gl.compileShader(shader)
      gl.attachShader(program, shader)
    })
    ATTRIBUTES.forEach((attribute, n) => gl.bindAttribLocation(program, n, attribute))
    gl.linkProgram(program)
    return { program }
  }

  #uniforms(program) {
    const gl = this.#gl
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(program))
    const uniforms = {}
    for (let n = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; n >= 0; n--) {
      const { name } = gl.getActiveUniform(program, n)
      uniforms[name.replace('[0]', '')] = gl.getUniformLocation(program, name)
    }
    UNITS.forEach((unit, n) => uniforms[`${unit}Map`] && gl.uniform1i(uniforms[`${unit}Map`], n))
    if (uniforms.sky) gl.uniform1i(uniforms.sky, UNITS.length)
    return uniforms
  }
}
