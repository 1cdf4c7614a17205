/** The elements around the stage: a line that shows the progress of loading, full screen, a note on errors, and the status for screen readers. */

import { h, iconButton } from './dom.js'

const STEPS = 64 // of the line
const CORNERS = 'M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5'

export class ViewerUI {
  /** Fills the stage; gets the canvas. */
  stage = h('div', { class: 'stage', part: 'stage' }, h('slot', { name: 'poster' }))
  /** Lies on the stage. */
  above
  /** Buttons in the corner. */
  corner
  /** All of it. */
  element
  #fullscreen
  #note = new Note()
  #line = h('div', { class: 'line', part: 'progress', hidden: true }, h('i'))
  #status = h('div', { class: 'hidden', role: 'status' })

  /** @param {ShadowRoot} root gets it all @param {{ act: Function, key: Function, retry: Function }} callbacks */
  constructor(root, { act, key, retry }) {
    this.#fullscreen = iconButton('fullscreen', CORNERS, 'Full screen', 'F', () => act('fullscreen'), { toggle: true })
    this.#fullscreen.hidden = !document.fullscreenEnabled
    this.#note.onretry = retry
    this.corner = h('div', { class: 'corner', part: 'corner' }, this.#fullscreen)
    this.above = h('div', { class: 'above' }, this.#line, this.#note.element, this.corner)
    const stack = h('div', { class: 'stack' }, this.stage, this.above)
    this.element = h('div', { class: 'viewer', keydown: key }, stack, this.#status)
    root.append(this.element)
  }

  /** Whether there are buttons. */
  set controls(on) {
    this.corner.hidden = !on
  }

  set fullscreen(on) {
    this.#fullscreen.setAttribute('aria-pressed', String(on))
  }

  /** Announce a text to screen readers. */
  say(text) {
    this.#status.textContent = text
  }

  /** Show that there will be no picture, with the poster, or with a description of the picture. */
  fail(title, advice, { alt, children }) {
    this.#note.show({ title, advice, detail: alt, middle: !children.length })
    this.controls = false
  }

  /**
   * Show the state of things.
   *
   * @param {import('./session.js').Session | null} session
   * @param {HTMLCanvasElement} canvas
   * @param {string} name what the picture shows, in words
   * @param {boolean} contextLost whether the graphics card has lost its memory
   */
  update(session, canvas, name, contextLost) {
    const loading = Boolean(session?.loading)
    const shown = Boolean(session?.model.first)
    this.#line.hidden = !loading
    const { received, total } = session?.model ?? {}
    // In steps, and none of them animated: each frame of that would be taken from painting, where there is no graphics card.
    this.#line.firstChild.style.scale = `${((STEPS * received) / total | 0) / STEPS} 1`
    if (contextLost) this.#note.show({ title: 'The graphics card was reset.', advice: 'The picture comes back when it is ready.' })
    else if (session?.problem) this.#note.show({ ...session.problem, middle: !shown, retry: true })
    else if (session?.stalled) this.#note.show({ title: 'Connection lost, trying again…' })
    else this.#note.hide()
    const state = shown ? '' : loading ? ', loading' : ', no picture'
    const label = `${name}${state}. Arrow keys turn it, plus and minus zoom.`
    if (canvas.ariaLabel !== label) canvas.ariaLabel = label
  }
}

/** One note at a time: an error, or what the viewer waits for. */
class Note {
  onretry = () => {}
  #title = h('p', { class: 'title' })
  #advice = h('p')
  #detail = h('p', { class: 'detail' })
  #retry = h('button', { type: 'button', class: 'main', part: 'button', click: () => this.onretry() }, 'Try again')
  element = h('div', { class: 'note', part: 'note', hidden: true }, this.#title, this.#advice, this.#detail, this.#retry)

  /** `middle` if there is no picture; `retry` offers to try again. */
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
