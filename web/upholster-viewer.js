/**
 * `<upholster-viewer src="ring.uph">`: shows a `.uph` stream while it comes, which a person can turn and light.
 *
 * Attributes: src, worker, view, background, controls, autorotate; see `upholster-viewer.d.ts`. Needs three.js, WebGL2, and
 * nothing that a strict content security policy forbids.
 */

import { h } from './viewer/dom.js'
import { parseView } from './viewer/frame.js'
import { Session, prepare } from './viewer/session.js'
import { Stage } from './viewer/stage.js'
import { style } from './viewer/style.js'
import { amount } from './viewer/text.js'
import { ViewerUI } from './viewer/ui.js'

const START_VIEW = [30, 30]
const TURN_DEGREES = 7.5
const ZOOM_FACTOR = 1.15

/** What the full quality is compared with where nothing else was chosen. */
const COMPARED_LIMIT = { coefficients: 0.07 }

const KEYS = {
  ArrowLeft: 'left',
  ArrowRight: 'right',
  ArrowUp: 'up',
  ArrowDown: 'down',
  '+': 'nearer',
  '=': 'nearer',
  '-': 'farther',
  0: 'reset',
  l: 'light',
  w: 'wireframe',
  b: 'borders',
  s: 'split',
  p: 'picture',
  i: 'numbers',
  f: 'fullscreen',
  '?': 'help',
  Escape: 'close',
}

/** Actions that need no controls. */
const STAGE_ACTIONS = ['left', 'right', 'up', 'down', 'nearer', 'farther', 'reset']

const DARK_SCHEME = matchMedia('(prefers-color-scheme: dark)')
const REDUCED_MOTION = matchMedia('(prefers-reduced-motion: reduce)')

/** The element; importing this module defines it. */
export class UpholsterViewer extends HTMLElement {
  static observedAttributes = ['src', 'view', 'background', 'controls', 'autorotate']

  #ui
  #source = null
  #view = null
  #session = null
  #stage = null
  #listening = null
  #refreshing = 0
  #contextLost = false
  #options = { wireframe: false, borders: false }

