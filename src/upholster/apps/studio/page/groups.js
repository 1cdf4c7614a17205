/** The four groups of settings: size, direction, material, variation. The defaults suit most models; experts unfold the rest. */

import { choice, numberIn, slider, text, toggle, typed } from './controls.js'
import { button, make } from './dom.js'
import * as lengths from './lengths.js'

/** What the direction can be besides the server's words for it. */
const OTHER_DIRECTIONS = [
  ['angle', 'turned by an angle'],
  ['around:x', 'round the x axis'],
  ['around:y', 'round the y axis'],
  ['around:z', 'round the z axis'],
]
const TEXELS = [
  ['', 'one texel per pixel of the sample'],
  ['250000', '0.25 million: a phone'],
  ['1000000', '1 million'],
  ['4000000', '4 million'],
  ['16000000', '16 million: print'],
]

/**
 * Build the groups; returns elements. Each control's `show` is called when the state or the facts about it have changed.
 * @param {import('./store.js').Store} store
 * @param {import('./live.js').Live} live
 */
export function groups(store, live) {
  const controls = []
  const add = (control) => {
    controls.push(control)
    return control
  }
  const refresh = () => controls.forEach((control) => control.show())
  store.addEventListener('change', refresh)
  live.addEventListener('facts', refresh)
  const of = (kind) => ({
    read: (name, fallback) => () => store.state[kind][name] ?? fallback,
    write: (name, fallback) => (value) => store.option(kind, name, value === fallback || value === '' ? null : value),
  })
  const [synthesis, writing, reading] = ['synthesis', 'writing', 'reading'].map(of)
  const expert = (...children) => make('details', {}, make('summary', {}, 'More'), ...children)
  const group = (name, ...children) => make('section', { className: 'group' }, make('h2', {}, name), ...children)

  return [
    group(
      'Size',
      add(size(store, live)),
      add(
        choice(
          { label: 'Detail', hint: 'How many texels the saved texture has.', option: '--texels' },
          TEXELS,
          synthesis.read('texels', ''),
          (value) => store.option('synthesis', 'texels', value ? Number(value) : null),
        ),
      ),
      expert(add(elementSize(store)), add(unit(reading))),
    ),
    group(
      'Direction',
      add(direction(store)),
      add(angle(store)),
      expert(
        add(
          text(
            { label: 'Direction in words', hint: 'A vector x,y,z, an axis around:1,0,0, or parts: Shaft=along.', option: '--direction' },
            synthesis.read('direction', ''),
            synthesis.write('direction', ''),
          ),
        ),
        add(
          slider(
            { label: 'Creases', hint: 'The texture is interrupted at edges that turn by at least this many degrees.', option: '--crease', least: 1, most: 180, step: 1 },
            synthesis.read('crease', 180),
            synthesis.write('crease', 180),
          ),
        ),
      ),
    ),
    group(
      'Material',
      add(
        toggle(
          { label: 'Even light', hint: 'Removes the shading of the photo from its colours.', option: '--even-light' },
          () => Boolean(store.state.sample?.even_light),
          (on) => store.sample({ even_light: on || null }),
        ),
      ),
      add(
        slider(
          { label: 'Relief', hint: "Strength of a material's normal map.", option: '--normal-scale', least: 0, most: 4, step: 0.1 },
          writing.read('normal_scale', 1),
          writing.write('normal_scale', 1),
        ),
      ),
      expert(
        add(
          text(
            { label: 'Displace', hint: 'Depth of the relief in a 3MF for printers. Save proposes one.', option: '--displace', placeholder: '0.6mm' },
            writing.read('displace', ''),
            writing.write('displace', ''),
          ),
        ),
      ),
    ),
    group(
      'Variation',
      make('div', { className: 'control' }, button('Again', () => store.set({ seed: store.state.seed + 1 }), { title: 'Another seed' })),
      add(
        toggle(
          { label: 'Mirror', hint: 'Parts of the sample may be mirrored. Not for writing.', option: '--mirror' },
          synthesis.read('mirror', false),
          synthesis.write('mirror', false),
        ),
      ),
      add(
        toggle(
          { label: 'Rotate', hint: 'Parts may be rotated by quarter turns. For samples without an up.', option: '--rotate' },
          synthesis.read('rotate', false),
          synthesis.write('rotate', false),
        ),
      ),
      expert(
        add(seed(store)),
        add(
          text(
            { label: 'Block', hint: 'Side of a block in pixels of the sample, 8 to 512.', option: '--block', placeholder: 'by itself' },
            synthesis.read('block', ''),
            (value) => store.option('synthesis', 'block', numberIn(value)),
          ),
        ),
      ),
    ),
  ]
}

