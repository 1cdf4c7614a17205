/**
 * `<upholster-viewer src="ring.uph">`: shows a `.uph` stream while it arrives; the user can turn the model.
 *
 * Attributes: src, alt, exemplar, worker, painting, limit, maxtexels, view, background, environment, controls, autorotate; see `upholster-viewer.d.ts`. Needs WebGL2, and
 * nothing that a strict content security policy forbids.
 */

import { axes, parseView } from './viewer/frame.js'
import { LINES } from './viewer/lines.js'
import { Renderer } from './viewer/renderer.js'
import { Session } from './viewer/session.js'
import { Stage } from './viewer/stage.js'
import { style } from './viewer/style.js'
import { amount } from './viewer/text.js'
import { ViewerUI } from './viewer/ui.js'
import { prepareWorker } from './uph-workers.js'

const START_VIEW = [30, 30]
const TURN_DEGREES = 7.5
const ZOOM_FACTOR = 1.15

const KEYS = {
  ArrowLeft: 'left',
  ArrowRight: 'right',
  ArrowUp: 'up',
  ArrowDown: 'down',
  '+': 'nearer',
  '=': 'nearer',
  '-': 'farther',
  0: 'reset',
  f: 'fullscreen',
}

/** On a server, which renders pages ahead of time, there is none of this. */
const { HTMLElement = Object, customElements, matchMedia } = globalThis
const DARK_SCHEME = matchMedia?.('(prefers-color-scheme: dark)')
const REDUCED_MOTION = matchMedia?.('(prefers-reduced-motion: reduce)')

/** The element; importing this module defines it. */
export class UpholsterViewer extends HTMLElement {
  static observedAttributes = ['src', 'alt', 'exemplar', 'view', 'background', 'environment', 'controls', 'autorotate']

  #ui
  #source = null
  #view = null
  #session = null
  #next = null // what is to take its place
  #other = null // what it is compared with
  #overlays = new Map() // lines over the model, by name
  #stage = null
  #lab = null
  #listening = null
  #refreshing = 0
  #seen = false // near the screen, once

