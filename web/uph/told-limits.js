/** Limits as a caller tells them. */

import { LIMITS } from './limits.js'

// The least where only the texels are told, and how many texels go with one.
const BY_TEXELS = { samples: [2 ** 16, 1], charts: [2 ** 12, 256], triangles: [2 ** 12, 8] }
const MAX_TEXELS = 2 ** 31

/** All limits, those that a caller does not tell filled in. @throws {RangeError} for limits that are none */
export function fillLimits({ texels = LIMITS.texels, ...told } = {}) {
  const limits = { texels }
  for (const [name, [least, each]] of Object.entries(BY_TEXELS)) {
    limits[name] = told[name] ?? Math.min(LIMITS[name], Math.max(least, Math.floor(texels / each)))
    delete told[name]
  }
  for (const name of Object.keys(told)) throw new RangeError(`limit ${name} is unknown; allowed: ${Object.keys(limits)}`)
  for (const [name, value] of Object.entries(limits)) {
    const most = name === 'texels' ? MAX_TEXELS : LIMITS[name]
    if (!(Number.isInteger(value) && value >= 1 && value <= most)) {
      throw new RangeError(`limit of ${name} is ${value}; allowed: 1 to ${most}`)
    }
  }
  return limits
}
