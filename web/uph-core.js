/** The decoder without its parts, which `uph-rare.js` adds; `uph.js` has all of the decoder. */

export { UphError } from './uph/bytes.js'
export { UphDecoder } from './uph/decoder.js'
export { MapPyramid, pyramidLevel } from './uph/paint/pyramid.js'
export { MissingPart, addParts, hasPart, part } from './uph/parts.js'
export { SYMMETRIES } from './uph/symmetry.js'
