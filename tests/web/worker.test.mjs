// What the worker hands to the page: run with `node --test`, also by test_web_worker.py, which gives STREAMS, a folder.
import assert from 'node:assert/strict'
import { readFileSync, readdirSync } from 'node:fs'
import { test } from 'node:test'
import { pathToFileURL } from 'node:url'

import { UphDecoder } from '../../web/uph.js'
import { edgeLines, putGutter } from '../../web/uph-gutter.js'
import { SurfaceMesher, TriangleMesher } from '../../web/uph-mesh.js'
import { UphClient } from '../../web/uph-client.js'
import { UphDecoder as Decoder } from '../../web/uph/decoder.js'
import { ImageDecoder } from '../../web/uph/image/image-decoder.js'
import { Samples, codeOf } from '../../web/worker/samples.js'
import { StreamSession } from '../../web/worker/stream-session.js'

const folders = [new URL('../vectors/', import.meta.url)]
if (process.env.STREAMS) folders.push(pathToFileURL(`${process.env.STREAMS}/`))
const streams = folders.flatMap((folder) =>
  readdirSync(folder)
    .filter((name) => name.endsWith('.uph'))
    .map((name) => [name, new Uint8Array(readFileSync(new URL(name, folder)))]),
)

test('an error of the worker is told, and so is a message that the page does not know', () => {
  const worker = { postMessage() {} }
  const told = []
  new UphClient(worker, {}, { notify: (type, { error }) => told.push([type, error.message, error.offset]) })
  worker.onmessage({ data: { kind: 'error', message: 'cut', offset: 7 } })
  worker.onmessage({ data: { kind: 'weather', message: 'fine' } })
  assert.deepEqual(told, [
    ['error', 'cut', 7],
    ['error', 'uph-worker.js sent a message of unknown kind weather', undefined],
  ])
})

/** A page that shows what it is sent. */
class Page {
  textures = new Map()
  sizes = new Map() // of the textures, by chart
  meshes = new Map()
  errors = []
  widths = [] // of chart 0's textures, one after another
  paintings = 0
  ticket = 0

  constructor({ maxTextureSize = 4096, maxTexels = 2 ** 26, samples, ...options } = {}) {
    this.session = new StreamSession((message) => setImmediate(() => this.take(message)), samples)
    this.session.receive({ kind: 'open', maxTextureSize, maxTexels, ...options })
  }

  take({ kind, ...message }) {
    if (kind === 'surface') {
      this.surface = message
      for (const kept of [this.textures, this.sizes, this.meshes]) kept.clear()
    } else if (kind === 'meshes') for (const piece of message.pieces) this.meshes.set(piece.chart, piece)
    else if (kind === 'textures') {
      this.paintings++
      this.firstPainted ??= message.entries.map(({ chart }) => chart)
      for (const { chart, target, height, width, gutter, data } of message.entries) {
        const key = `${target} ${chart}`
        this.sizes.set(chart, { height, width })
        if (gutter) putGutter(this.textures.get(key), { height, width }, data)
        else {
          this.textures.set(key, data)
          if (chart === 0 && data) this.widths.push(width)
        }
      }
      this.session.receive({ kind: 'shown', buffers: [] })
    } else if (kind === 'state') {
      this.state = message.state
      if (message.state.idle && message.state.ticket === this.ticket) this.done?.()
    } else this.errors.push(message)
  }

  send(message) {
    this.session.receive({ ...message, ticket: ++this.ticket })
    return new Promise((resolve) => (this.done = resolve))
  }
}

/** What a decoder has of a chart's colour, without a gutter. */
function colour(decoder, chart) {
  const { height, width } = decoder.paintedSize(chart)
  const paint = (role) => decoder.rgba(chart, { role, into: new Uint8Array(4 * height * width), stride: width })
  const texels = paint('albedo')
  if (decoder.coefficients('opacity').known) {
    const opacity = paint('opacity')
    for (let n = 3; n < texels.length; n += 4) texels[n] = opacity[n - 1]
  }
  return texels
}

/** Everything that can be seen, in an order of its own. */
const seen = (page) => [...page.textures].sort(([a], [b]) => (a < b ? -1 : 1))

async function shown(data, options) {
  const page = new Page(options)
  await page.send({ kind: 'feed', bytes: data })
  assert.deepEqual(page.errors, [])
  return page
}

