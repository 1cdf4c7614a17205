/** glTF 2.0 in one file. */

const [FLOAT, UINT] = [5126, 5125]
const [VERTICES, INDICES] = [34962, 34963]
const LINEAR = 9729
const LINEAR_MIPMAP_LINEAR = 9987
const CLAMP_TO_EDGE = 33071
const HALF = Math.SQRT1_2
const TYPES = { POSITION: 3, NORMAL: 3, TANGENT: 4, TEXCOORD_0: 2 }

/** A document that is added to, and its buffer. */
export class GlbWriter {
  #parts = []
  #length = 0
  #document = {
    asset: { version: '2.0', generator: 'upholster' },
    scene: 0,
    scenes: [{ nodes: [0] }],
    accessors: [],
    bufferViews: [],
    materials: [],
  }
  #primitives = []

  constructor(name, metres) {
    // The model's z is up, glTF's y; glTF's unit is a metre.
    const scale = metres === 1 ? {} : { scale: [metres, metres, metres] }
    Object.assign(this.#document, {
      nodes: [{ name, mesh: 0, rotation: [-HALF, 0, 0, HALF], ...scale }],
      meshes: [{ name, primitives: this.#primitives }],
    })
  }

  /** Add triangles: arrays by attribute, indices, and their material; `extras` is kept with them. */
  addTriangles(arrays, indices, material, extras) {
    const attributes = {}
    for (const [name, array] of Object.entries(arrays)) {
      const size = TYPES[name]
      const accessor = { bufferView: this.#addView(array, VERTICES), componentType: FLOAT, count: array.length / size, type: `VEC${size}` }
      if (name === 'POSITION') Object.assign(accessor, extent(array))
      attributes[name] = this.#document.accessors.push(accessor) - 1
    }
    const view = this.#addView(indices, INDICES)
    const accessor = { bufferView: view, componentType: UINT, count: indices.length, type: 'SCALAR' }
    const index = this.#document.accessors.push(accessor) - 1
    this.#primitives.push({ attributes, indices: index, material: this.#document.materials.push(material) - 1, ...(extras && { extras }) })
  }

  /** Add a PNG file's bytes; returns what a material names it by. */
  addTexture(name, bytes) {
    const document = this.#document
    document.samplers ??= [{ magFilter: LINEAR, minFilter: LINEAR_MIPMAP_LINEAR, wrapS: CLAMP_TO_EDGE, wrapT: CLAMP_TO_EDGE }]
    document.images ??= []
    document.textures ??= []
    const source = document.images.push({ name, bufferView: this.#addView(bytes), mimeType: 'image/png' }) - 1
    return { index: document.textures.push({ sampler: 0, source }) - 1 }
  }

  #addView(array, target) {
    const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength)
    const view = { buffer: 0, byteOffset: this.#length, byteLength: bytes.length, ...(target && { target }) }
    this.#parts.push(bytes)
    this.#length += bytes.length
    if (bytes.length % 4) this.#parts.push(new Uint8Array(4 - (bytes.length % 4)))
    this.#length += -bytes.length & 3
    return this.#document.bufferViews.push(view) - 1
  }

  /** The file's bytes. */
  finish() {
    const document = { ...this.#document, buffers: [{ byteLength: this.#length }] }
    const text = new TextEncoder().encode(JSON.stringify(document))
    const padded = text.length + (-text.length & 3)
    const out = new Uint8Array(12 + 8 + padded + 8 + this.#length)
    const view = new DataView(out.buffer)
    const put = (at, ...numbers) => numbers.forEach((number, n) => view.setUint32(at + 4 * n, number, true))
    put(0, 0x46546c67, 2, out.length, padded, 0x4e4f534a)
    out.fill(32, 20, 20 + padded)
    out.set(text, 20)
    put(20 + padded, this.#length, 0x004e4942)
    let at = 28 + padded
    for (const part of this.#parts) {
      out.set(part, at)
      at += part.length
    }
    return out
  }
}

function extent(positions) {
  const min = [Infinity, Infinity, Infinity]
  const max = [-Infinity, -Infinity, -Infinity]
  for (let n = 0; n < positions.length; n++) {
    min[n % 3] = Math.min(min[n % 3], positions[n])
    max[n % 3] = Math.max(max[n % 3], positions[n])
  }
  return { min, max }
}
