/** The laboratory's panel below the stage: how much of the stream is shown, and the tools. */

import { h } from './dom.js'
import { labButton } from './icons.js'
import { amount, percent } from './text.js'

/** Shares of the coefficients that have a button. */
export const SHARES = [0.03, 0.05, 0.07, 0.15, 1]

/** Steps of the slider: an arrow key moves by 1/200 of its length. */
const SLIDER_STEPS = 200

/** Where the slider's scale changes from even steps to even ratios, in bytes. */
const LINEAR_BYTES = 1000

/** Bytes at a place, 0 to 1, of a slider over `total` bytes. */
export const bytesAt = (place, total) => Math.round(LINEAR_BYTES * ((1 + total / LINEAR_BYTES) ** place - 1))

/** The slider's place, 0 to 1, of an amount of bytes. */
export const placeOf = (bytes, total) => (total > 0 ? Math.log1p(bytes / LINEAR_BYTES) / Math.log1p(total / LINEAR_BYTES) : 0)

/** Amounts to mark on the slider: 1, 2, 4, 8… kB, or every other of them where there is less room, and all. */
export function ticks(total, room) {
  let ratio = 2
  while (placeOf(LINEAR_BYTES * ratio, total) - placeOf(LINEAR_BYTES, total) < room && LINEAR_BYTES * ratio < total) ratio *= 2
  const marks = []
  for (let bytes = LINEAR_BYTES; bytes < total; bytes *= ratio) {
    const place = placeOf(bytes, total)
    if (place > room / 2 && place < 1 - 1.5 * room) marks.push({ bytes, place })
  }
  return [...marks, { bytes: total, place: 1 }]
}

const TOOLS = [
  ['reset', 'Show the whole model', '0', false],
  ['light', 'Move the light', 'L', true],
  ['wireframe', 'Wireframe', 'W', true],
  ['borders', 'Borders of the charts', 'B', true],
  ['split', 'Compare with full quality', 'S', true],
  ['picture', 'Save a picture', 'P', false],
]

/**
 * The controls below the stage.
 *
 * `act(name)` is called with a tool's name, `limit(limit)` with {bytes}, {coefficients} or null, as `Model.setLimit` takes it.
 */
export class Panel {
  #slider
  #amount = h('output', { part: 'amount' })
  #share = h('span')
  #ticks = h('div', { class: 'ticks', 'aria-hidden': 'true' })
  #shares
  #tools = {}
  #total = null
  #width = 0
  #sent = null

  constructor({ act, limit }) {
    this.#slider = h('input', {
      type: 'range',
      part: 'slider',
      min: 0,
      max: SLIDER_STEPS,
      value: 0,
      disabled: true,
      'aria-label': 'Bytes of the stream shown',
      input: () => this.#slide(limit),
    })
    const share = (value) =>
      h('button', {
        type: 'button',
        part: 'button',
        'aria-pressed': 'false',
        'aria-label': value < 1 ? `Show ${percent(value)} of the coefficients` : 'Show all that the stream has',
        title: value < 1 ? `${percent(value)} of the coefficients` : 'The whole stream',
        click: () => limit({ coefficients: value }),
      }, value < 1 ? `${Math.round(100 * value)} %` : 'All')
    const live = h('button', {
      type: 'button',
      class: 'word',
      part: 'button',
      'aria-pressed': 'true',
      title: 'Show the stream as it arrives',
      click: () => limit(null),
    }, 'Live')
    this.#shares = new Map([[null, live], ...SHARES.map((value) => [value, share(value)])])
    for (const [name, label, key, toggle] of TOOLS) {
      this.#tools[name] = labButton(name, label, key, () => act(name), { toggle })
    }
    const group = (label, name, ...children) => h('div', { class: name, part: name, role: 'group', 'aria-label': label }, ...children)
    this.element = group(
      'Controls',
      'panel',
      h('div', { class: 'data' }, h('p', {}, this.#amount, this.#share), this.#slider, this.#ticks),
      group('Share of the coefficients', 'group', ...this.#shares.values()),
      group('View', 'tools', ...Object.values(this.#tools)),
    )
  }

  /** Say whether a tool is on. */
  press(name, on) {
    this.#tools[name].setAttribute('aria-pressed', String(on))
  }

  /** Say whether a tool can be used. */
  enable(name, on) {
    this.#tools[name].setAttribute('aria-disabled', String(!on))
  }

  /**
   * Show the state of things.
   *
   * @param {{ received: number, total: number | null, limit: object | null, shown: { bytes: number, coefficients: number } }} state
   *   bytes that came and that there are, what is asked for, and what is on screen
   */
  update({ received, total, limit, shown }) {
    const whole = total ?? received
    this.#slider.disabled = total === null
    const width = this.#ticks.clientWidth
    if (total !== null && (total !== this.#total || width !== this.#width)) {
      this.#total = total
      this.#width = width
      // A label takes about 44 pixels.
      const marks = ticks(total, 44 / Math.max(width, 100))
      this.#ticks.replaceChildren(...marks.map(({ bytes, place }) => {
        const mark = h('span', {}, amount(bytes))
        mark.style.left = `${100 * place}%`
        return mark
      }))
    }
    // A limit of bytes is where the thumb was put; another one is where that turned out to be.
    const bytes = Math.min(limit?.bytes ?? shown.bytes, whole)
    this.#slider.style.setProperty('--here', placeOf(received, whole).toFixed(4))
    if (!(this.#sent && limit?.bytes === this.#sent)) this.#slider.value = Math.round(SLIDER_STEPS * placeOf(bytes, whole))
    const text = total === null ? amount(received) : `${amount(Math.min(bytes, received))} of ${amount(total)}`
    this.#slider.setAttribute('aria-valuetext', text)
    this.#amount.textContent = text
    // A lossy stream does not send every coefficient: its end is not at 100 %.
    const all = total !== null && shown.bytes >= total ? 'complete, ' : ''
    this.#share.textContent = `${all}${percent(shown.coefficients)} coefficients`
    for (const [value, button] of this.#shares) {
      const on = value === null ? limit === null : limit?.coefficients === value
      button.setAttribute('aria-pressed', String(on))
    }
  }

  #slide(limit) {
    const place = Number(this.#slider.value) / SLIDER_STEPS
    this.#sent = place < 1 ? bytesAt(place, this.#total) : null
    limit(place < 1 ? { bytes: this.#sent } : null)
  }
}
