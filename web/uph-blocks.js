/** What the page's painting takes of the decoder: blocks, where they show the sample, and their weights. */

export { halve, sourceOf } from './uph/paint/pyramid.js'
export { Scratch, placementWeights } from './uph/paint/weights.js'
export { topLeft } from './uph/plans/placement.js'
export { SYMMETRIES } from './uph/symmetry.js'
