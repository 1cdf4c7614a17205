/** The decoder without its parts, which `uph-painting.js` and `uph-rare.js` add; `uph.js` has all of the decoder. */

export { UphError } from './uph/bytes.js'
export { UphDecoder } from './uph/decoder.js'
export { MissingPart, addParts, hasPart, part } from './uph/parts.js'
