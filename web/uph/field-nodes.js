/** Chunks F and N: the warp field of every chart, its nodes coded [3, 5.3]. */

import { BitDecoder } from './bits.js'
import { IDENTITY_FIELD, WarpField } from './field.js'
import { ceilDivide, clamp } from './numbers.js'

const MAX_NODES = 2 ** 21
const SIZE_LIMIT = 192
const SHEAR_LIMIT = 56

// Kinds of fields of charts; 3 says that they differ.
const NONE = 0
const COMMON_MARGIN = 1
const DIFFER = 3

/** The warp fields of all charts, whose nodes come chart after chart: `fields`, null where they have not come. */
export class FieldDecoder {
  constructor(reader, charts) {
    const kind = reader.u8('kinds of fields', 3)
    const margin = reader.u8('margin of the fields', 64)
    const kinds = charts.map(() => (kind === DIFFER ? reader.u8('kind of a field', 2) : kind))
    let total = 0
    const shapes = charts.map((chart, n) => {
      if (kinds[n] === NONE) return null
      const shape = kinds[n] === COMMON_MARGIN ? coveringShape(chart, margin) : parseShape(reader)
      total += shape.rows * shape.columns
      return shape
    })
    if (total > MAX_NODES) reader.fail(`fields have ${total} nodes; allowed: ${MAX_NODES}`)
    reader.end('head of the fields')
    this.fields = shapes.map((shape) => (shape ? null : IDENTITY_FIELD))
    this.shapes = shapes
    /** Charts of which the field has come since somebody emptied the set. */
    this.changed = new Set()
    this.nodes = new NodeDecoder()
    this.steps = this.#decode()
    this.steps.next()
  }

  *#decode() {
    for (const [chart, shape] of this.shapes.entries()) {
      if (!shape) continue
      const nodes = yield* this.nodes.decode(shape.rows, shape.columns)
      this.fields[chart] = WarpField.fromNodes(nodes, shape.margin, shape.rows, shape.columns)
      this.changed.add(chart)
    }
  }

  /** Take further bytes of the nodes; fail(what) is called for one out of range. */
  feed(part, fail) {
    this.nodes.fail = fail
    this.nodes.bits.feed(part)
    this.steps.next()
  }
}

function coveringShape({ height, width }, margin) {
  const nodes = (texels) => 2 * margin + ceilDivide(texels, 32) + 1
  return { margin, rows: nodes(height), columns: nodes(width) }
}

function parseShape(reader) {
  return {
    margin: reader.varint('margin of a field', 64),
    rows: reader.varint('rows of nodes', 1024, 1),
    columns: reader.varint('columns of nodes', 1024, 1),
  }
}

// Where counters by guesses, by neighbours' residuals and by their sum begin, and the one of long residuals.
const GUESSED = 0
const AROUND = 3000
const SPREAD = 4800
const LONG = 6144
const LONG_MIXER = 12
const LONGEST_RUN = 20
const LONG_BITS = 10
const ANGLE = 2 // the number of a node that is an angle

const foldAngle = (x) => ((x + 128) & 255) - 128
const hint = (x) => clamp(x, -2, 2) + 2

/** Decodes nodes, each number by how far it lies from where its neighbours lead. */
class NodeDecoder {
  constructor() {
    this.bits = new BitDecoder(LONG + 1, LONG_MIXER + 1, 24030)
    this.bits.setWeights(LONG_MIXER, LONG_MIXER + 1, 72090)
    this.first = new Int16Array(4) // the first node of the chart before
    this.hints = new Int32Array(3)
    this.begin = new Int32Array(3) // of a number's counters
  }

  /** Nodes of one chart; waits where bytes are missing. */
  *decode(rows, columns) {
    const { bits, begin } = this
    const { input } = bits
    const nodes = new Int16Array(4 * rows * columns)
    const residuals = new Int16Array(nodes.length)
    Object.assign(this, { columns, nodes, residuals })
    for (let i = 0, place = 0; i < rows; i++) {
      for (let j = 0; j < columns; j++) {
        for (let k = 0; k < 4; k++, place++) {
          const guess = this.#guess(i, j, k)
          this.#enterContexts(i, j, k)
          // A generator of its own for each number would take as long as all the rest.
          let [size, sign] = [0, 1]
          for (let step = 0; step <= LONGEST_RUN; step++) {
            for (let n = 0; n < 3; n++) input[n] = begin[n] + (n < 2 ? Math.min(step, 5) : step)
            let bit
            while ((bit = bits.bit(3, 3 * k + Math.min(step, 2), 255)) < 0) yield
            if (step === 1) sign = bit ? -1 : 1
            else if (bit) size++
            else break
          }
          if (size === LONGEST_RUN) size += yield* this.#decodeLong()
          const value = guess + sign * size
          if (k !== ANGLE && Math.abs(value) > (k < ANGLE ? SIZE_LIMIT : SHEAR_LIMIT)) {
            this.fail("a field's node is out of range")
          }
          residuals[place] = sign * size
          nodes[place] = k === ANGLE ? value & 255 : value
        }
      }
    }
    this.first = nodes.slice(0, 4)
    return nodes
  }

  /** A number of a node; 0 beyond the grid. */
  #number(array, i, j, k) {
    return i < 0 || j < 0 || j >= this.columns ? 0 : array[4 * (i * this.columns + j) + k]
  }

  /** The likely value of a number; `hints` get how far three other guesses lie from it. */
  #guess(i, j, k) {
    const { nodes, columns, hints } = this
    hints.fill(0)
    if (!i && !j) return this.first[k]
    const west = this.#number(nodes, i, j - 1, k)
    const north = this.#number(nodes, i - 1, j, k)
    const northEast = this.#number(nodes, i - 1, j + 1, k)
    const guess = i && j ? west + north - this.#number(nodes, i - 1, j - 1, k) : i ? north : west
    if (j > 1) hints[0] = i ? 2 * west - this.#number(nodes, i, j - 2, k) - guess : west - this.#number(nodes, 0, j - 2, k)
    if (i > 1) hints[1] = j ? 2 * north - this.#number(nodes, i - 2, j, k) - guess : north - this.#number(nodes, i - 2, 0, k)
    if (i && j + 1 < columns) hints[2] = j ? west + northEast - north - guess : northEast - north
    return guess
  }

  /** Take note of where a number's counters begin: by hints, and by residuals round it, and of the one before. */
  #enterContexts(i, j, k) {
    const { residuals, hints, begin } = this
    if (k === ANGLE) for (let n = 0; n < 3; n++) hints[n] = foldAngle(hints[n])
    const west = this.#number(residuals, i, j - 1, k)
    const north = this.#number(residuals, i - 1, j, k)
    const northEast = this.#number(residuals, i - 1, j + 1, k)
    const before = k ? this.#number(residuals, i, j, k - 1) : 0
    const around = hint(west) * 15 + hint(north) * 3 + clamp(before, -1, 1) + 1
    const spread = Math.min(15, Math.abs(west) + Math.abs(north) + Math.abs(northEast))
    begin[0] = GUESSED + (k * 125 + hint(hints[0]) * 25 + hint(hints[1]) * 5 + hint(hints[2])) * 6
    begin[1] = AROUND + (k * 75 + around) * 6
    begin[2] = SPREAD + (k * 16 + spread) * 21
  }

  *#decodeLong() {
    let more = 0
    for (let b = 0; b < LONG_BITS; b++) {
      this.bits.input[0] = LONG
      let bit
      while ((bit = this.bits.bit(1, LONG_MIXER, 255)) < 0) yield
      more = 2 * more + bit
    }
    return more
  }
}