/** A stream that is shown when it is whole; the worker knows these samples. */
async function shownWhole(data, samples) {
  const page = new Page({ whole: true, samples })
  page.send({ kind: 'feed', bytes: data })
  await page.send({ kind: 'end' })
  return page
}

for (const [name, data] of streams) {
  test(`${name}: painted once, when it is whole, it is the same, whether or not its sample is known`, async (t) => {
    const plain = await shown(data)
    const samples = new Samples()
    for (const isKnown of [false, true]) {
      const decoding = t.mock.method(ImageDecoder.prototype, 'feed')
      const page = await shownWhole(data, samples)
      assert.equal(decoding.mock.callCount() === 0, isKnown)
      decoding.mock.restore()
      assert.deepEqual([page.errors, page.paintings], [[], 1])
      assert.deepEqual(seen(page), seen(plain))
      assert.deepEqual({ ...page.state, ticket: 0 }, { ...plain.state, ticket: 0 })
    }
  })

  test(`${name}: the texels in their gutters are the decoder's`, async () => {
    const page = await shown(data)
    const decoder = new UphDecoder()
    decoder.feed(data)
    assert.equal(page.meshes.size, decoder.charts.length)
    assert.ok(page.state.complete)
    decoder.charts.forEach((_, n) => {
      const { height, width } = decoder.paintedSize(n)
      const stride = width + 2
      const texture = page.textures.get(`color ${n}`)
      assert.equal(texture.length, 4 * stride * (height + 2))
      const plain = colour(decoder, n)
      for (let row = 0; row < height; row++) {
        const at = 4 * ((row + 1) * stride + 1)
        assert.deepEqual(texture.slice(at, at + 4 * width), plain.slice(4 * row * width, 4 * (row + 1) * width))
      }
    })
  })

  test(`${name}: a gutter holds what lies beyond the edge`, async () => {
    const page = await shown(data)
    const charts = [...page.sizes.keys()].sort((a, b) => a - b).map((n) => page.sizes.get(n))
    const decoder = new UphDecoder()
    decoder.feed(data)
    const Mesher = decoder.surface.kind === 'mesh' ? TriangleMesher : SurfaceMesher
    const mesher = new Mesher(decoder.surface, decoder.charts)
    let met = 0
    charts.forEach((size, n) => {
      const gutters = edgeLines(page.textures.get(`color ${n}`), size)
      const outside = gutterLines(page.textures.get(`color ${n}`), size)
      for (let edge = 0; edge < 4; edge++) {
        const beyond = mesher.seams(n, edge)
        if (!beyond.length && !mesher.seams(n, edge).length) assert.deepEqual(outside[edge], gutters[edge])
        for (const there of beyond) {
          if (there.start > 0 || there.stop < 1 || Math.abs(there.otherStop - there.otherStart) < 1) continue
          const other = edgeLines(page.textures.get(`color ${there.chart}`), charts[there.chart])[there.edge]
          if (other.length !== outside[edge].length) continue
          const expected = there.otherStart < there.otherStop ? other : reversed(other)
          assert.deepEqual(outside[edge], expected, `chart ${n}, edge ${edge}`)
          met++
        }
      }
    })
    if (charts.length > 4 && !['mesh', 'plane'].includes(decoder.surface.kind)) assert.ok(met > 4)
  })

  test(`${name}: pieces and their pace do not matter`, async () => {
    const whole = seen(await shown(data))
    const page = new Page()
    let at = 0
    for (let k = 0; at < data.length; k++) {
      const size = 1 + ((k * 7919) % Math.ceil(data.length / 7))
      const sent = page.send({ kind: 'feed', bytes: data.slice(at, (at += size)) })
      if (k % 5 === 1) await sent
    }
    await new Promise((resolve) => ((page.done = resolve), page.session.receive({ kind: 'none' })))
    assert.deepEqual(seen(page), whole)
  })

  test(`${name}: a limit shows what a cut stream shows, and can be lifted`, async () => {
    const page = await shown(data)
    const whole = seen(page)
    const decoder = new UphDecoder()
    decoder.feed(data)
    for (const share of [0.9, 0.4, 0.01]) {
      const bytes = Math.round(share * data.length)
      await page.send({ kind: 'limit', bytes })
      const cut = new UphDecoder()
      cut.feed(data.slice(0, Math.max(bytes, decoder.view)))
      assert.equal(page.state.bytes, cut.received)
      const { width } = page.sizes.get(0)
      const plain = colour(cut, 0)
      const texture = page.textures.get('color 0')
      assert.deepEqual(texture.slice(4 * (width + 3), 4 * (2 * width + 3)), plain.slice(0, 4 * width))
    }
    await page.send({ kind: 'limit', coefficients: 0.1 })
    assert.ok(page.state.coefficients >= 0.1 || page.state.complete)
    await page.send({ kind: 'limit' })
    assert.deepEqual(seen(page), whole)
  })
}

