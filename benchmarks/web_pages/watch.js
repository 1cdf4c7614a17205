// Notes when a model is on screen, in milliseconds since the click, and what the page did until then.
globalThis.seen = { first: null, complete: null, shown: null, deviation: 0, tasks: [], bytes: 0 }
;(() => {
  const tasks = []
  const keep = (list) => tasks.push(...list.getEntries())
  new PerformanceObserver(keep).observe({ type: 'longtask', buffered: true })
  const onScreen = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)))

  /** How much the colours of a picture differ: of one colour, not at all. */
  async function deviation(viewer) {
    const bitmap = await createImageBitmap(viewer.shadowRoot.querySelector('canvas'))
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d')
    context.drawImage(bitmap, 0, 0)
    // In front of the model's middle there is nothing but the model's texture and slow shading.
    const [x, y] = [bitmap.width * 0.2, bitmap.height * 0.6]
    const { data } = context.getImageData(x, y, bitmap.width * 0.2, bitmap.height * 0.15)
    const reds = data.filter((_, n) => n % 4 === 0)
    const mean = reds.reduce((sum, red) => sum + red, 0) / reds.length
    return Math.sqrt(reds.reduce((sum, red) => sum + (red - mean) ** 2, 0) / reds.length)
  }

  async function note(type, event) {
    await onScreen()
    if (seen[type] !== null) return
    seen[type] = performance.now()
    if (type === 'first') {
      seen.shown = event.detail
      if (event.target.localName === 'upholster-viewer') seen.deviation = await deviation(event.target)
      return
    }
    await onScreen()
    seen.tasks = tasks.filter(({ startTime }) => startTime > (seen.first ?? 0)).map(({ duration }) => duration)
    const all = [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')]
    seen.bytes = all.reduce((sum, { transferSize }) => sum + transferSize, 0)
  }
  addEventListener('first', (event) => note('first', event), true)
  addEventListener('complete', (event) => note('complete', event), true)
  // <model-viewer> shows nothing before all is there. No load event of an element reaches the window.
  document.addEventListener('load', (event) => event.target.localName === 'model-viewer' && note('complete', event), true)
})()
