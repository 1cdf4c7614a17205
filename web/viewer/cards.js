/** What lies on the stage: numbers, help, the light's direction, notes, and how far loading is. */

import { h } from './dom.js'
import { iconButton } from './panel.js'
import { amount, count, duration, percent } from './text.js'

const KEYS = [
  [['← ↑ → ↓'], 'turn'],
  [['+', '−'], 'nearer, farther'],
  [['0'], 'show the whole model; also a double click'],
  [['L'], 'drag to move the light; also drag with Shift'],
  [['W'], 'wireframe'],
  [['B'], 'borders of the charts'],
  [['S'], 'compare with full quality'],
  [['P'], 'save a picture'],
  [['I'], 'numbers'],
  [['F'], 'full screen'],
  [['?'], 'this help'],
]

function card(name, title, close, ...children) {
  const header = h('header', {}, h('h2', {}, title), iconButton('close', `Close: ${title.toLowerCase()}`, '', close))
  return h('section', { class: `card ${name}`, part: `card ${name}`, 'aria-label': title, hidden: true }, header, ...children)
}

/** What the keys do. */
export function helpCard(close) {
  const rows = KEYS.flatMap(([keys, text]) => [h('dt', {}, ...keys.flatMap((key) => [h('kbd', {}, key), ' '])), h('dd', {}, text)])
  return card('help', 'Keys', close, h('dl', {}, ...rows))
}

/** Two sliders for where the light comes from. `change([across, up])` is called with degrees, null for the light at the start. */
export class LightCard {
  #inputs
  #outputs

  constructor(close, change) {
    const slider = (label, limit) =>
      h('input', { type: 'range', part: 'slider', min: -limit, max: limit, step: 1, 'aria-label': label, input: () => this.#input(change) })
    this.#inputs = [slider('Light from the side, in degrees', 180), slider('Light from above, in degrees', 90)]
    this.#outputs = [h('output'), h('output')]
    const labels = ['Side', 'Height'].map((text, n) => h('label', {}, text, this.#outputs[n], this.#inputs[n]))
    const reset = h('button', { type: 'button', part: 'button', click: () => change(null) }, 'Reset')
    this.element = card('light narrow', 'Light', close, ...labels, reset)
  }

  set direction(direction) {
    direction.forEach((degrees, n) => {
      const text = `${Math.round(degrees)}°`
      this.#inputs[n].value = Math.round(degrees)
      this.#inputs[n].setAttribute('aria-valuetext', text)
      this.#outputs[n].textContent = text
    })
  }

  #input(change) {
    change(this.#inputs.map(({ value }) => Number(value)))
  }
}

/** Counts and times. `measure()` is called to time a frame, and gives milliseconds. */
export class NumbersCard {
  #values = {}
  #frame
  #measure

  constructor(close, measure) {
    this.#measure = measure
    this.#frame = h('button', { type: 'button', part: 'button', click: () => this.#measureFrame() }, 'Measure')
    const rows = ['Shown', 'Coefficients', 'Charts placed', 'Texels', 'Triangles', 'Maps', 'First view', 'Complete', 'Frame']
    const list = rows.flatMap((name) => [h('dt', {}, name), (this.#values[name] = h('dd', {}, '–'))])
    this.element = card('numbers narrow', 'Numbers', close, h('dl', {}, ...list), this.#frame)
  }

  /** @param state as for `Panel.update`, and texels, triangles, roles, and the times of first view and end in milliseconds */
  update({ total, shown, texels, triangles, roles, first, complete }) {
    const of = total === null ? '' : ` of ${amount(total)}`
    const values = {
      Shown: `${amount(shown.bytes)}${of}`,
      Coefficients: percent(shown.coefficients),
      'Charts placed': percent(shown.charts),
      Texels: count(texels),
      Triangles: count(triangles),
      Maps: roles.length ? roles.join(', ') : '–',
      'First view': first === null ? '–' : duration(first),
      Complete: complete === null ? '–' : duration(complete),
    }
    for (const [name, text] of Object.entries(values)) this.#values[name].textContent = text
  }

  async #measureFrame() {
    this.#values.Frame.textContent = '…'
    const time = await this.#measure()
    this.#values.Frame.textContent = Number.isNaN(time) ? '–' : time < 10 ? `${time.toFixed(1)} ms` : duration(time)
  }
}

/** One note at a time: an error, or what the viewer waits for. */
export class Note {
  #title = h('p', { class: 'title' })
  #advice = h('p')
  #detail = h('p', { class: 'detail' })
  #retry

  constructor(retry) {
    this.#retry = h('button', { type: 'button', class: 'main', part: 'button', click: retry }, 'Try again')
    this.element = h('div', { class: 'note', part: 'note', hidden: true }, this.#title, this.#advice, this.#detail, this.#retry)
  }

  /** `middle` where there is no picture; `retry` offers to try again. */
  show({ title, advice = '', detail = '', middle = false, retry = false }) {
    for (const [line, text] of [[this.#title, title], [this.#advice, advice], [this.#detail, detail]]) {
      line.textContent = text
      line.hidden = !text
    }
    this.#retry.hidden = !retry
    this.element.classList.toggle('middle', middle)
    this.element.hidden = false
  }

  hide() {
    this.element.hidden = true
  }
}

/** Before the first view a quiet bar in the middle, then a line on the upper edge until all is here. */
export class Loading {
  #amount = h('span')

  constructor() {
    this.bar = h('div', { class: 'loading', part: 'loading', hidden: true }, h('div', {}, h('i')), this.#amount)
    this.line = h('div', { class: 'line', part: 'progress', hidden: true }, h('i'))
  }

  update({ received, total }, { loading, shown }) {
    this.bar.hidden = !loading || shown
    this.line.hidden = !loading || !shown
    const share = total ? received / total : 0
    for (const element of [this.bar, this.line]) element.style.setProperty('--share', share.toFixed(4))
    this.#amount.textContent = received ? `${amount(received)}${total ? ` of ${amount(total)}` : ''}` : 'Loading…'
  }
}
