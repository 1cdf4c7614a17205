/** Painting charts by the processor: a part of the decoder, see `parts.js`. */

import { Painter } from './paint/painter.js'
import { sketch } from './paint/sketch.js'
import { addParts } from './parts.js'

addParts({ Painter, sketch })
