/**
 * Parts of the decoder that few streams need: meshes, strips, plain lists, lossless wavelets, samples of more than 8 bits.
 *
 * `uph.js` has all of them. A page that counts bytes begins with `uph-core.js`, and loads `uph-rare.js` when a stream needs a part
 * that is missing. They are known by a global name, since the two may be bundles of their own.
 */

/** A part is needed that has not been loaded. */
export class MissingPart extends Error {}

/** Have parts, by name. */
export function addParts(parts) {
  globalThis.uphParts = { ...globalThis.uphParts, ...parts }
}

/** The part of that name. @throws {MissingPart} */
export function part(name) {
  const found = globalThis.uphParts?.[name]
  if (!found) throw new MissingPart(`the decoder lacks ${name}: uph-rare.js has it`)
  return found
}