/** The width of the sample on the model; the slider starts at the present width. */
function size(store, live) {
  const about = { label: 'Width of the sample', hint: 'Width of the whole sample on the model.', option: '--sample-size' }
  const input = make('input', { type: 'text', className: 'short', ariaLabel: 'Width of the sample', spellcheck: false })
  const bar = make('input', { type: 'range', min: -1, max: 1, step: 0.01, ariaLabel: about.label })
  let middle = null // of the slider: the width when it was not moved
  const width = () => lengths.read(store.state.sample?.size, live.facts?.unit) ?? live.facts?.sample_size ?? null
  const write = (value, key) => {
    const { element_size: _, sample_size: __, ...others } = store.state.synthesis
    store.set({ synthesis: others, sample: { ...store.state.sample, size: value } }, key)
  }
  bar.oninput = () => {
    middle ??= width()
    if (middle === null) return
    const value = lengths.written(middle * 8 ** Number(bar.value), live.facts?.unit)
    input.value = value
    write(value, 'size')
  }
  bar.onchange = () => {
    middle = null
    show()
  }
  const show = () => {
    const value = width()
    bar.disabled = input.disabled = !store.state.sample
    if (middle === null) bar.value = 0
    setText(store.state.sample?.size ?? (value === null ? '' : lengths.written(value, live.facts?.unit)))
  }
  const setText = typed(input, (text) => write(text ?? undefined), show)
  const control = make(
    'div',
    { className: 'control' },
    make('div', { className: 'row' }, make('label', {}, about.label)),
    make('div', { className: 'row' }, bar, input),
    make('p', {}, `${about.hint} `, make('code', {}, about.option)),
  )
  return Object.assign(control, { show })
}

function elementSize(store) {
  return text(
    { label: 'Size of an element', hint: 'Width of one brick or plank, in place of the width of the whole sample.', option: '--element-size', placeholder: '21cm' },
    () => store.state.synthesis.element_size,
    (value) => {
      const { sample_size: _, ...others } = store.state.synthesis
      const sample = store.state.sample && { ...store.state.sample, size: value ? undefined : store.state.sample.size }
      store.set({ synthesis: { ...others, element_size: value ?? undefined }, sample })
    },
  )
}

function unit(reading) {
  const units = ['', ...Object.keys(lengths.METRES)].map((name) => [name, name || 'as the file says'])
  const about = { label: 'Unit of the model', hint: 'What one unit of the file is.', option: '--unit' }
  return choice(about, units, reading.read('unit', ''), reading.write('unit', ''))
}

/** Whether a direction is an angle. */
const isAngle = (asked) => asked !== undefined && asked !== null && asked !== '' && Number.isFinite(Number(asked))

function direction(store) {
  const asked = () => store.state.synthesis.direction
  return choice(
    { label: 'Rows run', hint: "Which way the sample's rows run over the model.", option: '--direction' },
    [['', 'by itself'], ...store.given.directions, ...OTHER_DIRECTIONS],
    () => (isAngle(asked()) ? 'angle' : (asked() ?? '')),
    (value) => store.option('synthesis', 'direction', value === 'angle' ? '0' : value || null),
  )
}

function angle(store) {
  const asked = () => store.state.synthesis.direction
  const control = slider(
    { label: 'Angle', hint: 'In degrees, from the default direction of rows.', option: '--direction DEG', least: 0, most: 360, step: 1 },
    () => (isAngle(asked()) ? Number(asked()) : 0),
    (value) => store.option('synthesis', 'direction', String(value)),
  )
  return control
}

function seed(store) {
  return text(
    { label: 'Seed', hint: 'The same seed gives the same texture.', option: '--seed' },
    () => String(store.state.seed),
    (value) => store.set({ seed: numberIn(value) ?? 0 }),
  )
}
