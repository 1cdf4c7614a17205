/** The decoder's rare parts; see `parts.js`. */

import { parseMesh } from './mesh/parse.js'
import { addParts } from './parts.js'
import { ListPlan } from './plans/list.js'
import { StripPlan } from './plans/strips.js'

addParts({ parseMesh, ListPlan, StripPlan })
