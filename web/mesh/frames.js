/** Normals and tangents of a patch, also where its derivatives vanish. */

import { basis, evaluate, norm, range } from './bezier.js'

/** Below this ratio a cross product has lost so many digits that a limit is better. */
export const INACCURATE = 1e-5
const LOST = 1e-10 // below this one it holds nothing but rounding
const INWARD = 1 / 1024 // where a tangent is looked for if there is none

/** The order of magnitude of the largest derivatives by s and by t. */
export function slopeBounds({ m, n, net }) {
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
    const good = range(7, (k) => {
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

/** The unit tangent by t, at right angles to the normal. */
function tangentAt(patch, s, t, v, at, bounds, [nx, ny, nz]) {
  let [x, y, z] = [v[at + 6], v[at + 7], v[at + 8]]
  if (norm(v, at + 6) <= INACCURATE * bounds[1]) {
    const [a, b] = [s, t].map((u) => u + (u <= 0.5 ? INWARD : -INWARD))
    ;[x, y, z] = evaluate(patch, basis(patch.m, [a]), basis(patch.n, [b])).subarray(6)
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

/** Write vertices at all pairs of the parameters of two bases into a mesh, from vertex `first` on. */
export function writeFrames(patch, S, T, mesh, first) {
  const v = evaluate(patch, S, T)
  const bounds = slopeBounds(patch)
  const normal = new Float64Array(3)
  for (let at = 0, k = first; at < v.length; at += 9, k++) {
    const s = S.us[Math.floor((k - first) / T.us.length)]
    const t = T.us[(k - first) % T.us.length]
    if (!unitNormal(v, at, bounds, INACCURATE, normal, 0)) limitNormal(patch, s, t, v, at, bounds, normal)
    const tangent = tangentAt(patch, s, t, v, at, bounds, normal)
    for (let c = 0; c < 3; c++) {
      mesh.positions[3 * k + c] = v[at + c]
      mesh.normals[3 * k + c] = normal[c]
      mesh.tangents[4 * k + c] = tangent[c]
    }
    mesh.tangents[4 * k + 3] = 1 // normal × tangent is up in the texture
    mesh.parameters[2 * k] = s
    mesh.parameters[2 * k + 1] = t
  }
}
