/** Controls of the panel: each has a name, one plain sentence, and the name of its option. */

import { make } from './dom.js'

let count = 0

/** The frame of every control. */
function framed({ hint, option }, ...row) {
  return make('div', { className: 'control' }, ...row, make('p', { id: `hint-${count}` }, `${hint} `, make('code', {}, option)))
}

function labelled(text, input, shown = null) {
  input.id = `control-${++count}`
  input.setAttribute('aria-describedby', `hint-${count}`)
  return make('div', { className: 'row' }, make('label', { htmlFor: input.id }, text), shown)
}

/**
 * Let the user type into an input: `write` gets the text, null if it is empty. Returns a function that sets the text; it waits while the user
 * types, and does not leave a text there that was not accepted.
 */
export function typed(input, write, show) {
  let isTyping = false
  input.oninput = () => (isTyping = true)
  input.onblur = () => (isTyping = false)
  input.onchange = () => {
    isTyping = false
    write(input.value.trim() || null)
    show()
  }
  return (text) => {
    if (!isTyping) input.value = text
  }
}

/** A typed number; a text that is none stays as it is, for the server to refuse. */
export const numberIn = (text) => (text === null || Number.isNaN(Number(text)) ? text : Number(text))

/**
 * A slider and a number input next to it. `about` has label, hint, option, least, most, step, and `isLog` if each step is a factor;
 * `read` returns the present value, `write` gets the new one.
 */
export function slider(about, read, write) {
  const { least, most, step = 'any', isLog = false } = about
  const [toBar, fromBar] = isLog ? [Math.log, Math.exp] : [Number, Number]
  const bar = make('input', { type: 'range', min: toBar(least), max: toBar(most), step: isLog ? 'any' : step })
  const number = make('input', { type: 'number', min: least, max: most, step: 'any', ariaLabel: about.label })
  const show = () => {
    const value = read()
    bar.value = toBar(value)
    setNumber(shortened(value))
  }
  const setNumber = typed(number, (text) => text !== null && write(Number(text)), () => show())
  bar.oninput = () => {
    const value = Number(shortened(fromBar(Number(bar.value))))
    number.value = value
    write(value)
  }
  const head = labelled(about.label, bar)
  show()
  return Object.assign(framed(about, head, make('div', { className: 'row' }, bar, number)), { show })
}

/** A choice: `choices` are [value, text]. */
export function choice(about, choices, read, write) {
  const select = make('select', {}, ...choices.map(([value, text]) => make('option', { value }, text)))
  select.onchange = () => write(select.value)
  const show = () => {
    const value = String(read())
    if (![...select.options].some((one) => one.value === value)) select.append(make('option', { value }, value))
    select.value = value
  }
  const head = labelled(about.label, select)
  head.append(select)
  show()
  return Object.assign(framed(about, head), { show })
}

/** On or off. */
export function toggle(about, read, write) {
  const box = make('input', { type: 'checkbox' })
  box.onchange = () => write(box.checked)
  const show = () => (box.checked = read())
  const head = labelled(about.label, box)
  head.prepend(box)
  show()
  return Object.assign(framed(about, head), { show })
}

/** A text; an empty one is null. */
export function text(about, read, write) {
  const input = make('input', { type: 'text', placeholder: about.placeholder ?? '', spellcheck: false })
  const show = () => setText(read() ?? '')
  const setText = typed(input, write, show)
  const head = labelled(about.label, input)
  show()
  return Object.assign(framed(about, head, make('div', { className: 'row' }, input)), { show })
}

/** A number with three figures, or its complete integer part. */
export function shortened(value) {
  return Math.abs(value) >= 1000 ? String(Math.round(value)) : String(Number(Number(value).toPrecision(3)))
}
