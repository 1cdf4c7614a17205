/** The graphics card's programs that paint charts as section 8 of SPEC.md defines, to the bit; `worker/recipes.js` describes their input. */

import { HALVINGS, MOST_OTHERS, REACH } from '../uph/paint/tones.js'
import { HEAD, SCREEN } from './shading.js'

/** As textures of colours are written: the card codes them. */
const LINEAR = `
uniform bool isColor;
vec4 stored(vec3 c) {
  return vec4(isColor ? mix(c / 12.92, pow((c + .055) / 1.055, vec3(2.4)), step(.04045, c)) : c, 1);
}
ivec2 turned(ivec2 c, int top, ivec2 turn) {
  ivec2 n = 2 * c - top;
  return clamp((n * turn.y + ivec2(-n.y, n.x) * turn.x + 8192 * (top + 1)) >> 14, 0, top);
}`

/** Reading placements. */
const READING = `${HEAD}
precision highp isampler2D;
precision highp usampler2DArray;
uniform isampler2D numbers;
uniform usampler2DArray sheet;
uniform ivec2 sheetSize;
uniform bool isNormal, isWide;
int number(int n) {
  return texelFetch(numbers, ivec2(n & 4095, n >> 12), 0).r;
}
ivec4 four(int n) {
  return ivec4(number(n), number(n + 1), number(n + 2), number(n + 3));
}
ivec3 nodesRound(int margin, int count, int place) {
  int n = margin + (place - 8 >> 9);
  return n < 0 ? ivec3(0) : n < count - 1 ? ivec3(n, n + 1, place - 8 & 511) : ivec3(count - 1, count - 1, 0);
}
ivec4 between(ivec4 a, ivec4 b, int f) {
  return a * (512 - f) + b * f + 256 >> 9;
}
ivec4 matrix(ivec2 p) {
  ivec4 grid = four(2);
  ivec3 i = nodesRound(grid.x, grid.y, p.x), j = nodesRound(grid.x, grid.z, p.y);
  int above = grid.w + 4 * grid.z * i.x, below = grid.w + 4 * grid.z * i.y;
  return between(between(four(above + 4 * j.x), four(below + 4 * j.x), i.z), between(four(above + 4 * j.y), four(below + 4 * j.y), i.z), j.z);
}
ivec2 mirrored(ivec2 n, ivec2 size) {
  n = max(n, -1 - n) % (2 * size);
  return min(n, 2 * size - 1 - n);
}
uvec3 sampled(int at, ivec2 p, ivec4 m, int above) {
  ivec4 place = four(at);
  m += four(at + 4);
  int shown = number(at + 8), level = shown >> 12, last = 0;
  while ((1 << last) < max(sheetSize.x, sheetSize.y)) last++;
  int shift = min((level >> 1) + above, last);
  ivec4 s = (ivec4(shown) >> ivec4(0, 2, 4, 6) & 3) - 1, box = ivec4(0, 0, sheetSize);
  ivec2 d = clamp(p - place.xy, -16383, 16383), e = d & 15;
  d >>= 4;
  ivec2 v = m.xz * d.x + m.yw * d.y + (m.xz * e.x + m.yw * e.y >> 4) + 256 >> 9;
  for (int k = 0; k < shift; k++) box = ivec4(k > 0 ? box.x + box.z : 0, sheetSize.y, (box.zw + 1) / 2);
  ivec2 q = (place.zw + s.xz * v.x + s.yw * v.y + 8 >> shift) - 8;
  ivec2 a = box.xy + mirrored(q >> 4, box.zw), b = box.xy + mirrored((q >> 4) + 1, box.zw);
  uvec2 f = uvec2(q & 15);
  int layer = (isNormal ? shown >> 8 & 7 : 0) + (above == 0 ? (level & 1) * textureSize(sheet, 0).z / 2 : 0);
  return (16u - f.x) * ((16u - f.y) * texelFetch(sheet, ivec3(a.y, a.x, layer), 0).rgb + f.y * texelFetch(sheet, ivec3(b.y, a.x, layer), 0).rgb)
    + f.x * ((16u - f.y) * texelFetch(sheet, ivec3(a.y, b.x, layer), 0).rgb + f.y * texelFetch(sheet, ivec3(b.y, b.x, layer), 0).rgb);
}
ivec3 shades(int at, ivec2 p, ivec4 m) {
  uvec3 c = sampled(at, p, m, ${HALVINGS});
  return ivec3(isWide ? c + 128u >> 8 : c);
}`

/** The tones of a chart's cells, a fragment each. */
const TONES = `${READING}
uniform ivec2 cells;
out ivec4 tone;
void main() {
  ivec2 at = ivec2(gl_FragCoord.yx), low = max(at - ${REACH}, 0), high = min(at + ${REACH}, cells - 1);
  ivec4 head = four(9);
  int first = number(13), own = number(head.w + at.x * head.z + at.y), count = 0, covered = 0;
  int named[${MOST_OTHERS}], weights[${MOST_OTHERS}];
  for (int i = low.x; i <= high.x; i++) {
    for (int j = low.y; j <= high.y; j++) {
      int label = number(head.w + i * head.z + j), weight = (${REACH + 1} - abs(i - at.x)) * (${REACH + 1} - abs(j - at.y)), n = 0;
      covered += weight;
      if (label == own) continue;
      while (n < count && named[n] != label) n++;
      if (n == ${MOST_OTHERS}) continue;
      if (n == count) {
        named[n] = label;
        weights[n] = 0;
        count++;
      }
      weights[n] += weight;
    }
  }
  int fade = clamp(covered - 2560 >> 2, 0, 256);
  tone = ivec4(0);
  if (fade == 0 || count == 0) return;
  ivec2 p = 16 * head.x * at - head.y;
  ivec4 m = matrix(p);
  ivec3 here = shades(first + 9 * own, p, m);
  for (int n = 0; n < count; n++) tone.rgb += weights[n] * (shades(first + 9 * named[n], p, m) - here);
  tone.rgb = (tone.rgb >> 8) * fade + 2048 >> 12;
}`

