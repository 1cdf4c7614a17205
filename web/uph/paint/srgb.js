/** Linear light as sRGB, for samples that are floats. */

import { range } from '../numbers.js'

let codes = null

/** The 8-bit codes of 65536 even steps of linear light, made once. */
export function srgbCodes() {
  codes ??= Uint8Array.from(range(65536), (n) => {
    const x = n / 65535
    return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055) + 0.5
  })
  return codes
}
