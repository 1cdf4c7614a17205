/** What surrounds the stage: panel, cards, notes, and the status for screen readers. */

import { helpCard, LightCard, Loading, Note, NumbersCard } from './cards.js'
import { h } from './dom.js'
import { iconButton, Panel } from './panel.js'
import { amount, percent } from './text.js'

const NO_STATE = {
  received: 0,
  total: null,
  limit: null,
  shown: { bytes: 0, coefficients: 0, charts: 0 },
  texels: 0,
  triangles: 0,
  roles: [],
  first: null,
  complete: null,
}

export class ViewerUI {
  /** Fills the stage; gets the canvas. */
  stage = h('div', { class: 'stage', part: 'stage' })
  #panel
  #light
  #numbers
  #note
  #loading = new Loading()
  #cards
  #buttons
  #corner
  #halves = h('div', { class: 'halves', part: 'halves', hidden: true }, h('span', { part: 'half' }), h('span', { part: 'half' }))
  #status = h('div', { class: 'hidden', role: 'status' })
  #opener = null

  /**
   * @param {ShadowRoot} root gets it all
   * @param {object} callbacks `act(name)` for a tool, `limit(limit)`, `light(direction)`, `measure()`, `retry()`, and
   *   `key(event)`
   */
  constructor(root, { act, limit, light, measure, retry, key }) {
    this.root = root
    const close = () => this.show(null)
    const button = (name, label, letter) => iconButton(name, label, letter, () => act(name), { toggle: true })
    this.#panel = new Panel({ act, limit })
    this.#light = new LightCard(close, light)
    this.#numbers = new NumbersCard(close, measure)
    this.#note = new Note(retry)
    this.#cards = { light: this.#light.element, numbers: this.#numbers.element, help: helpCard(close) }
    this.#buttons = {
      numbers: button('numbers', 'Numbers', 'I'),
      help: button('help', 'Keys', '?'),
      fullscreen: button('fullscreen', 'Full screen', 'F'),
    }
    this.#buttons.fullscreen.hidden = !document.fullscreenEnabled
    this.#corner = h('div', { class: 'corner', part: 'corner' }, ...Object.values(this.#buttons))
    const { bar, line } = this.#loading
    // The canvas comes first, then what lies on it.
    const above = h('div', { class: 'above' }, this.#halves, bar, line, this.#note.element, ...Object.values(this.#cards), this.#corner)
    const stack = h('div', { class: 'stack' }, this.stage, above)
    root.append(h('div', { class: 'viewer', keydown: key }, stack, this.#panel.element, this.#status))
  }

  /** Whether panel and buttons are there. */
  set controls(on) {
    this.#corner.hidden = this.#panel.element.hidden = !on
    if (!on) this.show(null)
  }

  /** Where the light comes from, as `Stage.light`. */
  set light(direction) {
    this.#light.direction = direction
  }

  /** The card that is open, or null. */
  get card() {
    return Object.keys(this.#cards).find((name) => !this.#cards[name].hidden) ?? null
  }

  /** Open one card, or none, and let the keyboard follow. */
  show(name) {
    const focused = this.root.activeElement
    for (const [one, card] of Object.entries(this.#cards)) {
      const open = one === name
      const leaves = !open && card.contains(focused)
      if (card.hidden === !open) continue
      card.hidden = !open
      this.press(one, open)
      if (leaves && !name) this.#opener?.focus()
    }
    this.oncard(name)
    if (!name) return
    if (!Object.values(this.#cards).some((card) => card.contains(focused))) this.#opener = focused
    this.#cards[name].querySelector('button').focus()
  }

  /** Called with the card that was opened, or null. */
  oncard = () => {}

  /** Show whether something is on. */
  press(name, on) {
    if (this.#buttons[name]) this.#buttons[name].setAttribute('aria-pressed', String(on))
    else this.#panel.press(name, on)
  }

  /** Say something to screen readers. */
  say(text) {
    this.#status.textContent = text
  }

  /** Show that there is no picture, and will be none. */
  fail(title, advice) {
    this.#note.show({ title, advice, middle: true })
    this.say(`${title} ${advice}`)
    this.controls = false
  }

  /**
   * Show the state of things.
   *
   * @param {import('./session.js').Session | null} session
   * @param {import('./stage.js').Stage} stage
   * @param {boolean} contextLost whether the graphics card has lost its memory
   */
  update(session, stage, contextLost) {
    const state = session?.state ?? NO_STATE
    const loading = Boolean(session?.loading)
    const shown = Boolean(session?.model.first)
    this.#panel.update(state)
    this.#panel.enable('split', shown && !loading)
    this.#panel.enable('picture', shown)
    this.#panel.press('split', Boolean(session?.other))
    if (this.card === 'numbers') this.#numbers.update(state)
    this.#loading.update(state, { loading, shown })
    if (contextLost) this.#note.show({ title: 'The graphics card was reset.', advice: 'The picture comes back when it is ready.' })
    else if (session?.problem) this.#note.show({ ...session.problem, middle: !shown, retry: true })
    else if (session?.stalled) this.#note.show({ title: 'Connection lost, trying again…' })
    else this.#note.hide()
    this.#label(session?.name ?? 'No model', state, { loading, shown }, stage)
  }

  /** Name the canvas, and the halves of it. */
  #label(name, { received, total, shown: { coefficients } }, { loading, shown }, { canvas, split, stacked }) {
    const of = total === null ? '' : ` of ${amount(total)}`
    const detail = `${percent(coefficients)} of the coefficients shown, ${amount(received)}${of} loaded`
    const label = `${name}: ${shown ? detail : loading ? 'loading' : 'no picture'}. Arrow keys turn it, plus and minus zoom.`
    if (canvas.ariaLabel !== label) canvas.ariaLabel = label
    this.#halves.hidden = !split
    this.#halves.classList.toggle('stacked', stacked)
    this.#halves.firstChild.textContent = `${percent(coefficients)} of coefficients`
    this.#halves.lastChild.textContent = 'Full quality'
  }
}
