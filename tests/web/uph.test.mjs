// What the decoder promises a web page: run with `node --test`, also by test_web_decoder.py.
import assert from 'node:assert/strict'
import { readFileSync, readdirSync } from 'node:fs'
import { test } from 'node:test'

import { EzwDecoder, UphDecoder, UphError } from '../../web/uph.js'

const folder = new URL('../vectors/', import.meta.url)
const read = (name) => new Uint8Array(readFileSync(new URL(name, folder)))
const names = readdirSync(folder).filter((name) => name.endsWith('.uph'))

function decoded(data, pieces) {
  const decoder = new UphDecoder()
  const changed = new Set()
  for (const piece of pieces(data)) {
    const part = decoder.feed(piece)
    for (const chart of part.charts) changed.add(chart)
  }
  return { decoder, changed, all: [decoder.exemplar(), ...decoder.charts.map((_, n) => decoder.texels(n))] }
}

const atOnce = (data) => [data]
const inPieces = (size) => (data) => Array.from({ length: Math.ceil(data.length / size) }, (_, n) => data.subarray(size * n, size * (n + 1)))
const byteByByte = inPieces(1)

for (const name of names) {
  test(`${name}: bytes one by one decode as all at once`, () => {
    const [whole, single] = [atOnce, byteByByte].map((pieces) => decoded(read(name), pieces))
    assert.deepEqual(single.all, whole.all)
    assert.ok(single.decoder.complete && whole.decoder.complete)
    assert.equal(single.decoder.needed, 0)
    assert.equal(whole.changed.size, whole.decoder.charts.length)
    assert.deepEqual(single.changed, whole.changed)
  })
}

test('what did not change is not reported', () => {
  const data = read('quilt.uph')
  const decoder = new UphDecoder()
  decoder.feed(data.subarray(0, 500))
  let before = decoder.needed ? [] : decoder.charts.map((_, n) => decoder.texels(n))
  for (let length = 700; length < data.length + 200; length += 200) {
    const { exemplar, charts } = decoder.feed(data.subarray(decoder.received, length))
    const after = decoder.charts.map((_, n) => decoder.texels(n))
    if (before.length && !exemplar) {
      after.forEach((texels, n) => {
        if (!charts.includes(n)) assert.deepEqual(texels, before[n])
      })
    }
    before = after
  }
})

test('placements come to all charts at once, and those that are known are shown', () => {
  const data = read('quilt.uph')
  const decoder = new UphDecoder()
  assert.deepEqual(decoder.placements, { known: 0, count: 0 })
  const counts = [] // of each chart, after each piece
  let changes = 0
  for (const piece of inPieces(5)(data)) {
    const before = decoder.placements.known
    const { charts } = decoder.feed(piece)
    if (!decoder.placements.count) continue
    counts.push(decoder.charts.map((_, n) => decoder.recipe(n).layers.reduce((sum, { placements }) => sum + placements.length, 0)))
    // A chart without any shows one that is made up.
    const { known, count } = decoder.placements
    assert.equal(counts.at(-1).reduce((sum, one) => sum + one, 0), known + decoder.charts.length - decoder.chartsKnown)
    assert.ok(known >= before && known <= count)
    if (counts.length < 2) continue
    const grown = counts.at(-1).flatMap((one, n) => (one === counts.at(-2)[n] ? [] : [n]))
    assert.ok(grown.every((n) => charts.includes(n)))
    changes += grown.length
  }
  assert.ok(changes > decoder.charts.length && decoder.placed)
  // Each chart has a part of its placements before any has all of them.
  const first = counts.find((list) => list.some((count, n) => count === counts.at(-1)[n]))
  assert.ok(Math.min(...first) > 1)
})

test('rows can be painted on their own', () => {
  const { decoder } = decoded(read('quilt.uph'), atOnce)
  const { height, width } = decoder.paintedSize(0)
  const whole = decoder.texels(0)
  const middle = decoder.texels(0, { start: 5, stop: height - 7 })
  const row = width * decoder.exemplar().channels
  assert.deepEqual(middle, whole.slice(5 * row, (height - 7) * row))
  assert.throws(() => decoder.texels(0, { stop: height + 1 }), RangeError)
  assert.throws(() => decoder.texels(decoder.charts.length), RangeError)
})

