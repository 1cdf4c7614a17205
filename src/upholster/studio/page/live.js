/** Shows the state while it changes: sends every change to the server and shows the results. */

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
  /** The server's answer for the state that is shown; null before its last look, and during a change. */
  shown = null
  /** The server's answer for the last state that it accepted. */
  answer = null
  facts = null
  /** The streams that are shown. */
  streams = []
  #final = null // the same, but kept during a change
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
      this.answer = await api.change(this.#store.state)
    } catch (error) {
      this.#fail(error)
      return
    }
    this.#emit('revision', this.answer)
    if (!this.#wanted) this.#follow(this.answer.revision, this.#abort.signal)
  }

  async #follow(revision, signal) {
    try {
      for await (const one of api.looks(revision, signal)) {
        if (signal.aborted) return
        if (one.stage) this.#say(progress(one), true)
        else {
          if (!(await this.#viewer.replace(...one.streams)) || signal.aborted) return
          this.streams = one.streams
          this.#emit('look', one)
          this.shown = this.#final = one.isFinal ? this.answer : null
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
    this.#emit('facts', { facts })
  }

  /** The previous look stays, and can be saved. */
  #fail(error) {
    this.shown = this.#final
    this.#say('', false)
    this.#emit('problem', { error })
  }

  #say(text, busy) {
    this.#emit('status', { text, busy })
  }

  #emit(type, detail) {
    this.dispatchEvent(Object.assign(new Event(type), detail))
  }
}

function progress({ stage, done, total }) {
  const words = STAGES[stage] ?? stage
  return total > 1 && done < total ? `${words}, ${Math.round((100 * done) / total)} %` : words
}
