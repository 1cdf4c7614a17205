/** The shelf of samples, models and surfaces to choose from: included ones and dropped ones. */

import * as api from './api.js'
import { button, make, named } from './dom.js'

const nameOf = (path) => String(Array.isArray(path) ? path[0] : path).split('/').at(-1).replace(/\.[a-z0-9]+$/i, '')

/**
 * Build the shelf; returns an element with `add(entry)` and `show()`. `actions` has `sample(path)`, `model(path)`, `files()`, and `table(path)`,
 * which opens the sample table.
 */
export function shelf(store, { samples, models, surfaces }, actions) {
  const kept = { sample: [...samples], model: [...models] }
  const own = { sample: make('ul', { className: 'shelf' }), model: make('ul', { className: 'shelf' }) }
  const isSame = (a, b) => JSON.stringify(a) === JSON.stringify(b)

  const entry = ({ path, name }, kind, isChosen) => {
    const text = named(name ?? nameOf(path))
    const one = make('button', { type: 'button', title: name ?? nameOf(path), ariaPressed: String(isChosen), onclick: () => actions[kind](path) }, text)
    if (path) one.style.backgroundImage = `url("${api.picture(Array.isArray(path) ? path[0] : path)}")`
    one.draggable = kind === 'sample'
    one.ondragstart = (event) => event.dataTransfer.setData('application/x-upholster-sample', JSON.stringify(path))
    return make('li', {}, one)
  }
  const list = make('select', { ariaLabel: 'Built-in surfaces' }, make('option', { value: '' }, 'or a surface …'))
  list.append(...surfaces.map(({ name, description }) => make('option', { value: name, title: description }, name)))
  list.onchange = () => list.value && actions.model(list.value)
  const table = button('Prepare the sample …', () => actions.table())
  const show = () => {
    const { sample, model } = store.state
    for (const kind of ['sample', 'model']) {
      const now = kind === 'sample' ? sample?.source : model
      own[kind].replaceChildren(...kept[kind].map((one) => entry(one, kind, isSame(one.path, now))))
    }
    list.value = surfaces.some(({ name }) => name === model) ? model : ''
    table.hidden = typeof sample?.source !== 'string' || !/\.(png|jpe?g|webp|tiff?|heic|heif|avif)$/i.test(sample.source)
  }
  store.addEventListener('change', show)
  const section = (name, ...children) => make('section', { className: 'group' }, make('h2', {}, name), ...children)
  const element = make(
    'div',
    {},
    section('Sample', own.sample, make('div', { className: 'control row' }, button('Add files …', actions.files), table)),
    section('Model', own.model, make('div', { className: 'control row' }, list)),
  )
  const add = ({ path, name }, kind) => {
    if (!kept[kind].some((one) => isSame(one.path, path))) kept[kind].push({ path, name })
    show()
  }
  // The state's sample and model may have been dropped before a reload.
  if (store.state.sample?.source) add({ path: store.state.sample.source }, 'sample')
  if (store.state.model && !surfaces.some(({ name }) => name === store.state.model)) add({ path: store.state.model }, 'model')
  show()
  return Object.assign(element, { add })
}
