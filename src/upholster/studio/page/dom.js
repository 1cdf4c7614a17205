/** Functions that make an element in one line. */

/** An element: properties, listeners by `onclick` …, attributes by `attributes`; then its children, elements or texts. */
export function make(tag, { attributes = {}, ...properties } = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties)
  for (const [name, value] of Object.entries(attributes)) if (value !== null) element.setAttribute(name, value)
  element.append(...children.filter((child) => child !== null && child !== undefined))
  return element
}

export const button = (text, onclick, more = {}) => make('button', { type: 'button', onclick, ...more }, text)

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
