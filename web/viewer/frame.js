/** Where the camera stands: the same view and framing as Python's pictures (upholster.render.camera). z is up. */

import { Vector3 } from 'three'

/** Vertical angle of view in degrees. */
export const FIELD_OF_VIEW = 30

/** Share of the picture's height or width, whichever is tighter, that the model fills. */
const FILL = 0.875

const radians = (degrees) => (degrees * Math.PI) / 180

/** Unit vectors right, up and backward for (azimuth, elevation) in degrees; azimuth 0 looks from -y toward +y. */
export function axes([azimuth, elevation]) {
  const [ca, sa] = [Math.cos(radians(azimuth)), Math.sin(radians(azimuth))]
  const [ce, se] = [Math.cos(radians(elevation)), Math.sin(radians(elevation))]
  return [new Vector3(ca, sa, 0), new Vector3(-sa * se, ca * se, ce), new Vector3(sa * ce, -ca * ce, se)]
}

/** (azimuth, elevation) in degrees, for the direction from the target to the eye. */
export function angles(backward) {
  const { x, y, z } = backward
  return [(Math.atan2(x, -y) * 180) / Math.PI, (Math.atan2(z, Math.hypot(x, y)) * 180) / Math.PI]
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
 * @returns {{ eye: Vector3, target: Vector3 }}
 */
export function fit(points, aspect, view) {
  const [right, up, backward] = axes(view)
  const slope = FILL * Math.tan(radians(FIELD_OF_VIEW) / 2)
  const most = [-Infinity, -Infinity, -Infinity, -Infinity]
  let nearest = -Infinity
  for (let i = 0; i < points.length; i += 3) {
    const [px, py, pz] = [points[i], points[i + 1], points[i + 2]]
    const x = right.x * px + right.y * py + right.z * pz
    const y = up.x * px + up.y * py + up.z * pz
    const z = backward.x * px + backward.y * py + backward.z * pz
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
  const target = new Vector3()
    .addScaledVector(right, (most[0] - most[1]) / 2)
    .addScaledVector(up, (most[2] - most[3]) / 2)
  return { eye: target.clone().addScaledVector(backward, distance), target }
}

/** Read an attribute like "30,30"; null where it is none. */
export function parseView(text) {
  const view = String(text).split(',').map(Number)
  return view.length === 2 && view.every(Number.isFinite) && Math.abs(view[1]) <= 90 ? view : null
}

/**
 * All vertices of a model, and the height of the lowest.
 *
 * @param {import('three').Object3D} model
 * @param {import('three').Matrix4} matrix from the model to the world
 * @returns {{ points: Float32Array, lowest: number }}
 */
export function verticesOf(model, matrix) {
  const attributes = []
  model.traverse(({ isMesh, geometry }) => isMesh && geometry.attributes.position && attributes.push(geometry.attributes.position))
  const points = new Float32Array(3 * attributes.reduce((sum, { count }) => sum + count, 0))
  const point = new Vector3()
  let place = 0
  let lowest = Infinity
  for (const attribute of attributes) {
    for (let i = 0; i < attribute.count; i++, place += 3) {
      point.fromBufferAttribute(attribute, i).applyMatrix4(matrix).toArray(points, place)
      lowest = Math.min(lowest, point.z)
    }
  }
  return { points, lowest }
}
