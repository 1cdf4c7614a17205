// Times web/uph.js on one file, and prints milliseconds as JSON: `node decoder.mjs image|paint FILE`.
import { readFileSync } from 'node:fs'

import { EzwDecoder, UphDecoder } from '../web/uph.js'

const PIECE = 1024
const ROUNDS = 15
const LAST_PIECE = 100

const median = (times) => times.toSorted((a, b) => a - b)[times.length >> 1]

function timed(work) {
  const start = performance.now()
  work()
  return performance.now() - start
}

/** Decode an image as it comes, with a picture after each piece: times of feeding and of showing, by piece. */
function decode(data) {
  const decoder = new EzwDecoder()
  const [fed, shown] = [[], []]
  for (let place = 0; place < data.length; place += PIECE) {
    fed.push(timed(() => decoder.feed(data.subarray(place, place + PIECE))))
    shown.push(timed(() => decoder.image()))
  }
  return { fed, shown }
}

function image(data) {
  const sum = (times) => times.reduce((total, time) => total + time, 0)
  const cold = decode(data)
  const first = 4096 / PIECE
  const warm = Array.from({ length: ROUNDS }, () => decode(data).fed)
  // Whole pieces alone, the first of which builds the trees as well.
  const pieces = warm[0].slice(1, -1).map((_, n) => median(warm.map((fed) => fed[n + 1])))
  return {
    first: sum([...cold.fed.slice(0, first), ...cold.shown.slice(0, first)]),
    all: sum([...cold.fed, ...cold.shown]),
    fedFirst: sum(cold.fed.slice(0, first)),
    pieces,
  }
}

/** Read a stream but for its end, paint it, then feed the end in small pieces and paint again after each. */
function paint(data) {
  const decoder = new UphDecoder()
  const feedTo = (end, piece) => {
    while (decoder.received < end) decoder.feed(data.subarray(decoder.received, Math.min(end, decoder.received + piece)))
  }
  const read = timed(() => feedTo(data.length - 2 * ROUNDS * LAST_PIECE, PIECE))
  const into = decoder.charts.map(({ height, width }) => new Uint8Array(4 * (height + 2) * (width + 2)))
  const texels = () => decoder.charts.forEach((_, n) => decoder.texels(n))
  const rgba = () =>
    decoder.charts.forEach(({ width }, n) => {
      decoder.rgba(n, { into: into[n], stride: width + 2, offset: 4 * (width + 3) })
    })
  const again = (work) =>
    median(Array.from({ length: ROUNDS }, () => {
      feedTo(decoder.received + LAST_PIECE, LAST_PIECE) // the exemplar gets better
      return timed(work)
    }))
  const cold = timed(rgba)
  return { read, cold, texels: again(texels), rgba: again(rgba) }
}

const [what, path] = process.argv.slice(2)
console.log(JSON.stringify({ image, paint }[what](new Uint8Array(readFileSync(path)))))
