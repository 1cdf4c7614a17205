/** Control nets of the built-in surfaces [SPEC.md, 2]. */

import { tabulate } from './bezier.js'

/** Cosine and sine of 2πk/steps for k = 0 … steps; exact at quarters, and the last is the first. */
const circle = (steps) =>
  tabulate(steps + 1, (n) => {
    const k = n % steps
    const angle = ((Math.PI / 2) * ((4 * k) % steps)) / steps
    const [c, s] = [Math.cos(angle), Math.sin(angle)]
    return [
      [c, s],
      [-s, c],
      [-c, -s],
      [s, -c],
    ][Math.floor((4 * k) / steps)]
  })

/** Patches of degree (m, n), rows × columns of them; point(p, q, i, j) gives control points. */
function nets(rows, columns, m, n, point) {
  return tabulate(rows * columns, (k) => ({
    m,
    n,
    net: Float64Array.from(
      tabulate((m + 1) * (n + 1), (c) =>
        point(Math.floor(k / columns), k % columns, Math.floor(c / (n + 1)), c % (n + 1)),
      ).flat(),
    ),
  }))
}

/** Profile curves of one degree, lists of (w·r, w·z, w), revolved round the z axis. */
function revolve(profile, spans) {
  const points = circle(2 * spans)
  return nets(profile.length, spans, profile[0].length - 1, 2, (p, q, i, j) => {
    const [radius, height, weight] = profile[p][i]
    const [x, y] = points[2 * q + j]
    const w = j === 1 ? Math.cos(Math.PI / spans) : 1
    return [radius * x, radius * y, height * w, weight * w]
  })
}

function cyclide({ a, c, mu, spans: [rows, columns] }) {
  const b = Math.sqrt((a - c) * (a + c))
  const [thetas, phis] = [circle(2 * rows), circle(2 * columns)]
  return nets(rows, columns, 2, 2, (p, q, i, j) => {
    const d = i === 1 ? Math.cos(Math.PI / rows) : 1
    const e = j === 1 ? Math.cos(Math.PI / columns) : 1
    const [x, y] = thetas[2 * p + i]
    const [f, z] = phis[2 * q + j]
    return [
      mu * (c * d * e - a * x * f) + b * b * x * e,
      b * (a * e - mu * f) * y,
      b * (c * x - mu * d) * z,
      a * d * e - c * x * f,
    ]
  })
}

function octants(rx, ry, rz) {
  const half = tabulate(2, (p) =>
    tabulate(3, (i) => {
      const [z, r] = circle(8)[2 * p + i]
      return [r, z, i === 1 ? Math.SQRT1_2 : 1]
    }),
  )
  const patches = revolve(half, 4)
  for (const { net } of patches) net.forEach((value, k) => (net[k] = value * [rx, ry, rz, 1][k % 4]))
  return patches
}

/** Cobb's net of a cube's face: i ≤ j ≤ 2, and the rest by its symmetries. */
function sixPatches(r) {
  const [r2, r3, r6] = [Math.SQRT2, Math.sqrt(3), Math.sqrt(6)]
  const low = 4 * (1 - r3)
  const far = r2 * (r3 - 4)
  const edge = (4 * (1 - 2 * r3)) / 3
  const inner = (2 - 3 * r3) / 2
  const top = (4 * (5 - r3)) / 3
  const quarter = [
    [[low, low, -low, 4 * (3 - r3)], [-r2, far, -far, r2 * (3 * r3 - 2)], [0, edge, -edge, top]],
    [, [inner, inner, (r3 + 6) / 2, (r3 + 6) / 2], [0, (r2 * (2 * r3 - 7)) / 3, (5 * r6) / 3, (r2 * (r3 + 6)) / 3]],
    [, , [0, 0, top, (4 * (5 * r3 - 1)) / 9]],
  ]
  // Right, down and outward as seen from outside: number and sign of the axis.
  const faces = [
    [1, 1, 2, -1, 0, 1],
    [0, -1, 2, -1, 1, 1],
    [1, -1, 2, -1, 0, -1],
    [0, 1, 2, -1, 1, -1],
    [0, 1, 1, -1, 2, 1],
    [0, 1, 1, 1, 2, -1],
  ]
  return nets(6, 1, 4, 4, (face, _, i, j) => {
    const [p, q] = [Math.min(i, 4 - i), Math.min(j, 4 - j)]
    let [x, y, z, w] = quarter[Math.min(p, q)][Math.max(p, q)]
    if (p > q) [x, y] = [y, x]
    const point = [0, 0, 0, w]
    const local = [j > 2 ? -x : x, i > 2 ? -y : y, z]
    local.forEach((value, k) => (point[faces[face][2 * k]] = r * value * faces[face][2 * k + 1]))
    return point
  })
}

// Radius and height in thousandths of the cubic control points: inside from the bottom up, outside downward, base.
const VASE = [
  [0, 120, 360, 120, 900, 300, 900, 470, 900, 620, 500, 560, 360, 720],
  [270, 5760 / 7, 340, 870, 420, 930, 480, 975, 480, 1000, 520, 1000, 580, 1000, 560, 965, 500, 930],
  [380, 860, 340, 800, 440, 720, 590, 600, 1000, 640, 1000, 470, 1000, 270, 500, 180, 460, 60],
  [445, 15, 460, 0, 400, 0, 800 / 3, 0, 400 / 3, 0, 0, 0],
].flat()

const frustum = (top, bottom, h, spans) => revolve([[[top, h / 2, 1], [bottom, -h / 2, 1]]], spans)

const BUILT_IN = {
  cyclide,
  torus: ({ R, r, spans }) => cyclide({ a: R, c: 0, mu: r, spans }),
  sphere: ({ r, tiling }) => (tiling ? octants(r, r, r) : sixPatches(r)),
  plane: ({ width, height, spans: [rows, columns] }) =>
    nets(rows, columns, 1, 1, (p, q, i, j) => {
      return [width * ((q + j) / columns - 0.5), height * (0.5 - (p + i) / rows), 0, 1]
    }),
  ellipsoid: ({ rx, ry, rz }) => octants(rx, ry, rz),
  cylinder: ({ r, h, spans }) => frustum(r, r, h, spans),
  cone: ({ r1, r2, h, spans }) => frustum(r2, r1, h, spans),
  vase: ({ radius, height, spans }) =>
    revolve(
      tabulate(10, (p) =>
        tabulate(4, (i) => {
          const k = 2 * (3 * p + i)
          return [(VASE[k] / 1000) * radius, (VASE[k + 1] / 1000 - 0.5) * height, 1]
        }),
      ),
      spans,
    ),
}

/** The patches of a built-in surface. */
export function builtInPatches(kind, params) {
  return BUILT_IN[kind](params)
}
