/** Which vertices a mesh's triangles have: a front runs over the mesh [5.4]. */

const [NEW, RIGHT, LEFT, BOTH, NONE, LATER, JOIN, KNOWN] = [0, 1, 2, 3, 4, 5, 6, 7]
const [JUMP, VERTEX] = [0, 1] // plain numbers
const START_VERTEX = 0 // a choice
const [OPEN, BORDER, GONE] = [0, 1, 2]
const MOST_DELAYS = 3

/** Decodes triangles into `mesh`: `triangles`, `twins`, `latestCorner`, `earlierCorners`. */
export class FrontDecoder {
  constructor(numbers, mesh) {
    this.numbers = numbers
    this.mesh = mesh
    this.triangles = 0
    this.vertices = 0
    this.degrees = new Uint8Array(mesh.vertexCount)
    // Edges of the front: from where to where, beside which others, and beyond which corner they lie.
    this.edges = 0
    const list = () => new Int32Array(3 * mesh.triangleCount)
    Object.assign(this, { tail: list(), head: list(), before: list(), after: list(), behind: list() })
    this.state = new Uint8Array(3 * mesh.triangleCount)
    this.delays = new Uint8Array(3 * mesh.triangleCount)
    this.stack = []
    this.queue = []
    this.queued = 0 // of the queue, how many were taken
    this.joined = 0
    this.last = 0 // operations, in octal digits
  }

  decode() {
    while (this.triangles < this.mesh.triangleCount) {
      const gate = this.#nextGate()
      if (gate < 0) this.#start()
      else this.#pass(gate)
    }
    if (this.vertices < this.mesh.vertexCount) this.numbers.wrong()
  }

  #nextGate() {
    while (this.stack.length) {
      const edge = this.stack.pop()
      if (this.state[edge] === OPEN) return edge
    }
    while (this.queued < this.queue.length) {
      const edge = this.queue[this.queued++]
      if (this.state[edge] === OPEN) return edge
    }
    return -1
  }

  /** Whether one triangle can close the gate and the edge beside it. */
  #canClose(gate, side) {
    const beside = side[gate]
    return this.state[beside] === OPEN && beside !== gate && side[beside] !== gate
  }

  #degree(vertex) {
    return Math.min(9, this.degrees[vertex])
  }

  #operation(gate) {
    const { tail, head } = this
    const [before, after] = [this.before[gate], this.after[gate]]
    const right = this.#canClose(gate, this.after)
    const left = this.#canClose(gate, this.before)
    const both = right && left && before !== after && tail[before] === head[after]
    const sides = 2 * left + right
    const places = [
      ((this.#degree(tail[gate]) * 10 + this.#degree(head[gate])) * 4 + sides) * 8,
      (this.last * 4 + sides) * 8,
      ((this.#degree(tail[before]) * 10 + this.#degree(head[after])) * 8 + (this.last & 7)) * 8,
    ]
    const isNever = []
    isNever[NEW] = this.vertices === this.mesh.vertexCount
    isNever[RIGHT] = !right
    isNever[LEFT] = !left
    isNever[BOTH] = !both
    isNever[LATER] = this.delays[gate] === MOST_DELAYS
    let found = 0
    while (found < KNOWN && (isNever[found] || !this.numbers.operation(found, places))) found++
    this.last = (this.last * 8 + found) & 511
    return found
  }

  #newVertex() {
    return this.vertices++
  }

  #knownVertex() {
    return this.numbers.within(this.vertices - 1 - this.numbers.plain(VERTEX), 0, this.vertices - 1)
  }

  #startVertex() {
    if (!this.vertices) return this.#newVertex()
    if (this.vertices < this.mesh.vertexCount && this.numbers.choice(START_VERTEX, 0, 0)) return this.#newVertex()
    return this.#knownVertex()
  }

  #enter(corners) {
    const { triangles, latestCorner, earlierCorners } = this.mesh
    const t = this.triangles++
    corners.forEach((vertex, k) => {
      const corner = 3 * t + k
      triangles[corner] = vertex
      earlierCorners[corner] = latestCorner[vertex]
      latestCorner[vertex] = corner
      this.degrees[vertex] = Math.min(255, this.degrees[vertex] + 1)
    })
    return t
  }

  /** Add the edge beyond the one that begins at a corner. */
  #add(corner) {
    const { triangles } = this.mesh
    const edge = this.edges++
    const first = corner - (corner % 3)
    this.tail[edge] = triangles[first + ((corner + 1) % 3)]
    this.head[edge] = triangles[corner]
    this.behind[edge] = corner
    this.stack.push(edge)
    return edge
  }

  #link(before, after) {
    this.after[before] = after
    this.before[after] = before
  }

  #start() {
    const corners = [this.#startVertex(), this.#startVertex(), this.#startVertex()]
    const t = this.#enter(corners)
    const last = this.#add(3 * t + 2)
    const middle = this.#add(3 * t + 1)
    const first = this.#add(3 * t)
    this.#link(last, middle)
    this.#link(middle, first)
    this.#link(first, last)
    this.last = 0
  }

  #pass(gate) {
    const operation = this.#operation(gate)
    if (operation === NONE) this.state[gate] = BORDER
    else if (operation === LATER) {
      this.delays[gate]++
      this.queue.push(gate)
    } else {
      const vertex = this.#vertexOf(gate, operation)
      this.#advance(gate, operation, this.#enter([this.tail[gate], this.head[gate], vertex]))
    }
  }

  #vertexOf(gate, operation) {
    if (operation === RIGHT) return this.head[this.after[gate]]
    if (operation === LEFT || operation === BOTH) return this.tail[this.before[gate]]
    if (operation === NEW) return this.#newVertex()
    if (operation === KNOWN) return this.#knownVertex()
    this.joined = this.numbers.within(this.edges - 1 - this.numbers.plain(JUMP), 0, this.edges - 1)
    if (this.joined === gate || this.state[this.joined] === GONE) this.numbers.wrong()
    return this.tail[this.joined]
  }

  #glue(edge, corner) {
    const { twins } = this.mesh
    const behind = this.behind[edge]
    twins[corner] = behind
    twins[behind] = corner
    this.state[edge] = GONE
  }

  /** Put the edges beyond a new triangle in the place of those that it closes. */
  #advance(gate, operation, t) {
    const [before, after] = [this.before[gate], this.after[gate]]
    this.#glue(gate, 3 * t)
    if (operation === BOTH || operation === RIGHT) this.#glue(after, 3 * t + 1)
    if (operation === BOTH || operation === LEFT) this.#glue(before, 3 * t + 2)
    if (operation === BOTH) {
      if (this.before[before] !== after) this.#link(this.before[before], this.after[after])
    } else if (operation === RIGHT) {
      const first = this.#add(3 * t + 2)
      this.#link(before, first)
      this.#link(first, this.after[after])
    } else if (operation === LEFT) {
      const last = this.#add(3 * t + 1)
      this.#link(this.before[before], last)
      this.#link(last, after)
    } else {
      const last = this.#add(3 * t + 1)
      const first = this.#add(3 * t + 2)
      this.#link(before, first)
      this.#link(last, after)
      if (operation === JOIN) {
        this.#link(this.before[this.joined], last)
        this.#link(first, this.joined)
      } else this.#link(first, last)
    }
  }
}
