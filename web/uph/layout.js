/** The layout [3]: charts, their sizes, and what they cover of their patches. */

import { range } from './numbers.js'

const MAX_CHARTS = 2 ** 18
const MAX_SIDE = 16384
const MAX_TEXELS = 2 ** 31

// Flags of the layout.
const ON_EACH_PATCH = 1
const WHOLE_PATCHES = 2
const ALIKE = 4
const SQUARE = 8
const DYADIC = 16
const SCALED = 32

/** Returns [charts, scale], the scale at which charts without placements show the exemplar. */
export function parseLayout(reader, patchCount) {
  const flags = reader.u8('flags of the layout', 63)
  const scale = flags & SCALED ? reader.u8('scale') - 128 : 0
  const charts = parseSizes(reader, flags, parsePatches(reader, flags, patchCount))
  if (!(flags & WHOLE_PATCHES)) {
    if (flags & DYADIC) parseDyadicParts(reader, charts)
    else parseParts(reader, charts)
  }
  reader.end('layout')
  return [charts, scale]
}

/** The patch of each chart. */
function parsePatches(reader, flags, patchCount) {
  if (flags & ON_EACH_PATCH) return range(patchCount)
  const count = reader.varint('number of charts', MAX_CHARTS, 1)
  if (count > reader.left) reader.fail(`${count} charts take more bytes than are left`)
  return range(count).map(() => reader.varint('patch of a chart', patchCount - 1))
}

/** Charts that cover whole patches. */
function parseSizes(reader, flags, patches) {
  let texels = 0
  let height, width
  const charts = patches.map((patch, n) => {
    if (n === 0 || !(flags & ALIKE)) {
      height = reader.varint('height of a chart', MAX_SIDE, 1)
      width = flags & SQUARE ? height : reader.varint('width of a chart', MAX_SIDE, 1)
    }
    texels += height * width
    return { patch, height, width, s0: 0, s1: 1, t0: 0, t1: 1 }
  })
  if (texels > MAX_TEXELS) reader.fail(`layout has ${texels} texels; allowed: ${MAX_TEXELS}`)
  return charts
}

function parseDyadicParts(reader, charts) {
  const unit = 2 ** reader.u8('fineness of the charts', 16)
  for (const chart of charts) {
    for (const name of ['s', 't']) {
      const low = reader.varint('start of a chart', unit - 1)
      chart[`${name}0`] = low / unit
      chart[`${name}1`] = (low + 1 + reader.varint('extent of a chart', unit - 1 - low)) / unit
    }
  }
}

function parseParts(reader, charts) {
  for (const chart of charts) {
    for (const name of ['s0', 's1', 't0', 't1']) chart[name] = reader.float(name, 8)
    const { s0, s1, t0, t1 } = chart
    if (!(s0 >= 0 && s0 < s1 && s1 <= 1 && t0 >= 0 && t0 < t1 && t1 <= 1)) {
      reader.fail('a chart covers parameters outside 0 to 1, or none')
    }
  }
}
