/** Limits given by a caller. */

import { LIMITS } from './limits.js'

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
