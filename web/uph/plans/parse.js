/** Chunk Q [4]: the plan of the placements. */

import { GridPlan } from './grid.js'
import { ListPlan } from './list.js'
import { StripPlan } from './strips.js'

const LIST = 0
const STRIPS = 1
const GRID = 2
const FINE_LIST = 3

/** The plan that a payload holds; `hasFields` if the file has warp fields. */
export function parsePlan(reader, charts, fields, exemplar, hasFields) {
  const kind = reader.u8('kind of plan', FINE_LIST)
  if (kind === STRIPS && hasFields) reader.fail('plan has strips where charts have warp fields')
  if (kind === STRIPS) return new StripPlan(reader, charts, exemplar)
  if (kind === GRID) return new GridPlan(reader, charts, fields, exemplar)
  return new ListPlan(reader, charts, fields, exemplar, kind === LIST ? 16 : 1)
}
