/**
 * Meshes of textured surfaces: rational Bézier patches to triangles, watertight whatever each chart's fineness.
 *
 * Made for what `UphDecoder` gives, without dependencies; frames and numbers of edges are those of CONVENTIONS.md.
 * A chart is a grid inside and a ring of vertices round it. Along a meeting of two charts both rings have the breaks
 * of either, at positions that one side gives to both; corners that touch share one position.
 */

const SLACK = 1e-6 // parameters of an edge closer than this are one
const LARGEST = 1e30
const DEFAULT_TOLERANCE = 1e-9
const MOST_SEGMENTS = 256
const FLAT = 1e-5 // below this ratio a cross product has lost so many digits that a limit is better,
const LOST = 1e-10 // and below this one it holds nothing but rounding
const INWARD = 1 / 1024 // where a tangent is looked for if there is none
const MARGIN = 1.2 // bends are sampled

const range = (count, of) => Array.from({ length: count }, (_, k) => of(k))

// ---------------------------------------------------------------- evaluation

/** Bernstein polynomials of degree d and their derivatives at the parameters `us`, d + 1 numbers each. */
function basis(d, us) {
  const values = new Float64Array((d + 1) * us.length)
  const slopes = new Float64Array(values.length)
  us.forEach((u, n) => {
    const at = n * (d + 1)
    values[at] = 1
    for (let e = 1; e <= d; e++) {
      if (e === d) for (let j = 0; j <= d; j++) slopes[at + j] = d * ((j && values[at + j - 1]) - values[at + j])
      for (let j = e; j > 0; j--) values[at + j] = (1 - u) * values[at + j] + u * values[at + j - 1]
      values[at] *= 1 - u
    }
  })
  return { us, values, slopes }
}

const TABLES = new Map()

/** `basis` at the multiples of 1/n from first/n to 1 − first/n, made once. */
function table(d, n, first) {
  const key = (64 * n + d) * 2 + first
  if (!TABLES.has(key)) TABLES.set(key, basis(d, range(n + 1 - 2 * first, (k) => (k + first) / n)))
  return TABLES.get(key)
}

/** Point, derivative by s and derivative by t, nine numbers, at all pairs of the parameters of two bases. */
function evaluate({ m, n, net }, S, T) {
  const out = new Float64Array(9 * S.us.length * T.us.length)
  const row = new Float64Array(8 * (n + 1))
  let at = 0
  for (let r = 0; r < S.us.length; r++) {
    for (let k = 0; k < 4 * (n + 1); k++) {
      let h = 0
      let slope = 0
      for (let i = 0, b = r * (m + 1); i <= m; i++, b++) {
        const value = net[4 * (n + 1) * i + k]
        h += S.values[b] * value
        slope += S.slopes[b] * value
      }
      row[k] = h
      row[4 * (n + 1) + k] = slope
    }
    for (let c = 0, b = 0; c < T.us.length; c++) {
      let x, y, z, w, xs, ys, zs, ws, xt, yt, zt, wt
      x = y = z = w = xs = ys = zs = ws = xt = yt = zt = wt = 0
      for (let k = 0, l = 4 * (n + 1); k < 4 * (n + 1); k += 4, l += 4, b++) {
        const value = T.values[b]
        const slope = T.slopes[b]
        x += value * row[k]
        y += value * row[k + 1]
        z += value * row[k + 2]
        w += value * row[k + 3]
        xs += value * row[l]
        ys += value * row[l + 1]
        zs += value * row[l + 2]
        ws += value * row[l + 3]
        xt += slope * row[k]
        yt += slope * row[k + 1]
        zt += slope * row[k + 2]
        wt += slope * row[k + 3]
      }
      const scale = 1 / w
      out[at] = x *= scale
      out[at + 1] = y *= scale
      out[at + 2] = z *= scale
      out[at + 3] = (xs - x * ws) * scale
      out[at + 4] = (ys - y * ws) * scale
      out[at + 5] = (zs - z * ws) * scale
      out[at + 6] = (xt - x * wt) * scale
      out[at + 7] = (yt - y * wt) * scale
      out[at + 8] = (zt - z * wt) * scale
      at += 9
    }
  }
  return out
}

const length = (v, at) => Math.sqrt(v[at] * v[at] + v[at + 1] * v[at + 1] + v[at + 2] * v[at + 2])
function distance(a, i, b, j) {
  const [x, y, z] = [a[i] - b[j], a[i + 1] - b[j + 1], a[i + 2] - b[j + 2]]
  return Math.sqrt(x * x + y * y + z * z) // Math.hypot takes ten times as long
}


