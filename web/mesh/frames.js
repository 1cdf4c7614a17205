/** Normals and tangents, also where derivatives vanish. */

import { basis, evaluate, norm, tabulate } from './bezier.js'

/** Below this ratio a cross product has lost so many digits that a limit is better. */
export const INACCURATE = 1e-5
const LOST = 1e-10 // below this one it holds nothing but rounding
const INWARD = 1 / 1024 // where a tangent is looked for if there is none

const BOUNDS = new WeakMap() // by patch

/** The order of magnitude of a patch's largest derivatives by s and by t. */
export function slopeBounds(patch) {
  if (!BOUNDS.has(patch)) BOUNDS.set(patch, measureSlopes(patch))
  return BOUNDS.get(patch)
}

function measureSlopes({ m, n, net }) {
  const most = [0, 0]
  for (const [axis, step] of [4 * (n + 1), 4].entries()) {
    for (let k = 0; k + step < net.length; k += 4) {
      if (axis && (k / 4 + 1) % (n + 1) === 0) continue
      for (let c = k; c < k + 3; c++) {
        most[axis] = Math.max(most[axis], Math.abs(net[c + step] / net[k + step + 3] - net[c] / net[k + 3]))
      }
    }
  }
  return [m * most[0], n * most[1]]
}

/** S_s × S_t of length 1 into to[i …], from what `evaluate` gives; false where it can not be trusted. */
export function unitNormal(v, at, bounds, least, to, i) {
  const x = v[at + 4] * v[at + 8] - v[at + 5] * v[at + 7]
  const y = v[at + 5] * v[at + 6] - v[at + 3] * v[at + 8]
  const z = v[at + 3] * v[at + 7] - v[at + 4] * v[at + 6]
  const size = Math.sqrt(x * x + y * y + z * z)
  to[i] = x / size
  to[i + 1] = y / size
  to[i + 2] = z / size
  return size > least * (norm(v, at + 3) * bounds[1] + norm(v, at + 6) * bounds[0]) && size < Infinity
}

/** The normal where the derivatives span no plane: the limit along the patch, inward, by Neville's scheme. */
function limitNormal(patch, s, t, v, at, bounds, to) {
  const inward = [s <= 0.5 ? 1 : -1, t <= 0.5 ? 1 : -1]
  // An edge s = const has collapsed where the derivative along it, by t, is the smaller one.
  const first = norm(v, at + 6) * bounds[0] <= norm(v, at + 3) * bounds[1] ? 0 : 1
  const found = new Float64Array(21)
  for (const axes of [[first], [1 - first], [0, 1]]) {
    const good = tabulate(7, (k) => {
      const place = [s, t]
      for (const axis of axes) place[axis] += inward[axis] / 2 ** (k + 5)
      const near = evaluate(patch, basis(patch.m, [place[0]]), basis(patch.n, [place[1]]))
      return unitNormal(near, 0, bounds, LOST, found, 3 * k)
    })
    if (good.includes(false)) continue
    for (let k = 1; k < 7; k++) {
      for (let c = 0; c < 21 - 3 * k; c++) found[c] = found[c + 3] + (found[c + 3] - found[c]) / (2 ** k - 1)
    }
    const size = norm(found, 0)
    for (let c = 0; c < 3; c++) to[c] = found[c] / size
    return
  }
  to.set([0, 0, 1])
}

/** The unit tangent by t, at right angles to the normal, at shares u and v of a chart's part of a face. */
function tangentAt(part, u, v, slope, least, [nx, ny, nz]) {
  let [x, y, z] = slope
  if (norm(slope, 0) <= least) {
    const [a, b] = [u, v].map((share) => share + (share <= 0.5 ? INWARD : -INWARD))
    ;[x, y, z] = part.evaluate([a], [b]).subarray(6)
  }
  const along = x * nx + y * ny + z * nz
  x -= along * nx
  y -= along * ny
  z -= along * nz
  let size = Math.sqrt(x * x + y * y + z * z)
  if (!(size > 0 && size < Infinity)) {
    // A patch without area there: any direction across the normal does.
    ;[x, y, z] = Math.abs(nx) < 0.6 ? [0, nz, -ny] : [-nz, 0, nx]
    size = Math.hypot(x, y, z)
  }
  return [x / size, y / size, z / size]
}

/** Write vertices at all pairs of shares of a chart's part of a face into a mesh, from vertex `first` on. */
export function writeFrames(part, us, vs, mesh, first) {
  const normal = new Float64Array(3)
  for (const { patch, S, T } of part.blocks(us, vs)) {
    const values = evaluate(patch, basis(patch.m, S.places), basis(patch.n, T.places))
    const bounds = slopeBounds(patch)
    for (let at = 0, n = 0; at < values.length; at += 9, n++) {
      const [i, j] = [Math.floor(n / T.places.length), n % T.places.length]
      if (!unitNormal(values, at, bounds, INACCURATE, normal, 0)) {
        limitNormal(patch, S.places[i], T.places[j], values, at, bounds, normal)
      }
      const [row, column] = [S.start + i, T.start + j]
      const slope = values.subarray(at + 6, at + 9)
      const tangent = tangentAt(part, us[row], vs[column], slope, INACCURATE * bounds[1], normal)
      const k = first + row * vs.length + column
      mesh.positions.set(values.subarray(at, at + 3), 3 * k)
      mesh.normals.set(normal, 3 * k)
      mesh.tangents.set(tangent, 4 * k)
      mesh.tangents[4 * k + 3] = 1 // normal × tangent is up in the texture
      mesh.parameters[2 * k] = us[row]
      mesh.parameters[2 * k + 1] = vs[column]
    }
  }
}
