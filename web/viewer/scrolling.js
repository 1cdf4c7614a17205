/** Whose the wheel and swipes are: the page's, where it scrolls, or the model's. */

/** Whether an element lies in something that a person can scroll up and down: as the page is at this moment. */
export function isInScroller(element) {
  if (document.fullscreenElement) return false
  for (let node = element; node; node = node.assignedSlot ?? node.parentNode ?? node.host) {
    if (node instanceof Element && node.scrollHeight > node.clientHeight + 1 && scrolls(node)) return true
  }
  return false
}

/** Whether an element whose content is higher than itself can be scrolled. */
function scrolls(element) {
  const { overflowY } = getComputedStyle(element)
  if (element !== document.scrollingElement) return /auto|scroll/.test(overflowY)
  // What the body says is the window's where the root says nothing.
  const { body } = document
  const window = overflowY === 'visible' && body && body !== element ? getComputedStyle(body).overflowY : overflowY
  return !/hidden|clip/.test(window)
}

/**
 * Let a page be scrolled past a canvas: its wheel zooms with Ctrl, after a click, or where nothing scrolls; one finger that moves up or
 * down scrolls, where something does. To be called after others have set what they want of the canvas.
 *
 * Each wheel and each touch is decided when it comes: a page may have grown since the last one, and no event reports that.
 */
export function letScroll(canvas, signal) {
  const isOurs = ({ ctrlKey, metaKey }) => ctrlKey || metaKey || canvas.matches(':focus') || !isInScroller(canvas)
  // Before those who listen on the canvas itself.
  canvas.addEventListener('wheel', (event) => isOurs(event) || event.stopImmediatePropagation(), { capture: true, signal })
  // The browser may scroll up and down unless the first move says no: then the finger goes on moving the model.
  canvas.style.touchAction = 'pan-y'
  let ours = false
  canvas.addEventListener('touchstart', () => (ours = !isInScroller(canvas)), { passive: true, signal })
  canvas.addEventListener('touchmove', (event) => ours && event.cancelable && event.preventDefault(), { passive: false, signal })
}
