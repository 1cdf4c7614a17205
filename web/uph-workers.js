/**
 * Workers for streams, a few for all of a page's, and what a page has asked for before the viewer came.
 *
 * A page can save the time until the viewer's script is there: `globalThis.upholsterEarly` may have a `worker` that runs
 * uph-worker.js, and a stream's `url` and `response`, the promise of `fetch`, of the whole stream or of a first part by range.
 */

const MOST = 3 // workers of one address

const hosts = new Set() // {address, worker, places}

/** Hosts of an address, those with the fewest streams first. */
const hostsOf = (address) => [...hosts].filter((host) => host.address === address).sort((a, b) => a.places.size - b.places.size)

/** Vite and webpack build a worker of their own from `new Worker(new URL(…))`, where it stands just so. */
const started = (address) =>
  address ? new Worker(address, { type: 'module' }) : new Worker(new URL('./uph-worker.js', import.meta.url), { type: 'module' })

function start(address, worker = started(address)) {
  const host = { address, worker, places: new Set() }
  worker.onerror = (event) => {
    hosts.delete(host)
    for (const place of host.places) place.onerror(event)
  }
  hosts.add(host)
  return host
}

/** Have a worker wait for the first stream. */
export function prepareWorker(address) {
  if (!hostsOf(address)[0]) start(address)
}

/** The worker at which a place is, or where there is room for another; null: a new one is to be started. */
function hostFor(address, beside) {
  const known = hostsOf(address)
  const free = known.length >= MOST || known[0]?.places.size === 0 ? known[0] : null
  return known.find(({ places }) => places.has(beside)) ?? free
}

/**
 * A place for a stream, to be used as a `Worker`: at the worker that `beside`, a place, is at; else at one that has none yet, at a new one, or
 * where there are fewest.
 */
export function takeWorker(address, beside = null) {
  const early = globalThis.upholsterEarly
  if (early?.worker && !address) {
    start(address, early.worker)
    early.worker = null
  }
  const host = hostFor(address, beside) ?? start(address)
  const { port1: place, port2: port } = new MessageChannel()
  host.worker.postMessage({ kind: 'join', port }, [port])
  host.places.add(place)
  // This function, which lives as long as the stream, knows none of those before: they are freed.
  // A worker ends with its last stream. One that ends before others is told so, and does no more.
  place.terminate = () => {
    place.postMessage({ kind: 'close' })
    place.close()
    host.places.delete(place)
    if (host.places.size) return
    host.worker.terminate()
    hosts.delete(host)
  }
  return place
}

/** The response that the page awaits already for an address, or null. */
export function takeEarly(address) {
  const early = globalThis.upholsterEarly
  if (!early?.response || new URL(early.url, location).href !== new URL(address, location).href) return null
  const { response } = early
  early.response = null
  return response
}
