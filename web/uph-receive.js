// Fetching a stream over a line that may break: what is missing is asked for by range.

const TRIES = 8 // in a row without a byte
const SILENCE = 20_000 // milliseconds without a byte: the connection is lost
const LONGEST_WAIT = 8000

/** Told by the server, or for ever: no use to ask again. */
class Refusal extends Error {}

/**
 * Fetch `url` and hand its bytes to `sink` as they come.
 *
 * `sink` has `received`, the bytes it has; `signal`, which ends all this; `feed(bytes)`, `end()`; and
 * `dispatchEvent`, for `stalled` {attempt, message} and `resumed`. Rejects with an Error of one line.
 */
export async function receive(url, sink, options) {
  let seen = null // what tells this version of the file from another
  for (let attempt = 0; !sink.signal.aborted; ) {
    const before = sink.received
    try {
      seen = await receiveOnce(url, sink, options, seen, attempt)
      sink.end()
      return
    } catch (error) {
      if (sink.signal.aborted) return
      if (error instanceof Refusal) throw error
      attempt = sink.received > before ? 1 : attempt + 1
      if (!(sink.received || error.answered) || attempt > TRIES) throw new Error(`${url} can not be loaded: ${error.message}`)
      seen = before ? (seen ?? error.seen) : error.seen
      sink.dispatchEvent({ type: 'stalled', attempt, message: error.message })
      await pause(Math.min(LONGEST_WAIT, 125 * 2 ** attempt), sink.signal)
    }
  }
}

async function receiveOnce(url, sink, { headers, ...options }, seen, attempt) {
  const start = sink.received
  const lost = new AbortController()
  const stop = () => lost.abort()
  sink.signal.addEventListener('abort', stop)
  let timer = setTimeout(stop, SILENCE)
  let version = seen
  let answered = attempt > 0 // a connection that breaks before its first byte is lost all the same
  try {
    const asked = new Headers(headers)
    if (start) {
      asked.set('Range', `bytes=${start}-`)
      // Across origins this header would need leave of the server; the answer is compared in any case.
      if (seen && new URL(url, location.href).origin === location.origin) asked.set('If-Range', seen)
    }
    const response = await fetch(url, { ...options, headers: asked, signal: lost.signal })
    if (start && response.status === 416) return seen // there is no more
    if (response.status >= 500 || response.status === 429) throw new Error(`the server says ${response.status}`)
    if (!response.ok) throw new Refusal(`${url} can not be loaded: the server says ${response.status}`)
    answered = true
    version = strong(response.headers.get('ETag')) ?? response.headers.get('Last-Modified')
    if (start && seen && version && version !== seen) throw new Refusal(`${url} has changed on the server`)
    let skip = start && response.status !== 206 ? start : 0
    const place = /^bytes (\d+)-/.exec(response.headers.get('Content-Range') ?? '')
    if (response.status === 206 && place && Number(place[1]) !== start) throw new Refusal(`${url} comes from a wrong place`)
    if (attempt) sink.dispatchEvent({ type: 'resumed' })
    const reader = response.body.getReader()
    for (;;) {
      const { done, value } = await reader.read()
      if (done) return version
      clearTimeout(timer)
      timer = setTimeout(stop, SILENCE)
      const used = Math.min(skip, value.length)
      skip -= used
      if (used < value.length) sink.feed(used ? value.slice(used) : value)
    }
  } catch (error) {
    throw Object.assign(lost.signal.aborted ? new Error('nothing comes any more') : error, { seen: version, answered })
  } finally {
    clearTimeout(timer)
    sink.signal.removeEventListener('abort', stop)
  }
}

/** An entity tag that stands for the very bytes; a weak one does not. */
function strong(tag) {
  return tag?.startsWith('"') ? tag : null
}

/** Wait, but no longer than until the machine is on line again, or all is over. */
function pause(milliseconds, signal) {
  return new Promise((resolve) => {
    const go = () => {
      clearTimeout(timer)
      globalThis.removeEventListener?.('online', go)
      signal.removeEventListener('abort', go)
      resolve()
    }
    const timer = setTimeout(go, milliseconds)
    globalThis.addEventListener?.('online', go)
    signal.addEventListener('abort', go)
  })
}
