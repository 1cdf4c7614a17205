/** Triangles of a mesh and where their vertices lie: a front runs over the mesh [5.4]. */

import { PLAIN, START_VERTEX, VERTEX, nextCorner } from './mesh-numbers.js'

const [NEW, CLOSES_BEFORE, CLOSES_AFTER, BORDER, KNOWN] = [0, 1, 2, 3, 4]
const OPEN = -1 // in place of a twin: an edge of the front; less: a border

/** Decodes `vertices`, `twins` and `positions` of `mesh`. An edge is named by the corner of a known triangle that begins it. */
export class FrontDecoder {
  constructor(numbers, mesh) {
    Object.assign(this, mesh, { numbers, triangles: 0, vertexNumber: 0, stack: [] })
    this.before = new Int32Array(this.vertices.length)
    this.after = new Int32Array(this.vertices.length)
    this.leaving = new Int32Array(this.vertexCount).fill(-1)
    this.degrees = new Uint8Array(this.vertexCount)
    this.left = new Int32Array(3 * this.vertexCount)
  }

  decode() {
    while (this.triangles < this.triangleCount) {
      const gate = this.#nextGate()
      if (gate < 0) this.#start()
      else this.#pass(gate)
    }
    if (this.vertexNumber < this.vertexCount) this.numbers.wrong()
  }

  #nextGate() {
    while (this.stack.length) {
      const edge = this.stack.pop()
      if (this.twins[edge] === OPEN) return edge
    }
    return -1
  }

  /** Whether one triangle can close the gate and the edge `adjacent` to it; `beyond` is the edge on the other side of that. */
  #canClose(gate, adjacent, beyond) {
    return this.twins[adjacent] === OPEN && adjacent !== gate && beyond !== gate
  }

  /** A new vertex; `adjacent`: the two vertices of its triangle, and the vertex across their edge. */
  #newVertex(adjacent) {
    const { numbers, positions: p, left, limit } = this
    if (this.vertexNumber === this.vertexCount) numbers.wrong()
    const at = 3 * this.vertexNumber
    for (let k = 0; k < 3; k++) {
      if (adjacent) {
        const [a, b, c] = adjacent.map((vertex) => 3 * vertex + k)
        const guess = p[a] + p[b] - p[c]
        p[at + k] = numbers.leftover(0, Math.abs(left[a]) + Math.abs(left[b]), guess, 0, limit)
        left[at + k] = p[at + k] - guess
      } else p[at + k] = numbers.within(PLAIN, at ? p[at + k - 3] : 0, 0, limit)
    }
    return this.vertexNumber++
  }

  #knownVertex() {
    return this.numbers.within(VERTEX, this.vertexNumber - 1, 0, this.vertexNumber - 1)
  }

  #enter(corners) {
    const first = 3 * this.triangles++
    corners.forEach((vertex, k) => {
      this.vertices[first + k] = vertex
      this.degrees[vertex] = Math.min(7, this.degrees[vertex] + 1)
    })
    return first
  }

  /** An edge of a new triangle comes to the front. */
  #add(edge) {
    this.leaving[this.vertices[nextCorner(edge)]] = edge
    this.stack.push(edge)
  }

  #link(before, after) {
    this.after[before] = after
    this.before[after] = before
  }

  #glue(edge, other) {
    this.twins[edge] = other
    this.twins[other] = edge
  }

  #start() {
    const corner = () => (this.numbers.flag(START_VERTEX) ? this.#newVertex() : this.#knownVertex())
    const first = this.#enter([corner(), corner(), corner()])
    for (let k = 2; k >= 0; k--) {
      this.#add(first + k)
      this.#link(nextCorner(first + k), first + k)
    }
  }

  #pass(gate) {
    const { vertices, before, after, numbers } = this
    const [tail, head] = [vertices[nextCorner(gate)], vertices[gate]]
    const place = 8 * this.degrees[tail]
    let operation = 0
    while (operation < KNOWN && numbers.flag(place + operation)) operation++
    if (operation === BORDER) {
      this.twins[gate] = OPEN - 1
      return
    }
    const [p, q] = [before[gate], after[gate]]
    const ends = [vertices[nextCorner(p)], vertices[q]]
    const can = [this.#canClose(gate, p, before[p]), this.#canClose(gate, q, after[q])]
    let vertex
    let jump = -1
    if (operation === NEW) vertex = this.#newVertex([tail, head, vertices[nextCorner(nextCorner(gate))]])
    else if (operation === KNOWN) {
      vertex = this.#knownVertex()
      jump = this.leaving[vertex]
      if (jump >= 0 && (this.twins[jump] >= 0 || jump === gate)) jump = -1
    } else {
      if (!can[operation - CLOSES_BEFORE]) numbers.wrong()
      vertex = ends[operation - CLOSES_BEFORE]
    }
    const first = this.#enter([tail, head, vertex])
    const closes = operation === CLOSES_BEFORE || operation === CLOSES_AFTER
    this.#glue(gate, first)
    this.#advance(first, [p, q], can.map((able, k) => closes && able && ends[k] === vertex), jump)
  }

  /** Put the edges beyond a new triangle in the place of those that it closes. */
  #advance(first, [left, right], [closesBefore, closesAfter], jump) {
    if (closesAfter) {
      this.#glue(right, first + 1)
      right = this.after[right]
    } else {
      this.#add(first + 1)
      this.#link(first + 1, right)
      right = first + 1
    }
    if (closesBefore) {
      this.#glue(left, first + 2)
      left = this.before[left]
    } else {
      this.#add(first + 2)
      this.#link(left, first + 2)
      left = first + 2
    }
    if (jump >= 0) {
      this.#link(this.before[jump], right)
      right = jump
    }
    this.#link(left, right)
  }
}
