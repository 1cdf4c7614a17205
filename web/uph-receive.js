// Fetching a stream over an unreliable connection: missing bytes are requested by range.

const MAX_ATTEMPTS = 8 // in a row without a byte
const SILENCE_LIMIT = 20_000 // milliseconds without a byte, after which the connection counts as lost
const LONGEST_WAIT = 8000

/** An error that a repeated request would not change. */
class Refusal extends Error {}

/**
 * Fetch `url` and pass its bytes to `sink` as they arrive.
 *
 * `sink` has `received`, the bytes it has; `signal`, which ends the transfer; `feed(bytes)`, `end()`; and
 * `dispatchEvent`, for `stalled` {attempt, message} and `resumed`. Rejects with an Error of one line.
 *
 * `early` may be the promise of an earlier response to `url`, of all or of a first part: then the rest is requested
 * when `sink.running` resolves, because only then it can be used.
 */
export async function receive(url, sink, options, early = null) {
  let version = null // identifies this version of the file
  for (let attempt = 0; !sink.signal.aborted; ) {
    const before = sink.received
    const own = early
    early = null
    try {
      const got = await receiveOnce(url, sink, options, version, attempt, own)
      version = got.version
      if (own && got.isPart) {
        await sink.running
        continue
      }
      sink.end()
      return
    } catch (error) {
      if (sink.signal.aborted) return
      if (error instanceof Refusal) throw error
      if (own && !sink.received) continue // request it again, as if there had been no early response
      attempt = sink.received > before ? 1 : attempt + 1
      if (!(sink.received || error.answered) || attempt > MAX_ATTEMPTS) throw new Error(`${url} can not be loaded: ${error.message}`)
      version = before ? (version ?? error.version) : error.version
      sink.dispatchEvent({ type: 'stalled', attempt, message: error.message })
      await pause(Math.min(LONGEST_WAIT, 125 * 2 ** attempt), sink.signal)
    }
  }
}

/** One request and its answer: the version of the file, and whether a part other than the last was requested. */
async function receiveOnce(url, sink, { headers, ...options }, known, attempt, early) {
  const start = sink.received
  const connection = new AbortController()
  const stop = () => connection.abort()
  sink.signal.addEventListener('abort', stop)
  let timer = setTimeout(stop, SILENCE_LIMIT)
  let version = known
  let answered = attempt > 0 // a connection that breaks before its first byte is lost all the same
  try {
    const ownHeaders = new Headers(headers)
    if (start) {
      ownHeaders.set('Range', `bytes=${start}-`)
      // Across origins this header would need the server's permission; the answer is compared in any case.
      if (known && new URL(url, location).origin === location.origin) ownHeaders.set('If-Range', known)
    }
    const response = await (early ?? fetch(url, { ...options, headers: ownHeaders, signal: connection.signal }))
    if (start && response.status === 416) return { version: known } // there is no more
    if (response.status >= 500 || response.status === 429) throw new Error(`the server says ${response.status}`)
    if (!response.ok) throw new Refusal(`${url} can not be loaded: the server says ${response.status}`)
    answered = true
    version = strongTag(response.headers.get('ETag')) ?? response.headers.get('Last-Modified')
    if (start && known && version && version !== known) throw new Refusal(`${url} has changed on the server`)
    let skip = start && response.status !== 206 ? start : 0
    const place = /^bytes (\d+)-(\d+)\/(.*)/.exec(response.headers.get('Content-Range') ?? '')
    const isPart = place !== null && !(Number(place[2]) + 1 >= Number(place[3]))
    if (response.status === 206 && place && Number(place[1]) !== start) throw new Refusal(`${url} comes from a wrong place`)
    if (attempt) sink.dispatchEvent({ type: 'resumed' })
    const reader = response.body.getReader()
    for (;;) {
      const { done, value } = await reader.read()
      if (done) return { version, isPart }
      clearTimeout(timer)
      timer = setTimeout(stop, SILENCE_LIMIT)
      const used = Math.min(skip, value.length)
      skip -= used
      if (used < value.length) sink.feed(used ? value.slice(used) : value)
    }
  } catch (error) {
    throw Object.assign(connection.signal.aborted ? new Error('nothing comes any more') : error, { version, answered })
  } finally {
    clearTimeout(timer)
    sink.signal.removeEventListener('abort', stop)
  }
}

/** An entity tag that stands for the very bytes; a weak one does not. */
function strongTag(tag) {
  return tag?.startsWith('"') ? tag : null
}

/** Wait, but no longer than until the machine is online again, or the signal ends it. */
function pause(milliseconds, signal) {
  return new Promise((resolve) => {
    setTimeout(resolve, milliseconds)
    globalThis.addEventListener?.('online', resolve, { once: true })
    signal.addEventListener('abort', resolve, { once: true })
  })
}
