/** Chunks F and N: the warp field of every chart, its nodes coded from coarse to fine [3, 5.3]. */

import { BitDecoder } from './bits.js'
import { IDENTITY_FIELD, WarpField } from './field.js'
import { INTEGER_COUNTERS, decodeInteger } from './integers.js'
import { ceilDivide } from './numbers.js'

const MAX_NODES = 2 ** 21
const SIZE_LIMIT = 192
const SHEAR_LIMIT = 56

// Kinds of fields of charts; 3 says that they differ.
const NONE = 0
const COMMON_MARGIN = 1
const DIFFER = 3

const STRIDES = [4, 2, 1]
const ANGLE = 2 // the number of a node that is an angle

/** The warp fields of all charts. Nodes that have not come are what they are guessed to be. */
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
    /** Of each chart its grid of nodes; null where the field is the identity. */
    this.grids = shapes.map((shape, chart) => shape && { ...shape, chart, nodes: new Int16Array(4 * shape.rows * shape.columns), isBegun: false })
    /** How many nodes have come. */
    this.known = 0
    /** Charts of which the field has changed since somebody emptied the set. */
    this.changed = new Set()
    this.bits = new BitDecoder(4 * INTEGER_COUNTERS)
    this.steps = this.#decode()
    this.steps.next()
    this.kept = [] // fields as they were when `known` was `keptAt`
    this.keptAt = -1
  }

  /** A chart's field as far as it is known. */
  field(chart) {
    const grid = this.grids[chart]
    if (!grid) return IDENTITY_FIELD
    if (this.keptAt < this.known) {
      this.#guessOn()
      this.kept = []
      this.keptAt = this.known
    }
    return (this.kept[chart] ??= WarpField.fromNodes(grid.nodes, grid.margin, grid.rows, grid.columns))
  }

  /** Take further bytes of the nodes; fail(what) is called for one out of range. */
  feed(part, fail) {
    this.fail = fail
    this.bits.feed(part)
    this.steps.next()
    // Guesses of charts without nodes follow the chart before.
    if (this.changed.size) for (const grid of this.grids) if (grid && !grid.isBegun) this.changed.add(grid.chart)
  }

  /** All nodes in the order in which they come: grid, that of the chart before, and what `placesOf` gives. */
  *#nodes() {
    const grids = this.grids.filter(Boolean)
    for (const stride of STRIDES) {
      for (const [n, grid] of grids.entries()) {
        for (const [i, j, before, after] of placesOf(grid, stride)) yield [grid, n ? grids[n - 1] : null, i, j, before, after]
      }
    }
  }

  *#decode() {
    let left = [0, 0, 0, 0] // what the guesses of the node before left over
    for (const [grid, chartBefore, i, j, before, after] of this.#nodes()) {
      const rest = [0, 0, 0, 0]
      const numbers = guessed(grid, chartBefore, before, after)
      for (let k = 0; k < 4; k++) {
        const context = 2 * Math.min(3, Math.abs(left[k])) + (k && rest[k - 1] ? 1 : 0)
        rest[k] = yield* decodeInteger(this.bits, k, context)
        const value = numbers[k] + rest[k]
        if (k !== ANGLE && Math.abs(value) > (k < ANGLE ? SIZE_LIMIT : SHEAR_LIMIT)) this.fail("a field's node is out of range")
        numbers[k] = k === ANGLE ? value & 255 : value
      }
      grid.nodes.set(numbers, 4 * (i * grid.columns + j))
      left = rest
      this.known++
      grid.isBegun = true
      this.changed.add(grid.chart)
    }
  }

  /** Give the nodes that have not come what they are guessed to be. */
  #guessOn() {
    let number = 0
    for (const [grid, chartBefore, i, j, before, after] of this.#nodes()) {
      if (number++ < this.known) continue
      grid.nodes.set(guessed(grid, chartBefore, before, after), 4 * (i * grid.columns + j))
    }
  }
}

/** The nodes of a grid that come with a stride: [row, column, place of the node it is guessed from, and of a second one]; −1: none. */
function* placesOf({ rows, columns }, stride) {
  const at = (i, j) => (i < rows && j < columns ? i * columns + j : -1)
  if (stride === STRIDES[0]) {
    for (let i = 0; i < rows; i += stride) {
      for (let j = 0; j < columns; j += stride) yield [i, j, j ? at(i, j - stride) : i ? at(i - stride, 0) : -1, -1]
    }
    return
  }
  for (let i = stride; i < rows; i += 2 * stride) {
    for (let j = 0; j < columns; j += 2 * stride) yield [i, j, at(i - stride, j), at(i + stride, j)]
  }
  for (let i = 0; i < rows; i += stride) {
    for (let j = stride; j < columns; j += 2 * stride) yield [i, j, at(i, j - stride), at(i, j + stride)]
  }
}

/** What a node is guessed to be: as one node, halfway between two, or, without any, as the first node of the chart before. */
function guessed({ nodes }, chartBefore, before, after) {
  if (before < 0) return chartBefore ? [...chartBefore.nodes.subarray(0, 4)] : [0, 0, 0, 0]
  const numbers = [...nodes.subarray(4 * before, 4 * before + 4)]
  if (after < 0) return numbers
  return numbers.map((number, k) => {
    const change = nodes[4 * after + k] - number
    const middle = number + (((k === ANGLE ? foldAngle(change) : change) + 1) >> 1)
    return k === ANGLE ? middle & 255 : middle
  })
}

const foldAngle = (x) => ((x + 128) & 255) - 128

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