test('a chart can be painted at any density', () => {
  const { decoder } = decoded(read('quilt.uph'), atOnce)
  const { height, width } = decoder.charts[0]
  for (const [density, wanted] of [[0.5, [height / 2, width / 2]], [3, [3 * height, 3 * width]], [1 / 64, [1, 1]]]) {
    assert.deepEqual(Object.values(decoder.paintedSize(0, density)), wanted.map(Math.round))
    assert.equal(decoder.rgba(0, { density }).length, 4 * Math.round(wanted[0]) * Math.round(wanted[1]))
  }
  // The middle one of three texels a step each way lies where the only one does.
  const [fine, plain] = [decoder.rgba(0, { density: 3 }), decoder.rgba(0, { density: 1 })]
  for (const [row, column] of [[0, 0], [7, 12], [height - 1, width - 1]]) {
    const at = 4 * ((3 * row + 1) * 3 * width + 3 * column + 1)
    assert.deepEqual(fine.slice(at, at + 4), plain.slice(4 * (row * width + column), 4 * (row * width + column + 1)))
  }
  for (const density of [0, -1, NaN, 65]) assert.throws(() => decoder.texels(0, { density }), RangeError)
})

test('texels for the screen leave room round them', () => {
  const { decoder } = decoded(read('quilt.uph'), atOnce)
  const { height, width } = decoder.paintedSize(0)
  const plain = decoder.rgba(0)
  assert.ok(plain instanceof Uint8ClampedArray)
  const into = new Uint8Array(4 * (height + 2) * (width + 2)).fill(7)
  const [stride, offset] = [width + 2, 4 * (width + 3)]
  assert.equal(decoder.rgba(0, { into, stride, offset }), into)
  for (let row = 0; row < height + 2; row++) {
    const line = into.subarray(4 * row * stride, 4 * (row + 1) * stride)
    const inside = row > 0 && row <= height
    const wanted = inside ? plain.subarray(4 * (row - 1) * width, 4 * row * width) : new Uint8Array(4 * width).fill(7)
    assert.deepEqual([...line.subarray(4, 4 * (width + 1))], [...wanted])
    assert.deepEqual([...line.subarray(0, 4), ...line.subarray(-4)], new Array(8).fill(7))
  }
  const some = decoder.rgba(0, { start: 3, stop: 9 })
  assert.deepEqual(some, plain.slice(4 * 3 * width, 4 * 9 * width))
  assert.equal(decoder.rgba(0, { start: 2, stop: 2 }).length, 0)
  const beyond = { into, stride, offset: offset + 4 * stride + 8 }
  for (const wrong of [beyond, { stride: width - 1 }, { offset: -1, into }, { stop: height + 1 }]) {
    assert.throws(() => decoder.rgba(0, wrong), RangeError)
  }
  assert.throws(() => decoder.rgba(decoder.charts.length), RangeError)
  assert.throws(() => decoder.rgba(0, { role: 'normal' }), RangeError)
})

test('the surface is told', () => {
  const { decoder } = decoded(read('nets_16_bit.uph'), atOnce)
  assert.equal(decoder.surface.kind, 'nets')
  assert.equal(decoder.surface.patches.length, 6)
  assert.deepEqual(decoder.surface.faces[5], { rows: 1, columns: 1, firstPatch: 5 })
  const { m, n, net } = decoder.surface.patches[0]
  assert.equal(net.length, 4 * (m + 1) * (n + 1))
  assert.deepEqual(decoded(read('smallest.uph'), atOnce).decoder.surface, {
    kind: 'plane',
    params: { width: 1, height: 1, spans: [1, 1] },
    faces: [{ rows: 1, columns: 1, firstPatch: 0 }],
    patchCount: 1,
    shared: [],
    points: [],
  })
})

test('any changed byte is refused, and says where', () => {
  const data = read('smallest.uph')
  for (let n = 0; n < data.length; n++) {
    const damaged = data.slice()
    damaged[n] ^= 0x55
    const decoder = new UphDecoder()
    try {
      decoder.feed(damaged)
      assert.ok(!decoder.complete, `byte ${n} changed unnoticed`)
    } catch (error) {
      assert.ok(error instanceof UphError, String(error.stack))
      assert.match(error.message, /^byte \d+: /)
      assert.throws(() => decoder.feed(new Uint8Array(0)), UphError)
    }
  }
})

