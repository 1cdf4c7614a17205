/** What few streams need, for `uph-core.js`: meshes, how these are drawn, and lossless or very deep samples. */

import './uph/rare.js'
import { addParts } from './uph/parts.js'
import { TriangleMesher } from './mesh/triangle-mesher.js'

addParts({ TriangleMesher })
