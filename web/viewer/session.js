/** One stream that was opened: its model, the full quality to compare with, times, and errors. */

import { UphLoader } from '../uph-three.js'
import { explain } from './text.js'

const EVENTS = ['progress', 'first', 'refine', 'geometry', 'complete', 'stalled', 'resumed']

/** Have a worker wait for the first stream. */
export function prepare(worker) {
  const loader = new UphLoader()
  if (worker) loader.setWorkerURL(worker)
  loader.prepare()
}

export class Session {
  /** The same stream in full quality, to compare with; null where nobody does. */
  other = null
  /** As `UphModel.setLimit` takes it. */
  limit = null
  /** The error, as `explain` puts it; null while there is none. */
  problem = null
  /** Whether the connection is lost at the moment. */
  stalled = false
  /** Milliseconds from the request to the first view and to the end, once they are on screen. */
  firstTime = null
  completeTime = null
  /** How many changes made a new frame necessary. */
  changes = 0
  #loader = new UphLoader()
  #start = performance.now()

  /**
   * @param {string | Uint8Array | ArrayBuffer} source an address, or the stream itself
   * @param {string | null} worker address of uph-worker.js; null for the loader's default
   * @param {(type: string, event: object) => void} notify called with the model's events, 'error' with its `problem` set
   */
  constructor(source, worker, notify) {
    if (worker) this.#loader.setWorkerURL(worker)
    const isAddress = typeof source === 'string'
    this.name = isAddress ? decodeURIComponent(source.split(/[?#]/)[0].split('/').at(-1)) || source : 'This'
    this.failed = new Promise((resolve) => (this.fail = resolve))
    this.model = isAddress ? this.#loader.load(source, undefined, undefined, () => {}) : this.#loader.parse(source)
    for (const type of EVENTS) {
      this.model.addEventListener(type, (event) => {
        if (type === 'first' || type === 'refine' || type === 'geometry') this.changes++
        if (type === 'stalled' || type === 'progress' || type === 'resumed') this.stalled = type === 'stalled'
        notify(type, event)
      })
    }
    this.model.addEventListener('error', (event) => {
      if (this.problem) return
      const { first: shown, received, total } = this.model
      this.stalled = false
      this.problem = explain(event.error, { shown, received, total, name: this.name })
      this.fail()
      notify('error', event)
    })
  }

  /** Whether bytes are awaited. */
  get loading() {
    return !this.problem && !this.model.complete
  }

  /** Milliseconds since the request. */
  get time() {
    return performance.now() - this.#start
  }

  /** All numbers at once, as panel and cards show them. */
  get state() {
    const { received, total, shown, texels, roles, children } = this.model
    const { limit, firstTime: first, completeTime: complete } = this
    const triangles = children.reduce((sum, { isMesh, geometry }) => sum + (isMesh ? (geometry.index?.count ?? 0) / 3 : 0), 0)
    return { received, total, limit, shown, texels, triangles, roles, first, complete }
  }

  /** Show a part of what has come: {bytes}, {coefficients}; null for all of it. */
  setLimit(limit) {
    this.limit = limit
    this.model.setLimit(limit)
  }

  /** Wireframe, and the borders of the charts. */
  draw({ wireframe, borders }) {
    for (const model of [this.model, this.other]) {
      if (!model) continue
      model.wireframe = wireframe
      model.outlines.visible = borders
    }
  }

  /** Load what has come a second time; `ready` is called with 'first' when it is there in full, and when it refines. */
  compare(ready) {
    const other = (this.other = this.#loader.parse(this.model.bytes()))
    other.settled().then(() => {
      if (this.other !== other) return
      this.changes++
      ready('first')
    })
    for (const type of ['refine', 'geometry']) {
      other.addEventListener(type, () => {
        this.changes++
        ready(type)
      })
    }
  }

  /** Drop the second model. */
  uncompare() {
    this.other?.dispose()
    this.other = null
  }

  /** Resolves when what is here is in the textures, or when there will be nothing. */
  settled() {
    const models = [this.model, this.other].filter(Boolean).map((model) => model.settled())
    return Promise.race([Promise.all(models), this.model.first ? Promise.all(models) : this.failed])
  }

  dispose() {
    this.fail()
    this.model.abort()
    this.model.dispose()
    this.uncompare()
  }
}