  constructor() {
    super()
    const root = this.attachShadow({ mode: 'open' })
    root.adoptedStyleSheets = [style()]
    this.#ui = new ViewerUI(root, {
      act: (name) => this.#act(name),
      limit: (limit) => this.#setLimit(limit),
      light: (direction) => {
        this.#stage.light = direction
        this.#ui.light = this.#stage.light
      },
      measure: () => this.#stage.measure(),
      retry: () => this.open(this.#source),
      key: (event) => this.#key(event),
    })
    this.#ui.oncard = (name) => {
      if (this.#stage) this.#stage.dragLight = name === 'light'
      this.#refresh()
    }
  }

  // ---------------------------------------------------------------- public

  /** Open a stream: its address, or the stream itself. What was open is dropped. */
  open(source) {
    this.#close()
    this.#source = source
    if (this.isConnected && source !== null) this.#begin()
  }

  /** Address of the stream, as the attribute has it; null for none. */
  get src() {
    return this.getAttribute('src')
  }

  set src(address) {
    if (address === null || address === undefined) this.removeAttribute('src')
    else this.setAttribute('src', address)
  }

  /** The model shown, a `UphModel`, or null. */
  get model() {
    return this.#session?.model ?? null
  }

  /** Azimuth and elevation in degrees, as in Python. Setting it frames the whole model. */
  get view() {
    return this.#stage?.view ?? this.#view ?? this.#startView
  }

  set view(view) {
    const angles = parseView(view)
    if (!angles) throw new RangeError(`view is ${view}; allowed: azimuth and elevation in degrees, elevation from -90 to 90`)
    this.#view = angles
    if (this.#stage) this.#stage.view = angles
  }

  /** A PNG of what the canvas shows, in the screen's pixels. */
  async picture() {
    if (!this.#stage) throw new Error('there is no picture')
    return this.#stage.picture()
  }

  /** Resolves when all that has come, up to the limit, is on screen, and as finely as the view needs it. */
  async settled() {
    for (let quiet = 0; quiet < 2; ) {
      const session = this.#session
      if (!session) return
      const { changes } = session
      await session.settled()
      await this.#stage?.settle()
      quiet = session === this.#session && session.changes === changes ? quiet + 1 : 0
    }
  }

  get fullscreen() {
    return this.matches(':fullscreen')
  }

  set fullscreen(on) {
    if (on === this.fullscreen) return
    const done = on ? this.requestFullscreen() : document.exitFullscreen()
    done.catch(() => this.#ui.say('Full screen is not allowed here.'))
  }

  // ---------------------------------------------------------------- life cycle

  connectedCallback() {
    if (this.#stage) return
    this.#source ??= this.getAttribute('src')
    try {
      this.#stage = new Stage(this.#ui.stage, this.view)
    } catch {
      this.#ui.fail('This browser can not show 3D models.', 'It has no WebGL2, or WebGL2 is switched off.')
      return
    }
    this.#listening = new AbortController()
    const { signal } = this.#listening
    DARK_SCHEME.addEventListener('change', () => this.#applySettings(), { signal })
    REDUCED_MOTION.addEventListener('change', () => this.#applySettings(), { signal })
    document.addEventListener('fullscreenchange', () => this.#ui.press('fullscreen', this.fullscreen), { signal })
    const { canvas } = this.#stage
    canvas.tabIndex = 0
    const described = { part: 'canvas', role: 'application', 'aria-roledescription': '3D model' }
    for (const [name, value] of Object.entries(described)) canvas.setAttribute(name, value)
    this.#stage.onlight = () => (this.#ui.light = this.#stage.light)
    this.#stage.onlost = () => this.#setContextLost(true)
    this.#stage.onrestored = () => this.#setContextLost(false)
    this.#ui.light = this.#stage.light
    this.#applySettings()
    this.#rotate()
    this.#refresh()
    if (this.#source !== null) this.#begin()
    else prepare(this.getAttribute('worker'))
    // After the request has gone out.
    requestAnimationFrame(() => this.#stage?.precompile())
  }

  disconnectedCallback() {
    // An element that moves is back before the microtask runs.
    queueMicrotask(() => {
      if (this.isConnected || !this.#stage) return
      this.#close()
      this.#listening.abort()
      this.#stage.dispose()
      this.#stage = null
      this.#contextLost = false
    })
  }

  attributeChangedCallback(name, before, after) {
    if (!this.#stage || before === after) return
    if (name === 'src') this.open(after)
    else if (name === 'view') this.view = this.#startView
    else if (name === 'autorotate') this.#rotate()
    else this.#applySettings()
  }

  get #startView() {
    return parseView(this.getAttribute('view') ?? '') ?? START_VIEW
  }

  get #hasControls() {
    return this.getAttribute('controls') !== 'none'
  }

  /** Let attributes and the system's settings have their effect. */
  #applySettings() {
    this.#ui.controls = this.#hasControls
    this.#stage.setBackground(this.getAttribute('background'), DARK_SCHEME.matches)
    this.#stage.reducedMotion = REDUCED_MOTION.matches
    if (REDUCED_MOTION.matches) this.#rotate()
  }

  #rotate() {
    this.#stage.autorotate = this.hasAttribute('autorotate') && !REDUCED_MOTION.matches
  }

  #setContextLost(lost) {
    this.#contextLost = lost
    this.#refresh()
  }

  // ---------------------------------------------------------------- the stream

  #begin() {
    if (!this.#stage) return
    const session = new Session(this.#source, this.getAttribute('worker'), (type, event) => {
      if (session === this.#session) this.#receive(type, event)
    })
    this.#session = session
    this.#refresh()
  }

  #close() {
    this.#stage?.show()
    this.#session?.dispose()
    this.#session = null
    this.#refresh()
  }

  #receive(type, event) {
    const session = this.#session
    const stage = this.#stage
    if (type === 'first') {
      session.draw(this.#options)
      stage.show(session.model)
    } else if (type === 'refine' || type === 'geometry') stage.refresh({ shape: type === 'geometry' })
    this.#refresh()
    if (type === 'first' || type === 'refine' || type === 'complete') this.#report(session, type)
    if (type !== 'error') return
    this.#ui.say(`${session.problem.title} ${session.problem.advice}`)
    this.#emit('error', { message: session.problem.title, error: event.error })
  }

  /** Report what is on screen once it is. */
  async #report(session, type) {
    await this.#stage.drawn()
    if (session !== this.#session) return
    const { time } = session
    if (type === 'first') {
      session.firstTime = time
      this.#ui.say('First view. It gets sharper while the rest is loading.')
    } else if (type === 'complete') {
      session.completeTime = time
      this.#ui.say(`The whole stream is loaded: ${amount(session.model.received)}.`)
    }
    this.#refresh()
    this.#emit(type, { ...session.model.shown, milliseconds: time })
  }

  #emit(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }))
  }

  /** Update panel, cards and notes, at most once a frame. */
  #refresh() {
    this.#refreshing ||= requestAnimationFrame(() => {
      this.#refreshing = 0
      if (this.#stage) this.#ui.update(this.#session, this.#stage, this.#contextLost)
    })
  }

  // ---------------------------------------------------------------- actions

  #act(name) {
    const stage = this.#stage
    if (!stage) return
    if (name === 'left' || name === 'right') stage.turn(name === 'left' ? TURN_DEGREES : -TURN_DEGREES, 0)
    else if (name === 'up' || name === 'down') stage.turn(0, name === 'up' ? TURN_DEGREES : -TURN_DEGREES)
    else if (name === 'nearer' || name === 'farther') stage.zoom(name === 'nearer' ? ZOOM_FACTOR : 1 / ZOOM_FACTOR)
    else if (name === 'reset') stage.reset()
    else if (name === 'light' || name === 'numbers' || name === 'help') this.#ui.show(this.#ui.card === name ? null : name)
    else if (name === 'close') this.#ui.show(null)
    else if (name === 'split') this.#compare()
    else if (name === 'picture') this.#save()
    else if (name === 'fullscreen') this.fullscreen = !this.fullscreen
    else this.#toggle(name)
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return
    if (event.target.matches('input') && /^(Arrow|Home|End|Page)/.test(event.key)) return
    const name = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key]
    if (!name || (!this.#hasControls && !STAGE_ACTIONS.includes(name))) return
    // Escape is the page's where no card is open.
    if (name === 'close' && !this.#ui.card) return
    event.preventDefault()
    this.#act(name)
  }

  #setLimit(limit) {
    this.#session?.setLimit(limit)
    this.#refresh()
  }

  #toggle(name) {
    this.#options[name] = !this.#options[name]
    this.#ui.press(name, this.#options[name])
    this.#session?.draw(this.#options)
    this.#stage.refresh()
  }

  #compare() {
    const session = this.#session
    const stage = this.#stage
    if (!session || session.loading || !session.model.first) {
      this.#ui.say('Comparing needs the whole stream, which is still loading.')
      return
    }
    if (session.other) {
      stage.show(session.model)
      session.uncompare()
    } else {
      if (!session.limit) session.setLimit(COMPARED_LIMIT)
      session.compare((type) => {
        if (session !== this.#session || !session.other) return
        if (type === 'first') {
          session.draw(this.#options)
          stage.show(session.model, session.other)
        } else stage.refresh()
        this.#refresh()
      })
    }
    this.#refresh()
  }

  async #save() {
    if (!this.model?.first) return
    const name = this.#session.name.replace(/\.uph$/, '')
    const url = URL.createObjectURL(await this.picture())
    h('a', { href: url, download: `${name === 'This' ? 'model' : name}.png` }).click()
    setTimeout(() => URL.revokeObjectURL(url), 10_000)
    this.#ui.say('Picture saved.')
  }
}

if (!customElements.get('upholster-viewer')) customElements.define('upholster-viewer', UpholsterViewer)
