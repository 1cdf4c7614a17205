/** The graphics card's programs that paint charts, as section 8 of SPEC.md has it; `worker/recipes.js` tells what they read. */

import { HEAD, SCREEN } from './shading.js'

/** The warp field's matrix at a texel. */
const FIELD = `
uniform highp isampler2D nodes;
uniform int margin;
ivec4 matrix(ivec2 q) {
  ivec2 last = textureSize(nodes, 0).yx - 1, i = min(margin + (q >> 5), last), j = min(i + 1, last), f = q & 31;
  ivec4 above = texelFetch(nodes, i.yx, 0) * (32 - f.y) + texelFetch(nodes, ivec2(j.y, i.x), 0) * f.y;
  ivec4 below = texelFetch(nodes, ivec2(i.y, j.x), 0) * (32 - f.y) + texelFetch(nodes, j.yx, 0) * f.y;
  return (above * (32 - f.x) + below * f.x + 512) >> 10;
}`

const BLOCK = `${HEAD}
layout(location = 0) in ivec4 rectangle;
layout(location = 1) in ivec4 shown;
layout(location = 2) in ivec4 centre;
layout(location = 3) in ivec2 weighted;
uniform ivec2 size, sheetSize;
flat out ivec4 block, there, turned, level;
flat out ivec2 corner, weightRows;
flat out int shift;
void main() {
  vec2 at = vec2(rectangle.yx) + vec2(gl_VertexID & 1, gl_VertexID >> 1) * vec2(rectangle.wz);
  gl_Position = vec4(2. * at / vec2(size.yx) - 1., 0, 1);
  corner = rectangle.xy;
  block = ivec4(rectangle.xy + rectangle.zw / 2, shown.xy);
  turned = (shown.zzzz >> ivec4(0, 2, 4, 6) & 3) - 1;
  there = centre;
  weightRows = weighted;
  shift = shown.w;
  level = ivec4(0, 0, sheetSize);
  for (int k = 0; k < shift; k++) level = ivec4(k > 0 ? level.x + level.z : 0, sheetSize.y, (level.zw + 1) / 2);
}`

const SAMPLED = `${HEAD}
${FIELD}
flat in ivec4 block, there, turned, level;
flat in ivec2 corner, weightRows;
flat in int shift;
uniform sampler2D sheet, weights;
uniform bool isNormal;
out vec4 color;
void main() {
  ivec2 q = ivec2(gl_FragCoord.yx), d = q - block.xy;
  ivec4 m = (there + matrix(q)) * d.xyxy, s = turned;
  ivec2 v = (m.xz + m.yw + 256) >> 9;
  ivec2 p = clamp((block.zw + s.xz * v.x + s.yw * v.y >> shift) - 8, ivec2(0), 16 * (level.zw - 1));
  ivec2 at = (level.xy + (p >> 4)).yx;
  vec2 f = vec2(p & 15) / 16.;
  vec3 c = mix(
    mix(texelFetch(sheet, at, 0).rgb, texelFetch(sheet, at + ivec2(1, 0), 0).rgb, f.y),
    mix(texelFetch(sheet, at + ivec2(0, 1), 0).rgb, texelFetch(sheet, at + 1, 0).rgb, f.y), f.x);
  if (isNormal) {
    vec2 n = c.xy - .5;
    c.xy = .5 + vec2(ivec2(s.w, s.x)) * n - vec2(ivec2(s.y, s.z)) * n.yx;
  }
  float w = 1.;
  if (weightRows.y > 0) {
    ivec2 at = q - corner;
    int place = weightRows.x + at.x * weightRows.y + at.y;
    w = 255. * texelFetch(weights, ivec2(place & 4095, place >> 12), 0).r;
    w = w > 254.5 ? 1. : w / 256.;
  }
  color = vec4(c, w);
}`

/** As textures of colours are written: the card codes them. */
const LINEAR = `
uniform bool isColor;
vec4 stored(vec3 c) {
  return vec4(isColor ? mix(c / 12.92, pow((c + .055) / 1.055, vec3(2.4)), step(.04045, c)) : c, 1);
}
vec3 rounded(vec3 c) {
  return floor(c * 255. + .5) / 255.;
}
vec3 turned(vec3 c, float sine, float cosine) {
  vec2 n = c.xy - .5;
  return rounded(vec3(.5 + n * cosine + vec2(-n.y, n.x) * sine, c.z));
}`

/** What was painted, with what lies along its edges round it; or what lies along its edges alone, a row each. */
const TEXELS = `${HEAD}
${FIELD}
${LINEAR}
uniform sampler2D layer;
uniform ivec2 size;
uniform bool isNormal, isLines;
out vec4 color;
void main() {
  ivec2 at = ivec2(gl_FragCoord.yx), last = size - 1, q = at - 1;
  if (isLines) q = at.x == 0 ? ivec2(0, at.y) : at.x == 1 ? ivec2(at.y, last.y) : at.x == 2 ? ivec2(last.x, at.y) : ivec2(at.y, 0);
  q = clamp(q, ivec2(0), last);
  vec3 c = rounded(texelFetch(layer, q.yx, 0).rgb);
  if (isNormal) {
    ivec4 m = matrix(q);
    vec2 along = vec2(m.y, m.w) / max(length(vec2(m.y, m.w)), 1.);
    c = turned(c, along.x, along.y);
  }
  color = stored(c);
}`

const GUTTER_POINT = `${HEAD}
layout(location = 0) in vec4 point;
layout(location = 1) in float angle;
uniform ivec2 size;
flat out ivec2 from;
flat out float turn;
void main() {
  gl_PointSize = 1.;
  gl_Position = vec4(2. * (point.xy + .5) / vec2(size.yx) - 1., 0, 1);
  from = ivec2(point.zw);
  turn = angle;
}`

const GUTTER = `${HEAD}
${LINEAR}
uniform sampler2D lines;
flat in ivec2 from;
flat in float turn;
out vec4 color;
void main() {
  vec3 c = texelFetch(lines, from, 0).rgb;
  color = stored(turn == 0. ? c : turned(c, sin(turn), cos(turn)));
}`

/** Vertex and fragment shader of each program. */
export const PAINTING = {
  blocks: () => [BLOCK, SAMPLED],
  texels: () => [SCREEN, TEXELS],
  gutter: () => [GUTTER_POINT, GUTTER],
}
