/** The laboratory: what of the stream is shown, comparisons, wireframe, light, numbers. */

import { helpCard, LightCard, NumbersCard } from './cards.js'
import { h } from './dom.js'
import { onDrag } from './drag.js'
import { labButton } from './icons.js'
import { labStyle } from './lab-style.js'
import { BORDER_COLOR, LINES, borderOf, edgesOf } from './lines.js'
import { Panel } from './panel.js'
import { percent } from './text.js'

/** What the full quality is compared with where nothing else was chosen. */
const COMPARED_LIMIT = { coefficients: 0.07 }

const KEYS = {
  l: 'light',
  w: 'wireframe',
  b: 'borders',
  s: 'split',
  p: 'picture',
  i: 'numbers',
  '?': 'help',
  Escape: 'close',
}

const NO_STATE = {
  received: 0,
  total: null,
  limit: null,
  shown: { bytes: 0, coefficients: 0, placements: 0 },
  texels: 0,
  triangles: 0,
  roles: [],
  first: null,
  complete: null,
}

/** All numbers of a session at once. */
function stateOf(session) {
  if (!session) return NO_STATE
  const { received, total, shown, texels, geometries, roles } = session.model
  const triangles = geometries.reduce((sum, { indices }) => sum + indices.length / 3, 0)
  return { received, total, shown, texels, triangles, roles, limit: session.limit, first: session.firstTime, complete: session.completeTime }
}

export class Lab {
  #ui
  #stage
  #viewer
  #session
  #refresh
  #panel
  #light
  #numbers
  #cards
  #buttons
  #added
  #halves = h('div', { class: 'halves', part: 'halves', hidden: true }, h('span', { part: 'half' }), h('span', { part: 'half' }))
  #opener = null
  #listening = new AbortController()
  #options = { wireframe: false, borders: false }

