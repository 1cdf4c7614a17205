/** The page: a model and its settings, shown while they change. */

import './upholster-viewer.js'
import * as api from './api.js'
import { button, make, openDialog, say } from './dom.js'
import { chooseFiles, listenForFiles, send } from './drop.js'
import { groups } from './groups.js'
import * as lengths from './lengths.js'
import { Live } from './live.js'
import { looking } from './look.js'
import { parts } from './parts.js'
import { openSave } from './save.js'
import { shelf } from './shelf.js'
import { Store } from './store.js'

const viewer = document.getElementById('viewer')
const light = document.getElementById('light')

async function start() {
  await api.enter()
  let given
  try {
    given = await api.session()
  } catch (error) {
    if (!(error instanceof api.TakenError)) throw error
    return askToTake(error.message)
  }
  build(given)
}

/** Another tab has the session: ask whether this one should take it over. */
function askToTake(message) {
  const take = async () => {
    await api.take()
    location.reload()
  }
  openDialog('The studio is open in another tab', make('p', {}, message), make('div', { className: 'end' }, button('Work here', take, { className: 'main' })))
}

function build(given) {
  const store = new Store(given.state, given)
  const live = new Live(store, viewer)
  const status = (text, busy = false) => {
    light.textContent = text
    light.classList.toggle('busy', busy)
  }
  const fail = (error) => {
    if (error instanceof api.TakenError) askToTake(error.message)
    else say(error.message)
  }
  const dropped = { sample: [...given.samples], model: [...given.models] }

  /** Use dropped files as models, samples or projects. */
  const use = async (drops) => {
    const problems = []
    const wrong = (error) => (error instanceof api.TakenError ? fail(error) : problems.push(error.message))
    for (const drop of drops) {
      try {
        const sent = await send(drop, (text) => status(text, true), wrong)
        const others = sent.filter(({ kind }) => kind === 'other').map(({ path }) => path.split('/').at(-1))
        for (const { path, kind } of sent) if (kind !== 'other') await place(path, kind).catch(wrong)
        if (others.length) wrong(new Error(`${others.join(', ')} ${others.length > 1 ? 'are no image' : 'is not an image'}, material, model or project`))
      } catch (error) {
        wrong(error)
      }
    }
    status('')
    if (problems.length) say(problems.join('\n'))
  }
  const place = async (path, kind) => {
    if (kind === 'project') {
      const { state } = await api.source(path)
      return store.set(state)
    }
    const of = kind === 'model' ? 'model' : 'sample'
    if (of === 'sample') for (const one of [path].flat()) await api.source(one) // throws if it is not allowed
    dropped[of].push({ path })
    chooser.add({ path }, of)
    if (of === 'model') store.set({ model: path, materials: {}, reading: {} })
    else store.set({ sample: { source: path } })
  }
  const chooser = shelf(store, given, {
    sample: (path) => store.set({ sample: { ...store.state.sample, source: path, crop: undefined, rectify: undefined, use: undefined } }),
    model: (path) => store.set({ model: path, materials: {}, reading: {}, sample: store.state.sample && { ...store.state.sample, size: undefined } }),
    files: () => chooseFiles(use),
    table: () => openSampleTable(store).catch(fail),
  })
  const panel = document.getElementById('panel')
  panel.append(notes(live), chooser, parts(store, live, viewer, () => dropped.sample), ...groups(store, live), looking(live, viewer))
  bar(store, live, given)
  listenForFiles(use, fail)

  live.addEventListener('status', ({ text, busy }) => status(text, busy))
  live.addEventListener('problem', ({ error }) => fail(error))
  live.addEventListener('look', ({ isFinal, seconds }) => {
    document.body.dataset.look = isFinal ? 'final' : 'first'
    document.body.dataset.seconds = seconds
  })
  const welcome = document.getElementById('welcome')
  const greet = () => {
    const { model, sample } = store.state
    welcome.hidden = store.isWhole
    welcome.firstElementChild.textContent = model ? 'Now drop or choose a photo' : sample ? 'Now drop or choose a model' : 'Drop or choose a photo and a model'
  }
  store.addEventListener('change', greet)
  store.addEventListener('change', () => say(null)) // what was wrong is about the state before
  greet()
  live.update()
}

/** The server's remarks on the state, such as a photo that it reduces; returns an element. */
function notes(live) {
  const element = make('p', { className: 'note', role: 'status', hidden: true })
  live.addEventListener('revision', ({ notes = [] }) => {
    element.textContent = notes.map((note) => `Note: ${note}.`).join('\n')
    element.hidden = !notes.length
  })
  return element
}

/** The relief to begin with: a fortieth of the sample's width looks about right on bricks and fabrics. */
function reliefOf({ writing }, facts) {
  const proposed = facts?.sample_size ? lengths.written(Number((facts.sample_size / 40).toPrecision(1)), facts.unit) : ''
  return { depth: String(writing.displace ?? proposed), hasHeights: Boolean(facts?.heights) }
}

/** Undo, redo, save. */
function bar(store, live, given) {
  const undo = button('Undo', () => store.undo(), { title: 'Ctrl+Z' })
  const redo = button('Redo', () => store.redo(), { title: 'Ctrl+Y' })
  const save = button('Save', () => live.shown && openSave(live.shown, given, reliefOf(store.state, live.facts)), {
    className: 'main',
    title: 'Ctrl+S',
  })
  document.getElementById('bar').append(undo, redo, save)
  const show = () => {
    undo.disabled = !store.canUndo
    redo.disabled = !store.canRedo
    save.disabled = !live.shown
  }
  for (const type of ['look', 'status']) live.addEventListener(type, show)
  store.addEventListener('change', show)
  show()
  addEventListener('keydown', (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || /^(text|number)$/.test(event.target.type ?? '')) return
    const key = event.key.toLowerCase()
    if (key === 'z' && !event.shiftKey) store.undo()
    else if (key === 'y' || key === 'z') store.redo()
    else if (key === 's') save.click()
    else return
    event.preventDefault()
  })
}

async function openSampleTable(store) {
  const { openTable } = await import('./table.js')
  const { sample } = store.state
  const { source } = sample
  const found = await api.source(source)
  const chosen = await openTable({
    picture: api.picture(source, 2048),
    width: found.width,
    height: found.height,
    options: sample,
    hints: api.hints(source),
    preview: (options) => api.prepared(source, options),
  })
  if (chosen) store.sample({ ...chosen, resize: null }) // that was for another part of the photo
}

/** Say what failed, whatever it was: nothing of it would be seen otherwise. */
const failed = (error) => say(error?.message || 'The page has failed. Reload it.')
addEventListener('error', ({ error }) => error && failed(error))
addEventListener('unhandledrejection', ({ reason }) => failed(reason))

start().catch((error) => {
  failed(error)
  const welcome = document.getElementById('welcome')
  welcome.replaceChildren(make('h2', {}, 'The studio can not begin'), make('p', {}, error.message), button('Try again', () => location.reload()))
})
