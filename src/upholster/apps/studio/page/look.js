/** Lines drawn over the model, and facts about it. */

import * as api from './api.js'
import { button, make, openDialog, say } from './dom.js'

const KINDS = [
  ['direction', 'Directions', 'Direction of the rows of the sample.', [0.9, 0.35, 0.02]],
  ['seams', 'Charts', 'Where the parts of the texture meet. Without these lines they should be invisible.', [0.13, 0.4, 1]],
  ['density', 'Density', 'All squares have the same number of texels.', [0.03, 0.55, 0.12]],
  ['singular', 'Singular points', 'Where no direction is right, as at the poles of a globe.', [0.8, 0, 0.25]],
]

/** Build the section; returns an element. */
export function looking(live, viewer) {
  const on = new Set()
  const draw = async (kind, color) => {
    if (!live.answer) return
    const { revision } = live.answer
    const segments = await api.overlay(revision, kind).catch(() => null)
    if (on.has(kind) && revision === live.answer.revision) viewer.overlay(kind, segments, color)
  }
  const boxes = KINDS.map(([kind, label, hint, color]) => {
    const box = make('input', { type: 'checkbox' })
    box.onchange = () => {
      if (box.checked) on.add(kind)
      else on.delete(kind)
      if (box.checked) draw(kind, color)
      else viewer.overlay(kind, null)
    }
    return make('div', { className: 'control' }, make('label', { className: 'row' }, box, label), make('p', {}, hint))
  })
  // The lines of the previous state do not fit the new one.
  live.addEventListener('revision', () => on.forEach((kind) => viewer.overlay(kind, null)))
  live.addEventListener('look', ({ isFinal }) => isFinal && KINDS.forEach(([kind, , , color]) => on.has(kind) && draw(kind, color)))

  const facts = make('dl', { className: 'facts' })
  live.addEventListener('facts', ({ facts: known }) => {
    if (!known) return facts.replaceChildren()
    const lines = [['texels', known.texels.toLocaleString('en')], ...Object.entries(known.settled ?? {})]
    facts.replaceChildren(...lines.flatMap(([name, text]) => [make('dt', {}, name), make('dd', {}, String(text))]))
    facts.append(...(known.notes ?? []).flatMap((note) => [make('dt', {}, 'note'), make('dd', {}, note)]))
  })
  return make(
    'section',
    { className: 'group' },
    make('h2', {}, 'Look'),
    comparing(live, viewer),
    ...boxes,
    atlas(live),
    make('details', {}, make('summary', {}, 'Details'), facts),
  )
}

/** The texture itself, as it is saved. */
function atlas(live) {
  const open = button('Show the atlas', async () => {
    if (!live.shown) return
    open.disabled = true
    try {
      const { id, files } = await api.save(live.shown.revision, ['atlas:atlas.png'])
      const images = files.map(({ name }) => make('img', { src: `/saved/${id}/${encodeURIComponent(name)}`, alt: 'The atlas' }))
      const close = openDialog('The atlas', make('div', { className: 'atlas' }, ...images), make('div', { className: 'end' }, button('Close', () => close())))
    } catch (error) {
      say(error.message)
    } finally {
      open.disabled = false
    }
  })
  return make('div', { className: 'control' }, open, make('p', {}, 'All charts side by side in one image. ', make('code', {}, '-o atlas:texture.png')))
}

/** Two variants under a slider: the kept one and the present one. */
function comparing(live, viewer) {
  const line = make('input', { type: 'range', min: 0, max: 1, step: 0.001, value: 0.5, ariaLabel: 'Now to the left, kept to the right', hidden: true })
  line.className = 'wipe'
  line.oninput = () => (viewer.wipe = Number(line.value))
  document.getElementById('scene').append(line)
  const keep = button('Keep this to compare', async () => {
    const isOn = !line.hidden
    if (!isOn && !live.streams.length) return
    line.hidden = isOn
    keep.textContent = isOn ? 'Keep this to compare' : 'Stop comparing'
    viewer.wipe = isOn ? null : Number(line.value)
    await viewer.compare(...(isOn ? [] : live.streams))
  })
  return make('div', { className: 'control' }, keep, make('p', {}, 'Then change something, and move the slider over the model.'))
}
