/**
 * Drag on a canvas before its other listeners see it: for turning the light.
 *
 * @param {HTMLElement} parent of the canvas
 * @param {HTMLCanvasElement} canvas
 * @param {{ starts: (event: PointerEvent) => boolean, moves: (x: number, y: number) => void, signal: AbortSignal }} options whether a
 *   press starts a drag; what to do with steps in pixels, to the right and down; and what ends all this
 */
export function onDrag(parent, canvas, { starts, moves, signal }) {
  parent.addEventListener('pointerdown', (press) => {
    if (press.target !== canvas || !press.isPrimary || press.button !== 0 || !starts(press)) return
    press.stopPropagation()
    canvas.setPointerCapture(press.pointerId)
    const ending = new AbortController()
    const listen = (type, work) => {
      const own = (event) => event.pointerId === press.pointerId && work(event)
      canvas.addEventListener(type, own, { signal: ending.signal })
    }
    let [x, y] = [press.clientX, press.clientY]
    listen('pointermove', ({ clientX, clientY }) => {
      moves(clientX - x, clientY - y)
      ;[x, y] = [clientX, clientY]
    })
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) listen(type, () => ending.abort())
  }, { capture: true, signal })
}
