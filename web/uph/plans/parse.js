/** Chunk Q [4]: the plan of the placements. */

import { part } from '../parts.js'
import { GridPlan } from './grid.js'

const STRIPS = 1
const GRID = 2
const FINE_LIST = 3

/** The plan that a payload holds, whose placements may take no more work than a budget. */
export function parsePlan(reader, charts, fields, exemplar, budget) {
  const kind = reader.u8('kind of plan', FINE_LIST)
  if (kind === STRIPS) {
    if (fields.some((field) => !field?.isIdentity)) reader.fail('plan has strips where charts have warp fields')
    return new (part('StripPlan'))(reader, charts, exemplar, budget)
  }
  if (kind === GRID) return new GridPlan(reader, charts, fields, exemplar, budget)
  return new (part('ListPlan'))(reader, charts, fields, exemplar, budget, kind === FINE_LIST)
}
