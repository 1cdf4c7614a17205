/** Painting charts in the worker, for `uph-core.js`: where there is no graphics card that does, or it fails. */

import './uph/painting.js'
import { addParts } from './uph/parts.js'
import { ChartPainting } from './worker/painting.js'

addParts({ ChartPainting })