test('textures are sketched while labels are to come, and are in the end as if they had not been', async () => {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  const decoder = new UphDecoder()
  let half = 0
  while (decoder.needed || decoder.chartsKnown < decoder.charts.length) decoder.feed(data.subarray(half, ++half))
  const [page, plain] = [new Page({ sketches: 2000 }), new Page()]
  for (const one of [page, plain]) await one.send({ kind: 'feed', bytes: data.subarray(0, half) })
  const { width } = decoder.paintedSize(0)
  // The first is a sketch; as nothing more comes, the charts are painted in full.
  assert.ok(page.widths[0] < width)
  assert.deepEqual([page.widths.at(-1), ...plain.widths], [width, ...plain.widths.map(() => width)])
  assert.deepEqual(seen(page), seen(plain))
  for (const one of [page, plain]) await one.send({ kind: 'feed', bytes: data.subarray(half) })
  assert.equal(page.widths.at(-1), width)
  assert.deepEqual(seen(page), seen(plain))
})

/** Bytes of quilt.uph behind which so many of its placements are known, and the stream. */
function placed(...shares) {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  const decoder = new UphDecoder()
  let length = 0
  const lengths = shares.map((share) => {
    while (!decoder.placements.count || decoder.placements.known < share * decoder.placements.count) decoder.feed(data.subarray(length, ++length))
    return length
  })
  return { data, lengths, decoder }
}

test('while placements come, charts are painted when there are an eighth more', async () => {
  const { data, lengths } = placed(0.4, 0.42, 0.43, 0.47, 0.96, 1)
  const page = new Page()
  const painted = []
  let before = 0
  for (const length of lengths) {
    const { paintings } = page
    await page.send({ kind: 'feed', bytes: data.slice(before, length) })
    before = length
    painted.push(page.paintings > paintings)
  }
  assert.deepEqual(painted, [true, false, false, true, true, true])
})

test('where no more placements come, those that are there are painted', async () => {
  const { data, lengths, decoder } = placed(0.4, 0.42)
  const wanted = decoder.charts.map((_, n) => colour(decoder, n).slice(0, 4 * decoder.paintedSize(n).width))
  const rows = (page) => wanted.map((row, n) => page.textures.get(`color ${n}`).slice(row.length + 12).subarray(0, row.length))
  const limit = { kind: 'limit', bytes: lengths[1] }
  for (const message of [{ kind: 'end' }, limit]) {
    const page = new Page()
    await page.send({ kind: 'feed', bytes: data.slice(0, lengths[0]) })
    await page.send({ kind: 'feed', bytes: data.slice(lengths[0], lengths[1]) })
    assert.notDeepEqual(rows(page), wanted)
    await page.send(message)
    assert.deepEqual(rows(page), wanted)
  }
  const page = new Page()
  for (const message of [limit, { kind: 'feed', bytes: data.slice(0, lengths[0]) }, { kind: 'feed', bytes: data.slice(lengths[0]) }]) await page.send(message)
  assert.deepEqual(rows(page), wanted)
})

test('a base is shown until the surface takes its place, and again where a limit asks for it', async () => {
  const [, data] = streams.find(([name]) => name === 'base.uph')
  const part = Math.floor(data.length / 3)
  const onlyBase = await shown(data.slice(0, part))
  const whole = await shown(data)
  assert.deepEqual([onlyBase.state.isBase, whole.state.isBase], [true, false])
  const page = await shown(data.slice(0, part))
  await page.send({ kind: 'feed', bytes: data.slice(part) })
  assert.deepEqual([page.surface, seen(page)], [whole.surface, seen(whole)])
  await page.send({ kind: 'limit', bytes: part })
  assert.deepEqual([page.surface, seen(page)], [onlyBase.surface, seen(onlyBase)])
  await page.send({ kind: 'limit' })
  assert.deepEqual([page.surface, seen(page)], [whole.surface, seen(whole)])
  assert.deepEqual([...page.meshes.keys()], [...whole.meshes.keys()])
})

