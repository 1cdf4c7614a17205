// Notes when a model is on screen, in milliseconds since the click, and the page's longest task.
globalThis.seen = { first: null, complete: null, longest: 0 }
;(() => {
  const keep = (list) => (seen.longest = Math.max(seen.longest, ...list.getEntries().map(({ duration }) => duration)))
  new PerformanceObserver(keep).observe({ type: 'longtask', buffered: true })

  async function note(type) {
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done)))
    seen[type] ??= performance.now()
  }
  addEventListener('first', () => note('first'), true)
  addEventListener('complete', () => note('complete'), true)
  // <model-viewer> shows nothing before all is there. No load event of an element reaches the window.
  document.addEventListener('load', (event) => event.target.localName === 'model-viewer' && note('complete'), true)
})()
