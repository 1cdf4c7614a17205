/** What few streams need, for `uph-core.js`: meshes, strips and plain lists, and how meshes are drawn. */

import './uph/rare.js'
import { addParts } from './uph/parts.js'
import { TriangleMesher } from './mesh/triangle-mesher.js'

addParts({ TriangleMesher })
