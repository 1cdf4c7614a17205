/**
 * Decoder of the formats `.uph` (textured surfaces) and `.ezw` (images), version 1, as SPEC.md describes them.
 *
 * For browsers, module workers and node, without dependencies. Feed bytes as they come, in pieces of any size; the
 * work is proportional to the new bytes. Numbers in brackets in the modules of `uph/` are sections of SPEC.md.
 */

import './uph/painting.js'
import './uph/rare.js'

export { UphError } from './uph/bytes.js'
export { UphDecoder } from './uph/decoder.js'
export { EzwDecoder } from './uph/ezw.js'
