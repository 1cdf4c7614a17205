// The page's side of `uph-worker.js`: sends a stream's bytes, and passes the results to the view, some per frame.

const TEXELS_PER_FRAME = 2 ** 21 // handed over at once

/** Texels of a first picture, which is sketched: hardly more are on screen. */
export const SKETCHED_TEXELS = 2 ** 18

const nextFrame = globalThis.requestAnimationFrame?.bind(globalThis) ?? ((work) => setTimeout(work, 16))

/**
 * One stream and its worker. Results go to `view`, which has these methods:
 *
 * - `begin({bounds, sphere, plain})`: spheres of the charts and round them, triangles on no chart; again for each surface that takes the place of
 *   the one before, which stays on screen until `show`
 * - `takeMeshes({pieces, counts})`: geometry of the charts that changed
 * - `takeTexture(entry)`: an entry as `uph-worker.js` lists them; returns memory that is free again, or null
 * - `show(state, first)`: all textures of a painting have been taken
 * - `notify(type, detail)`: progress, refine (some of the textures are there), complete, error
 */
export class UphClient {
  received = 0
  total = null
  complete = false
  first = false
  #worker
  #view
  #abort = new AbortController()
  #parts = [] // pieces of the stream
  #queue = [] // received textures that are not taken yet
  #isDrawing = false
  #begun = false
  #ticket = 0
  #state = null
  #painted = null // the state of the latest textures
  #settling = [] // callbacks for when everything is shown
  #ended = false
  #failed = false
  #foundSize
  #size = new Promise((resolve) => (this.#foundSize = resolve)) // the exemplar's height and width
  #exemplarCalls = 0

  /** @param {Worker} worker @param {{ maxTextureSize: number, maxTexels: number, eye?: number[], onPage?: boolean }} limits @param {object} view */
  constructor(worker, limits, view) {
    this.#worker = worker
    this.#view = view
    /** Resolves when the worker's script has come and runs. */
    this.running = new Promise((resolve) => {
      worker.onmessage = ({ data }) => {
        resolve()
        this.#receive(data)
      }
    })
    worker.onerror = (event) => this.fail(new Error(event.message || 'the worker uph-worker.js does not start'))
    worker.postMessage({ kind: 'open', ...limits })
  }

  /** Aborted when receiving is to stop. */
  get signal() {
    return this.#abort.signal
  }

  /** Take further bytes of the stream. */
  feed(bytes) {
    if (this.signal.aborted) return
    this.#parts.push(bytes)
    this.received += bytes.length
    this.send({ kind: 'feed', bytes })
    this.#view.notify('progress', { received: this.received, total: this.total, loaded: this.received })
  }

  /** Report that all bytes have been fed. */
  end() {
    this.#ended = true
    this.send({ kind: 'end' })
  }

  /** Report an error; what is shown stays. */
  fail(error) {
    this.#failed = true
    this.#view.notify('error', { error })
  }

  /** Events of `receive` about the connection. */
  dispatchEvent({ type, ...detail }) {
    this.#view.notify(type, detail)
  }

  /** The bytes received so far. */
  bytes() {
    const all = new Uint8Array(this.received)
    let at = 0
    for (const part of this.#parts) {
      all.set(part, at)
      at += part.length
    }
    return all
  }

  /** Send a message, see `uph-worker.js`, with a new ticket: states report which tickets have been handled. */
  send(message) {
    this.#worker.postMessage({ ...message, ticket: ++this.#ticket })
  }

  /**
   * Show the model with another sample in place of its own, as `upholster.paint` does: an image source of a canvas, a Blob or ImageData; null:
   * the stream's own. Resolves when it is in the textures, or another call has replaced it.
   */
  async setExemplar(image) {
    const call = ++this.#exemplarCalls
    const size = await this.#size
    const picture = image === null ? null : await (await import('./uph-picture.js')).readPicture(image, size)
    if (call !== this.#exemplarCalls) return
    this.send({ kind: 'exemplar', picture })
    await this.settled()
  }

  /** Resolves when all received bytes, up to the limit, are in the textures. */
  settled() {
    return new Promise((resolve) => {
      this.#settling.push(resolve)
      this.#settle()
    })
  }

  /** Stop receiving. */
  abort() {
    this.#abort.abort()
  }

  /** Stop altogether. */
  dispose() {
    this.abort()
    this.#worker.terminate()
    this.#queue = []
    this.#begun = false
  }

  #receive(message) {
    if (message.kind === 'surface') {
      this.#begun = true
      this.#foundSize(message.exemplar)
      this.#view.begin(message)
    } else if (message.kind === 'meshes') this.#view.takeMeshes(message)
    else if (message.kind === 'textures') {
      this.#queue.push(...message.entries)
      this.#state = this.#painted = message.state
      this.#drawSoon()
    } else if (message.kind === 'state') {
      this.#state = message.state
      this.total = message.state.total
      this.#settle()
    } else if (message.kind === 'error') this.fail(Object.assign(new Error(message.message), { offset: message.offset }))
    else this.fail(new Error(`uph-worker.js sent a message of unknown kind ${message.kind}`))
  }

  #drawSoon() {
    if (this.#isDrawing) return
    this.#isDrawing = true
    nextFrame(() => {
      this.#isDrawing = false
      if (this.#begun) this.#draw()
    })
  }

  /** Pass textures on, some per frame, so that no frame takes long. */
  #draw() {
    const buffers = []
    let texels = 0
    while (this.#queue.length && texels < TEXELS_PER_FRAME) {
      const entry = this.#queue.shift()
      const old = this.#view.takeTexture(entry)
      if (old) buffers.push(old)
      if (entry.height) texels += entry.height * entry.width
    }
    if (this.#queue.length) {
      if (this.first) this.#view.notify('refine', {})
      this.#drawSoon()
      return
    }
    this.total = this.#painted.total
    this.#worker.postMessage({ kind: 'shown', buffers }, buffers)
    // Without a placement there is hardly a texture: as long as more comes, a better picture is waited for. A base has none.
    if (this.first || this.#painted.placements || this.#painted.isBase) this.#show()
  }

  #show() {
    const isFirst = !this.first
    this.first = true
    this.#view.show(this.#painted, isFirst)
  }

  /** Resolve waiting promises if everything that was sent is shown. */
  #settle() {
    const state = this.#state
    if (!state?.idle || state.ticket !== this.#ticket || this.#queue.length) return
    if (this.#ended && this.#painted && !this.first) this.#show()
    if (this.#ended && !this.complete && !this.#failed) {
      if (this.received === this.total) {
        this.complete = true
        this.#view.notify('complete', {})
      } else {
        const whole = this.total ? ` of ${this.total.toLocaleString('en')}` : ''
        this.fail(new Error(`the stream is cut: ${this.received.toLocaleString('en')}${whole} bytes have come`))
      }
    }
    for (const resolve of this.#settling.splice(0)) resolve()
  }
}
