/** The decoder's rare parts; see `parts.js`. */

import * as exact from './image/exact.js'
import { parseMesh } from './mesh/parse.js'
import { srgbCodes } from './paint/srgb.js'
import { addParts } from './parts.js'

addParts({ exact, parseMesh, srgbCodes })
