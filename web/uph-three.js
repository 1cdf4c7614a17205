// `.uph` streams in three.js: a Group whose textures and geometry refine by themselves.

import { Loader } from 'three'
import { DEFAULTS } from './model/model.js'
import { UphModel } from './three/uph-model.js'
import { fillLimits } from './uph/limits.js'
import { receive } from './uph-receive.js'

export { UphModel }

let spareWorker = null // waits for a stream

/** Loads `.uph` streams like three.js' loaders; the model refines further while bytes arrive. */
export class UphLoader extends Loader {
  /** Texture side that every graphics card supports; charts that are larger get fewer texels. */
  maxTextureSize = DEFAULTS.maxTextureSize
  /** Texels of all charts together; models with more are shown at half the size, or a quarter… */
  maxTexels = DEFAULTS.maxTexels
  /** Largest distance of the mesh from the surface, in pixels. */
  errorPixels = DEFAULTS.errorPixels
  /** Limits of a stream's demands, as of `UphDecoder`; a stream that exceeds one is refused. */
  limits = {}

  #workerURL = null
  #running = new Set()

  /** Address of `uph-worker.js`, if it is not next to this module. */
  setWorkerURL(url) {
    this.#workerURL = url
    return this
  }

  /**
   * Load a stream. `onLoad(model)` is called with the first textured picture; the model is returned immediately, still empty.
   * A lost connection is resumed by a range request.
   */
  load(url, onLoad, onProgress, onError) {
    const model = this.#newModel()
    const { client } = model
    const path = this.path + url
    this.manager.itemStart(path)
    let open = true
    const end = (error) => {
      if (!open) return
      open = false
      if (error) this.manager.itemError(path)
      this.manager.itemEnd(path)
    }
    this.#running.add(model)
    model.addEventListener('first', () => {
      end()
      onLoad?.(model)
    })
    if (onProgress) model.addEventListener('progress', (event) => onProgress(loadEvent(event)))
    model.addEventListener('error', ({ error }) => {
      const early = open
      end(error)
      if (!early) return
      if (onError) onError(error)
      else console.error(`UphLoader: ${error.message}`)
    })
    const options = {
      headers: this.requestHeader,
      credentials: this.crossOrigin === 'anonymous' ? 'same-origin' : 'include',
      cache: this.cache ?? 'default',
    }
    if (this.withCredentials) options.credentials = 'include'
    receive(this.manager.resolveURL(path), client, options)
      .catch((error) => client.signal.aborted || client.fail(error))
      .finally(() => {
        this.#running.delete(model)
        if (client.signal.aborted) end() // else the worker still has to say what the bytes are
      })
    return model
  }

  /** Show a stream that has been loaded already, complete or cut. */
  parse(bytes) {
    const model = this.#newModel()
    const copy = ArrayBuffer.isView(bytes) ? bytes.slice() : new Uint8Array(bytes.slice(0))
    model.client.feed(copy)
    model.client.end()
    return model
  }

  /** Stop all transfers: the models stay as they are. */
  abort() {
    for (const model of this.#running) model.abort()
    return this
  }

  /** Start the worker before there is a stream: starting takes longer than receiving the first bytes. */
  prepare() {
    spareWorker ??= { url: this.#workerURL, worker: this.#startWorker() }
    return this
  }

  #startWorker() {
    if (this.#workerURL) return new Worker(this.#workerURL, { type: 'module' })
    return new Worker(new URL('./uph-worker.js', import.meta.url), { type: 'module' })
  }

  #newModel() {
    const limits = fillLimits(this.limits)
    const isReady = spareWorker?.url === this.#workerURL
    const worker = isReady ? spareWorker.worker : this.#startWorker()
    if (isReady) spareWorker = null
    const { maxTextureSize, maxTexels, errorPixels } = this
    return new UphModel(worker, { maxTextureSize, maxTexels, errorPixels, limits })
  }
}

/** A model's progress as an event of three.js' loaders. */
function loadEvent({ received, total }) {
  const progress = { loaded: received, total: total ?? 0, lengthComputable: total !== null }
  return Object.assign(new ProgressEvent('progress', progress), { received })
}
