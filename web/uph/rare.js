/** The decoder's rare parts; see `parts.js`. */

import * as exact from './image/exact.js'
import { parseMesh } from './mesh/parse.js'
import { fillRamp } from './paint/ramp.js'
import { laySamples } from './paint/samples.js'
import { srgbCodes } from './paint/srgb.js'
import { addParts } from './parts.js'
import { ListPlan } from './plans/list.js'
import { StripPlan } from './plans/strips.js'

addParts({ exact, fillRamp, laySamples, parseMesh, srgbCodes, ListPlan, StripPlan })
