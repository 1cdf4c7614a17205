/** Texts of the viewer: quantities, states and errors. */

/** A whole number with separators: 4,045,092. */
export const count = (n) => n.toLocaleString('en')

/** An amount of data with at most three digits, as the command line gives it: 640 B, 8 kB, 8.2 kB, 110 kB, 1.3 MB. */
export function amount(bytes) {
  if (bytes < 1000) return `${bytes} B`
  const [value, unit] = bytes < 999500 ? [bytes / 1e3, 'kB'] : [bytes / 1e6, 'MB']
  return `${value < 9.95 ? value.toFixed(1).replace('.0', '') : Math.round(value)} ${unit}`
}

/** A share of 0 to 1 in per cent, never rounded up to all nor down to nothing. */
export function percent(share) {
  const value = 100 * share
  if (value > 0 && value < 1) return 'under 1 %'
  return `${value < 100 ? Math.min(Math.round(value), 99) : 100} %`
}

/** A time: 640 ms, 3.4 s, 71 s. */
export function duration(milliseconds) {
  if (milliseconds < 995) return `${Math.round(milliseconds)} ms`
  return `${(milliseconds / 1000).toFixed(milliseconds < 9950 ? 1 : 0)} s`
}

const KEPT = 'The picture shows what was loaded before.'

/** What answers of a server mean, by status. */
const ANSWERS = {
  401: ['can not be read.', 'The server asks for a login.'],
  403: ['can not be read.', 'The server refuses access.'],
  404: ['was not found.', 'Check the address.'],
  410: ['is no longer there.', 'Check the address.'],
}

/** Messages of the decoder about a caller's limits. */
const TOO_LARGE = /number of (texels|samples|charts|triangles) is \d+; allowed: 1 to/

/**
 * What an error means to the user.
 *
 * @param {Error} error as `Model` gives it
 * @param {{ shown: boolean, received: number, total: number | null, name: string }} state whether a picture is there, the
 *   bytes received and to come, and what was opened
 * @returns {{ title: string, advice: string, detail: string }} a sentence, what it means, and the loader's own words
 */
export function explain(error, { shown, received, total, name }) {
  const detail = error.message
  const say = (title, advice) => ({ title, advice: shown ? KEPT : advice, detail })
  if (detail.startsWith('the stream is cut')) {
    const title = `${name} ends after ${amount(received)}${total === null ? '' : ` of ${amount(total)}`}.`
    const advice = shown ? 'The picture shows all that it holds; the rest is missing.' : 'That is too little for a picture.'
    return { title, advice, detail: '' }
  }
  if (/^(limit|maxtexels) /.test(detail)) return say(`${name} was not loaded: an attribute of this element is wrong.`, '')
  if (Number.isInteger(error.offset)) {
    if (TOO_LARGE.test(detail)) return say(`${name} is larger than this page allows.`, '')
    if (!shown && error.offset < 8) return say(`${name} is no .uph stream.`, 'Check the address, or the server that answers.')
    return say(`${name} is damaged after ${amount(error.offset)}.`, 'Nothing can be shown. Write or download the file again.')
  }
  const status = Number(/the server says (\d+)/.exec(detail)?.[1] ?? 0)
  if (status) {
    const [what, advice] = ANSWERS[status] ?? ['could not be fetched.', 'The server failed. Try again in a while.']
    return say(`${name} ${what}`, advice)
  }
  if (detail.includes('changed on the server')) return say(`${name} was replaced while it was loading.`, 'Load it again.')
  if (detail.includes('can not be loaded')) {
    if (shown) return say('The connection was lost.', '')
    return say(`${name} could not be fetched.`, 'You may be offline, or its server does not let this page read it (CORS).')
  }
  return say('Something went wrong.', 'Nothing can be shown.')
}
