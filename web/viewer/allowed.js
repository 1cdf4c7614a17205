/** What the element's attributes allow a stream to demand. */

import { fillLimits } from '../uph/limits.js'
import { DEFAULTS } from '../model/model.js'

const UNITS = { '': 1, k: 1e3, m: 1e6, g: 1e9 }

/**
 * Read the attributes `limit` and `maxtexels`, null where there is none; returns the options of a `Model`.
 *
 * @throws {RangeError} for wrong values: the message begins with the attribute's name
 */
export function readAllowed({ limit, maxtexels }) {
  const texels = readCount('limit', limit)
  const maxTexels = readCount('maxtexels', maxtexels) ?? DEFAULTS.maxTexels
  if (maxTexels < 1 || maxTexels > DEFAULTS.maxTexels) throw new RangeError(`maxtexels is ${maxtexels}; allowed: 1 to ${DEFAULTS.maxTexels}`)
  return { limits: fillLimits({ texels }), maxTexels }
}

/** A number as on the command line: 4M, 500k. */
function readCount(name, text) {
  if (text === null) return undefined
  const [, digits, unit] = /^([0-9]{1,10}(?:\.[0-9]{1,6})?)([kmg]?)$/i.exec(text.trim()) ?? []
  if (!digits) throw new RangeError(`${name} is "${text}"; allowed: a number such as 500k or 4M`)
  return Math.floor(digits * UNITS[unit.toLowerCase()])
}
