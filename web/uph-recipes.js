/** Of what a page paints charts, for `uph-core.js`: where there is a graphics card. */

import { addParts } from './uph/parts.js'
import { ChartRecipes } from './worker/recipes.js'

addParts({ ChartRecipes })
