/** Whose the wheel and swipes are: the page's, where it scrolls, or the model's. */

/** Whether an element lies in something that scrolls up and down. */
export function isInScroller(element) {
  if (document.fullscreenElement) return false
  for (let node = element; node; node = node.assignedSlot ?? node.parentNode ?? node.host) {
    if (!(node instanceof Element) || node.scrollHeight <= node.clientHeight + 1) continue
    if (node === document.scrollingElement || /auto|scroll/.test(getComputedStyle(node).overflowY)) return true
  }
  return false
}

/**
 * Let a page be scrolled past a canvas: its wheel zooms with Ctrl, after a click, or where nothing scrolls; one finger that moves up or
 * down scrolls. To be called after others have set what they want of the canvas; returns what has to be called when the page changes.
 */
export function letScroll(canvas, signal) {
  const isOurs = ({ ctrlKey, metaKey }) => ctrlKey || metaKey || canvas.matches(':focus') || !isInScroller(canvas)
  // Before those who listen on the canvas itself.
  canvas.addEventListener('wheel', (event) => isOurs(event) || event.stopImmediatePropagation(), { capture: true, signal })
  const fit = () => (canvas.style.touchAction = isInScroller(canvas) ? 'pan-y' : 'none')
  canvas.addEventListener('pointerenter', fit, { signal })
  return fit
}
