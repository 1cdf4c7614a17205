/** The few DOM helpers that the viewer needs: elements without innerHTML, and buttons with drawings. */

const SVG = 'http://www.w3.org/2000/svg'

/**
 * Make an element. Attributes that are functions become listeners (`{ click: … }`); null and false are left out, true is
 * an empty attribute. Children are nodes or text.
 */
export function h(name, attributes = {}, ...children) {
  const element = document.createElement(name)
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(key, value)
    else if (value !== null && value !== false) element.setAttribute(key, value === true ? '' : value)
  }
  element.append(...children)
  return element
}

/** A line drawing, 24 units square, in the text's colour; decoration for assistive technology. */
function icon(drawing) {
  const svg = document.createElementNS(SVG, 'svg')
  const path = document.createElementNS(SVG, 'path')
  svg.setAttribute('viewBox', '0 0 24 24')
  svg.setAttribute('aria-hidden', 'true')
  path.setAttribute('d', drawing)
  svg.append(path)
  return svg
}

/** A button with a drawing, the data of an SVG path, instead of words. */
export function iconButton(name, drawing, label, key, click, { toggle = false } = {}) {
  const title = key ? `${label} (${key})` : label
  const keys = key ? { 'aria-keyshortcuts': key } : {}
  const pressed = toggle ? { 'aria-pressed': 'false' } : {}
  const part = `button ${name}`
  return h('button', { type: 'button', class: 'icon', part, title, 'aria-label': label, ...keys, ...pressed, click }, icon(drawing))
}
