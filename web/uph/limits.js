/** What a stream may ask for, checked before anything is painted [9]. */

/** Limits of a stream's demands if the caller gives none. */
export const LIMITS = { texels: 2 ** 28, samples: 12_800_000, charts: 2 ** 18, triangles: 2 ** 20 }

/** The longest side of a chart. */
export const MAX_SIDE = 16384

const LEAST_CELLS = 2 ** 16

const countTexels = (charts) => charts.reduce((sum, { height, width }) => sum + height * width, 0)

/** Check charts, of so many steps or texels. */
export function checkCharts(reader, charts, limits) {
  for (const { height, width } of charts) reader.within(Math.max(height, width), 'side of a chart', 1, MAX_SIDE)
  reader.within(charts.length, 'number of charts', 1, limits.charts)
  reader.within(countTexels(charts), 'number of texels', 1, limits.texels)
}

/** Check the samples of maps with these headers. */
export function checkSamples(reader, headers, limits) {
  const samples = headers.reduce((sum, { height, width, channels }) => sum + height * width * channels, 0)
  reader.within(samples, 'number of samples', 1, limits.samples, 0)
}

/** Check the cells of all label maps: decoding one takes as long as painting a texel. Small charts have more cells than texels. */
export function checkCells(reader, cells, limits) {
  reader.within(cells, 'number of cells', 1, Math.max(LEAST_CELLS, limits.texels), 0)
}

// If only texels are given: the least value, and the number of texels per unit.
const BY_TEXELS = { samples: [2 ** 16, 1], charts: [2 ** 12, 256], triangles: [2 ** 12, 8] }
const MAX_TEXELS = 2 ** 31

/** All limits, with those that a caller does not give filled in. @throws {RangeError} for wrong limits */
export function fillLimits({ texels = LIMITS.texels, ...given } = {}) {
  const limits = { texels }
  for (const [name, [least, each]] of Object.entries(BY_TEXELS)) {
    limits[name] = given[name] ?? Math.min(LIMITS[name], Math.max(least, Math.floor(texels / each)))
    delete given[name]
  }
  for (const name of Object.keys(given)) throw new RangeError(`limit ${name} is unknown; allowed: ${Object.keys(limits)}`)
  for (const [name, value] of Object.entries(limits)) {
    const most = name === 'texels' ? MAX_TEXELS : LIMITS[name]
    if (!(Number.isInteger(value) && value >= 1 && value <= most)) {
      throw new RangeError(`limit of ${name} is ${value}; allowed: 1 to ${most}`)
    }
  }
  return limits
}
