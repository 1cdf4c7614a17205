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

/** The worker of a place, or one with room for another; null: start a new one. */
function hostFor(address, neighbour) {
  const known = hostsOf(address)
  const free = known.length >= MOST || known[0]?.places.size === 0 ? known[0] : null
  return known.find(({ places }) => places.has(neighbour)) ?? free
}

/**
 * A place for a stream, to be used as a `Worker`: at the worker of `neighbour`, another place, if given; else at a worker without places, at a new one, or
 * at the one with the fewest.
 */
export function takeWorker(address, neighbour = null) {
  const early = globalThis.upholsterEarly
  if (early?.worker && !address) {
    start(address, early.worker)
    early.worker = null
  }
  const host = hostFor(address, neighbour) ?? start(address)
  const { port1: place, port2: port } = new MessageChannel()
  host.worker.postMessage({ kind: 'join', port }, [port])
  host.places.add(place)
  // This function, which lives as long as the stream, knows none of those before: they are freed.
  // A worker ends with its last stream. A stream that is closed before others stops its work.
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
