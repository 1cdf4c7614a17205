/** Controls of the panel: each has a name, one plain sentence, and the option that it stands for. */

import { make } from './dom.js'

let count = 0

/** What stands round every control. */
function framed({ hint, option }, ...row) {
  return make('div', { className: 'control' }, ...row, make('p', { id: `hint-${count}` }, `${hint} `, make('code', {}, option)))
}

function labelled(text, input, shown = null) {
  input.id = `control-${++count}`
  input.setAttribute('aria-describedby', `hint-${count}`)
  return make('div', { className: 'row' }, make('label', { htmlFor: input.id }, text), shown)
}

/**
 * A slider with a number beside it. `told` has label, hint, option, least, most, step, and `isLog` where each step is a factor;
 * `read` returns what is so now, `write` gets what it shall be.
 */
export function slider(told, read, write) {
  const { least, most, step = 'any', isLog = false } = told
  const [toBar, fromBar] = isLog ? [Math.log, Math.exp] : [Number, Number]
  const bar = make('input', { type: 'range', min: toBar(least), max: toBar(most), step: isLog ? 'any' : step })
  const number = make('input', { type: 'number', min: least, max: most, step: 'any', ariaLabel: told.label })
  const show = () => {
    const value = read()
    bar.value = toBar(value)
    if (document.activeElement !== number) number.value = shortened(value)
  }
  bar.oninput = () => {
    const value = Number(shortened(fromBar(Number(bar.value))))
    number.value = value
    write(value)
  }
  number.onchange = () => number.value !== '' && write(Number(number.value))
  const head = labelled(told.label, bar)
  show()
  return Object.assign(framed(told, head, make('div', { className: 'row' }, bar, number)), { show })
}

/** A choice: `choices` are [value, text]. */
export function choice(told, choices, read, write) {
  const select = make('select', {}, ...choices.map(([value, text]) => make('option', { value }, text)))
  select.onchange = () => write(select.value)
  const show = () => {
    const value = String(read())
    if (![...select.options].some((one) => one.value === value)) select.append(make('option', { value }, value))
    select.value = value
  }
  const head = labelled(told.label, select)
  head.append(select)
  show()
  return Object.assign(framed(told, head), { show })
}

/** On or off. */
export function toggle(told, read, write) {
  const box = make('input', { type: 'checkbox' })
  box.onchange = () => write(box.checked)
  const show = () => (box.checked = read())
  const head = labelled(told.label, box)
  head.prepend(box)
  show()
  return Object.assign(framed(told, head), { show })
}

/** A text: an empty one is none. */
export function text(told, read, write) {
  const input = make('input', { type: 'text', placeholder: told.placeholder ?? '', spellcheck: false })
  input.onchange = () => write(input.value.trim() || null)
  const show = () => document.activeElement !== input && (input.value = read() ?? '')
  const head = labelled(told.label, input)
  show()
  return Object.assign(framed(told, head, make('div', { className: 'row' }, input)), { show })
}

/** A number with three figures, or all of its whole part. */
export function shortened(value) {
  return Math.abs(value) >= 1000 ? String(Math.round(value)) : String(Number(Number(value).toPrecision(3)))
}
