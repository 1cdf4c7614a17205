/**
 * Parts of the decoder that few streams need, in `rare.js`. `uph.js` has all of them; `uph-core.js` none, and loads `uph-rare.js` when one
 * is missing. They are known by a global name, since that may be a bundle.
 */

/** A part is needed that has not been loaded. */
export class MissingPart extends Error {}

/** Have parts, by name. */
export function addParts(parts) {
  globalThis.uphParts = { ...globalThis.uphParts, ...parts }
}

/** Whether there is a part of that name. */
export function hasPart(name) {
  return Boolean(globalThis.uphParts?.[name])
}

/** The part of that name. @throws {MissingPart} */
export function part(name) {
  if (!hasPart(name)) throw new MissingPart(`the decoder lacks ${name}`)
  return globalThis.uphParts[name]
}
