/** Requests to the server: each resolves to its answer, or throws an Error with a one-line message for the user. */

const TAB = (sessionStorage.tab ??= crypto.randomUUID())

/** Thrown if another tab has the session. */
export class TakenError extends Error {}

/** Thrown if the server does not accept what was asked, or fails at it: asking again gives the same answer. */
export class RefusedError extends Error {}

async function asked(address, { json, ...how } = {}) {
  const headers = { 'X-Tab': TAB, ...how.headers }
  if (how.method === 'POST') headers['X-Upholster'] = 'studio'
  if (json !== undefined) {
    headers['Content-Type'] = 'application/json'
    how.body = JSON.stringify(json)
  }
  let answer
  try {
    answer = await fetch(address, { credentials: 'same-origin', ...how, headers })
  } catch (error) {
    if (how.signal?.aborted) throw error
    throw new Error('The studio does not answer. Is the program still running?')
  }
  if (answer.ok || answer.status === 410) return answer
  const { error = `an internal error occurred (${answer.status}); see the terminal for details` } = await answer.json().catch(() => ({}))
  if (answer.status === 409) throw new TakenError(error)
  throw new ([413, 422, 500].includes(answer.status) ? RefusedError : Error)(error)
}

const post = (address, json) => asked(address, { method: 'POST', json })
const inJson = async (answer) => (await answer).json()

/** Exchange the address's token for a cookie, which requests after a reload send. */
export async function enter() {
  const token = location.hash.slice(1)
  if (!token) return
  history.replaceState(null, '', location.pathname)
  await post('/enter', { token }).catch(() => {}) // the token is valid once; the cookie may exist already
}

export const session = () => inJson(asked('/session'))
export const take = () => post('/take', { tab: TAB })
export const roles = (names) => inJson(post('/roles', { names }))
export const source = (path) => inJson(post('/sources', { path }))
export const hints = (path) => inJson(post('/hints', { path }))
export const change = (state) => inJson(post('/state', { state }))
export const pick = (ray) => inJson(post('/pick', ray))
/** `depth` is that of the relief in files for printers; undefined: as the state has it. */
export const save = (revision, targets, depth) => inJson(post('/save', { revision, targets, depth }))
export const keep = (id, over) => inJson(post('/keep', { id, over }))

/**
 * Send a file, named with its folders; `group` is the group of files that belong together, undefined for a new one; `made`, whether it is no
 * file that the user has.
 */
export async function upload(file, path, { group, made }) {
  const [, folder, name] = /^(.*?)\/?([^/]*)$/.exec(path)
  const more = Object.entries({ name, folder, group, made }).filter(([, value]) => value !== undefined)
  const address = `/blobs?${new URLSearchParams(more)}`
  return inJson(asked(address, { method: 'POST', body: file }))
}

/** Address of a picture of a blob. */
export const picture = (path, size = 160, role) =>
  `/pictures/${path.split('/').map(encodeURIComponent).join('/')}?size=${size}${role ? `&role=${role}` : ''}`

/** The sample read with options: a blob, its own size, and its repeating element: width and height, or only the distance of rows. */
export async function prepared(path, options, size = 512) {
  const place = path.split('/').map(encodeURIComponent).join('/')
  const answer = await asked(`/prepared/${place}?size=${size}&options=${encodeURIComponent(JSON.stringify(options))}`)
  const [width, height] = ['X-Width', 'X-Height'].map((name) => Number(answer.headers.get(name)))
  const element = answer.headers.get('X-Element').split(',').filter(Boolean).map(Number)
  return { picture: await answer.blob(), width, height, element }
}

/** Facts about a revision's model and sample; null while they are not known. */
export async function facts(revision) {
  const answer = await asked(`/facts/${revision}`)
  return answer.status === 200 ? answer.json() : null
}

/** Line segments that show something of a revision, six numbers each. */
export async function overlay(revision, kind) {
  return new Float32Array(await (await asked(`/overlays/${revision}?kind=${kind}`)).arrayBuffer())
}

/**
 * Yield the results of a revision up to its last look: `{stage, done, total}`, or `{streams, isFinal, seconds}`. Ends early if another revision
 * replaced it.
 */
export async function* looks(revision, signal) {
  for (let after = 0, isFinal = false; !isFinal; ) {
    const answer = await asked(`/looks/${revision}?after=${after}`, { signal })
    if (answer.status === 410) return
    if (answer.status === 204) continue
    if (answer.status === 202) yield await answer.json()
    else {
      const header = (name) => Number(answer.headers.get(name))
      after = header('X-Look')
      isFinal = header('X-Final') === 1
      yield { streams: parted(await answer.arrayBuffer()), isFinal, seconds: header('X-Seconds') }
    }
  }
}

/** The streams in one body: their count, then the length and bytes of each. */
function parted(body) {
  const view = new DataView(body)
  const streams = []
  for (let at = 4; streams.length < view.getUint32(0, true); ) {
    const length = view.getUint32(at, true)
    streams.push(new Uint8Array(body, at + 4, length))
    at += 4 + length
  }
  return streams
}
