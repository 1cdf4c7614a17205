/** What a stream may ask for, checked before anything is painted [9]. */

/** Limits of a stream's demands if the caller gives none. */
export const LIMITS = { texels: 2 ** 28, samples: 12_800_000, charts: 2 ** 18, triangles: 2 ** 20 }

/** The longest side of a chart. */
export const MAX_SIDE = 16384

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
