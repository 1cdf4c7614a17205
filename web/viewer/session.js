/** One stream that was opened: its model, how it is fetched, times, and errors. */

import { receive } from '../uph-receive.js'
import { Group } from '../model/group.js'
import { Model } from '../model/model.js'
import { readAllowed } from './allowed.js'
import { explain } from './text.js'
import { takeEarly, takeWorker } from '../uph-workers.js'

const EVENTS = ['progress', 'surface', 'first', 'refine', 'geometry', 'complete', 'stalled', 'resumed', 'error']

export class Session {
  /** The same stream in full quality, to compare with; null where nobody does. */
  other = null
  /** As `Model.setLimit` takes it. */
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
  #worker
  #options = {}
  #refusal = null // the error of wrong attributes
  #start = performance.now()

  /**
   * @param {string | File | File[]} source an address, or the stream itself; or several streams, parts of one model
   * @param {string | null} worker address of uph-worker.js; null: next to the viewer
   * @param {{ eye: number[], pixels: number, onPage: boolean, whole?: boolean }} options as `Model` takes them
   * @param {{ limit: string | null, maxtexels: string | null }} attributes see `readAllowed`
   * @param {(type: string, event: object) => void} notify called with the model's events, 'error' with its `problem` set
   * @param {Session | null} [before] whose workers go on with this one
   */
  constructor(source, worker, options, attributes, notify, before = null) {
    this.#worker = worker
    try {
      this.#options = { onPage: options.onPage, ...readAllowed(attributes) }
    } catch (error) {
      this.#refusal = error
    }
    const sources = Array.isArray(source) ? source : [source]
    this.name = typeof sources[0] === 'string' ? nameOf(sources[0]) : sources[0].name
    this.failed = new Promise((resolve) => (this.fail = resolve))
    this.places = placesFor(sources, worker, before)
    const models = this.places.map((place) => new Model(place, { ...options, ...this.#options }))
    const model = (this.model = models.length > 1 ? new Group(models) : models[0])
    for (const type of EVENTS) {
      model.addEventListener(type, (event) => {
        if (type === 'surface' || type === 'first' || type === 'refine' || type === 'geometry') this.changes++
        if (type === 'stalled' || type === 'progress' || type === 'resumed') this.stalled = type === 'stalled'
        if (type === 'error' && !this.#explain(event.error)) return
        notify(type, event)
      })
    }
    /** Resolves when all bytes have arrived, or no more will. */
    this.received = Promise.all(sources.map((one, n) => this.#receive(one, models[n].client)))
  }

  /** Whether bytes are awaited. */
  get loading() {
    return !this.problem && !this.model.complete
  }

  /** Milliseconds since the request. */
  get time() {
    return performance.now() - this.#start
  }

  /** Show a part of the received bytes: {bytes}, {coefficients}; null for all of them. */
  setLimit(limit) {
    this.limit = limit
    this.model.setLimit(limit)
  }

  /** Load the received bytes a second time; returns that model. */
  compare() {
    this.other = new Model(takeWorker(this.#worker), this.#options)
    give(this.other.client, this.model.bytes())
    return this.other
  }

  /** Resolves when the received bytes are in the textures, or when there will be none. */
  settled() {
    const models = [this.model, this.other].filter(Boolean).map((model) => model.settled())
    return Promise.race([Promise.all(models), this.model.first ? Promise.all(models) : this.failed])
  }

  dispose() {
    this.fail()
    this.model.dispose()
    this.other?.dispose()
  }

  async #receive(source, client) {
    await null // now events are heard
    try {
      if (this.#refusal) throw this.#refusal
      if (typeof source === 'string') await receive(source, client, { credentials: 'same-origin' }, takeEarly(source))
      else give(client, new Uint8Array(await source.arrayBuffer()))
    } catch (error) {
      if (!client.signal.aborted) client.fail(error)
    }
  }

  /** Say what an error means; returns whether it is the first. */
  #explain(error) {
    if (this.problem) return false
    const { first: shown, received, total } = this.model
    this.stalled = false
    this.problem = explain(error, { shown, received, total, name: this.name || 'This' })
    this.fail()
    return true
  }
}

/** A place for each stream. Not in the constructor: its functions would have all sessions before, as long as this one lives. */
function placesFor(sources, worker, before) {
  return sources.map((_, n) => takeWorker(worker, before?.places[n]))
}

/** What an address calls a file. */
function nameOf(address) {
  const name = address.split(/[?#]/)[0].split('/').at(-1)
  try {
    return decodeURIComponent(name) || address
  } catch {
    return name // with a % that stands for itself
  }
}

function give(client, bytes) {
  client.feed(bytes)
  client.end()
}