/** The order of magnitude of the largest derivatives by s and by t. */
function slopeBounds({ m, n, net }) {
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

/** S_s × S_t of length 1 into to[i …]; false where it cannot be trusted. */
function cross(v, at, bounds, least, to, i) {
  const x = v[at + 4] * v[at + 8] - v[at + 5] * v[at + 7]
  const y = v[at + 5] * v[at + 6] - v[at + 3] * v[at + 8]
  const z = v[at + 3] * v[at + 7] - v[at + 4] * v[at + 6]
  const size = Math.sqrt(x * x + y * y + z * z)
  to[i] = x / size
  to[i + 1] = y / size
  to[i + 2] = z / size
  return size > least * (length(v, at + 3) * bounds[1] + length(v, at + 6) * bounds[0]) && size < Infinity
}

/** The normal where the derivatives span no plane: the limit along the patch, inward, by Neville's scheme. */
function limit(patch, s, t, v, at, bounds, to, i) {
  const inward = [s <= 0.5 ? 1 : -1, t <= 0.5 ? 1 : -1]
  // An edge s = const has collapsed where the derivative along it, by t, is the smaller one.
  const first = length(v, at + 6) * bounds[0] <= length(v, at + 3) * bounds[1] ? 0 : 1
  const found = new Float64Array(21)
  for (const way of [[first], [1 - first], [0, 1]]) {
    const good = range(7, (k) => {
      const place = [s, t]
      for (const axis of way) place[axis] += inward[axis] / 2 ** (k + 5)
      const near = evaluate(patch, basis(patch.m, [place[0]]), basis(patch.n, [place[1]]))
      return cross(near, 0, bounds, LOST, found, 3 * k)
    })
    if (good.includes(false)) continue
    for (let k = 1; k < 7; k++) {
      for (let c = 0; c < 21 - 3 * k; c++) found[c] = found[c + 3] + (found[c + 3] - found[c]) / (2 ** k - 1)
    }
    const size = length(found, 0)
    for (let c = 0; c < 3; c++) to[i + c] = found[c] / size
    return
  }
  to.set([0, 0, 1], i)
}

/** Write vertices at all pairs of the parameters of two bases into a mesh, from vertex `first` on. */
function frames(patch, S, T, mesh, first) {
  const v = evaluate(patch, S, T)
  const bounds = slopeBounds(patch)
  const normal = new Float64Array(3)
  for (let at = 0, k = first; at < v.length; at += 9, k++) {
    const s = S.us[Math.floor((k - first) / T.us.length)]
    const t = T.us[(k - first) % T.us.length]
    if (!cross(v, at, bounds, FLAT, normal, 0)) limit(patch, s, t, v, at, bounds, normal, 0)
    const [nx, ny, nz] = normal
    let [x, y, z] = [v[at + 6], v[at + 7], v[at + 8]]
    if (length(v, at + 6) <= FLAT * bounds[1]) {
      const [a, b] = [s, t].map((u) => u + (u <= 0.5 ? INWARD : -INWARD))
      ;[x, y, z] = evaluate(patch, basis(patch.m, [a]), basis(patch.n, [b])).subarray(6)
    }
    let along = x * nx + y * ny + z * nz
    x -= along * nx
    y -= along * ny
    z -= along * nz
    along = Math.sqrt(x * x + y * y + z * z)
    if (!(along > 0 && along < Infinity)) {
      // A patch without area there: any direction across the normal does.
      ;[x, y, z] = Math.abs(nx) < 0.6 ? [0, nz, -ny] : [-nz, 0, nx]
      along = Math.hypot(x, y, z)
    }
    mesh.positions[3 * k] = v[at]
    mesh.positions[3 * k + 1] = v[at + 1]
    mesh.positions[3 * k + 2] = v[at + 2]
    mesh.normals[3 * k] = nx
    mesh.normals[3 * k + 1] = ny
    mesh.normals[3 * k + 2] = nz
    mesh.tangents[4 * k] = x / along
    mesh.tangents[4 * k + 1] = y / along
    mesh.tangents[4 * k + 2] = z / along
    mesh.tangents[4 * k + 3] = 1 // normal × tangent is up in the texture
    mesh.parameters[2 * k] = s
    mesh.parameters[2 * k + 1] = t
  }
}

/** The net of a chart: what it covers of its patch, cut out by de Casteljau's algorithm. */
function part(patch, { s0, s1, t0, t1 }) {
  if (!s0 && !t0 && s1 === 1 && t1 === 1) return patch
  const { m, n } = patch
  const net = patch.net.slice()
  for (const [d, step, low, high] of [
    [m, 4 * (n + 1), s0, s1],
    [n, 4, t0, t1],
  ]) {
    const u = low / high
    for (let k = 0; k < net.length; k++) {
      if (Math.floor(k / step) % (d + 1)) continue
      for (let e = 1; e <= d; e++) {
        for (let i = d; i >= e; i--) net[k + i * step] = (1 - high) * net[k + (i - 1) * step] + high * net[k + i * step]
      }
      for (let e = 1; e <= d; e++) {
        for (let i = 0; i <= d - e; i++) net[k + i * step] = (1 - u) * net[k + i * step] + u * net[k + (i + 1) * step]
      }
    }
  }
  return { m, n, net }
}

// ---------------------------------------------------------------- built-in surfaces [SPEC.md, 2]

/** Cosine and sine of 2πk/steps for k = 0 … steps; exact at quarters, and the last is the first. */
const circle = (steps) =>
  range(steps + 1, (k) => {
    k %= steps
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
  return range(rows * columns, (k) => ({
    m,
    n,
    net: Float64Array.from(
      range((m + 1) * (n + 1), (c) =>
        point(Math.floor(k / columns), k % columns, Math.floor(c / (n + 1)), c % (n + 1)),
      ).flat(),
    ),
  }))
}

/** Profile curves of one degree, lists of (w·r, w·z, w), revolved round the z axis. */
function revolve(profile, spans) {
  const round = circle(2 * spans)
  return nets(profile.length, spans, profile[0].length - 1, 2, (p, q, i, j) => {
    const [radius, height, weight] = profile[p][i]
    const [x, y] = round[2 * q + j]
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

function ball(rx, ry, rz) {
  const half = range(2, (p) =>
    range(3, (i) => {
      const [z, r] = circle(8)[2 * p + i]
      return [r, z, i === 1 ? Math.SQRT1_2 : 1]
    }),
  )
  const patches = revolve(half, 4)
  for (const { net } of patches) net.forEach((value, k) => (net[k] = value * [rx, ry, rz, 1][k % 4]))
  return patches
}

/** Cobb's net of a cube's face: i ≤ j ≤ 2, and the rest by its symmetries. */
function six(r) {
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

const wall = (top, bottom, h, spans) => revolve([[[top, h / 2, 1], [bottom, -h / 2, 1]]], spans)

const BUILDERS = {
  cyclide,
  torus: ({ R, r, spans }) => cyclide({ a: R, c: 0, mu: r, spans }),
  sphere: ({ r, tiling }) => (tiling ? ball(r, r, r) : six(r)),
  plane: ({ width, height, spans: [rows, columns] }) =>
    nets(rows, columns, 1, 1, (p, q, i, j) => {
      return [width * ((q + j) / columns - 0.5), height * (0.5 - (p + i) / rows), 0, 1]
    }),
  ellipsoid: ({ rx, ry, rz }) => ball(rx, ry, rz),
  cylinder: ({ r, h, spans }) => wall(r, r, h, spans),
  cone: ({ r1, r2, h, spans }) => wall(r2, r1, h, spans),
  vase: ({ radius, height, spans }) =>
    revolve(
      range(10, (p) =>
        range(4, (i) => {
          const k = 2 * (3 * p + i)
          return [(VASE[k] / 1000) * radius, (VASE[k + 1] / 1000 - 0.5) * height, 1]
        }),
      ),
      spans,
    ),
}

// ---------------------------------------------------------------- which edges of patches meet

/** An edge of a patch, numbered 4·patch + edge, as a curve. */
function edgeOf(patches, e) {
  const { m, n, net } = patches[e >> 2]
  const down = e & 1
  return { net, d: down ? m : n, start: 4 * [0, n, m * (n + 1), 0][e & 3], step: down ? 4 * (n + 1) : 4 }
}

/**
 * Find the meetings {a, b, a0, a1, b0, b1} of edges a < b, the interval a0 < a1 of a with b0 to b1 of b, by a linear
 * map, no farther apart than the tolerance; and the edges that are a point. Where more than two edges lie in one
 * place they are taken as border.
 */
function findMeetings(patches, relative) {
  const count = 4 * patches.length
  const low = new Float64Array(3 * count).fill(Infinity)
  const high = new Float64Array(3 * count).fill(-Infinity)
  const box = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity]
  patches.forEach(({ m, n, net }, p) => {
    for (let k = 0; k < net.length; k += 4) {
      const [i, j] = [Math.floor(k / 4 / (n + 1)), (k / 4) % (n + 1)]
      const weight = net[k + 3]
      for (let c = 0; c < 3; c++) {
        const x = net[k + c] / weight
        if (!(weight >= 1 / LARGEST && weight <= LARGEST && Math.abs(net[k + c]) <= LARGEST)) {
          throw new RangeError(
            `patch ${p}: control point [${i}, ${j}] is outside the limits; ` +
              `allowed: weights ${1 / LARGEST} to ${LARGEST}, coordinates times weight up to ${LARGEST}`,
          )
        }
        box[c] = Math.min(box[c], x)
        box[c + 3] = Math.max(box[c + 3], x)
        for (let e = 0; e < 4; e++) {
          if ((e & 1 ? j : i) !== [0, n, m, 0][e]) continue
          const at = 3 * (4 * p + e) + c
          low[at] = Math.min(low[at], x)
          high[at] = Math.max(high[at], x)
        }
      }
    }
  })
  const size = distance(box, 0, box, 3)
  const tolerance = Math.min(Math.max(relative, 0), 0.01) * size
  const isPoint = Uint8Array.from(range(count, (e) => distance(low, 3 * e, high, 3 * e) <= tolerance))
  const meetings = []
  // Nets made to be slow to search are not searched to the end: what is left counts as border.
  let steps = 0
  const mostSteps = 1e7 + 500 * count

  /** The point of an edge for entry k of a basis; with `wantSlope`, its derivative there as well. */
  function pointOf({ net, d, start, step }, { values, slopes }, k, wantSlope) {
    steps += 16 + 4 * d
    const h = [0, 0, 0, 0]
    const g = [0, 0, 0, 0]
    for (let i = 0, b = k * (d + 1), p = start; i <= d; i++, b++, p += step) {
      for (let c = 0; c < 4; c++) {
        h[c] += values[b] * net[p + c]
        if (wantSlope) g[c] += slopes[b] * net[p + c]
      }
    }
    for (let c = 0; c < 3; c++) {
      h[c] /= h[3]
      g[c] = (g[c] - h[c] * g[3]) / h[3]
    }
    return wantSlope ? [h, g] : h
  }

  function pointAt(edge, u, wantSlope) {
    steps += 4 * edge.d ** 2
    return pointOf(edge, basis(edge.d, [u]), 0, wantSlope)
  }

  // Whole edges: those that coincide have their middles in one place. A hash finds them; -2 is more than two.
  const partner = new Int32Array(count).fill(-1)
  const middles = new Float64Array(3 * count)
  const cell = 8 * tolerance + size * 1e-5 || 1
  const heads = new Int32Array(2 ** Math.ceil(Math.log2(count))).fill(-1)
  const next = new Int32Array(count)
  const bucket = (x, y, z) =>
    (Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791)) & (heads.length - 1)
  const gap = (a, b, turned) => {
    let most = 0
    const [one, other] = [edgeOf(patches, a), edgeOf(patches, b)]
    for (let k = 0; k <= 8 && most <= tolerance; k++) {
      const p = pointOf(one, table(one.d, 8, 0), k)
      most = Math.max(most, distance(p, 0, pointOf(other, table(other.d, 8, 0), turned ? 8 - k : k), 0))
    }
    return most
  }
  for (let e = 0; e < count; e++) {
    if (isPoint[e]) continue
    const edge = edgeOf(patches, e)
    const middle = pointOf(edge, table(edge.d, 8, 0), 4)
    for (let c = 0; c < 3; c++) middles[3 * e + c] = middle[c]
    const [first, last] = [-tolerance, tolerance].map((more) => middle.map((x) => Math.floor((x + more) / cell)))
    const found = []
    for (let x = first[0]; x <= last[0]; x++) {
      for (let y = first[1]; y <= last[1]; y++) {
        for (let z = first[2]; z <= last[2]; z++) {
          for (let f = heads[bucket(x, y, z)]; f >= 0 && found.length < 2 && steps < mostSteps; f = next[f]) {
            steps++
            if (distance(middles, 3 * f, middle, 0) > tolerance || found[0]?.[0] === f) continue
            const [straight, turned] = [gap(e, f, false), gap(e, f, true)]
            if (Math.min(straight, turned) <= tolerance) found.push([f, turned < straight])
          }
        }
      }
    }
    const home = bucket(...middle.map((x) => Math.floor(x / cell)))
    next[e] = heads[home]
    heads[home] = e
    if (!found.length) continue
    const [f, turned] = found[0]
    if (found.length === 1 && partner[f] === -1) {
      partner[e] = f
      partner[f] = e
      meetings.push({ a: f, b: e, a0: 0, a1: 1, b0: turned ? 1 : 0, b1: turned ? 0 : 1 })
    } else for (const g of [e, ...found.flatMap(([h]) => [h, partner[h]])]) if (g >= 0) partner[g] = -2
  }
  const whole = meetings.filter(({ a }) => partner[a] >= 0)

  // Parts of the edges that are left. Their ends are ends of one edge or the other.
  steps = 0
  const lone = range(count, (e) => e).filter((e) => !isPoint[e] && partner[e] === -1)
  const extent = (c) => box[c + 3] - box[c]
  const [axis] = [0, 1, 2].sort((p, q) => extent(q) - extent(p))
  lone.sort((e, f) => low[3 * e + axis] - low[3 * f + axis])
  const inside = (e, p) =>
    [0, 1, 2].every((c) => p[c] >= low[3 * e + c] - tolerance && p[c] <= high[3 * e + c] + tolerance)
  const endsOf = (e) => {
    const edge = edgeOf(patches, e)
    return [0, 1].map((k) => pointOf(edge, table(edge.d, 1, 0), k))
  }
  const partial = new Map()
  for (let n = 0; n < lone.length; n++) {
    const a = lone[n]
    for (let k = n + 1; k < lone.length && steps < mostSteps; k++) {
      const b = lone[k]
      steps++
      if (low[3 * b + axis] > high[3 * a + axis] + 2 * tolerance) break
      const apart = (c) =>
        Math.max(low[3 * a + c], low[3 * b + c]) - Math.min(high[3 * a + c], high[3 * b + c]) > 2 * tolerance
      if (apart(0) || apart(1) || apart(2)) continue
      const meeting = compare(Math.min(a, b), Math.max(a, b))
      if (!meeting) continue
      for (const e of [a, b]) {
        if (!partial.has(e)) partial.set(e, [])
        partial.get(e).push(meeting)
      }
    }
  }

  /** The longest part that edges a and b have in common. */
  function compare(a, b) {
    const [endsA, endsB] = [endsOf(a), endsOf(b)]
    if (endsA.filter((p) => inside(b, p)).length + endsB.filter((p) => inside(a, p)).length < 2) return null
    const hits = []
    for (const k of [0, 1]) {
      const [u, v] = [project(a, endsB[k]), project(b, endsA[k])]
      if (u >= 0) hits.push([u, k])
      if (v >= 0) hits.push([k, v])
    }
    const parts = hits.flatMap((p) => hits.map((q) => [p, q]))
    parts.sort(([p, q], [r, s]) => s[0] - r[0] - (q[0] - p[0]))
    const [one, other] = [edgeOf(patches, a), edgeOf(patches, b)]
    for (const [[a0, b0], [a1, b1]] of parts) {
      if (a1 - a0 < SLACK || Math.abs(b1 - b0) < SLACK) continue
      const near = range(9, (k) => {
        const p = pointAt(one, a0 + ((a1 - a0) * k) / 8)
        return distance(p, 0, pointAt(other, b0 + ((b1 - b0) * k) / 8), 0) <= tolerance
      })
      if (!near.includes(false)) return { a, b, a0, a1, b0, b1 }
    }
    return null
  }

  /** Where on an edge a point lies, or -1. */
  function project(e, target) {
    if (!inside(e, target)) return -1
    const edge = edgeOf(patches, e)
    const [first, last] = endsOf(e)
    const refine = (u) => {
      for (let k = 0, before = -1; k < 8 && u !== before; k++) {
        const [p, g] = pointAt(edge, u, true)
        let [step, square] = [0, 0]
        for (let c = 0; c < 3; c++) {
          step += (target[c] - p[c]) * g[c]
          square += g[c] * g[c]
        }
        before = u
        u = Math.min(Math.max(u + step / (square || 1), 0), 1)
      }
      return distance(pointAt(edge, u), 0, target, 0) <= tolerance ? u : -1
    }
    const chord = distance(first, 0, last, 0)
    const guess = chord ? distance(first, 0, target, 0) / chord : 0
    let u = refine(Math.min(guess, 1))
    if (u < 0) {
      // Not from there: from the nearest of many places, if that is near enough.
      const samples = range(33, (k) => pointOf(edge, table(edge.d, 32, 0), k))
      const gaps = samples.map((p) => distance(p, 0, target, 0))
      const nearest = Math.min(...gaps)
      const spacing = Math.max(...range(32, (k) => distance(samples[k], 0, samples[k + 1], 0)))
      if (nearest > 2 * spacing + tolerance) return -1
      u = refine(gaps.indexOf(nearest) / 32)
    }
    // Halves and their like come out as they were meant, so that breaks of both sides can agree.
    const plain = Math.round(u * 2 ** 20) / 2 ** 20
    return Math.abs(u - plain) < 1e-10 ? plain : u
  }

  // A loose tolerance lets neighbours along an edge overlap by about as much; what overlaps by more is dropped.
  for (const [e, found] of partial) {
    const lowEnd = (one) => (one.a === e ? 'a0' : one.b0 < one.b1 ? 'b0' : 'b1')
    found.sort((p, q) => p[lowEnd(p)] - q[lowEnd(q)])
    const edge = edgeOf(patches, e)
    let covered = 0
    for (const one of found) {
      if (one.dropped) continue
      const start = one[lowEnd(one)]
      const stop = one.a === e ? one.a1 : Math.max(one.b0, one.b1)
      if (start < covered) {
        const overlap = distance(pointAt(edge, start), 0, pointAt(edge, covered), 0)
        one.dropped = (covered - start > SLACK && overlap > 4 * tolerance) || stop < covered + SLACK
        if (one.dropped) continue
        one[lowEnd(one)] = covered
      }
      covered = stop
    }
  }
  const parts = new Set([...partial.values()].flat().filter((one) => !one.dropped))
  return [[...whole, ...parts], isPoint]
}

// ---------------------------------------------------------------- which edges of charts meet

/** Charts' edges along a line, {side, low, high}: sorted, and without those that overlap the one before. */
function tidy(spans) {
  let covered = -1
  return spans
    .sort((p, q) => p.low - q.low)
    .filter(({ low, high }) => {
      const fits = low > covered - SLACK * (high - low)
      if (fits) covered = high
      return fits
    })
}

/** The first of spans that ends behind x. */
function firstBehind(spans, x) {
  let [from, to] = [0, spans.length]
  while (from < to) {
    const middle = (from + to) >> 1
    if (spans[middle].high > x) to = middle
    else from = middle + 1
  }
  return from
}

/** Cut a meeting of two lines along the charts' edges that lie on them, and hand out the pieces. */
function join(ones, others, { a0, a1, b0, b1 }, hand) {
  const slope = (a1 - a0) / (b1 - b0)
  const step = slope > 0 ? 1 : -1
  let i = firstBehind(ones, a0)
  let j = firstBehind(others, b0)
  if (step < 0 && !(others[j]?.low < b0)) j--
  const own = ({ low, high }, x) => {
    const u = (x - low) / (high - low)
    return u < SLACK ? 0 : u > 1 - SLACK ? 1 : u
  }
  while (i < ones.length && others[j]) {
    const [one, other] = [ones[i], others[j]]
    const ends = [other.low, other.high].map((y) => a0 + (y - b0) * slope)
    const low = Math.max(a0, one.low, Math.min(...ends))
    const high = Math.min(a1, one.high, Math.max(...ends))
    const u = [low, high].map((x) => own(one, x))
    const v = [low, high].map((x) => own(other, b0 + (x - a0) / slope))
    if (u[1] - u[0] > SLACK && Math.abs(v[1] - v[0]) > SLACK) hand(one.side, other.side, u, v)
    if (low >= a1) return
    if (one.high < Math.max(...ends)) i++
    else j += step
  }
}

// Corners (0, 0), (0, 1), (1, 1), (1, 0) are 0 to 3: where edges begin and end.
const BEGIN = [0, 1, 3, 0]
const END = [1, 2, 2, 3]

const cornerOf = (side, u) => (u === 0 ? (side & -4) + BEGIN[side & 3] : u === 1 ? (side & -4) + END[side & 3] : -1)

/** A meeting as an edge of a chart sees it, and which corners lie where it begins and ends: of either chart, or -1. */
function seen({ a, b, a0, a1, b0, b1 }, side) {
  const low = [cornerOf(a, a0), cornerOf(b, b0)]
  const high = [cornerOf(a, a1), cornerOf(b, b1)]
  if (a === side) return { start: a0, stop: a1, other: b, otherStart: b0, otherStop: b1, from: low, to: high }
  if (b0 < b1) return { start: b0, stop: b1, other: a, otherStart: a0, otherStop: a1, from: low, to: high }
  return { start: b1, stop: b0, other: a, otherStart: a1, otherStop: a0, from: high, to: low }
}

/**
 * Segments along s and t with which a chart's chords stay within `errorPixels` of it: powers of two from 1 to 256.
 *
 * `bounds` is what `SurfaceMesher.bounds` returns; `pixelsPerUnit` how large the model's unit is on the screen there.
 */
export function countsFor({ bendS, bendT }, pixelsPerUnit, errorPixels) {
  // Half the error to either direction: in the middle of a cell they add up.
  return [bendS, bendT].map((bend) => {
    const wanted = Math.log2(Math.sqrt((bend * pixelsPerUnit) / (4 * errorPixels)) || 1)
    return 2 ** Math.ceil(Math.min(Math.max(wanted, 0), Math.log2(MOST_SEGMENTS)))
  })
}

/** Makes meshes of a surface's charts; see `uph-mesh.d.ts`. */
export class SurfaceMesher {
  #charts
  #sides // per edge of a chart, 4·chart + edge, its meetings along it: {a, b, a0, a1, b0, b1} as of patches
  #roots // per corner, 4·chart + corner, the corner that gives its position
  #isPoint

  /** Find what meets what. Throws `RangeError` for a surface that cannot be. */
  constructor(surface, charts) {
    this.patches = surface.patches ?? BUILDERS[surface.kind](surface.params)
    this.#charts = charts
    const [meetings, isPoint] = findMeetings(this.patches, surface.tolerance ?? DEFAULT_TOLERANCE)
    const borders = range(isPoint.length, () => [])
    const lines = new Map()
    this.#sides = range(4 * charts.length, () => [])
    this.#isPoint = new Uint8Array(4 * charts.length)
    this.#roots = Int32Array.from(range(4 * charts.length, (k) => k))
    charts.forEach(({ patch, s0, s1, t0, t1 }, n) => {
      for (let k = 0; k < 4; k++) {
        const at = [s0, t1, s1, t0][k]
        const behind = k === 0 || k === 3 // the chart lies behind this line
        const side = 4 * n + k
        const span = { side, low: k & 1 ? s0 : t0, high: k & 1 ? s1 : t1 }
        if (at === (behind ? 0 : 1)) {
          borders[4 * patch + k].push(span)
          if (!isPoint[4 * patch + k]) continue
          this.#isPoint[side] = 1
          this.#weld(cornerOf(side, 0), cornerOf(side, 1))
        } else {
          const key = `${patch} ${k & 1} ${Math.round(at * 2 ** 30)}`
          if (!lines.has(key)) lines.set(key, [[], []])
          lines.get(key)[behind ? 1 : 0].push(span)
        }
      }
    })
    const add = (a, b, [a0, a1], [b0, b1]) => {
      const meeting = { a, b, a0, a1, b0, b1 }
      this.#sides[a].push(meeting)
      this.#sides[b].push(meeting)
    }
    const sorted = borders.map(tidy)
    for (const meeting of meetings) join(sorted[meeting.a], sorted[meeting.b], meeting, add)
    const same = { a0: 0, a1: 1, b0: 0, b1: 1 }
    for (const [before, behind] of lines.values()) join(tidy(before), tidy(behind), same, add)
    this.#sides.forEach((found, side) => {
      found.sort((p, q) => seen(p, side).start - seen(q, side).start)
      let before = null
      for (const meeting of found) {
        const { start, stop, from, to } = seen(meeting, side)
        for (const corners of [from, to]) if (Math.min(...corners) >= 0) this.#weld(...corners)
        // Two that meet this edge at one point meet each other there.
        const touching = Math.max(...from)
        if (before && start - before.stop < SLACK && Math.min(touching, before.corner) >= 0) {
          this.#weld(touching, before.corner)
        }
        before = { stop, corner: Math.max(...to) }
      }
    })
    for (let k = 0; k < this.#roots.length; k++) this.#roots[k] = this.#root(k)
  }

  /** Intervals of a chart's edge that meet edges of charts, along it; the maps between them are linear. */
  neighbours(chart, edge) {
    const side = 4 * this.#checked(chart) + edge
    return (this.#sides[side] ?? []).map((meeting) => {
      const { start, stop, other, otherStart, otherStop } = seen(meeting, side)
      return { start, stop, chart: other >> 2, edge: other & 3, otherStart, otherStop }
    })
  }

  /** A sphere round a chart, and about how much it bends along s and along t. */
  bounds(chart) {
    const patch = this.#net(this.#checked(chart))
    const cells = 8
    const v = evaluate(patch, table(patch.m, cells, 0), table(patch.n, cells, 0))
    const row = 9 * (cells + 1)
    const normal = [0, 0, 0]
    const reach = slopeBounds(patch)
    let [bendS, bendT, twist] = [0, 0, 0]
    const box = [Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity]
    for (let at = 0; at < v.length; at += 9) {
      for (let c = 0; c < 3; c++) {
        box[c] = Math.min(box[c], v[at + c])
        box[c + 3] = Math.max(box[c + 3], v[at + c])
      }
      if ((at + 9) % row) bendT = Math.max(bendT, distance(v, at + 6, v, at + 15))
      if (at + row >= v.length) continue
      bendS = Math.max(bendS, distance(v, at + 3, v, at + row + 3))
      if (!cross(v, at, reach, FLAT, normal, 0)) continue
      // Twist bends cells as well, but only out of the surface.
      const out = normal.reduce((sum, x, c) => sum + x * (v[at + row + 6 + c] - v[at + 6 + c]), 0)
      twist = Math.max(twist, Math.abs(out))
    }
    bendS = MARGIN * cells * (bendS + twist)
    bendT = MARGIN * cells * (bendT + twist)
    const center = range(3, (c) => (box[c] + box[c + 3]) / 2)
    let radius = 0
    for (let at = 0; at < v.length; at += 9) radius = Math.max(radius, distance(v, at, center, 0))
    return { center, radius: radius + (bendS + bendT) / (8 * cells ** 2), bendS, bendT }
  }

  /** At each of `count` texels along an edge: the angle by which the tangents beyond it are turned against the chart's. */
  turns(chart, edge, count) {
    const angles = new Float32Array(count)
    for (const there of this.neighbours(chart, edge)) {
      const { start, stop, otherStart, otherStop } = there
      const places = range(count, (n) => (n + 0.5) / count).filter((u) => u >= start && u < stop)
      const slope = (otherStop - otherStart) / (stop - start)
      const across = places.map((u) => Math.min(1, Math.max(0, otherStart + slope * (u - start))))
      const own = this.#frames(chart, edge, places)
      const other = this.#frames(there.chart, there.edge, across)
      places.forEach((u, k) => {
        const [nx, ny, nz] = own.normals.subarray(3 * k)
        const [x, y, z] = own.tangents.subarray(4 * k)
        const [tx, ty, tz] = other.tangents.subarray(4 * k)
        const up = tx * (ny * z - nz * y) + ty * (nz * x - nx * z) + tz * (nx * y - ny * x)
        angles[Math.round(u * count - 0.5)] = Math.atan2(up, tx * x + ty * y + tz * z)
      })
    }
    return angles
  }

  /** The mesh of a chart; `counts` are the segments along s and along t of every chart. */
  mesh(chart, counts) {
    const patch = this.#net(this.#checked(chart))
    const [rows, columns] = [this.#segments(4 * chart + 1, counts), this.#segments(4 * chart, counts)]
    const sides = range(4, (k) => this.#side(4 * chart + k, counts))
    const [wide, inner] = [columns - 1, (rows - 1) * (columns - 1)]
    const round = sides.reduce((sum, { us }) => sum + us.length - 1, 0)
    const size = inner + round
    const mesh = {
      positions: new Float32Array(3 * size),
      normals: new Float32Array(3 * size),
      tangents: new Float32Array(4 * size),
      parameters: new Float32Array(2 * size),
      indices: new (size > 65535 ? Uint32Array : Uint16Array)(6 * (inner - 1) + 3 * round),
      outline: new Float32Array(6 * round),
    }
    const { positions, indices, outline } = mesh
    frames(patch, table(patch.m, rows, 1), table(patch.n, columns, 1), mesh, 0)
    let count = 0
    const triangle = (a, b, c) => {
      indices[count++] = a
      indices[count++] = b
      indices[count++] = c
    }
    for (let i = 0; i < rows - 2; i++) {
      for (let j = 0, a = i * wide; j < columns - 2; j++, a++) {
        triangle(a, a + wide, a + wide + 1)
        triangle(a, a + wide + 1, a + 1)
      }
    }
    // Round the chart from corner to corner, what lies inside to the right.
    const apart = (a, b) => distance(positions, 3 * a, positions, 3 * b) > 0
    let start = inner
    sides.forEach(({ us, points }, k) => {
      const places = us.slice(0, -1)
      const [S, T] = [basis(patch.m, k & 1 ? places : [k / 2]), basis(patch.n, k & 1 ? [k === 1 ? 1 : 0] : places)]
      frames(patch, S, T, mesh, start)
      positions.set(points.slice(0, -3), 3 * start)
      start += places.length
    })
    start = inner
    sides.forEach(({ us }, k) => {
      // Between the edge and the first line of the grid: always what lies less far ahead.
      const segments = k & 1 ? rows : columns
      const [first, step] = [[0, 1], [wide - 1, wide], [inner - 1, -1], [inner - wide, -wide]][k]
      const outer = (i) => inner + ((start - inner + i) % round)
      const far = (u) => (k > 1 ? 1 - u : u)
      for (let i = 0, j = 1; i < us.length - 1 || j < segments - 1; ) {
        const a = outer(i)
        const b = first + step * (j - 1)
        const out = i < us.length - 1 && (j === segments - 1 || far(us[i]) + far(us[i + 1]) <= (2 * j + 1) / segments)
        const c = out ? outer(++i) : first + step * j++
        if (apart(a, b) && apart(b, c) && apart(c, a)) triangle(a, b, c)
      }
      start += us.length - 1
    })
    for (let k = 0; k < 2 * round; k++) {
      const from = 3 * (inner + (((k + 1) >> 1) % round))
      for (let c = 0; c < 3; c++) outline[3 * k + c] = positions[from + c]
    }
    mesh.indices = indices.slice(0, count)
    return mesh
  }

  #checked(chart) {
    if (!this.#charts[chart]) throw new RangeError(`chart is ${chart}; allowed: 0 to ${this.#charts.length - 1}`)
    return chart
  }

  #net(chart) {
    return part(this.patches[this.#charts[chart].patch], this.#charts[chart])
  }

  #root(k) {
    while (this.#roots[k] !== k) k = this.#roots[k] = this.#roots[this.#roots[k]]
    return k
  }

  #weld(k, l) {
    const [p, q] = [this.#root(k), this.#root(l)]
    this.#roots[Math.max(p, q)] = Math.min(p, q)
  }

  /** Segments along an edge: at least two, so that the grid has an inside. */
  #segments(side, counts) {
    const count = counts[2 * (side >> 2) + (side & 1 ? 0 : 1)]
    if (!(count >= 1 && count <= MOST_SEGMENTS)) {
      throw new RangeError(`count of chart ${side >> 2} is ${count}; allowed: 1 to ${MOST_SEGMENTS}`)
    }
    return Math.max(2, Math.floor(count))
  }

  /** Points of a chart's edge at parameters of it, nine numbers each of which three are the point. */
  #along(side, us) {
    const { patch, s0, s1, t0, t1 } = this.#charts[side >> 2]
    const { m, n } = this.patches[patch]
    const at = [[s0, t1, s1, t0][side & 3]]
    if (side & 1) return evaluate(this.patches[patch], basis(m, us.map((u) => s0 + (s1 - s0) * u)), basis(n, at))
    return evaluate(this.patches[patch], basis(m, at), basis(n, us.map((u) => t0 + (t1 - t0) * u)))
  }

  /** Normals and tangents at parameters of a chart's edge. */
  #frames(chart, edge, us) {
    const patch = this.#net(chart)
    const names = { positions: 3, normals: 3, tangents: 4, parameters: 2 }
    const found = Object.fromEntries(Object.entries(names).map(([name, k]) => [name, new Float32Array(k * us.length)]))
    const at = [edge === 1 || edge === 2 ? 1 : 0]
    const [S, T] = edge & 1 ? [us, at] : [at, us]
    frames(patch, basis(patch.m, S), basis(patch.n, T), found, 0)
    return found
  }

  #corner(k) {
    const root = this.#roots[k]
    const side = (root & -4) + [0, 0, 2, 2][root & 3]
    return this.#along(side, [[0, 1, 1, 0][root & 3]]).subarray(0, 3)
  }

  /** Vertices along an edge: their parameters and positions, in the order in which they go round the chart. */
  #side(side, counts) {
    const count = this.#segments(side, counts)
    const us = [0]
    const points = [...this.#corner(cornerOf(side, 0))]
    const add = (u, v, at) => {
      if (!(u > us.at(-1))) return
      us.push(u)
      points.push(v[at], v[at + 1], v[at + 2])
    }
    const alone = (stop) => {
      const first = us.at(-1)
      const own = range(count, (k) => k / count).filter((u) => u > first + SLACK && u < stop - SLACK)
      const v = this.#along(side, own)
      own.forEach((u, k) => add(u, v, 9 * k))
    }
    for (const meeting of this.#sides[side]) {
      const { a, b, a0, a1, b0, b1 } = meeting
      const { start, stop, from, to } = seen(meeting, side)
      // Breaks of both sides, 0 to 1 along the meeting.
      const breaks = []
      for (const [one, first, last] of [
        [a, a0, a1],
        [b, b0, b1],
      ]) {
        const segments = this.#segments(one, counts)
        const [low, high] = [first, last].sort((p, q) => p - q)
        for (let k = Math.ceil(low * segments); k <= high * segments; k++) {
          breaks.push((k / segments - first) / (last - first))
        }
      }
      breaks.sort((p, q) => p - q)
      const inside = breaks.filter((x, k) => x > SLACK && x < 1 - SLACK && !(k && x - breaks[k - 1] < SLACK))
      const places = [0, ...inside, 1]
      const v = this.#along(a, places.map((x) => a0 + (a1 - a0) * x))
      const turned = side !== a && b0 > b1
      ;[from, to].forEach((corners, k) => {
        const corner = Math.max(...corners)
        if (corner >= 0) v.set(this.#corner(corner), (k ? !turned : turned) ? v.length - 9 : 0)
      })
      alone(start)
      places.forEach((_, k) => {
        const n = turned ? places.length - 1 - k : k
        const x = turned ? 1 - places[n] : places[n]
        if (k || start > us.at(-1) + SLACK) add(x === 1 ? stop : start + (stop - start) * x, v, 9 * n)
      })
    }
    alone(1)
    add(1, this.#corner(cornerOf(side, 1)), 0)
    if (this.#isPoint[side]) for (let k = 3; k < points.length; k++) points[k] = points[k - 3]
    if ((side & 3) < 2) return { us, points }
    return { us: us.reverse(), points: range(us.length, (k) => points.splice(-3)).flat() }
  }
}
