// Notes when a model is on screen, in milliseconds since the click, and what the page did until then.
globalThis.seen = { first: null, complete: null, shown: null, deviation: 0, tasks: [], bytes: 0 }
;(() => {
  const tasks = []
  let measured = 0
  const keep = (list) => tasks.push(...list.getEntries())
  new PerformanceObserver(keep).observe({ type: 'longtask', buffered: true })
  const onScreen = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)))

  /** How much the colours of the model differ within a small square: slow shading hardly differs there. */
  async function deviation(viewer) {
    const bitmap = await createImageBitmap(viewer.shadowRoot.querySelector('canvas'))
    const { width, height } = bitmap
    const context = new OffscreenCanvas(width, height).getContext('2d')
    context.drawImage(bitmap, 0, 0)
    const size = Math.round(width / 20)
    let most = 0
    for (let y = 0; y + size <= height; y += size) {
      for (let x = 0; x + size <= width; x += size) {
        const { data } = context.getImageData(x, y, size, size)
        const reds = data.filter((_, n) => n % 4 === 0)
        // What lies behind the model is grey.
        if (reds.some((red, n) => red - data[4 * n + 2] < 8)) continue
        const mean = reds.reduce((sum, red) => sum + red, 0) / reds.length
        most = Math.max(most, Math.sqrt(reds.reduce((sum, red) => sum + (red - mean) ** 2, 0) / reds.length))
      }
    }
    return most
  }

  async function note(type, event) {
    await onScreen()
    if (seen[type] !== null) return
    seen[type] = performance.now()
    if (type === 'first') {
      seen.shown = event.detail
      if (event.target.localName === 'upholster-viewer') seen.deviation = await deviation(event.target)
      measured = performance.now() // reading the picture back is no work of the page
      return
    }
    await onScreen()
    seen.tasks = tasks.filter(({ startTime }) => startTime > Math.max(measured, seen.first ?? 0)).map(({ duration }) => duration)
    const all = [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')]
    seen.bytes = all.reduce((sum, { transferSize }) => sum + transferSize, 0)
  }
  addEventListener('first', (event) => note('first', event), true)
  addEventListener('complete', (event) => note('complete', event), true)
  // <model-viewer> shows nothing before all is there. No load event of an element reaches the window.
  document.addEventListener('load', (event) => event.target.localName === 'model-viewer' && note('complete', event), true)
})()
