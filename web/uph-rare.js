/** What few streams need, for `uph-core.js`: meshes, strips and plain lists, how meshes are drawn, and charts that are too large. */

import './uph/rare.js'
import { addParts } from './uph/parts.js'
import { TriangleMesher } from './mesh/triangle-mesher.js'
import { paintShrunk } from './worker/shrinking.js'

addParts({ TriangleMesher, paintShrunk })