/** A chart with what lies along its edges round it; or what lies along its edges alone, a row each. */
const CHART = `${READING}
${LINEAR}
uniform isampler2D tones;
uniform ivec2 size;
uniform bool isLines, isSharp;
out vec4 color;
uvec3 painted(ivec2 p, ivec4 m) {
  uvec3 value = uvec3(0);
  int count = number(7);
  for (int n = 0; n < count; n++) {
    ivec4 head = four(9 + 5 * n);
    ivec2 x = p + head.y, i = x / (16 * head.x), f = x % (16 * head.x) / head.x, g = 16 - f;
    int at = head.w + i.x * head.z + i.y, first = number(13 + 5 * n);
    ivec4 labels = ivec4(number(at), number(at + 1), number(at + head.z), number(at + head.z + 1));
    ivec4 weights = ivec4(g.x * g.y, g.x * f.y, f.x * g.y, f.x * f.y);
    uvec3 sum = uvec3(32768);
    int covered = 0;
    for (int k = 0; k < 4; k++) {
      ivec4 same = ivec4(equal(labels, ivec4(labels[k])));
      if (labels[k] < 0 || (k > 0 && same.x > 0) || (k > 1 && same.y > 0) || (k > 2 && same.z > 0)) continue;
      same *= weights;
      int weight = same.x + same.y + same.z + same.w;
      if (weight > 0) sum += uint(weight) * sampled(first + 9 * labels[k], p, m, 0);
      covered += weight;
    }
    if (covered > 0) value = value * uint(256 - covered << 8) + sum >> 16;
  }
  return value;
}
ivec3 toned(ivec3 c, ivec2 p) {
  ivec2 x = p + number(10), i = x / (16 * number(9)), f = x % (16 * number(9)) / number(9), g = 16 - f;
  ivec3 tone = g.x * (g.y * texelFetch(tones, i.yx, 0).rgb + f.y * texelFetch(tones, i.yx + ivec2(1, 0), 0).rgb)
    + f.x * (g.y * texelFetch(tones, i.yx + ivec2(0, 1), 0).rgb + f.y * texelFetch(tones, i.yx + 1, 0).rgb);
  int shift = isWide ? 8 : 16;
  return clamp(c + (tone + (1 << shift - 1) >> shift), 0, isWide ? 65535 : 255);
}
int farthest(ivec2 v) {
  return max(abs(v.x), abs(v.y));
}
ivec2 angle(ivec2 v) {
  while (farthest(v) > 32767) v >>= 1;
  while (v != ivec2(0) && farthest(v) < 16384) v *= 2;
  int n = v.x * v.x + v.y * v.y, l = int(sqrt(float(n)));
  l = max(l + (l * l > n ? -1 : 2 * l < n - l * l ? 1 : 0), 1);
  return (8192 * v + (l >> 1) + 16384 * l) / l - 16384; // what is divided is positive: then / rounds down
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.yx), last = size - 1, q = at - 1;
  if (isLines) q = at.x == 0 ? ivec2(0, at.y) : at.x == 1 ? ivec2(at.y, last.y) : at.x == 2 ? ivec2(last.x, at.y) : ivec2(at.y, 0);
  q = clamp(q, ivec2(0), last);
  ivec2 p = (2 * q + 1) * 8 * ivec2(number(0), number(1)) / size;
  ivec4 m = matrix(p);
  uvec3 c = painted(p, m);
  if (number(8) > 0 && !isSharp) c = uvec3(toned(ivec3(c), p));
  if (isNormal && number(6) > 0) {
    c.xy = uvec2(turned(ivec2(c.xy), isWide ? 65535 : 255, angle(m.yw)));
  }
  if (isWide) c = (c + 128u) / 257u;
  color = stored(vec3(c) / 255.);
}`

const GUTTER_POINT = `${HEAD}
layout(location = 0) in vec4 point;
layout(location = 1) in vec2 angle;
uniform ivec2 size;
flat out ivec2 from;
flat out ivec2 turn;
void main() {
  gl_PointSize = 1.;
  gl_Position = vec4(2. * (point.xy + .5) / vec2(size.yx) - 1., 0, 1);
  from = ivec2(point.zw);
  turn = ivec2(angle);
}`

const GUTTER = `${HEAD}
${LINEAR}
uniform sampler2D lines;
flat in ivec2 from;
flat in ivec2 turn;
out vec4 color;
void main() {
  vec3 c = texelFetch(lines, from, 0).rgb;
  c.xy = vec2(turned(ivec2(c.xy * 255. + .5), 255, turn)) / 255.;
  color = stored(c);
}`

/** Vertex and fragment shader of each program. */
export const PAINTING = {
  tones: () => [SCREEN, TONES],
  chart: () => [SCREEN, CHART],
  gutter: () => [GUTTER_POINT, GUTTER],
}
