/** Shows the state while it changes: every change is told to the server, and what comes of it is seen. */

import * as api from './api.js'

const STAGES = {
  read: 'reading the model',
  faces: 'reading the model',
  mesh: 'reading the model',
  unwrap: 'laying the model out flat',
  prepare: 'finding directions',
  blocks: 'laying the texture',
  seams: 'laying the texture',
  texels: 'laying the texture',
  paint: 'painting',
  compile: 'compiling, once for this machine and version',
}

/**
 * Events: `revision` {revision, command, python, notes}; `facts` {facts}; `look` {isFinal, seconds}; `problem` {error}; `status` {text, busy}.
 */
export class Live extends EventTarget {
  /** What the server told of what is shown; null before its last look, and while a change is under way. */
  shown = null
  /** What the server told of the last state that it took. */
  told = null
  facts = null
  /** The streams that are shown. */
  streams = []
  #final = null // the same, while a change is under way as well
  #store
  #viewer
  #wanted = false // the state has changed since it was sent
  #isSending = false
  #abort = new AbortController()

  constructor(store, viewer) {
    super()
    this.#store = store
    this.#viewer = viewer
    store.addEventListener('change', () => this.update())
  }

  /** Show the state as it is now. */
  async update() {
    this.#wanted = true
    if (this.#isSending || !this.#store.isWhole) return
    this.#isSending = true
    try {
      while (this.#wanted) {
        this.#wanted = false
        await this.#send()
      }
    } finally {
      this.#isSending = false
    }
  }

  async #send() {
    this.#abort.abort()
    this.#abort = new AbortController()
    this.shown = null
    this.#say('working', true)
    try {
      this.told = await api.change(this.#store.state)
    } catch (error) {
      this.#fail(error)
      return
    }
    this.#tell('revision', this.told)
    if (!this.#wanted) this.#follow(this.told.revision, this.#abort.signal)
  }

  async #follow(revision, signal) {
    try {
      for await (const one of api.looks(revision, signal)) {
        if (signal.aborted) return
        if (one.stage) this.#say(progress(one), true)
        else {
          if (!(await this.#viewer.replace(...one.streams)) || signal.aborted) return
          this.streams = one.streams
          this.#tell('look', one)
          this.shown = this.#final = one.isFinal ? this.told : null
          this.#say(one.isFinal ? '' : 'getting sharper', !one.isFinal)
          this.#learn(revision, signal)
        }
      }
    } catch (error) {
      if (!signal.aborted) this.#fail(error)
    }
  }

  async #learn(revision, signal) {
    const facts = await api.facts(revision).catch(() => null)
    if (!facts || signal.aborted) return
    this.facts = facts
    this.#tell('facts', { facts })
  }

  /** What was shown before stays, and can be saved. */
  #fail(error) {
    this.shown = this.#final
    this.#say('', false)
    this.#tell('problem', { error })
  }

  #say(text, busy) {
    this.#tell('status', { text, busy })
  }

  #tell(type, detail) {
    this.dispatchEvent(Object.assign(new Event(type), detail))
  }
}

function progress({ stage, done, total }) {
  const words = STAGES[stage] ?? stage
  return total > 1 && done < total ? `${words}, ${Math.round((100 * done) / total)} %` : words
}