test('damage within whole chunks is an error or a picture, never anything else', () => {
  let state = 1
  const random = (below) => (state = (Math.imul(state, 48271) >>> 0) % 2147483647) % below
  const crc = (bytes) => {
    let sum = -1
    for (const byte of bytes) {
      sum ^= byte
      for (let k = 0; k < 8; k++) sum = (sum >>> 1) ^ (sum & 1 ? 0xedb88320 : 0)
    }
    return ~sum >>> 0
  }
  let [refused, shown] = [0, 0]
  for (const name of names) {
    const data = read(name)
    for (let round = 0; round < 5; round++) {
      const damaged = data.slice()
      // Walk over the chunks, damage one, and give it the CRC that it then has.
      let place = 4
      for (let k = 0; k < 2; k++) while (damaged[place++] > 127);
      const chunks = []
      while (place < damaged.length) {
        let [at, length, shift] = [place + 1, 0, 0]
        do length += (damaged[at] & 127) << (7 * shift++)
        while (damaged[at++] > 127)
        chunks.push([place, at, at + length])
        place = at + length + 4
      }
      const [start, payload, end] = chunks[random(chunks.length)]
      for (let k = random(3); k >= 0 && end > payload; k--) damaged[payload + random(end - payload)] ^= 1 << random(8)
      new DataView(damaged.buffer).setUint32(end, crc(damaged.subarray(start, end)), true)
      const decoder = new UphDecoder()
      try {
        decoder.feed(damaged)
        if (decoder.charts.reduce((sum, { height, width }) => sum + height * width, 0) > 1e6) continue
        decoder.charts.forEach((_, n) => decoder.texels(n))
        shown++
      } catch (error) {
        assert.ok(error instanceof UphError, String(error.stack))
        refused++
      }
    }
  }
  assert.ok(refused > 10 && shown > 10, `${refused} refused, ${shown} shown`)
})

test('an image that is none is refused', () => {
  assert.throws(() => new EzwDecoder().feed(new TextEncoder().encode('PNG, surely')), UphError)
  const decoder = new EzwDecoder()
  assert.equal(decoder.needed, 13)
  assert.throws(() => decoder.image(), RangeError)
})

test('other versions are refused by their number', () => {
  const stream = read('smallest.uph')
  const image = new TextEncoder().encode('EZW1 and so on')
  for (const [data, newest, first] of [[stream, 3, 0], [image, 1, 48]]) {
    const Decoder = data === stream ? UphDecoder : EzwDecoder
    for (const [version, why] of [[newest - 1, 'it was never released'], [newest + 1, 'a newer decoder reads it']]) {
      data[3] = first + version
      assert.throws(() => new Decoder().feed(data), new RegExp(`version is ${version}; allowed: ${newest}; ${why}`))
    }
  }
})

test('a stream that asks for more than a caller allows is refused', () => {
  const data = read('quilt.uph')
  const take = (limits) => () => new UphDecoder({ limits }).feed(data)
  const { decoder } = decoded(data, atOnce)
  const charts = decoder.charts.length
  const texels = Math.max(...[1, decoder.density].map((density) =>
    decoder.charts.reduce((sum, _, n) => sum + decoder.paintedSize(n, density).height * decoder.paintedSize(n, density).width, 0)))
  const samples = decoder.exemplar().data.length
  take({ texels, samples, charts })()
  for (const [limits, what] of [
    [{ texels: texels - 1, samples, charts }, `number of texels is ${texels}`],
    [{ charts: charts - 1 }, `number of charts is ${charts}`],
    [{ samples: samples - 1 }, `number of samples is ${samples}`],
  ]) {
    assert.throws(take(limits), (error) => error instanceof UphError && error.message.includes(what))
  }
  assert.throws(() => new UphDecoder({ limits: { triangles: 319 } }).feed(read('mesh.uph')), /number of triangles is 320/)
  // A chart of 256 × 256 steps, with cells of 1 step: 258 × 258 of them.
  const cells = Buffer.from('75706803382b530104a3bccd8f4c030f8002e1534597580f4000400003010600008000800080005b8124515107010300000201029bb5975d', 'hex')
  new UphDecoder({ limits: { texels: 66_564 } }).feed(cells)
  assert.throws(() => new UphDecoder({ limits: { texels: 65_536 } }).feed(cells), /number of cells is 66564; allowed: 1 to 65536/)
  assert.throws(() => new EzwDecoder({ limits: { samples: 0 } }), RangeError)
  assert.throws(() => new UphDecoder({ limits: { work: 1 } }), /limit work is unknown/)
})