  constructor() {
    super()
    const root = this.attachShadow({ mode: 'open', delegatesFocus: true })
    root.adoptedStyleSheets = [style()]
    this.#ui = new ViewerUI(root, {
      act: (name) => this.#act(name),
      key: (event) => this.#key(event),
      retry: () => this.open(this.#source),
    })
  }

  // ---------------------------------------------------------------- public

  /** Open a stream: its address, or the stream itself; null: none. What was open is dropped. */
  open(source) {
    const isHere = source instanceof Blob || source instanceof ArrayBuffer || ArrayBuffer.isView(source)
    if (!isHere && source !== null && typeof source !== 'string') {
      throw new TypeError(`stream is ${source}; allowed: an address, Blob, ArrayBuffer or view of one, null`)
    }
    this.#close()
    this.#source = isHere ? new File([source], source.name ?? '') : source
    if (this.isConnected && source !== null) this.#begin()
  }

  /**
   * Open a stream in place of the one that is shown, which stays until the new one is whole, painted and as fine as the view takes: then it
   * changes in one frame, and the camera stays. The same worker decodes it, a sample that it knows not again. Several streams are parts of one
   * model. Resolves to whether it is shown: not where another call came first.
   */
  async replace(...streams) {
    if (!this.#stage) throw new Error('the viewer is in no page, or has no WebGL2')
    const unwanted = this.#next
    const next = (this.#next = this.#openedBehind(unwanted ?? this.#session, streams))
    unwanted?.dispose()
    await next.received // before, it has settled with nothing
    await next.settled()
    if (next === this.#next && !next.problem) await Promise.race([this.#stage.refine(next.model), next.failed])
    if (next !== this.#next) return false
    this.#next = null
    if (next.problem) {
      next.dispose()
      throw new Error(`${next.problem.title} ${next.problem.advice ?? ''}`)
    }
    this.#session?.dispose()
    this.#session = next
    this.#source = new File([streams[0]], '')
    this.#show()
    this.#lay()
    this.#refresh()
    await this.#stage.drawn()
    return next === this.#session
  }

  /** Address of the stream, as the attribute has it; null for none. */
  get src() {
    return this.getAttribute('src')
  }

  set src(address) {
    if (address === null || address === undefined) this.removeAttribute('src')
    else this.setAttribute('src', address)
  }

  /** A description of the picture, for users who do not see it. */
  get alt() {
    return this.getAttribute('alt') ?? ''
  }

  set alt(text) {
    this.setAttribute('alt', text)
  }

  /** The model shown, see `model/model.js`, or null. */
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

  /** Show other streams, parts of one model, right of a line: see `wipe`. None: no more. Resolves when they are shown. */
  async compare(...streams) {
    this.#other?.dispose()
    this.#other = null
    if (!streams.length) return this.#show()
    const other = (this.#other = this.#openedBehind(this.#session, streams))
    await other.received
    await other.settled()
    if (other === this.#other) this.#show()
  }

  /** Where the line is, 0 to 1 from the left. */
  set wipe(share) {
    if (this.#stage) this.#stage.wipe = share
  }

  /** The ray from the eye through a point, in CSS pixels of the element, in the model's own units: {origin, direction}; null without a model. */
  ray(x, y) {
    return this.model && this.#stage ? this.#stage.ray(x, y) : null
  }

  /**
   * Draw lines over the model, whichever is shown: `segments` are x, y, z of both ends of each, in the model's own units, `color` is linear red,
   * green and blue. null: none of that name any more.
   */
  overlay(name, segments, color = [0.13, 0.4, 1]) {
    if (segments) {
      const positions = Float32Array.from(segments)
      const indices = Uint32Array.from({ length: positions.length / 3 }, (_, n) => n)
      this.#overlays.set(name, { geometry: { positions, indices }, shader: LINES, ink: color })
    } else this.#overlays.delete(name)
    this.#lay()
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
    } catch (error) {
      setTimeout(() => this.#giveUp(error)) // when who made the element listens
      return
    }
    this.#listening = new AbortController()
    const { signal } = this.#listening
    for (const query of [DARK_SCHEME, REDUCED_MOTION]) query.addEventListener('change', () => this.#applySettings(), { signal })
    document.addEventListener('fullscreenchange', () => (this.#ui.fullscreen = this.fullscreen), { signal })
    Object.assign(this.#stage.canvas, { tabIndex: 0, part: 'canvas', role: 'application', ariaRoleDescription: '3D model' })
    this.#stage.onlost = () => this.#refresh()
    this.#stage.onseen = () => this.#see()
    this.#applySettings()
    this.#rotate()
    this.#light()
    if (this.#source === null) prepareWorker(this.getAttribute('worker'))
    this.#refresh()
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
      this.#lab?.dispose()
      this.#lab = null
      this.#seen = false
    })
  }

  attributeChangedCallback(name, before, after) {
    if (!this.#stage || before === after) return
    if (name === 'src') this.open(after)
    else if (name === 'view') this.view = this.#startView
    else if (name === 'autorotate') this.#rotate()
    else if (name === 'environment') this.#light()
    else if (name === 'exemplar') this.#dye()
    else this.#applySettings()
  }

  get #startView() {
    return parseView(this.getAttribute('view') ?? '') ?? START_VIEW
  }

  get #hasControls() {
    return this.getAttribute('controls') !== 'none'
  }

  /** There is no WebGL2. */
  #giveUp(error) {
    const title = 'This browser can not show 3D models.'
    const advice = 'It has no WebGL2, or WebGL2 is switched off.'
    this.#ui.fail(title, advice, this)
    this.#reportError(title, error, advice)
  }

  /** Let attributes and the system's settings have their effect. */
  #applySettings() {
    this.#ui.controls = this.#hasControls
    this.#stage.setBackground(this.getAttribute('background'), DARK_SCHEME.matches)
    this.#stage.reducedMotion = REDUCED_MOTION.matches
    if (REDUCED_MOTION.matches) this.#rotate()
    this.#openLab()
    this.#refresh()
  }

  #rotate() {
    this.#stage.autorotate = this.hasAttribute('autorotate') && !REDUCED_MOTION.matches
  }

  /** Load the laboratory when it is requested: a page without it does not load it. */
  async #openLab() {
    const wanted = this.getAttribute('controls') === 'lab'
    if (wanted === (this.#lab !== null)) return
    if (!wanted) {
      this.#lab.dispose()
      this.#lab = null
      return
    }
    try {
      const { Lab } = await import('./upholster-lab.js')
      if (this.#lab || !this.#stage || this.getAttribute('controls') !== 'lab') return
      this.#lab = new Lab({ ui: this.#ui, stage: this.#stage, viewer: this, session: () => this.#session, refresh: () => this.#refresh() })
      this.#refresh()
    } catch {
      this.#ui.say('The laboratory, upholster-lab.js, can not be loaded.')
    }
  }

  /** Light the model by a picture of surroundings, if one is named. */
  async #light() {
    const address = this.getAttribute('environment')
    try {
      const environment = address ? await (await import('./upholster-environment.js')).loadEnvironment(address) : null
      if (this.#stage && address === this.getAttribute('environment')) this.#stage.environment = environment
    } catch (error) {
      this.#reportError(`environment ${address} can not be loaded`, error)
    }
  }

  /** Show the model with another sample, if one is named, or with its own again. */
  async #dye() {
    const address = this.getAttribute('exemplar')
    const { model } = this
    try {
      const response = address && (await fetch(address))
      if (response && !response.ok) throw new Error(`the server says ${response.status}`)
      const picture = response ? await response.blob() : null
      if (model && model === this.model && address === this.getAttribute('exemplar')) await model.setExemplar(picture)
    } catch (error) {
      this.#reportError(`exemplar ${address} can not be shown: ${error.message}`, error)
    }
  }

  // ---------------------------------------------------------------- the stream

  /** The element has come near the screen: now its stream is wanted. */
  #see() {
    this.#seen = true
    if (!this.#session && this.#source !== null) this.#begin()
  }

  #begin() {
    if (!this.#stage || !(this.#seen || typeof this.#source !== 'string')) return
    this.#session = this.#opened(this.#source)
    if (this.hasAttribute('exemplar')) this.#dye()
    this.#refresh()
  }

  #show() {
    const models = [this.#session, this.#other].map((session) => session?.model).filter((model) => model?.first)
    this.#stage?.show(...models)
  }

  /** Streams that are shown when they are whole, by the workers of another session. */
  #openedBehind(before, streams) {
    const files = streams.map((stream) => new File([stream], ''))
    return this.#opened(files.length > 1 ? files : files[0], { before, whole: true })
  }

  #opened(source, { before = null, whole = false } = {}) {
    let session = null // bytes that have already arrived are reported before there is one
    const onPage = Renderer.shared.paints(this.getAttribute('painting'))
    const options = { eye: axes(this.view)[2], pixels: this.#stage.pixels, onPage, whole }
    const notify = (type, event) => {
      if (session && session === this.#session) this.#receive(type, event)
    }
    const attributes = { limit: this.getAttribute('limit'), maxtexels: this.getAttribute('maxtexels') }
    session = new Session(source, this.getAttribute('worker'), options, attributes, notify, before)
    return session
  }

  /** Give the model that is shown its overlays. */
  #lay() {
    const { model } = this
    if (!model) return
    for (const one of new Set([model, model.parts?.[0] ?? model])) one.overlays = [...this.#overlays.values()]
    this.#stage?.invalidate()
  }

  #close() {
    this.#stage?.show()
    for (const session of [this.#session, this.#next, this.#other]) session?.dispose()
    this.#session = this.#next = this.#other = null
    this.#refresh()
  }

  #receive(type, event) {
    const session = this.#session
    const stage = this.#stage
    if (type === 'first') {
      stage.show(session.model)
      this.#lay()
    }
    if (type === 'refine') stage.refresh()
    if (type === 'surface' || type === 'geometry') stage.refresh({ shape: true, before: event.before })
    this.#refresh()
    if (type === 'first' || type === 'refine' || type === 'complete') this.#report(session, type)
    if (type === 'error') this.#reportError(session.problem.title, event.error, session.problem.advice)
  }

  /** Report the state of the picture once it is on screen. */
  async #report(session, type) {
    await this.#stage.drawn()
    if (session !== this.#session || (session.model.isBare && type !== 'complete')) return
    const { time, firstTime } = session
    // A first picture that the card could not paint comes with the worker's textures.
    if (type === 'refine' && !firstTime) type = 'first'
    if (type === 'first') session.firstTime = time
    else if (type === 'complete') {
      session.completeTime = time
      this.#ui.say(`Loaded: ${amount(session.model.received)}.`)
    }
    this.#refresh()
    this.#emit(type, { ...session.model.shown, milliseconds: time })
  }

  /** Report an error to screen readers and the page. */
  #reportError(message, error, advice = '') {
    this.#ui.say(`${message} ${advice}`)
    this.#emit('error', { message, error })
  }

  #emit(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }))
  }

  /** What the picture is called. */
  get #name() {
    return this.alt || this.#session?.name.replace(/\.uph$/, '') || (this.#session ? '3D model' : 'No model')
  }

  /** Update buttons and notes, at most once a frame. */
  #refresh() {
    this.#refreshing ||= requestAnimationFrame(() => {
      this.#refreshing = 0
      if (!this.#stage) return
      this.#ui.update(this.#session, this.#stage.canvas, this.#name, this.#stage.isLost)
      this.#lab?.update(this.#session)
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
    else this.fullscreen = !this.fullscreen
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return
    if (event.target.matches('input') && /^(Arrow|Home|End|Page)/.test(event.key)) return
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key
    const name = KEYS[key]
    if (name && (this.#hasControls || name !== 'fullscreen')) this.#act(name)
    else if (!this.#lab?.key(key)) return
    event.preventDefault()
  }
}

if (customElements && !customElements.get('upholster-viewer')) customElements.define('upholster-viewer', UpholsterViewer)
