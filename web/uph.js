/**
 * Decoder of the formats `.uph` (textured surfaces) and `.ezw` (images) as SPEC.md describes them.
 *
 * For browsers, module workers and node, without dependencies. Feed bytes as they come, in pieces of any size; the
 * work is proportional to the new bytes. Numbers in brackets in the modules of `uph/` are sections of SPEC.md.
 */

import { UphDecoder as Decoder } from './uph/decoder.js'
import { fillLimits } from './uph/limits.js'

export { UphError } from './uph/bytes.js'
export { EzwDecoder } from './uph/ezw.js'

/** Decodes a `.uph` stream as its bytes arrive, with a caller's limits. */
export class UphDecoder extends Decoder {
  constructor({ limits } = {}) {
    super({ limits: fillLimits(limits) })
  }
}