  /** @param {object} viewer its `ui`, `stage`, the element itself, `session()` and `refresh()` */
  constructor({ ui, stage, viewer, session, refresh }) {
    this.#ui = ui
    this.#stage = stage
    this.#viewer = viewer
    this.#session = session
    this.#refresh = refresh
    const close = () => this.#show(null)
    const act = (name) => this.#act(name)
    this.#panel = new Panel({ act, limit: (limit) => this.#setLimit(limit) })
    this.#light = new LightCard(close, (direction) => {
      stage.light = direction
      this.#light.direction = stage.light
    })
    this.#numbers = new NumbersCard(close, () => stage.finish())
    this.#cards = { light: this.#light.element, numbers: this.#numbers.element, help: helpCard(close) }
    const button = (name, label, letter) => labButton(name, label, letter, () => act(name), { toggle: true })
    this.#buttons = { numbers: button('numbers', 'Numbers', 'I'), help: button('help', 'Keys', '?') }
    this.#added = [this.#halves, ...Object.values(this.#cards), ...Object.values(this.#buttons), this.#panel.element]
    ui.corner.prepend(...Object.values(this.#buttons))
    ui.above.prepend(this.#halves)
    ui.corner.before(...Object.values(this.#cards))
    ui.element.firstChild.after(this.#panel.element)
    ui.element.getRootNode().adoptedStyleSheets.push(labStyle())
    this.#light.direction = stage.light
    this.#listen(ui.stage, stage)
  }

  dispose() {
    this.#show(null)
    const root = this.#ui.element.getRootNode()
    root.adoptedStyleSheets = root.adoptedStyleSheets.filter((sheet) => sheet !== labStyle())
    for (const element of this.#added) element.remove()
    this.#listening.abort()
  }

  /** Have the light turned by dragging, where its card is open, or with the shift key. */
  #listen(parent, stage) {
    onDrag(parent, stage.canvas, {
      signal: this.#listening.signal,
      starts: (event) => Boolean(this.#session()?.model.first) && (event.shiftKey || this.#card === 'light'),
      moves: (right, down) => {
        const [across, up] = stage.light
        stage.light = [across + right / 2, up - down / 2]
        this.#light.direction = stage.light
      },
    })
  }

  /** Show the state of things. */
  update(session) {
    const state = stateOf(session)
    const shown = Boolean(session?.model.first)
    this.#draw(session)
    this.#panel.update(state)
    this.#panel.enable('split', shown && !session.loading)
    this.#panel.enable('picture', shown)
    this.#panel.press('split', Boolean(session?.other))
    if (this.#card === 'numbers') this.#numbers.update(state)
    const { split, stacked } = this.#stage
    this.#halves.hidden = !split
    this.#halves.classList.toggle('stacked', stacked)
    this.#halves.firstChild.textContent = `${percent(state.shown.coefficients)} of coefficients`
    this.#halves.lastChild.textContent = 'Full quality'
  }

  /** A key was pressed; returns whether it means something here. */
  key(key) {
    const name = KEYS[key]
    // Escape is the page's where no card is open.
    if (!name || (name === 'close' && !this.#card)) return false
    this.#act(name)
    return true
  }

  #act(name) {
    if (name === 'light' || name === 'numbers' || name === 'help') this.#show(this.#card === name ? null : name)
    else if (name === 'close') this.#show(null)
    else if (name === 'reset') this.#stage.reset()
    else if (name === 'split') this.#compare()
    else if (name === 'picture') this.#save()
    else {
      this.#options[name] = !this.#options[name]
      this.#press(name, this.#options[name])
      this.#draw(this.#session())
      this.#stage.refresh()
    }
  }

  // ---------------------------------------------------------------- cards

  get #card() {
    return Object.keys(this.#cards).find((name) => !this.#cards[name].hidden) ?? null
  }

  /** Open one card, or none, and let the keyboard follow. */
  #show(name) {
    const focused = this.#ui.element.getRootNode().activeElement
    for (const [one, card] of Object.entries(this.#cards)) {
      const open = one === name
      const leaves = !open && card.contains(focused)
      if (card.hidden === !open) continue
      card.hidden = !open
      this.#press(one, open)
      if (leaves && !name) this.#opener?.focus()
    }
    this.#stage.dragRotates = name !== 'light'
    this.#stage.canvas.classList.toggle('light', name === 'light')
    this.#refresh()
    if (!name) return
    if (!Object.values(this.#cards).some((card) => card.contains(focused))) this.#opener = focused
    this.#cards[name].querySelector('button').focus()
  }

  /** Show whether something is on. */
  #press(name, on) {
    if (this.#buttons[name]) this.#buttons[name].setAttribute('aria-pressed', String(on))
    else this.#panel.press(name, on)
  }

  // ---------------------------------------------------------------- tools

  #setLimit(limit) {
    this.#session()?.setLimit(limit)
    this.#refresh()
  }

  /** Wireframe, and the borders of the charts. */
  #draw(session) {
    const { wireframe, borders } = this.#options
    const lines = { shader: LINES, ink: BORDER_COLOR, edges: wireframe ? edgesOf : null, borders: borders ? borderOf : null }
    for (const model of [session?.model, session?.other]) if (model) model.lines = lines
  }

  #compare() {
    const session = this.#session()
    const stage = this.#stage
    if (!session || session.loading || !session.model.first) {
      this.#ui.say('Comparing needs the whole stream, which is still loading.')
      return
    }
    if (session.other) {
      stage.show(session.model)
      session.other.dispose()
      session.other = null
    } else {
      if (!session.limit) session.setLimit(COMPARED_LIMIT)
      const other = session.compare()
      const ready = () => session === this.#session() && session.other === other
      const update = () => {
        session.changes++
        this.#draw(session)
        this.#refresh()
      }
      other.settled().then(() => {
        if (!ready()) return
        update()
        stage.show(session.model, other)
      })
      for (const type of ['refine', 'geometry']) {
        other.addEventListener(type, () => {
          if (!ready()) return
          update()
          stage.refresh()
        })
      }
    }
    this.#refresh()
  }

  async #save() {
    const session = this.#session()
    if (!session?.model.first) return
    const url = URL.createObjectURL(await this.#viewer.picture())
    h('a', { href: url, download: `${session.name.replace(/\.uph$/, '') || 'model'}.png` }).click()
    setTimeout(() => URL.revokeObjectURL(url), 10_000)
    this.#ui.say('Picture saved.')
  }
}
