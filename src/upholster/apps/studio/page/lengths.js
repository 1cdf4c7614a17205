/** Lengths as people write them: "18cm", or a number in the model's own unit. */

export const METRES = { mm: 0.001, cm: 0.01, dm: 0.1, m: 1, km: 1000, in: 0.0254, ft: 0.3048 }

/** Metres per unit with a name; null for a unit without one. */
const metresOf = (unit) => METRES[unit] ?? null

/** A length of the model as a text with the unit in which it is between 1 and 1000; a plain number if the unit has no name. */
export function written(length, unit) {
  const metres = metresOf(unit)
  if (metres === null) return String(Number(length.toPrecision(4)))
  const name = ['km', 'm', 'cm', 'mm'].find((one) => length * metres >= METRES[one]) ?? 'mm'
  return `${Number(((length * metres) / METRES[name]).toPrecision(4))}${name}`
}

/** A text or number as a length of the model; null if it is not a length. */
export function read(text, unit) {
  const found = /^\s*([0-9.]+(?:e-?[0-9]+)?)\s*([a-z]*)\s*$/i.exec(String(text ?? ''))
  if (!found || !(Number(found[1]) > 0)) return null
  if (!found[2]) return Number(found[1])
  const [own, metres] = [metresOf(unit), metresOf(found[2])]
  return own === null || metres === null ? null : (Number(found[1]) * metres) / own
}
