/** Requests to the server: each answers with what is asked for, or throws an Error with one line for people. */

const TAB = (sessionStorage.tab ??= crypto.randomUUID())

/** Thrown where another tab has the session. */
export class TakenError extends Error {}

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
  const { error = `the server says ${answer.status}` } = await answer.json().catch(() => ({}))
  if (answer.status === 409) throw new TakenError(error)
  throw new Error(error)
}

const post = (address, json) => asked(address, { method: 'POST', json })
const inJson = async (answer) => (await answer).json()

/** Exchange the token of the address for a cookie; what is asked for again after a reload has that. */
export async function enter() {
  const token = location.hash.slice(1)
  if (!token) return
  history.replaceState(null, '', location.pathname)
  await post('/enter', { token }).catch(() => {}) // it counts once; the cookie may be there
}

export const session = () => inJson(asked('/session'))
export const take = () => post('/take', { tab: TAB })
export const source = (path) => inJson(post('/sources', { path }))
export const hints = (path) => inJson(post('/hints', { path }))
export const change = (state) => inJson(post('/state', { state }))
export const pick = (ray) => inJson(post('/pick', ray))
export const save = (revision, targets) => inJson(post('/save', { revision, targets }))
export const keep = (id, over) => inJson(post('/keep', { id, over }))

/** Send a file; `group` is of files that belong together, none for a new one. */
export async function upload(file, name, group) {
  const address = `/blobs?name=${encodeURIComponent(name)}${group === undefined ? '' : `&group=${group}`}`
  return inJson(asked(address, { method: 'POST', body: file }))
}

/** Address of a picture of a blob. */
export const picture = (path, size = 160, role) =>
  `/pictures/${path.split('/').map(encodeURIComponent).join('/')}?size=${size}${role ? `&role=${role}` : ''}`

/** The sample as it is read with options: a blob, its own size, and of what repeats in it width and height, or the distance of rows alone. */
export async function prepared(path, options, size = 512) {
  const place = path.split('/').map(encodeURIComponent).join('/')
  const answer = await asked(`/prepared/${place}?size=${size}&options=${encodeURIComponent(JSON.stringify(options))}`)
  const [width, height] = ['X-Width', 'X-Height'].map((name) => Number(answer.headers.get(name)))
  const element = answer.headers.get('X-Element').split(',').filter(Boolean).map(Number)
  return { picture: await answer.blob(), width, height, element }
}

/** What is known of a revision's model and sample; null while it is not. */
export async function facts(revision) {
  const answer = await asked(`/facts/${revision}`)
  return answer.status === 200 ? answer.json() : null
}

/** Line segments that show something of a revision, six numbers each. */
export async function overlay(revision, kind) {
  return new Float32Array(await (await asked(`/overlays/${revision}?kind=${kind}`)).arrayBuffer())
}

/**
 * Yield what comes of a revision until its last look: `{stage, done, total}`, or `{streams, isFinal, seconds}`. Ends early where another revision
 * took its place.
 */
export async function* looks(revision, signal) {
  for (let after = 0, isFinal = false; !isFinal; ) {
    const answer = await asked(`/looks/${revision}?after=${after}`, { signal })
    if (answer.status === 410) return
    if (answer.status === 204) continue
    if (answer.status === 202) yield await answer.json()
    else {
      const told = (name) => Number(answer.headers.get(name))
      after = told('X-Look')
      isFinal = told('X-Final') === 1
      yield { streams: parted(await answer.arrayBuffer()), isFinal, seconds: told('X-Seconds') }
    }
  }
}

/** The streams in one body: their count, then each one's length and bytes. */
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
