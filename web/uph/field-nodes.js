/** Chunks F and N: the warp field of every chart, its nodes coded [3, 5.7]. */

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
  }

  /** Take the order in which the charts' nodes come. */
  begin(order) {
    this.nodes = new NodeDecoder()
    this.steps = this.#decode(order)
    this.steps.next()
  }

  *#decode(order) {
    for (const chart of order) {
      const shape = this.shapes[chart]
      if (!shape) continue
      const nodes = yield* this.nodes.decode(shape.rows, shape.columns)
      this.fields[chart] = WarpField.fromNodes(nodes, shape.margin, shape.rows, shape.columns)
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
  }

  /** Nodes of one chart; waits where bytes are missing. */
  *decode(rows, columns) {
    const nodes = new Int16Array(4 * rows * columns)
    Object.assign(this, { columns, nodes, residuals: new Int16Array(nodes.length) })
    for (let i = 0; i < rows; i++) {
      for (let j = 0; j < columns; j++) for (let k = 0; k < 4; k++) yield* this.#decodeNumber(i, j, k)
    }
    this.first = nodes.slice(0, 4)
    return nodes
  }

  *#decodeNumber(i, j, k) {
    const { nodes, residuals } = this
    const [guess, ...hints] = this.#guess(i, j, k)
    const [x, y, z] = k === ANGLE ? hints.map(foldAngle) : hints
    const residual = yield* this.#decodeResidual(k, hint(x) * 25 + hint(y) * 5 + hint(z), ...this.#context(i, j, k))
    const place = 4 * (i * this.columns + j) + k
    const value = guess + residual
    if (k !== ANGLE && Math.abs(value) > (k < ANGLE ? SIZE_LIMIT : SHEAR_LIMIT)) {
      this.fail("a field's node is out of range")
    }
    residuals[place] = residual
    nodes[place] = k === ANGLE ? value & 255 : value
  }

  /** A number of a node; 0 beyond the grid. */
  #number(array, i, j, k) {
    return i < 0 || j < 0 || j >= this.columns ? 0 : array[4 * (i * this.columns + j) + k]
  }

  /** The likely value of a number, and how far three other guesses lie from it. */
  #guess(i, j, k) {
    const { nodes, columns } = this
    const west = this.#number(nodes, i, j - 1, k)
    const north = this.#number(nodes, i - 1, j, k)
    const northEast = this.#number(nodes, i - 1, j + 1, k)
    if (i && j) {
      const guess = west + north - this.#number(nodes, i - 1, j - 1, k)
      const x = j > 1 ? 2 * west - this.#number(nodes, i, j - 2, k) - guess : 0
      const y = i > 1 ? 2 * north - this.#number(nodes, i - 2, j, k) - guess : 0
      return [guess, x, y, j + 1 < columns ? west + northEast - north - guess : 0]
    }
    if (j) return [west, j > 1 ? west - this.#number(nodes, 0, j - 2, k) : 0, 0, 0]
    if (i) {
      const y = i > 1 ? north - this.#number(nodes, i - 2, 0, k) : 0
      return [north, 0, y, columns > 1 ? northEast - north : 0]
    }
    return [this.first[k], 0, 0, 0]
  }

  /** What residuals round a number, and of the one before, say of its own: two contexts. */
  #context(i, j, k) {
    const { residuals } = this
    const west = this.#number(residuals, i, j - 1, k)
    const north = this.#number(residuals, i - 1, j, k)
    const northEast = this.#number(residuals, i - 1, j + 1, k)
    const before = k ? this.#number(residuals, i, j, k - 1) : 0
    const around = hint(west) * 15 + hint(north) * 3 + clamp(before, -1, 1) + 1
    return [around, Math.min(15, Math.abs(west) + Math.abs(north) + Math.abs(northEast))]
  }

  *#decodeResidual(k, guesses, around, spread) {
    const { input } = this.bits
    let [size, sign] = [0, 1]
    for (let step = 0; step <= LONGEST_RUN; step++) {
      const near = Math.min(step, 5)
      input[0] = GUESSED + (k * 125 + guesses) * 6 + near
      input[1] = AROUND + (k * 75 + around) * 6 + near
      input[2] = SPREAD + (k * 16 + spread) * 21 + step
      let bit
      while ((bit = this.bits.bit(3, 3 * k + Math.min(step, 2), 255)) < 0) yield
      if (step === 1) sign = bit ? -1 : 1
      else if (bit) size++
      else break
    }
    if (size === LONGEST_RUN) {
      input[0] = LONG
      let more = 0
      for (let b = 0; b < LONG_BITS; b++) {
        let bit
        while ((bit = this.bits.bit(1, LONG_MIXER, 255)) < 0) yield
        more = 2 * more + bit
      }
      size += more
    }
    return sign * size
  }
}