test('a model too large for the graphics card is painted smaller', async () => {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  const decoder = new UphDecoder()
  decoder.feed(data)
  const { height, width } = decoder.paintedSize(0)
  const small = await shown(data, { maxTextureSize: 2 + Math.max(height, width) / 2 })
  const density = decoder.density / 2
  assert.deepEqual(small.sizes.get(0), decoder.paintedSize(0, density))
  const texture = small.textures.get('color 0')
  const line = small.sizes.get(0).width
  assert.deepEqual(texture.slice(4 * (line + 3), 4 * (2 * line + 3)), decoder.rgba(0, { density, into: new Uint8Array(4 * line), stop: 1 }))
})

test('there are as many texels as the size on screen takes, and hardly more', async () => {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  const texels = []
  for (let pixels = 100; texels.length < 9; pixels *= 2 ** -0.25) {
    const { sizes } = await shown(data, { pixels })
    texels.push([...sizes.values()].reduce((sum, { height, width }) => sum + height * width, 0))
  }
  const ratios = texels.slice(1).map((count, n) => texels[n] / count)
  assert.ok(texels[0] > 5 * texels.at(-1), `${texels}`)
  assert.ok(ratios.every((ratio) => ratio < 2), `${texels}`) // a step of sizes is √2, and charts have whole texels
})

test('a complete stream has all of its coefficients', async () => {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  const page = new Page()
  await page.send({ kind: 'feed', bytes: data.slice(0, -1) })
  assert.ok(page.state.coefficients < 1)
  await page.send({ kind: 'feed', bytes: data.slice(-1) })
  assert.equal(page.state.coefficients, 1)
})

test('what is nearest to the eye is painted first', async () => {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  for (const eye of [[0, 0, 1], [-1, 0, 0]]) {
    const { firstPainted, surface } = await shown(data, { eye })
    const near = firstPainted.map((chart) => surface.bounds[chart].center.reduce((sum, x, k) => sum + x * eye[k], 0))
    assert.ok(near.length > 1)
    assert.deepEqual(near, near.toSorted((a, b) => b - a))
  }
})

test('only charts whose counts changed, and those beside them, are tessellated again', async () => {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  const page = await shown(data)
  const before = new Map(page.meshes)
  const counts = new Uint16Array(2 * before.size).fill(4)
  await page.send({ kind: 'counts', counts: counts.slice() })
  counts[0] = 16
  page.meshes.clear()
  await page.send({ kind: 'counts', counts })
  assert.ok(page.meshes.has(0))
  assert.ok(page.meshes.size > 1 && page.meshes.size <= 5, `${page.meshes.size}`)
})

test('a damaged stream is told once, and what was shown stays', async () => {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  const bad = data.slice()
  bad[Math.round(bad.length * 0.7)] ^= 16
  const page = new Page()
  await page.send({ kind: 'feed', bytes: bad.slice(0, bad.length / 2) })
  const before = page.textures.size
  await page.send({ kind: 'feed', bytes: bad.slice(bad.length / 2) })
  assert.equal(page.errors.length, 1)
  assert.match(page.errors[0].message, /^byte \d+: |CRC/)
  assert.ok(page.textures.size >= before && before > 0)
  await page.send({ kind: 'limit', bytes: 3000 })
  assert.equal(page.state.bytes, 3000)
})

const laid = ['sphere.uph', 'vase.uph', 'rough.uph'].map((name) => streams.find(([other]) => other === name)?.[1])

test('a known sample, laid otherwise, is not decoded again, but for a part of the stream', { skip: !laid[0] }, async (t) => {
  const samples = new Samples()
  await shownWhole(laid[0], samples)
  const decoding = t.mock.method(ImageDecoder.prototype, 'feed')
  const page = await shownWhole(laid[1], samples)
  assert.equal(decoding.mock.callCount(), 0)
  const plain = await shown(laid[1])
  assert.deepEqual(seen(page), seen(plain))
  for (const limit of [{ bytes: laid[1].length >> 1 }, { coefficients: 0.1 }, {}]) {
    for (const one of [page, plain]) await one.send({ kind: 'limit', ...limit })
    assert.deepEqual(seen(page), seen(plain))
  }
  // It is another one where but one of its maps is.
  assert.deepEqual(seen(await shownWhole(laid[2], samples)), seen(await shown(laid[2])))
})

