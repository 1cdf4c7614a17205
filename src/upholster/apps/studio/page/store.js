/** The state of the page: a project, in the form of its file, and its earlier states. */

const MOST = 200 // states that can be undone

const EMPTY = { upholster: 1, model: null, sample: null, materials: {}, reading: {}, synthesis: {}, writing: {}, seed: 0 }

/**
 * Events: `change`, after anything has changed. A state is never modified: `set` replaces it. Changes within a second under the same
 * `key`, as from a slider that moves, are undone in one step.
 */
export class Store extends EventTarget {
  #states
  #at
  #key = null
  #time = 0
  #good = new WeakSet() // states that were shown

  /**
   * @param {object | null} state as the server has it; earlier states come from this tab's memory, if they lead to it
   * @param {object} given what the server gives at start: its lists of directions, outputs, surfaces, samples and models
   */
  constructor(state, given) {
    super()
    this.given = given
    const kept = JSON.parse(sessionStorage.history ?? 'null')
    const first = { ...EMPTY, ...state }
    const leads = kept && JSON.stringify(kept.states[kept.at]) === JSON.stringify(first)
    this.#states = leads ? kept.states : [first]
    this.#at = leads ? kept.at : 0
  }

  get state() {
    return this.#states[this.#at]
  }

  /** Whether the state is complete enough to show. */
  get isWhole() {
    const { model, sample, materials } = this.state
    return Boolean(model && (sample || Object.keys(materials).length))
  }

  get canUndo() {
    return this.#at > 0
  }

  get canRedo() {
    return this.#at < this.#states.length - 1
  }

  /** Change some of the state's own entries; undefined removes one. */
  set(entries, key = null) {
    const state = Object.fromEntries(Object.entries({ ...this.state, ...entries }).filter(([, value]) => value !== undefined))
    if (JSON.stringify(state) === JSON.stringify(this.state)) return
    const now = performance.now()
    const isSame = key !== null && key === this.#key && now - this.#time < 1000 && this.#at === this.#states.length - 1
    this.#states.length = this.#at + 1
    if (isSame) this.#states[this.#at] = state
    else this.#states.push(state)
    this.#states.splice(0, this.#states.length - MOST)
    this.#at = this.#states.length - 1
    ;[this.#key, this.#time] = [key, now]
    this.#emit()
  }

  /** Change an option of one kind, `reading`, `synthesis` or `writing`; null or undefined restores its default. */
  option(kind, name, value) {
    const { [name]: _, ...others } = this.state[kind]
    this.set({ [kind]: value === null || value === undefined ? others : { ...others, [name]: value } }, `${kind}.${name}`)
  }

  /** Change some of the sample's entries. */
  sample(entries, key = null) {
    const changed = Object.entries({ ...this.state.sample, ...entries }).filter(([, value]) => value !== null && value !== undefined)
    this.set({ sample: Object.fromEntries(changed) }, key)
  }

  /** Remember that a state was shown completely. */
  accept(state) {
    this.#good.add(state)
  }

  /**
   * Forget a state that can not be shown; the one before it takes its place, or an empty one. A state that was shown before stays: what
   * fails now is something else.
   */
  reject(state) {
    const at = this.#states.indexOf(state)
    if (at < 0 || this.#good.has(state) || (this.#states.length === 1 && !this.isWhole)) return
    const isPresent = at === this.#at
    this.#states.splice(at, 1)
    if (!this.#states.length) this.#states.push({ ...EMPTY })
    if (at <= this.#at) this.#at = Math.max(0, this.#at - 1)
    this.#key = null
    if (isPresent) this.#emit()
  }

  undo() {
    this.#go(-1)
  }

  redo() {
    this.#go(1)
  }

  #go(by) {
    if (!this.#states[this.#at + by]) return
    this.#at += by
    this.#key = null
    this.#emit()
  }

  #emit() {
    try {
      sessionStorage.history = JSON.stringify({ states: this.#states, at: this.#at })
    } catch {
      delete sessionStorage.history // full: a reload finds the state, and no earlier ones
    }
    this.dispatchEvent(new Event('change'))
  }
}
