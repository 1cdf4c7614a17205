/** The decoder without its rare parts, which `uph-rare.js` adds, and what the page's painting takes; `uph.js` has all of the decoder. */

export { UphError } from './uph/bytes.js'
export { UphDecoder } from './uph/decoder.js'
export { halve } from './uph/paint/pyramid.js'
export { SourceTracer } from './uph/paint/tracer.js'
export { Scratch, placementWeights } from './uph/paint/weights.js'
export { topLeft } from './uph/plans/placement.js'
export { SYMMETRIES } from './uph/symmetry.js'
export { MissingPart, addParts, part } from './uph/parts.js'
