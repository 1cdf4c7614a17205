/** Evaluation of rational Bézier patches of degree (m, n): `net` holds (m + 1) × (n + 1) points (w·x, w·y, w·z, w). */

/** of(0), of(1) … of(count − 1). */
export const tabulate = (count, of) => Array.from({ length: count }, (_, k) => of(k))

/** Bernstein polynomials of degree d and their derivatives at the parameters `us`, d + 1 numbers each. */
export function basis(d, us) {
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

/** Point, derivative by s and derivative by t, nine numbers, at all pairs of the parameters of two bases. */
export function evaluate({ m, n, net }, S, T) {
  const out = new Float64Array(9 * S.us.length * T.us.length)
  const row = new Float64Array(8 * (n + 1)) // control points of the curve at s, and their derivatives
  for (let r = 0, at = 0; r < S.us.length; r++) {
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
    for (let c = 0; c < T.us.length; c++, at += 9) evaluateRow(row, n, T, c, out, at)
  }
  return out
}

/** The c-th point of a row, with its derivatives, into out[at …]. */
function evaluateRow(row, n, T, c, out, at) {
  let x, y, z, w, xs, ys, zs, ws, xt, yt, zt, wt
  x = y = z = w = xs = ys = zs = ws = xt = yt = zt = wt = 0
  for (let k = 0, l = 4 * (n + 1), b = c * (n + 1); k < 4 * (n + 1); k += 4, l += 4, b++) {
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
}

/** Length of the vector at v[at …]. */
export function norm(v, at) {
  return Math.sqrt(v[at] * v[at] + v[at + 1] * v[at + 1] + v[at + 2] * v[at + 2])
}

/** Distance of the points at a[i …] and b[j …]. */
export function distance(a, i, b, j) {
  const [x, y, z] = [a[i] - b[j], a[i + 1] - b[j + 1], a[i + 2] - b[j + 2]]
  return Math.sqrt(x * x + y * y + z * z) // Math.hypot takes ten times as long
}
