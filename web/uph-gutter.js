// One texel round a chart, taken from beyond its edges: filtered across an edge, both sides look the same.
//
// A chart with its gutter is RGBA, (height + 2) × (width + 2). Edges: 0 top, 1 right, 2 bottom, 3 left.

import { ONE, turnNormal } from './uph/paint/normals.js'
import { forEachAcross } from './worker/across.js'

/** Texels along the four edges of a chart that lies in its gutter. */
export function edgeLines(data, { height, width }) {
  const stride = 4 * (width + 2)
  const row = (n) => data.slice(n * stride + 4, n * stride + 4 + 4 * width)
  const column = (n) => {
    const line = new Uint8Array(4 * height)
    for (let i = 0; i < height; i++) {
      for (let k = 0; k < 4; k++) line[4 * i + k] = data[(i + 1) * stride + 4 * n + k]
    }
    return line
  }
  return [row(1), column(width), row(height), column(1)]
}

/**
 * The gutter of a chart: top and bottom with corners, right and left without, in one array.
 *
 * `lines` are its own edge lines; `beyond(edge)` returns what is beyond an edge: `seams`, each {start, stop, otherStart,
 * otherStop, line}, and, for normals, by which angle to turn each texel, `angles`. Borders repeat the chart.
 */
export function makeGutter(lines, { height, width }, beyond) {
  const bands = lines.map((own, edge) => {
    const band = own.slice()
    const { seams, angles } = beyond(edge)
    for (const seam of seams) copyAcross(seam, band, edge % 2 ? height : width, angles)
    return band
  })
  const corner = (a, i, b, j) => [0, 1, 2, 3].map((k) => (bands[a][4 * i + k] + bands[b][4 * j + k]) >> 1)
  const across = (edge, row) => [...corner(edge, 0, 3, row), ...bands[edge], ...corner(edge, width - 1, 1, row)]
  return Uint8Array.of(...across(0, 0), ...across(2, height - 1), ...bands[1], ...bands[3])
}

/** Copy texels from beyond a seam into a band of `count` texels. */
function copyAcross(seam, band, count, angles) {
  const { line } = seam
  forEachAcross(seam, count, line.length / 4, (n, m) => {
    for (let k = 0; k < 4; k++) band[4 * n + k] = line[4 * m + k]
    if (angles) turnNormal(band, 4 * n, 255, ...turnOf(angles[n]))
  })
}

/** Write a gutter round a chart. */
export function putGutter(data, { height, width }, gutter) {
  const stride = 4 * (width + 2)
  data.set(gutter.subarray(0, stride), 0)
  data.set(gutter.subarray(stride, 2 * stride), (height + 1) * stride)
  for (let i = 0, from = 2 * stride; i < height; i++, from += 4) {
    const at = (i + 1) * stride
    for (let k = 0; k < 4; k++) {
      data[at + stride - 4 + k] = gutter[from + k]
      data[at + k] = gutter[from + 4 * height + k]
    }
  }
}

/** Sine and cosine of an angle, in 1/8192. */
export function turnOf(angle) {
  return [Math.round(ONE * Math.sin(angle)), Math.round(ONE * Math.cos(angle))]
}
