/** Cards of the laboratory: numbers, help, the light's direction. */

import { h } from './dom.js'
import { labButton } from './icons.js'
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
  const header = h('header', {}, h('h2', {}, title), labButton('close', `Close: ${title.toLowerCase()}`, '', close))
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

/** Counts and times. `draw()` is called to time a frame: it draws one, the graphics card's work included. */
export class NumbersCard {
  #values = {}
  #frame
  #draw

  constructor(close, draw) {
    this.#draw = draw
    this.#frame = h('button', { type: 'button', part: 'button', click: () => this.#measureFrame() }, 'Measure')
    const rows = ['Shown', 'Coefficients', 'Placements', 'Texels', 'Triangles', 'Maps', 'First view', 'Complete', 'Frame']
    const list = rows.flatMap((name) => [h('dt', {}, name), (this.#values[name] = h('dd', {}, '–'))])
    this.element = card('numbers narrow', 'Numbers', close, h('dl', {}, ...list), this.#frame)
  }

  /** @param state as for `Panel.update`, and texels, triangles, roles, and the times of first view and end in milliseconds */
  update({ total, shown, texels, triangles, roles, first, complete }) {
    const of = total === null ? '' : ` of ${amount(total)}`
    const values = {
      Shown: `${amount(shown.bytes)}${of}`,
      Coefficients: percent(shown.coefficients),
      Placements: percent(shown.placements),
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
    const time = await frameTime(this.#draw)
    this.#values.Frame.textContent = Number.isNaN(time) ? '–' : time < 10 ? `${time.toFixed(1)} ms` : duration(time)
  }
}

/** Median time of some frames in milliseconds. */
async function frameTime(draw, frames = 9) {
  const times = []
  for (let n = 0; n < frames; n++) {
    await new Promise((resolve) => setTimeout(resolve))
    const start = performance.now()
    draw()
    times.push(performance.now() - start)
  }
  return times.sort((a, b) => a - b)[frames >> 1]
}
