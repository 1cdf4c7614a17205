// Pixels of pictures that a page has, as the decoder takes them: loaded where a model is to have another sample.

/**
 * The pixels of an image, scaled to `height` × `width` where it has another size, but the same shape: {height, width, channels, data}.
 *
 * `image` is a Blob, ImageData, or what a canvas draws: an <img> that is loaded, an ImageBitmap, a canvas.
 *
 * @throws {RangeError} for a picture of another shape, by more than a pixel of the smaller one
 */
export async function readPicture(image, { height, width }) {
  const drawn = await createImageBitmap(image)
  if (Math.abs(drawn.height * width - height * drawn.width) > Math.max(drawn.height, drawn.width, height, width)) {
    throw new RangeError(`picture is ${drawn.width} × ${drawn.height} pixels; allowed: the sample's shape, ${width} × ${height}`)
  }
  const canvas = Object.assign(document.createElement('canvas'), { height, width })
  const context = canvas.getContext('2d', { willReadFrequently: true })
  context.imageSmoothingQuality = 'high'
  context.drawImage(drawn, 0, 0, width, height)
  drawn.close()
  const { data } = context.getImageData(0, 0, width, height)
  return withoutAlpha({ height, width, channels: 4, data: new Uint8Array(data.buffer) })
}

/** The same with three channels, where nothing is see-through. */
function withoutAlpha(picture) {
  const { height, width, data } = picture
  for (let n = 3; n < data.length; n += 4) if (data[n] < 255) return picture
  const colors = new Uint8Array(3 * height * width)
  for (let n = 0, m = 0; m < colors.length; n += 4, m += 3) {
    colors[m] = data[n]
    colors[m + 1] = data[n + 1]
    colors[m + 2] = data[n + 2]
  }
  return { height, width, channels: 3, data: colors }
}
