/** The model's parts: names, which are covered, and with which sample; a click on the model chooses one. */

import * as api from './api.js'
import { make, named } from './dom.js'

const BASE = '' // the sample of all other parts

/** Build the list; returns an element. `samples()` returns the samples to choose from, `[{path, name}]`. */
export function parts(store, live, viewer, samples) {
  const list = make('ul', { className: 'parts' })
  const element = make(
    'section',
    { className: 'group', hidden: true },
    make('h2', {}, 'Parts'),
    list,
    make(
      'div',
      { className: 'control' },
      make('p', {}, 'Click on the model to find a part; drag a sample on it. ', make('code', {}, '--material PART=SAMPLE')),
      make('p', {}, 'Parts that are not checked keep the look that they have in the file; here they have its mean colour. ', make('code', {}, '--part')),
    ),
  )
  let known = []
  let chosen = null

  const assign = (name, source) => {
    const { [name]: _, ...others } = store.state.materials
    store.set({ materials: source === null ? others : { ...others, [name]: typeof source === 'object' && source.source ? source : { source } } })
  }
  const row = ({ name, triangles }) => {
    const now = store.state.materials[name]
    const covered = store.state.reading.part
    const isOff = !now && covered && !covered.includes(name)
    const eye = make('input', { type: 'checkbox', checked: !isOff, ariaLabel: `Cover ${name}` })
    eye.onchange = () => {
      const all = known.map((part) => part.name)
      const wanted = (covered ?? all).filter((one) => one !== name)
      if (eye.checked) wanted.push(name)
      store.option('reading', 'part', wanted.length === all.length ? null : wanted)
    }
    const select = make('select', { ariaLabel: `Sample of ${name}` })
    const entries = samples()
    const values = entries.map(({ path }) => JSON.stringify(path))
    select.append(make('option', { value: BASE }, 'as the others'))
    select.append(...entries.map((one, n) => make('option', { value: values[n] }, one.name ?? String(one.path).split('/').at(-1))))
    const value = now ? JSON.stringify(now.source) : BASE
    if (now && !values.includes(value)) select.append(make('option', { value }, String(now.source).split('/').at(-1)))
    select.value = value
    select.onchange = () => assign(name, select.value === BASE ? null : JSON.parse(select.value))
    const item = make('li', { className: name === chosen ? 'chosen' : '', title: `${name}: ${triangles.toLocaleString('en')} triangles` }, eye, named(name), select)
    item.ondragover = (event) => {
      if (![...event.dataTransfer.types].includes('application/x-upholster-sample')) return
      event.preventDefault()
      item.classList.add('over')
    }
    item.ondragleave = () => item.classList.remove('over')
    item.ondrop = (event) => {
      event.preventDefault()
      assign(name, JSON.parse(event.dataTransfer.getData('application/x-upholster-sample')))
    }
    return item
  }
  const show = () => {
    element.hidden = known.length < 2
    list.replaceChildren(...known.map(row))
  }
  live.addEventListener('facts', ({ facts }) => {
    known = facts?.parts ?? []
    show()
  })
  store.addEventListener('change', show)

  /** The part under a point of the viewer, or null. */
  const partAt = async (x, y) => {
    const ray = viewer.ray(x, y)
    return ray ? (await api.pick(ray).catch(() => ({ part: null }))).part : null
  }
  let pressed = null
  viewer.addEventListener('pointerdown', (event) => (pressed = [event.clientX, event.clientY]))
  viewer.addEventListener('pointerup', async (event) => {
    const isClick = pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) < 4
    if (!isClick || known.length < 2) return
    const { left, top } = viewer.getBoundingClientRect()
    chosen = await partAt(event.clientX - left, event.clientY - top)
    show()
    list.querySelector('.chosen')?.scrollIntoView({ block: 'nearest' })
  })
  viewer.addEventListener('dragover', (event) => {
    if ([...event.dataTransfer.types].includes('application/x-upholster-sample')) event.preventDefault()
  })
  viewer.addEventListener('drop', async (event) => {
    const dragged = event.dataTransfer.getData('application/x-upholster-sample')
    if (!dragged) return
    event.preventDefault()
    const { left, top } = viewer.getBoundingClientRect()
    const part = known.length > 1 ? await partAt(event.clientX - left, event.clientY - top) : null
    if (part) assign(part, JSON.parse(dragged))
    else store.sample({ source: JSON.parse(dragged) })
  })
  return element
}
