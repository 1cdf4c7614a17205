/** Where the camera stands: the same view and framing as Python's pictures (upholster.model.render.camera). z is up. */

/** Vertical angle of view in degrees. */
export const FIELD_OF_VIEW = 30

/** Share of the picture's height or width, whichever is tighter, that the model fills. */
const FILL = 0.875

export const radians = (degrees) => (degrees * Math.PI) / 180
const degrees = (angle) => (angle * 180) / Math.PI

/** Half the height of what is seen at distance 1. */
export const SLOPE = Math.tan(radians(FIELD_OF_VIEW) / 2)

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

/** `a + k·b`. */
export const plus = (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]]

/** Unit vectors right, up and backward for (azimuth, elevation) in degrees; azimuth 0 looks from -y toward +y. */
export function axes([azimuth, elevation]) {
  const [ca, sa] = [Math.cos(radians(azimuth)), Math.sin(radians(azimuth))]
  const [ce, se] = [Math.cos(radians(elevation)), Math.sin(radians(elevation))]
  return [[ca, sa, 0], [-sa * se, ca * se, ce], [sa * ce, -ca * ce, se]]
}

/** (azimuth, elevation) in degrees, for the direction from the target to the eye. */
export function angles([x, y, z]) {
  return [degrees(Math.atan2(x, -y)), degrees(Math.atan2(z, Math.hypot(x, y)))]
}

/**
 * Stand so that points just fit: centred, filling `FILL` of the height or of the width.
 *
 * The points p fit between two side planes of slope k exactly when max(x + k·z) ≤ cx + k·cz and max(-x + k·z) ≤ -cx + k·cz
 * in the camera's axes (z backward), and likewise for y: the camera's place follows in closed form.
 *
 * @param {Float32Array} points x, y, z of each
 * @param {number} aspect width / height
 * @param {[number, number]} view azimuth and elevation in degrees
 * @returns {{ target: number[], distance: number }} what is looked at, and from how far
 */
export function fit(points, aspect, view) {
  const [right, up, backward] = axes(view)
  const slope = FILL * SLOPE
  const most = [-Infinity, -Infinity, -Infinity, -Infinity]
  let nearest = -Infinity
  for (let i = 0; i < points.length; i += 3) {
    const [px, py, pz] = [points[i], points[i + 1], points[i + 2]]
    const x = right[0] * px + right[1] * py + right[2] * pz
    const y = up[0] * px + up[1] * py + up[2] * pz
    const z = backward[0] * px + backward[1] * py + backward[2] * pz
    most[0] = Math.max(most[0], x + slope * aspect * z)
    most[1] = Math.max(most[1], -x + slope * aspect * z)
    most[2] = Math.max(most[2], y + slope * z)
    most[3] = Math.max(most[3], -y + slope * z)
    nearest = Math.max(nearest, z)
  }
  const distance = Math.max(
    (most[0] + most[1]) / (2 * slope * aspect),
    (most[2] + most[3]) / (2 * slope),
    nearest + 0.05,
  )
  const across = plus([0, 0, 0], right, (most[0] - most[1]) / 2)
  return { target: plus(across, up, (most[2] - most[3]) / 2), distance }
}

/** Read an attribute like "30,30"; null where it is none. */
export function parseView(text) {
  const view = String(text).split(',').map(Number)
  return view.length === 2 && view.every(Number.isFinite) && Math.abs(view[1]) <= 90 ? view : null
}

/** All vertices of a model in the world, where it fills the unit ball, and the height of the lowest. */
export function verticesOf(model) {
  const { center, radius } = model.sphere
  const lists = model.geometries.map(({ positions }) => positions)
  const points = new Float32Array(lists.reduce((sum, { length }) => sum + length, 0))
  let place = 0
  let lowest = Infinity
  for (const positions of lists) {
    for (let i = 0; i < positions.length; i++, place++) points[place] = (positions[i] - center[i % 3]) / radius
  }
  for (let i = 2; i < points.length; i += 3) lowest = Math.min(lowest, points[i])
  return { points, lowest }
}
