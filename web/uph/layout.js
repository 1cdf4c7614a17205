/** The layout [3]: charts, their sizes, and what they cover of their faces. */

import { MAX_SIDE } from './limits.js'
import { fromZigzag, range } from './numbers.js'

const MAX_CHARTS = 2 ** 18
const MAX_TEXELS = 2 ** 31

// Flags of the layout.
const ON_EACH_PATCH = 1
const ON_FIRST_FACE = 2
const ALIKE = 4
const SQUARE = 8
const DYADIC = 16
const EVEN = 32

const FARTHEST = 2 ** 32 // texels, of an even layout
const MOST = 1e18

const LEAST_CHART_BYTES = 2 // of a chart's rectangle

/** Returns the charts. */
export function parseLayout(reader, { kind, faces }) {
  const isMesh = kind === 'mesh'
  const flags = reader.u8('flags of the layout', 63)
  if (flags & (isMesh ? ON_EACH_PATCH | DYADIC : EVEN)) {
    reader.fail(`flags of the layout are ${flags}; allowed: 1 and 16 on patches only, 32 on a mesh`)
  }
  const charts = flags & ON_EACH_PATCH ? chartsOfPatches(faces) : parseFaces(reader, flags, faces.length)
  parseSizes(reader, flags, charts)
  if (!(flags & ON_EACH_PATCH)) {
    if (flags & EVEN) parseEvenRectangles(reader, charts)
    else if (flags & DYADIC) parseDyadicRectangles(reader, charts, faces)
    else parseRectangles(reader, charts, faces)
  }
  reader.end('layout')
  return charts
}

const chartOn = (face, s, t) => ({ face, height: 0, width: 0, s0: s, s1: s + 1, t0: t, t1: t + 1 })

/** A chart for each patch. */
function chartsOfPatches(faces) {
  return faces.flatMap(({ rows, columns }, face) =>
    range(rows * columns).map((n) => chartOn(face, Math.floor(n / columns), n % columns)),
  )
}

/** Charts of which only the faces are known. */
function parseFaces(reader, flags, faceCount) {
  const count = reader.varint('number of charts', MAX_CHARTS, 1)
  if (LEAST_CHART_BYTES * count > reader.left) reader.fail(`${count} charts take more bytes than are left`)
  return range(count).map(() =>
    chartOn(flags & ON_FIRST_FACE ? 0 : reader.varint('face of a chart', faceCount - 1), 0, 0),
  )
}

function parseSizes(reader, flags, charts) {
  let texels = 0
  let height, width
  charts.forEach((chart, n) => {
    if (n === 0 || !(flags & ALIKE)) {
      height = reader.varint('height of a chart', MAX_SIDE, 1)
      width = flags & SQUARE ? height : reader.varint('width of a chart', MAX_SIDE, 1)
    }
    texels += height * width
    Object.assign(chart, { height, width })
  })
  if (texels > MAX_TEXELS) reader.fail(`layout has ${texels} texels; allowed: ${MAX_TEXELS}`)
}

function parseDyadicRectangles(reader, charts, faces) {
  const unit = 2 ** reader.u8('fineness of the charts', 16)
  const interval = (most) => {
    const low = reader.varint('start of a chart', most - 1)
    return [low / unit, (low + 1 + reader.varint('extent of a chart', most - 1 - low)) / unit]
  }
  for (const chart of charts) {
    const { rows, columns } = faces[chart.face]
    ;[chart.s0, chart.s1] = interval(rows * unit)
    ;[chart.t0, chart.t1] = interval(columns * unit)
  }
}

function parseRectangles(reader, charts, faces) {
  for (const chart of charts) {
    for (const name of ['s0', 's1', 't0', 't1']) chart[name] = reader.float(name, 8)
    const { s0, s1, t0, t1 } = chart
    const { rows, columns } = faces[chart.face] ?? { rows: MOST, columns: MOST }
    const low = faces[chart.face] ? 0 : -MOST
    if (!(s0 >= low && s0 < s1 && s1 <= rows && t0 >= low && t0 < t1 && t1 <= columns)) {
      reader.fail('a chart covers parameters outside its face, or none')
    }
  }
}

/** Charts whose texels are squares of one size, from a whole multiple of it on. */
function parseEvenRectangles(reader, charts) {
  const texel = reader.float('texel', 8)
  const interval = (count) => {
    const low = fromZigzag(reader.varint('start of a chart', 2 * FARTHEST))
    return [texel * low, texel * (low + count)]
  }
  for (const chart of charts) {
    ;[chart.s0, chart.s1] = interval(chart.height)
    ;[chart.t0, chart.t1] = interval(chart.width)
    const { s0, s1, t0, t1 } = chart
    if (!(s0 >= -MOST && s0 < s1 && s1 <= MOST && t0 >= -MOST && t0 < t1 && t1 <= MOST)) {
      reader.fail('a chart covers parameters outside its island, or none')
    }
  }
}