test('a damaged stream is told as such where its sample is known', async () => {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  const samples = new Samples()
  const whole = seen(await shownWhole(data, samples))
  for (const at of [0.3, 0.7, 0.99]) {
    const bad = data.slice()
    bad[Math.round(bad.length * at)] ^= 16
    const [page, plain] = [await shownWhole(bad, samples), new Page()]
    await plain.send({ kind: 'feed', bytes: bad })
    assert.equal(page.errors.length, 1)
    assert.deepEqual(page.errors, plain.errors)
  }
  const cut = await shownWhole(data.slice(0, -9), samples)
  assert.equal(cut.state.complete, false)
  assert.deepEqual(seen(await shownWhole(data, samples)), whole)
})

test('the last two samples are known, by all of their bytes', () => {
  const maps = (bytes) => new Map([['albedo', { pyramid: { picture: { data: { byteLength: bytes } } } }]])
  const samples = new Samples()
  const codes = [[1, 2, 3], [1, 2], [1, 2, 4], [1, 2, 3, 0]].map((bytes) => [new Uint8Array(3), Uint8Array.from(bytes)])
  const known = () => codes.map((code) => samples.find(code) !== null)
  samples.keep(codes[0], maps(9))
  assert.deepEqual(known(), [true, false, false, false])
  samples.keep(codes[1], maps(9))
  samples.keep(codes[0], samples.find(codes[0]))
  samples.keep(codes[2], maps(9))
  assert.deepEqual(known(), [true, false, true, false])
  samples.keep(codes[3], maps(2 ** 25 - 9))
  assert.deepEqual(known(), [false, false, true, true])
  samples.keep(codes[3], maps(2 ** 25 - 8))
  assert.deepEqual(known(), [false, false, false, true])
  samples.keep(codes[1], maps(2 ** 26))
  assert.deepEqual(known(), [false, false, false, true])
  // Nothing of the sample is left out, and what is not its own is.
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  const length = codeOf(data).reduce((sum, part) => sum + part.length, 0)
  assert.ok(length > 100 && length < data.length)
})

test('a stream that is closed is dropped at the next step', async (t) => {
  const [, data] = streams.find(([name]) => name === 'quilt.uph')
  for (const closing of ['end', 'surface', 'paint']) {
    let time = 0
    const clock = t.mock.method(performance, 'now', () => (time += 100)) // each step takes a slice
    const told = []
    const painting = t.mock.method(Decoder.prototype, 'rgba', () => take('paint'))
    let tell
    const closed = new Promise((resolve) => (tell = resolve))
    const session = new StreamSession(({ kind }) => take(kind))
    function take(kind) {
      told.push(kind)
      if (kind !== closing) return
      session.receive({ kind: 'close' })
      tell()
    }
    const all = [{ kind: 'open', maxTextureSize: 4096, maxTexels: 2 ** 26, whole: true }, { kind: 'feed', bytes: data }, { kind: 'end' }]
    for (const message of all) session.receive(message)
    if (closing === 'end') take('end')
    await closed
    for (const one of [painting, clock]) one.mock.restore()
    await shown(data) // all of it, behind that
    assert.deepEqual(told, { end: ['end'], surface: ['surface', 'meshes'], paint: ['surface', 'meshes', 'paint'] }[closing])
  }
})

function gutterLines(data, { height, width }) {
  const inner = { height: height + 2, width: width + 2 }
  // As if the gutter were the chart: its own edges, without corners.
  const framed = new Uint8Array(4 * (width + 4) * (height + 4))
  for (let row = 0; row < height + 2; row++) {
    framed.set(data.subarray(4 * row * (width + 2), 4 * (row + 1) * (width + 2)), 4 * ((row + 1) * (width + 4) + 1))
  }
  return edgeLines(framed, inner).map((line) => line.slice(4, -4))
}

function reversed(line) {
  const out = new Uint8Array(line.length)
  for (let n = 0; n < line.length; n += 4) out.set(line.subarray(n, n + 4), line.length - 4 - n)
  return out
}
