/**
 * The graphics card's programs. Light and what surfaces mirror of it are those of Python's pictures of materials, formula by formula
 * (upholster.model.render.environment), but for the exposure: what faces the eye shows its own colours. A picture of surroundings may stand in
 * for the sky.
 */

import { ROLES, TARGETS } from '../uph/roles.js'

/** Toward the key light, in degrees in the camera's axes: to the right, and up. */
export const KEY_DIRECTION = [-35.7, 38.2]

/** To the right, toward the camera and up; strength and sharpness. Python's `_LAMPS`. */
export const LAMPS = [
  [0.85, 0.1, 0.5, 1.5, 12],
  [-0.75, -0.55, 0.35, 1, 14],
  [0.35, -0.8, 0.5, 0.8, 10],
]

/** Linear colours of the background, top and bottom. */
export const BACKGROUNDS = {
  light: [[0.8, 0.81, 0.82], [0.92, 0.92, 0.91]],
  dark: [[0.022, 0.024, 0.027], [0.05, 0.05, 0.051]],
}

/** Half a side of the square below the model that its shadow may reach, in radii of the model; and the cells along a side. */
export const [REACH, CELLS] = [2, 64]

/** Textures by target, in the order of their units. */
export const UNITS = Object.keys(TARGETS)

export const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
`

export const SCREEN = `${HEAD}
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.;
  gl_Position = vec4(2. * at - 1., 0, 1);
}`

/** Coded as sRGB; and no bands: less than a step of noise. */
const CODED = `
float noise() {
  return (fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(.06711056, .00583715)))) - .5) / 255.;
}
vec3 coded(vec3 c) {
  return mix(12.92 * c, 1.055 * pow(max(c, 1e-5), vec3(1. / 2.4)) - .055, step(.0031308, c)) + noise();
}`

export const VERTEX = `${HEAD}
uniform mat4 camera;
uniform vec4 world, place;
in vec3 position, normal;
in vec4 tangent;
in vec2 parameter;
out vec3 P, N;
out vec4 T;
out vec2 uv;
void main() {
  P = (position - world.xyz) * world.w;
  N = normal;
  T = tangent;
  uv = parameter.yx * place.xy + place.zw;
  gl_Position = camera * vec4(P, 1);
}`

/** What a surface mirrors of sky and lamps, and how much light arrives. */
const SKY = `
uniform vec3 lamps[3], key;
const vec2 LAMPS[3] = vec2[](${LAMPS.map(([, , , a, k]) => `vec2(${a}, ${k})`).join()});
const float ABOVE = .5, BELOW = .28, FILL = .1, KEY = .5, SHARP = 24., HORIZON = .16, WIDTH = .14;
float lamp(float cosine, float a, float k, float s) {
  float b = k * s / (k + s);
  return a * (1. - exp(-2. * k)) / k * b / (1. - exp(-2. * b)) * exp(b * (cosine - 1.));
}
vec3 mirrored(vec3 R, float rough, float facing) {
  float alpha = max(rough * rough, .01), s = .5 / (alpha * alpha * max(facing, .1));
  float light = .5 * (ABOVE + BELOW) + .75 * (ABOVE - BELOW) * ((s < 20. ? 1. / tanh(s) : 1.) - 1. / s) * R.z;
  float width = sqrt(WIDTH * WIDTH + 2. / s);
  light -= HORIZON * WIDTH / width * exp(-R.z * R.z / (width * width));
  for (int i = 0; i < 3; i++) light += lamp(dot(R, lamps[i]), LAMPS[i].x, LAMPS[i].y, s);
  return vec3(light + lamp(dot(R, key), .5 * KEY * SHARP, SHARP, s));
}
float diffuse(vec3 n, float facing) {
  return BELOW + (ABOVE - BELOW) * (.5 + .5 * n.z) + FILL * facing + KEY * max(dot(n, key), 0.);
}
vec3 arriving(vec3 n, float facing) {
  return vec3(diffuse(n, facing) / diffuse(normalize(eye), 1.));
}`

/** As Khronos PBR Neutral: colours come out as they are; only highlights are compressed. */
const TONES = `
vec3 toned(vec3 c) {
  float peak = max(c.r, max(c.g, c.b));
  if (peak < .76) return c;
  float most = 1. - .0576 / (peak - .52);
  c *= most / peak;
  return mix(vec3(most), c, 1. / (.15 * (peak - most) + 1.));
}`

const DETAILS = `
uniform sampler2D normalMap, surfaceMap, emissionMap, heightMap;
const int ${Object.keys(ROLES).map((role, n) => `${role.toUpperCase()} = ${n}`).join()};
uniform int maps;
uniform float bump;
bool has(int bit) {
  return (maps >> bit & 1) == 1;
}
vec3 bent(vec3 n) {
  if (has(NORMAL)) {
    vec3 t = texture(normalMap, uv).xyz * 2. - 1.;
    vec3 along = normalize(T.xyz - n * dot(n, T.xyz) + 1e-6);
    return normalize(t.x * along + t.y * T.w * cross(n, along) + t.z * n);
  }
  if (!has(HEIGHT)) return n;
  vec3 dx = dFdx(P), dy = dFdy(P), a = cross(dy, n), b = cross(n, dx);
  float here = texture(heightMap, uv).r, area = dot(dx, a);
  float hx = texture(heightMap, uv + dFdx(uv)).r - here, hy = texture(heightMap, uv + dFdy(uv)).r - here;
  return normalize(abs(area) * n - sign(area) * bump * (hx * a + hy * b));
}`

const channel = (role) => 'rgb'[ROLES[role].channel]
const neutral = (role) => `float(${ROLES[role].neutral})`

/** A surface; `full` with all maps, else with only a colour; `light` returns the reflections and the incoming light. */
const surface = (full, light) => `${HEAD}
in vec3 P, N;
in vec4 T;
in vec2 uv;
out vec4 color;
uniform sampler2D colorMap;
uniform vec3 eye;
uniform float cut;
${CODED}${TONES}${light}${full ? DETAILS : ''}
void main() {
  vec4 albedo = texture(colorMap, uv);
  if (albedo.a < cut) discard;
  float alpha = cut > 0. ? 1. : albedo.a, rough = ${neutral('roughness')}, metal = ${neutral('metallic')}, open = ${neutral('ao')};
  vec3 v = normalize(eye - P), n = normalize(gl_FrontFacing ? N : -N), glow = vec3(0);
  ${full ? `n = bent(n);
  vec3 shown = texture(surfaceMap, uv).rgb;
  if (has(AO)) open = shown.${channel('ao')};
  if (has(ROUGHNESS)) rough = shown.${channel('roughness')};
  if (has(METALLIC)) metal = shown.${channel('metallic')};
  if (has(EMISSION)) glow = texture(emissionMap, uv).rgb;` : ''}
  float facing = max(dot(n, v), 0.), x = 1. - rough, q = min(x * x, exp2(-9.28 * facing)) * x + .0425 - .0275 * rough;
  vec3 f = mix(vec3(.04), albedo.rgb, metal) * (1.04 - .572 * rough - 1.04 * q) + max(.022 * rough - .04 + 1.04 * q, 0.);
  // What any matt surface mirrors veils its colour, and is left out.
  vec3 mirror = max(f * mirrored(reflect(-v, n), rough, facing) - 0.02 * (1. - metal), 0.);
  vec3 light = albedo.rgb * (1. - metal) * open * arriving(n, facing) + open * mirror + glow;
  color = vec4(coded(toned(light)) * alpha, alpha);
}`

/** From one linear colour on top to another at the bottom. */
const BACKDROP = `${HEAD}
in vec2 at;
out vec4 color;
uniform vec3 top, bottom;
${CODED}
void main() {
  color = vec4(coded(mix(bottom, top, at.y)), 1);
}`

/** The floor shows nothing but how much of the light the model keeps from it. */
const FLOOR_VERTEX = `${HEAD}
uniform mat4 camera;
uniform float floorHeight;
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = camera * vec4(${REACH}. * (2. * at - 1.), floorHeight, 1);
}`

const FLOOR = `${HEAD}
in vec2 at;
out vec4 color;
uniform sampler2D shade;
${CODED}
void main() {
  vec2 rim = smoothstep(0., .2, at) * smoothstep(0., .2, 1. - at);
  float dark = .62 * texture(shade, at).r * rim.x * rim.y;
  // What is blended are coded colours, not light: hence the power.
  color = vec4(0, 0, 0, dark > 0. ? 1. - pow(1. - dark, 1. / 2.2) + noise() : 0.);
}`

/** How high the model is over every place of the floor, seen from below: the lowest, in units of 2, in two bytes. */
const HEIGHT_VERTEX = `${HEAD}
uniform vec4 world;
uniform float floorHeight;
in vec3 position;
out float h;
void main() {
  vec3 P = (position - world.xyz) * world.w;
  h = clamp((P.z - floorHeight) / 2., 0., 1.);
  gl_Position = vec4(P.xy / ${REACH}., 2. * h - 1., 1);
}`

const HEIGHT = `${HEAD}
in float h;
out vec4 color;
void main() {
  float coarse = floor(h * 255.) / 255.;
  color = vec4(coarse, (h - coarse) * 255., 0, 1);
}`

/** The share of the sky that what lies over the floor hides: the sum of form factors of its cells, as of discs. */
const SHADE = `${HEAD}
uniform sampler2D heights;
out vec4 color;
void main() {
  const float side = ${2 * REACH}. / ${CELLS}., area = side * side;
  float sum = 0.;
  for (int i = 0; i < ${CELLS}; i++) for (int j = 0; j < ${CELLS}; j++) {
    vec4 found = texelFetch(heights, ivec2(i, j), 0);
    vec2 apart = (vec2(i, j) + .5 - gl_FragCoord.xy) * side;
    float h = 2. * (found.r + found.g / 255.) + .02, d = dot(apart, apart) + h * h;
    sum += (1. - found.b) * h * h * area / (d * (3.14159 * d + area));
  }
  color = vec4(min(sum, 1.), 0, 0, 1);
}`

/** Programs of surfaces in a light, such as that of `environment.js`. */
export const surfaces = (light, name = '') => ({
  [`plain${name}`]: () => [VERTEX, surface(false, light)],
  [`full${name}`]: () => [VERTEX, surface(true, light)],
})

/** Vertex and fragment shader of each program. */
export const SOURCES = {
  ...surfaces(SKY),
  backdrop: () => [SCREEN, BACKDROP],
  floor: () => [FLOOR_VERTEX, FLOOR],
  height: () => [HEIGHT_VERTEX, HEIGHT],
  shade: () => [SCREEN, SHADE],
}
