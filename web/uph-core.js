/** The decoder without its rare parts, which `uph-rare.js` adds; `uph.js` has all. */

export { UphError } from './uph/bytes.js'
export { UphDecoder } from './uph/decoder.js'
export { MissingPart, addParts, part } from './uph/parts.js'
