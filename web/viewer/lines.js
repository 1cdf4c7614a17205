/** Models drawn as lines, for the laboratory. */

export const BORDER_COLOR = [0.13, 0.4, 1]

/** The fragment shader of lines, in one colour. */
export const LINES = `#version 300 es
precision highp float;
uniform vec3 ink;
out vec4 color;
void main() {
  color = vec4(ink, 1);
}`

/** The edges of a geometry's triangles. */
export function edgesOf({ positions, normals, tangents, parameters, indices }) {
  const after = (corner) => (corner % 3 === 2 ? corner - 2 : corner + 1)
  const corner = (_, n) => indices[n & 1 ? after(n >> 1) : n >> 1]
  return { positions, normals, tangents, parameters, indices: Uint32Array.from({ length: 2 * indices.length }, corner) }
}

/** Its border. */
export function borderOf({ outline }) {
  return { positions: outline, indices: outline.subarray(0, outline.length / 3).map((_, n) => n) }
}
