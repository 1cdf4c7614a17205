/** PNG files of 8-bit pixels, without loss and without a canvas, which would multiply colours with alpha. */

const SIGNATURE = [137, 80, 78, 71, 13, 10, 26, 10]
const COLOR_TYPES = { 3: 2, 4: 6 } // by channels
const PAETH = 4
const ROWS_AT_ONCE = 128 // then the page may do something else

const CRCS = Int32Array.from({ length: 256 }, (_, n) => {
  let crc = n
  for (let bit = 0; bit < 8; bit++) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1
  return crc
})

/** Write RGBA pixels {height, width, data} as PNG with 3 or 4 channels; resolves with a Uint8Array. */
export async function encodePng(image, channels) {
  const { height, width } = image
  const header = new Uint8Array(13)
  const view = new DataView(header.buffer)
  view.setUint32(0, width)
  view.setUint32(4, height)
  header.set([8, COLOR_TYPES[channels]], 8)
  const parts = [Uint8Array.from(SIGNATURE), chunk('IHDR', header), chunk('IDAT', await deflated(image, channels)), chunk('IEND', new Uint8Array())]
  return new Uint8Array(await new Blob(parts).arrayBuffer())
}

function chunk(tag, payload) {
  const out = new Uint8Array(12 + payload.length)
  const view = new DataView(out.buffer)
  view.setUint32(0, payload.length)
  for (let n = 0; n < 4; n++) out[4 + n] = tag.charCodeAt(n)
  out.set(payload, 8)
  let crc = -1
  for (let n = 4; n < 8 + payload.length; n++) crc = CRCS[(crc ^ out[n]) & 255] ^ (crc >>> 8)
  view.setUint32(8 + payload.length, ~crc)
  return out
}

async function deflated(image, channels) {
  const packing = new CompressionStream('deflate')
  const whole = new Response(packing.readable).arrayBuffer()
  const writer = packing.writable.getWriter()
  for (let row = 0; row < image.height; row += ROWS_AT_ONCE) {
    await writer.write(filtered(image, channels, row, Math.min(row + ROWS_AT_ONCE, image.height)))
    await new Promise((resolve) => setTimeout(resolve))
  }
  await writer.close()
  return new Uint8Array(await whole)
}

/** Rows [start, stop), each sample less what its neighbours to the left and above foretell. */
function filtered({ width, data }, channels, start, stop) {
  const length = channels * width
  const out = new Uint8Array((stop - start) * (length + 1))
  const above = new Uint8Array(length + channels) // with a pixel of zeros to the left
  const here = new Uint8Array(length + channels)
  const read = (row, into) => {
    for (let n = 4 * row * width, to = channels; to < into.length; n += 4) {
      for (let k = 0; k < channels; k++) into[to++] = data[n + k]
    }
  }
  if (start) read(start - 1, above)
  for (let row = start, to = 0; row < stop; row++) {
    read(row, here)
    out[to++] = PAETH
    for (let n = channels; n < here.length; n++) out[to++] = here[n] - foretold(here[n - channels], above[n], above[n - channels])
    above.set(here)
  }
  return out
}

/** Of left, up and the corner, what is nearest to left + up − corner. */
function foretold(left, up, corner) {
  const [a, b, c] = [Math.abs(up - corner), Math.abs(left - corner), Math.abs(left + up - 2 * corner)]
  if (a <= b && a <= c) return left
  return b <= c ? up : corner
}
