/** Charts' textures packed on the pages of an atlas. */

const MAX_SIDE = 4096 // which every graphics card takes
const GUTTER = 4 // texels round a chart: one from beyond its edge, then repeats of it

/**
 * Where charts of these sizes, {height, width}, lie: pages {height, width, charts}, each chart {chart, row, column, height, width} with
 * its first texel there.
 */
export function packCharts(sizes) {
  const boxes = sizes.map(({ height, width }, chart) => ({ chart, height: height + 2 * GUTTER, width: width + 2 * GUTTER }))
  const area = boxes.reduce((sum, { height, width }) => sum + height * width, 0)
  const widest = boxes.reduce((most, { width }) => Math.max(most, width), 1)
  const side = Math.max(widest, Math.min(MAX_SIDE, Math.ceil(Math.sqrt(1.05 * area))))
  const pages = []
  let page = null
  let [row, column, shelf] = [0, 0, 0]
  for (const { chart, height, width } of boxes.sort((a, b) => b.height - a.height || b.width - a.width || a.chart - b.chart)) {
    if (page && column + width > side) [row, column, shelf] = [row + shelf, 0, 0]
    if (!page || (row && row + height > MAX_SIDE)) {
      pages.push((page = { height: 0, width: 0, charts: [] }))
      ;[row, column, shelf] = [0, 0, 0]
    }
    page.charts.push({ chart, row: row + GUTTER, column: column + GUTTER, height: height - 2 * GUTTER, width: width - 2 * GUTTER })
    column += width
    shelf = Math.max(shelf, height)
    page.height = Math.max(page.height, row + height)
    page.width = Math.max(page.width, column)
  }
  return pages
}

/** The picture of a page; `textureOf(chart)` is RGBA with a gutter of one texel, {height, width, data}, or nothing. */
export function drawPage({ height, width, charts }, textureOf) {
  const data = new Uint8Array(4 * height * width)
  const out = new Uint32Array(data.buffer)
  for (const { chart, row, column, height: tall, width: wide } of charts) {
    const texture = textureOf(chart)
    if (!texture) continue
    // Textures are views of buffers of their own, from their first byte on.
    const from = new Uint32Array(texture.data.buffer, texture.data.byteOffset, texture.data.length / 4)
    for (let i = -GUTTER; i < tall + GUTTER; i++) {
      const line = Math.min(Math.max(i + 1, 0), tall + 1) * (wide + 2)
      const to = (row + i) * width + column
      out.set(from.subarray(line, line + wide + 2), to - 1)
      out.fill(from[line], to - GUTTER, to - 1)
      out.fill(from[line + wide + 1], to + wide + 1, to + wide + GUTTER)
    }
  }
  return { height, width, data }
}
