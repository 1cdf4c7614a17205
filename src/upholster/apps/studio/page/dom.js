/** Functions that make an element in one line. */

const NAME_END = 9 // characters of a long name that are always seen

/** An element: properties, listeners by `onclick` …, attributes by `attributes`; then its children, elements or texts. */
export function make(tag, { attributes = {}, ...properties } = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties)
  for (const [name, value] of Object.entries(attributes)) if (value !== null) element.setAttribute(name, value)
  element.append(...children.filter((child) => child !== null && child !== undefined))
  return element
}

export const button = (text, onclick, more = {}) => make('button', { type: 'button', onclick, ...more }, text)

/** A name that is too long for its place is cut in the middle: names of one model often begin alike and differ at the end. */
export function named(name) {
  const end = name.length > 2 * NAME_END ? name.length - NAME_END : name.length
  return make('span', { className: 'name' }, make('span', {}, name.slice(0, end)), make('span', {}, name.slice(end)))
}

/** Open the page's dialog with a heading; returns a function that closes it. */
export function openDialog(heading, ...children) {
  const dialog = document.getElementById('dialog')
  const close = () => dialog.close()
  dialog.replaceChildren(make('h2', {}, heading), ...children)
  if (!dialog.open) dialog.showModal()
  return close
}

/** Show a message to the user until it is clicked or the next one comes; null removes it. */
export function say(text) {
  const message = document.getElementById('message')
  message.onclick = () => (message.hidden = true)
  message.textContent = text ?? ''
  message.hidden = !text
}
