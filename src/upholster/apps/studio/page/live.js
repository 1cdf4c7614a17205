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
 * A state that can not be shown is taken out of the store: then the one before it is shown again.
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
    if (this.#isSending) return
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
    const [store, state] = [this.#store, this.#store.state]
    this.#abort.abort()
    const { signal } = (this.#abort = new AbortController())
    this.shown = null
    this.#say(store.isWhole ? 'working' : '', store.isWhole)
    try {
      if (!store.isWhole) this.#clear()
      this.answer = await api.change(state)
    } catch (error) {
      return this.#fail(error, state)
    }
    this.#emit('revision', this.answer)
    if (!this.#wanted && store.isWhole) this.#follow(state, signal)
  }

  /** Show nothing: model or sample is not chosen yet. */
  #clear() {
    this.#final = this.facts = null
    this.streams = []
    this.#emit('facts', { facts: null })
    this.#viewer.open(null)
  }

  async #follow(state, signal) {
    const { revision } = this.answer
    try {
      for await (const one of api.looks(revision, signal)) {
        if (signal.aborted) return
        if (one.stage) this.#say(progress(one), true)
        else {
          if (!(await this.#viewer.replace(...one.streams)) || signal.aborted) return
          if (one.isFinal) this.#store.accept(state)
          this.streams = one.streams
          this.shown = this.#final = one.isFinal ? this.answer : null
          this.#emit('look', one)
          this.#say(one.isFinal ? '' : 'getting sharper', !one.isFinal)
          this.#learn(revision, signal)
        }
      }
    } catch (error) {
      if (!signal.aborted) this.#fail(error, state)
    }
  }

  async #learn(revision, signal) {
    const facts = await api.facts(revision).catch(() => null)
    if (!facts || signal.aborted) return
    this.facts = facts
    this.#emit('facts', { facts })
  }

  /** The previous look stays, and can be saved. */
  #fail(error, state) {
    this.shown = this.#final
    this.#say('', false)
    if (error instanceof api.RefusedError) this.#store.reject(state)
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
