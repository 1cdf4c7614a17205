/** Parts, islands and wedges of a mesh's triangles [5.4]. A wedge: what corners of an island at one vertex share. */

const GROUPS = 3 // plain numbers: island, part
const [GOES_ON, THIS_WEDGE, GROUP] = [1, 2, 3] // choices
const LOOKED_AT = 8

export class WedgeDecoder {
  constructor(numbers, mesh) {
    this.numbers = numbers
    this.mesh = mesh
    this.latest = new Int32Array(mesh.vertexCount).fill(-1)
    this.earlier = new Int32Array(mesh.wedgeCount)
    this.islands = new Int32Array(mesh.wedgeCount)
    this.count = 0
    this.last = [-1, -1] // the last island and part that were told
  }

  decode() {
    const { mesh, numbers } = this
    for (let t = 0; t < mesh.triangleCount; t++) {
      if (mesh.parts.length > 1) mesh.part[t] = numbers.within(this.#group(t, mesh.part, 1), 0, mesh.parts.length - 1)
      const twin = this.#before(t, 0)
      const goesOn = twin >= 0 && this.#goesOn(t)
      const island = goesOn ? mesh.island[Math.floor(twin / 3)] : this.#group(t, mesh.island, 0)
      mesh.island[t] = numbers.within(island, -1, mesh.islandCount - 1)
      if (island < 0) continue
      if (goesOn) {
        this.#enter(3 * t, mesh.cornerWedges[twin - (twin % 3) + ((twin + 1) % 3)])
        this.#enter(3 * t + 1, mesh.cornerWedges[twin])
      }
      for (let k = goesOn ? 2 : 0; k < 3; k++) this.#enter(3 * t + k, this.#wedge(t, k))
    }
    if (this.count < mesh.wedgeCount) numbers.wrong()
  }

  /** The corner across an edge of a triangle, if its triangle comes before; else −1. */
  #before(t, k) {
    const twin = this.mesh.twins[3 * t + k]
    return twin < 3 * t ? twin : -1
  }

  #group(t, groups, which) {
    let asked = 0
    const seen = []
    for (let k = 0; k < 3; k++) {
      const twin = this.#before(t, k)
      const near = groups[Math.floor(twin / 3)]
      if (twin < 0 || seen.includes(near)) continue
      seen.push(near)
      if (this.numbers.choice(GROUP, which * 3 + asked++, 0)) return near
    }
    return (this.last[which] += 1 + this.numbers.plain(GROUPS + which))
  }

  #goesOn(t) {
    let [several, closing] = [0, 0]
    for (let k = 0; k < 2; k++) {
      const wedge = this.latest[this.mesh.triangles[3 * t + k]]
      if (wedge >= 0 && this.earlier[wedge] >= 0) several++
      if (this.#before(t, k + 1) >= 0) closing++
    }
    return this.numbers.choice(GOES_ON, several, 3 * several + closing)
  }

  /** The wedge of corner k on the triangle across the edge that begins or ends there; −1 for none. */
  #beside(t, k) {
    const { cornerWedges } = this.mesh
    let twin = this.#before(t, k)
    if (twin >= 0) return cornerWedges[twin - (twin % 3) + ((twin + 1) % 3)]
    twin = this.#before(t, (k + 2) % 3)
    return twin >= 0 ? cornerWedges[twin] : -1
  }

  #wedge(t, k) {
    const vertex = this.mesh.triangles[3 * t + k]
    const island = this.mesh.island[t]
    const first = this.#beside(t, k)
    let asked = 0
    let wedge = first >= 0 ? first : this.latest[vertex]
    for (let looked = 0; looked < LOOKED_AT && wedge >= 0; looked++) {
      const isBeside = looked === 0 && first >= 0
      if (this.islands[wedge] === island && (looked === 0 || wedge !== first)) {
        if (this.numbers.choice(THIS_WEDGE, (isBeside ? 8 : 0) + Math.min(7, asked), 0)) return wedge
        asked++
      }
      wedge = isBeside ? this.latest[vertex] : this.earlier[wedge]
    }
    if (this.count === this.mesh.wedgeCount) this.numbers.wrong()
    this.earlier[this.count] = this.latest[vertex]
    this.latest[vertex] = this.count
    this.islands[this.count] = island
    return this.count++
  }

  #enter(corner, wedge) {
    const { cornerWedges, wedgeNext, wedgeCorners } = this.mesh
    cornerWedges[corner] = wedge
    wedgeNext[corner] = wedgeCorners[wedge]
    wedgeCorners[wedge] = corner
  }
}
