/**
 * Workers for streams, and what a page has asked for before the viewer came.
 *
 * A page can save the time until the viewer's script is there: `globalThis.upholsterEarly` may have a `worker` that runs
 * uph-worker.js, and a stream's `url` and `response`, the promise of `fetch`, of the whole stream or of a first part by range.
 */

let spare = null // waits for a stream

const key = (address) => address ?? ''

function start(address) {
  if (address) return new Worker(address, { type: 'module' })
  return new Worker(new URL('./uph-worker.js', import.meta.url), { type: 'module' })
}

/** Have a worker wait for the first stream. */
export function prepareWorker(address) {
  spare ??= { key: key(address), worker: start(address) }
}

/** A worker that has no stream yet. */
export function takeWorker(address) {
  const early = globalThis.upholsterEarly
  const found = early?.worker && !address ? early.worker : spare?.key === key(address) ? spare.worker : null
  if (found === early?.worker && early) early.worker = null
  else if (found) spare = null
  return found ?? start(address)
}

/** The response that the page awaits already for an address, or null. */
export function takeEarly(address) {
  const early = globalThis.upholsterEarly
  if (!early?.response || new URL(early.url, location.href).href !== new URL(address, location.href).href) return null
  const { response } = early
  early.response = null
  return response
}
