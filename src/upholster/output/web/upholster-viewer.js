/*! upholster, SPDX-License-Identifier: MIT, see LICENSES.txt */
var R=o=>o*Math.PI/180;var w=Math.tan(R(30)/2),bt=(o,t)=>o[0]*t[0]+o[1]*t[1]+o[2]*t[2],E=(o,t,e=1)=>[o[0]+e*t[0],o[1]+e*t[1],o[2]+e*t[2]];function S([o,t]){let[e,s]=[Math.cos(R(o)),Math.sin(R(o))],[i,r]=[Math.cos(R(t)),Math.sin(R(t))];return[[e,s,0],[-s*r,e*r,i],[s*i,-e*i,r]]}function J(o,t,e){let[s,i,r]=S(e),n=.875*w,a=[-1/0,-1/0,-1/0,-1/0],h=-1/0;for(let u=0;u<o.length;u+=3){let[d,p,f]=[o[u],o[u+1],o[u+2]],b=s[0]*d+s[1]*p+s[2]*f,g=i[0]*d+i[1]*p+i[2]*f,A=r[0]*d+r[1]*p+r[2]*f;a[0]=Math.max(a[0],b+n*t*A),a[1]=Math.max(a[1],-b+n*t*A),a[2]=Math.max(a[2],g+n*A),a[3]=Math.max(a[3],-g+n*A),h=Math.max(h,A)}let c=Math.max((a[0]+a[1])/(2*n*t),(a[2]+a[3])/(2*n),h+.05),l=E([0,0,0],s,(a[0]-a[1])/2);return{target:E(l,i,(a[2]-a[3])/2),distance:c}}function tt(o){let t=String(o).split(",").map(Number);return t.length===2&&t.every(Number.isFinite)&&Math.abs(t[1])<=90?t:null}function Et(o){let{center:t,radius:e}=o.sphere,s=o.geometries.map(({positions:a})=>a),i=new Float32Array(s.reduce((a,{length:h})=>a+h,0)),r=0,n=1/0;for(let a of s)for(let h=0;h<a.length;h++,r++)i[r]=(a[h]-t[h%3])/e;for(let a=2;a<i.length;a+=3)n=Math.min(n,i[a]);return{points:i,lowest:n}}var wt=`#version 300 es
precision highp float;
uniform vec3 ink;
out vec4 color;
void main() {
  color = vec4(ink, 1);
}`;var x={albedo:{target:"color",isColor:!0},normal:{target:"normal"},roughness:{target:"surface",channel:1,neutral:.8},metallic:{target:"surface",channel:2,neutral:0,isSharp:!0},ao:{target:"surface",channel:0,neutral:1},height:{target:"height"},opacity:{target:"color",channel:3,isSharp:!0},emission:{target:"emission",isColor:!0}},P={};for(let[o,{target:t}]of Object.entries(x))(P[t]??=[]).push(o);var Tt=o=>P[o].some(t=>x[t].isColor);var it=[-35.7,38.2],rt=[[.85,.1,.5,1.5,12],[-.75,-.55,.35,1,14],[.35,-.8,.5,.8,10]],nt={light:[[.8,.81,.82],[.92,.92,.91]],dark:[[.022,.024,.027],[.05,.05,.051]]},[ot,T]=[2,64],y=Object.keys(P),v=`#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
`,k=`${v}
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.;
  gl_Position = vec4(2. * at - 1., 0, 1);
}`,at=`
float noise() {
  return (fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(.06711056, .00583715)))) - .5) / 255.;
}
vec3 coded(vec3 c) {
  return mix(12.92 * c, 1.055 * pow(max(c, 1e-5), vec3(1. / 2.4)) - .055, step(.0031308, c)) + noise();
}`,U=`${v}
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
}`,Kt=`
uniform vec3 lamps[3], key;
const vec2 LAMPS[3] = vec2[](${rt.map(([,,,o,t])=>`vec2(${o}, ${t})`).join()});
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
}`,Zt=`
vec3 toned(vec3 c) {
  float peak = max(c.r, max(c.g, c.b));
  if (peak < .76) return c;
  float most = 1. - .0576 / (peak - .52);
  c *= most / peak;
  return mix(vec3(most), c, 1. / (.15 * (peak - most) + 1.));
}`,Qt=`
uniform sampler2D normalMap, surfaceMap, emissionMap, heightMap;
const int ${Object.keys(x).map((o,t)=>`${o.toUpperCase()} = ${t}`).join()};
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
}`,et=o=>"rgb"[x[o].channel],st=o=>`float(${x[o].neutral})`,yt=(o,t)=>`${v}
in vec3 P, N;
in vec4 T;
in vec2 uv;
out vec4 color;
uniform sampler2D colorMap;
uniform vec3 eye;
uniform float cut;
${at}${Zt}${t}${o?Qt:""}
void main() {
  vec4 albedo = texture(colorMap, uv);
  if (albedo.a < cut) discard;
  float alpha = cut > 0. ? 1. : albedo.a, rough = ${st("roughness")}, metal = ${st("metallic")}, open = ${st("ao")};
  vec3 v = normalize(eye - P), n = normalize(gl_FrontFacing ? N : -N), glow = vec3(0);
  ${o?`n = bent(n);
  vec3 shown = texture(surfaceMap, uv).rgb;
  if (has(AO)) open = shown.${et("ao")};
  if (has(ROUGHNESS)) rough = shown.${et("roughness")};
  if (has(METALLIC)) metal = shown.${et("metallic")};
  if (has(EMISSION)) glow = texture(emissionMap, uv).rgb;`:""}
  float facing = max(dot(n, v), 0.), x = 1. - rough, q = min(x * x, exp2(-9.28 * facing)) * x + .0425 - .0275 * rough;
  vec3 f = mix(vec3(.04), albedo.rgb, metal) * (1.04 - .572 * rough - 1.04 * q) + max(.022 * rough - .04 + 1.04 * q, 0.);
  // What any matt surface mirrors veils its colour, and is left out.
  vec3 mirror = max(f * mirrored(reflect(-v, n), rough, facing) - 0.02 * (1. - metal), 0.);
  vec3 light = albedo.rgb * (1. - metal) * open * arriving(n, facing) + open * mirror + glow;
  color = vec4(coded(toned(light)) * alpha, alpha);
}`,Jt=`${v}
in vec2 at;
out vec4 color;
uniform vec3 top, bottom;
${at}
void main() {
  color = vec4(coded(mix(bottom, top, at.y)), 1);
}`,te=`${v}
uniform mat4 camera;
uniform float floorHeight;
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = camera * vec4(${ot}. * (2. * at - 1.), floorHeight, 1);
}`,ee=`${v}
in vec2 at;
out vec4 color;
uniform sampler2D shade;
${at}
void main() {
  vec2 rim = smoothstep(0., .2, at) * smoothstep(0., .2, 1. - at);
  float dark = .62 * texture(shade, at).r * rim.x * rim.y;
  // What is blended are coded colours, not light: hence the power.
  color = vec4(0, 0, 0, dark > 0. ? 1. - pow(1. - dark, 1. / 2.2) + noise() : 0.);
}`,se=`${v}
uniform vec4 world;
uniform float floorHeight;
in vec3 position;
out float h;
void main() {
  vec3 P = (position - world.xyz) * world.w;
  h = clamp((P.z - floorHeight) / 2., 0., 1.);
  gl_Position = vec4(P.xy / ${ot}., 2. * h - 1., 1);
}`,ie=`${v}
in float h;
out vec4 color;
void main() {
  float coarse = floor(h * 255.) / 255.;
  color = vec4(coarse, (h - coarse) * 255., 0, 1);
}`,re=`${v}
uniform sampler2D heights;
out vec4 color;
void main() {
  const float side = ${2*ot}. / ${T}., area = side * side;
  float sum = 0.;
  for (int i = 0; i < ${T}; i++) for (int j = 0; j < ${T}; j++) {
    vec4 found = texelFetch(heights, ivec2(i, j), 0);
    vec2 apart = (vec2(i, j) + .5 - gl_FragCoord.xy) * side;
    float h = 2. * (found.r + found.g / 255.) + .02, d = dot(apart, apart) + h * h;
    sum += (1. - found.b) * h * h * area / (d * (3.14159 * d + area));
  }
  color = vec4(min(sum, 1.), 0, 0, 1);
}`,ht=(o,t="")=>({[`plain${t}`]:()=>[U,yt(!1,o)],[`full${t}`]:()=>[U,yt(!0,o)]}),Rt={...ht(Kt),backdrop:()=>[k,Jt],floor:()=>[te,ee],height:()=>[se,ie],shade:()=>[k,re]};var At=`
uniform bool isColor;
vec4 stored(vec3 c) {
  return vec4(isColor ? mix(c / 12.92, pow((c + .055) / 1.055, vec3(2.4)), step(.04045, c)) : c, 1);
}
ivec2 turned(ivec2 c, int top, ivec2 turn) {
  ivec2 n = 2 * c - top;
  return clamp((n * turn.y + ivec2(-n.y, n.x) * turn.x + 8192 * (top + 1)) >> 14, 0, top);
}`,St=`${v}
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
  int shown = number(at + 8), shift = shown >> 12, last = 0;
  while ((1 << last) < max(sheetSize.x, sheetSize.y)) last++;
  shift = min(shift + above, last);
  ivec4 s = (ivec4(shown) >> ivec4(0, 2, 4, 6) & 3) - 1, box = ivec4(0, 0, sheetSize);
  ivec2 d = clamp(p - place.xy, -16383, 16383), e = d & 15;
  d >>= 4;
  ivec2 v = m.xz * d.x + m.yw * d.y + (m.xz * e.x + m.yw * e.y >> 4) + 256 >> 9;
  for (int k = 0; k < shift; k++) box = ivec4(k > 0 ? box.x + box.z : 0, sheetSize.y, (box.zw + 1) / 2);
  ivec2 q = (place.zw + s.xz * v.x + s.yw * v.y + 8 >> shift) - 8;
  ivec2 a = box.xy + mirrored(q >> 4, box.zw), b = box.xy + mirrored((q >> 4) + 1, box.zw);
  uvec2 f = uvec2(q & 15);
  int layer = isNormal ? shown >> 8 & 7 : 0;
  return (16u - f.x) * ((16u - f.y) * texelFetch(sheet, ivec3(a.y, a.x, layer), 0).rgb + f.y * texelFetch(sheet, ivec3(b.y, a.x, layer), 0).rgb)
    + f.x * ((16u - f.y) * texelFetch(sheet, ivec3(a.y, b.x, layer), 0).rgb + f.y * texelFetch(sheet, ivec3(b.y, b.x, layer), 0).rgb);
}
ivec3 shades(int at, ivec2 p, ivec4 m) {
  uvec3 c = sampled(at, p, m, 2);
  return ivec3(isWide ? c + 128u >> 8 : c);
}`,ne=`${St}
uniform ivec2 cells;
out ivec4 tone;
void main() {
  ivec2 at = ivec2(gl_FragCoord.yx), low = max(at - 7, 0), high = min(at + 7, cells - 1);
  ivec4 head = four(9);
  int first = number(13), own = number(head.w + at.x * head.z + at.y), count = 0, covered = 0;
  int named[8], weights[8];
  for (int i = low.x; i <= high.x; i++) {
    for (int j = low.y; j <= high.y; j++) {
      int label = number(head.w + i * head.z + j), weight = (8 - abs(i - at.x)) * (8 - abs(j - at.y)), n = 0;
      covered += weight;
      if (label == own) continue;
      while (n < count && named[n] != label) n++;
      if (n == 8) continue;
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
}`,oe=`${St}
${At}
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
}`,ae=`${v}
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
}`,he=`${v}
${At}
uniform sampler2D lines;
flat in ivec2 from;
flat in ivec2 turn;
out vec4 color;
void main() {
  vec3 c = texelFetch(lines, from, 0).rgb;
  c.xy = vec2(turned(ivec2(c.xy * 255. + .5), 255, turn)) / 255.;
  color = stored(c);
}`,ct={tones:()=>[k,ne],chart:()=>[k,oe],gutter:()=>[ae,he]};var C=class{#t;#e;#i;#s=new Map;#r;#o=[];constructor(t,e,s){this.#t=t,this.#e=e,e.add(ct),this.#i=s,this.#r=t.createFramebuffer()}ready(){return this.#e.ready(...Object.keys(ct))}paint({charts:t}){let e=new Set,s=t.flatMap(({textures:i})=>Object.entries(i).filter(([,r])=>r.recipe));for(let[i,r]of s){let n=this.#i.target(r,i);n&&(this.#a(r,i,n),e.add(r))}if(!e.size)return!1;for(let[i,r]of s){let n=this.#i.known(r),a=e.has(r);for(let{chart:h,points:c,height:l,width:u}of r.recipe.gutters){let d=t[h].textures[i];!(d?.recipe&&d.height===l+2&&d.width===u+2)||!(e.has(r)||e.has(d))||(this.#c(r,i,n,c,this.#i.known(d).lines),a=!0)}a&&this.#i.finish(n)}return!0}sweep(t){let e=t.flatMap(({charts:i})=>i.flatMap(({textures:r})=>Object.values(r))),s=new Set(e.flatMap(({recipe:i,sheets:r})=>i?[i,...Object.values(r),...i.gutters.map(({points:n})=>n)]:[]));for(let[i,{texture:r,array:n,buffer:a}]of this.#s)s.has(i)||(r&&this.#t.deleteTexture(r),n&&this.#t.deleteVertexArray(n),a&&this.#t.deleteBuffer(a),this.#s.delete(i))}#a({recipe:t,sheets:e,height:s,width:i},r,n){let a=this.#t,h=Math.max(s,i)-2;n.length!==h&&(a.deleteTexture(n.lines),n.lines=this.#p(a.TEXTURE_2D),a.texImage2D(a.TEXTURE_2D,0,a.RGBA8,h,4,0,a.RGBA,a.UNSIGNED_BYTE,null),n.length=h);let{texture:c}=this.#l(t,()=>this.#f(t.numbers));a.disable(a.BLEND);let l=Object.values(e).map((d,p)=>this.#n(t,c,d,r,p)),u=this.#e.use("chart");a.uniform2i(u.size,s-2,i-2),a.uniform1i(u.isNormal,r==="normal"),this.#u(0,a.TEXTURE_2D,c,u.numbers);for(let d of[0,1]){this.#g(d?n.lines:n.texture,d?h:i,d?4:s),a.uniform1i(u.isLines,d),a.uniform1i(u.isColor,!d&&n.isColor),a.clearColor(1,1,1,1),a.clear(a.COLOR_BUFFER_BIT);for(let[p,[f,b]]of Object.entries(e).entries())this.#h(b,u),this.#u(2,a.TEXTURE_2D,l[p],u.tones),a.uniform1i(u.isSharp,!!x[f].isSharp),a.colorMask(...[0,1,2].map(g=>(x[f].channel??g)===g),!0),a.drawArrays(a.TRIANGLE_STRIP,0,4);a.colorMask(!0,!0,!0,!0)}}#n({numbers:t},e,s,i,r){let n=this.#t,[a,h]=[t[8],t[8]&&t[11]],c=this.#o[r]??={texture:this.#p(n.TEXTURE_2D),size:""},l=[Math.max(h,1),Math.max(a,1)];if(c.size!==`${l}`&&(this.#u(0,n.TEXTURE_2D,c.texture),n.texImage2D(n.TEXTURE_2D,0,n.RGBA32I,...l,0,n.RGBA_INTEGER,n.INT,null),c.size=`${l}`),!a)return c.texture;let u=this.#e.use("tones");return this.#g(c.texture,...l),n.uniform2i(u.cells,a,h),n.uniform1i(u.isNormal,i==="normal"),this.#u(0,n.TEXTURE_2D,e,u.numbers),this.#h(s,u),n.drawArrays(n.TRIANGLE_STRIP,0,4),c.texture}#h(t,e){let s=this.#t;this.#u(1,s.TEXTURE_2D_ARRAY,this.#l(t,()=>this.#m(t)).texture,e.sheet),s.uniform2i(e.sheetSize,...t.size),s.uniform1i(e.isWide,t.data instanceof Uint16Array)}#c({height:t,width:e},s,i,r,n){let a=this.#t,{array:h}=this.#l(r,()=>this.#d(r));this.#g(i.texture,e,t);let c=this.#e.use("gutter");a.uniform2i(c.size,t,e),a.uniform1i(c.isColor,i.isColor),this.#u(0,a.TEXTURE_2D,n,c.lines),a.bindVertexArray(h),a.drawArrays(a.POINTS,0,r.length/6),a.bindVertexArray(null)}#l(t,e){return this.#s.has(t)||this.#s.set(t,e()),this.#s.get(t)}#f(t){let e=this.#t,s=this.#p(e.TEXTURE_2D);return e.texImage2D(e.TEXTURE_2D,0,e.R32I,4096,t.length/4096,0,e.RED_INTEGER,e.INT,t),{texture:s}}#m({data:t,width:e,height:s,count:i}){let r=this.#t,n=this.#p(r.TEXTURE_2D_ARRAY),[a,h]=t instanceof Uint16Array?[r.RGBA16UI,r.UNSIGNED_SHORT]:[r.RGBA8UI,r.UNSIGNED_BYTE];return r.texImage3D(r.TEXTURE_2D_ARRAY,0,a,e,s,i,0,r.RGBA_INTEGER,h,t),{texture:n}}#d(t){let e=this.#t,s=e.createVertexArray(),i=e.createBuffer();e.bindVertexArray(s),e.bindBuffer(e.ARRAY_BUFFER,i),e.bufferData(e.ARRAY_BUFFER,t,e.STATIC_DRAW);for(let[r,n]of[4,2].entries())e.enableVertexAttribArray(r),e.vertexAttribPointer(r,n,e.FLOAT,!1,24,16*r);return e.bindVertexArray(null),{array:s,buffer:i}}#p(t){let e=this.#t,s=e.createTexture();this.#u(0,t,s);for(let i of[e.TEXTURE_MIN_FILTER,e.TEXTURE_MAG_FILTER])e.texParameteri(t,i,e.NEAREST);return s}#u(t,e,s,i){let r=this.#t;r.activeTexture(r.TEXTURE0+t),r.bindTexture(e,s),i&&r.uniform1i(i,t)}#g(t,e,s){let i=this.#t;if(i.bindFramebuffer(i.FRAMEBUFFER,this.#r),i.framebufferTexture2D(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0,i.TEXTURE_2D,t,0),i.checkFramebufferStatus(i.FRAMEBUFFER)!==i.FRAMEBUFFER_COMPLETE&&!i.isContextLost())throw new Error("the card can not paint");i.viewport(0,0,e,s)}};var ce=["position","normal","tangent","parameter"],z=class{#t;#e;#i=new Map;#s={...Rt};constructor(t){this.#t=t,this.#e=t.getExtension("KHR_parallel_shader_compile")}add(t){Object.assign(this.#s,t)}ready(...t){for(let e of t)this.#i.has(e)||this.#i.set(e,this.#r(e));return this.#e?t.every(e=>this.#t.getProgramParameter(this.#i.get(e).program,this.#e.COMPLETION_STATUS_KHR)):!0}use(t){this.ready(t);let e=this.#i.get(t);return this.#t.useProgram(e.program),e.uniforms??=this.#o(e.program),e.uniforms}#r(t){let e=this.#t,s=e.createProgram();return this.#s[t]().forEach((i,r)=>{let n=e.createShader(r?e.FRAGMENT_SHADER:e.VERTEX_SHADER);e.shaderSource(n,i),e.compileShader(n),e.attachShader(s,n)}),ce.forEach((i,r)=>e.bindAttribLocation(s,r,i)),e.linkProgram(s),{program:s}}#o(t){let e=this.#t;if(!e.getProgramParameter(t,e.LINK_STATUS)&&!e.isContextLost())throw new Error(e.getProgramInfoLog(t));let s={};for(let i=e.getProgramParameter(t,e.ACTIVE_UNIFORMS)-1;i>=0;i--){let{name:r}=e.getActiveUniform(t,i);s[r.replace("[0]","")]=e.getUniformLocation(t,r)}return y.forEach((i,r)=>s[`${i}Map`]&&e.uniform1i(s[`${i}Map`],r)),s.sky&&e.uniform1i(s.sky,y.length),s}};var[le,ue]=[45,22],fe=.35,de=/swiftshader|llvmpipe|softpipe|software|basic render/i,B=class{quality=1;isSoftware;#t=0;#e=0;constructor(t){let e=t.getExtension("WEBGL_debug_renderer_info");this.isSoftware=de.test(t.getParameter(e?.UNMASKED_RENDERER_WEBGL??t.RENDERER)),this.isSoftware&&(this.quality=.4)}addFrame(t){this.#t=t>le?this.#t+1:0,this.#e=t<ue?this.#e+1:0,this.#t>=2?this.#i(this.quality*.71):this.#e>=30&&this.#i(this.quality*1.41)}#i(t){this.quality=Math.min(Math.max(t,fe),1),this.#t=this.#e=0}};var pe=8,me=8,ge=[["positions",3],["normals",3],["tangents",4],["parameters",2]],$=class{#t;#e=new Map;#i=new Map;#s=new Map;#r;#o;constructor(t){this.#t=t,this.#r=t.getExtension("EXT_texture_filter_anisotropic"),this.#o=this.color([1,1,1])}upload(t){let e=performance.now()+me;for(let{charts:s,geometries:i}of t){for(let r of i)if(!this.#e.has(r)){if(performance.now()>e)return!1;this.bind(r)}for(let{textures:r}of s)for(let[n,a]of y.entries())if(!(!r[a]?.data||this.known(r[a]).version===r[a].version)){if(performance.now()>e)return!1;this.texture(n,r[a])}}return!0}bind(t,e=null){let s=this.#e.get(t);s||this.#e.set(t,s={arrays:new Map,buffers:[]}),s.arrays.has(e)||s.arrays.set(e,this.#n(e?e(t):t,s.buffers));let{array:i,count:r}=s.arrays.get(e);return this.#t.bindVertexArray(i),r}texture(t,e){if(!e)return this.#a({texture:this.#o},t);let s=this.known(e);this.#a(s,t),e.data&&s.version!==e.version&&this.#h(s,e,y[t])}known({key:t}){return this.#i.has(t)||this.#i.set(t,{texture:this.#t.createTexture(),version:0,width:0,height:0,lines:null}),this.#i.get(t)}target(t,e){let s=this.known(t);return s.version===t.version?null:(this.#a(s),this.#c(s,t,e),s.version=t.version,s)}finish(t){this.#a(t),this.#t.generateMipmap(this.#t.TEXTURE_2D)}#a({texture:t},e=0){this.#t.activeTexture(this.#t.TEXTURE0+e),this.#t.bindTexture(this.#t.TEXTURE_2D,t)}color(t){let e=this.#t,s=e.createTexture();e.bindTexture(e.TEXTURE_2D,s);let i=new Uint8Array([...t.map(r=>Math.round(255*r)),255]);return e.texImage2D(e.TEXTURE_2D,0,e.SRGB8_ALPHA8,1,1,0,e.RGBA,e.UNSIGNED_BYTE,i),e.texParameteri(e.TEXTURE_2D,e.TEXTURE_MIN_FILTER,e.LINEAR),s}sweep(t){let e=new Set(t.flatMap(s=>ve(s)));for(let[s,i]of this.#i)e.has(s)||(this.#t.deleteTexture(i.texture),this.#t.deleteTexture(i.lines),this.#i.delete(s));for(let[s,{arrays:i,buffers:r}]of this.#e)if(!e.has(s)){for(let{array:n}of i.values())this.#t.deleteVertexArray(n);for(let n of r)this.#t.deleteBuffer(n);this.#e.delete(s)}}#n(t,e){let s=this.#t,i=s.createVertexArray();s.bindVertexArray(i);let r=(a,h)=>{let c=s.createBuffer();e.push(c),s.bindBuffer(a,c),s.bufferData(a,h,s.STATIC_DRAW)},n=(a,h,c)=>{r(s.ARRAY_BUFFER,h),s.enableVertexAttribArray(a),s.vertexAttribPointer(a,c,s.FLOAT,!1,0,0)};return ge.forEach(([a,h],c)=>t[a]&&n(c,t[a],h)),r(s.ELEMENT_ARRAY_BUFFER,Uint32Array.from(t.indices)),{array:i,count:t.indices.length}}#h(t,e,s){let i=this.#t;this.#c(t,e,s),i.texSubImage2D(i.TEXTURE_2D,0,0,0,t.width,t.height,i.RGBA,i.UNSIGNED_BYTE,e.data),i.generateMipmap(i.TEXTURE_2D),t.version=e.version}#c(t,{width:e,height:s},i){if(t.width===e&&t.height===s)return;let r=this.#t,n=Tt(i);r.texImage2D(r.TEXTURE_2D,0,n?r.SRGB8_ALPHA8:r.RGBA8,e,s,0,r.RGBA,r.UNSIGNED_BYTE,null);for(let h of[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T])r.texParameteri(r.TEXTURE_2D,h,r.CLAMP_TO_EDGE);r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MIN_FILTER,r.LINEAR_MIPMAP_LINEAR);let a=this.#r;a&&r.texParameterf(r.TEXTURE_2D,a.TEXTURE_MAX_ANISOTROPY_EXT,pe),Object.assign(t,{width:e,height:s,isColor:n})}};function ve({charts:o,geometries:t,overlays:e=[]}){let s=o.flatMap(i=>Object.values(i.textures).map(r=>r.key));return[...t,...e.map(({geometry:i})=>i),...s]}var L=6,xe=null,M=class o extends EventTarget{canvas=new OffscreenCanvas(1,1);models=new Set;#t;#e;#i;#s;#r=new Map;#o=null;static get shared(){return xe??=new o}constructor(){super();let t=this.canvas.getContext("webgl2",{powerPreference:"high-performance"});if(!t)throw new Error("there is no WebGL2");this.#t=t,this.quality=new B(t),this.#a(),this.canvas.addEventListener("webglcontextlost",e=>{e.preventDefault(),this.dispatchEvent(new Event("lost"))}),this.canvas.addEventListener("webglcontextrestored",()=>{this.#a(),this.dispatchEvent(new Event("restored"))})}#a(){this.#e=new z(this.#t),this.#i=new $(this.#t),this.#s=new C(this.#t,this.#e,this.#i),this.#r.clear(),this.#o=null,this.#e.ready("plain","backdrop","floor","height","shade")}get isLost(){return this.#t.isContextLost()}paints(t){let e=t==="card"||t!=="worker"&&!this.quality.isSoftware;return e&&this.#s.ready(),e}isBusy(t,e){let s=this.#t;this.#o&&s.getSyncParameter(this.#o,s.SYNC_STATUS)!==s.UNSIGNALED&&(s.deleteSync(this.#o),this.#o=null);let i=t.flatMap(lt),r=i.map(n=>this.#l(n,e));return i.some(n=>n.onPage&&!this.#s.ready())||this.#o!==null||!this.#e.ready("backdrop","floor","height","shade",...r)?!0:!this.#i.upload(i)}warm(){if(this.isBusy([],null)||!this.#e.ready("plain"))return!1;let t=new Uint8Array(4),e={positions:new Float32Array(9),normals:new Float32Array(9),tangents:new Float32Array(12),parameters:new Float32Array(6),indices:new Uint16Array([0,1,2])},r={charts:[{geometry:e,textures:{color:{key:t,data:t,width:1,height:1,version:1}}}],geometries:[e],roles:[],alpha:"opaque",sphere:{center:[0,0,0],radius:1},plain:null},n={eye:[0,0,9],right:[1,0,0],up:[0,1,0],backward:[0,0,1],matrix:new Float32Array(16)};return this.draw([1,1],[{model:r,viewport:[0,0,1,1]}],{camera:n,light:[0,0],background:null,floor:-1,environment:null}),this.#r.delete(r),this.#i.sweep([...this.models]),!0}draw([t,e],s,i){let r=this.#t,{canvas:n}=this;(n.width!==t||n.height!==e)&&Object.assign(n,{width:t,height:e});for(let{model:a}of s)for(let h of lt(a))this.#n(h);for(let{model:a}of s)i.floor!==null&&this.#E(a,i.floor);r.bindFramebuffer(r.FRAMEBUFFER,null),r.enable(r.SCISSOR_TEST);for(let{model:a,viewport:h,clip:c=h}of s){r.viewport(...h),r.scissor(...c),r.clearColor(0,0,0,0),r.clear(r.COLOR_BUFFER_BIT|r.DEPTH_BUFFER_BIT),r.disable(r.DEPTH_TEST),i.background&&this.#h(i.background),r.enable(r.DEPTH_TEST);for(let l of lt(a))this.#c(l,i);i.floor!==null&&this.#b(a,i)}r.disable(r.SCISSOR_TEST),this.#o&&r.deleteSync(this.#o),this.#o=r.fenceSync(r.SYNC_GPU_COMMANDS_COMPLETE,0),r.flush()}finish(){this.#t.readPixels(0,0,1,1,this.#t.RGBA,this.#t.UNSIGNED_BYTE,new Uint8Array(4))}sweep(){this.#i.sweep([...this.models]),this.#s.sweep([...this.models]);for(let[t,{texture:e}]of this.#r)this.models.has(t)||(this.#t.deleteTexture(e),this.#r.delete(t))}#n(t){try{t.onPage&&this.#s.paint(t)&&this.#s.sweep([...this.models,t])}catch{t.paintInWorker()}}#h([t,e]){let s=this.#t,i=this.#e.use("backdrop");s.uniform3fv(i.top,t),s.uniform3fv(i.bottom,e),s.disable(s.BLEND),s.drawArrays(s.TRIANGLE_STRIP,0,4)}#c(t,e){let s=this.#t,{camera:i,environment:r}=e,{edges:n,borders:a,ink:h}=t.lines??{},c=n?this.#p(t.lines.shader,t,i,t.mean):this.#e.use(this.#l(t,r));n||this.#g(c,t,e);let l=t.alpha==="blend";s[l?"enable":"disable"](s.BLEND),s.blendFunc(s.ONE,s.ONE_MINUS_SRC_ALPHA);for(let u of l?[s.FRONT,s.BACK]:[null]){s[u?"enable":"disable"](s.CULL_FACE),u&&s.cullFace(u);for(let d of t.charts)this.#f(t,d,c)}if(s.disable(s.CULL_FACE),t.plain&&this.#m(t,c),a){this.#p(t.lines.shader,t,i,h);for(let{geometry:u}of t.charts)u&&this.#d(u,a)}for(let{geometry:u,shader:d,ink:p}of t.overlays??[])this.#p(d,t,i,p),this.#d(u,be)}#l({roles:t},e){let s=t.some(i=>x[i]?.target!=="color");return e&&this.#e.add(ht(e.light,"Picture")),`${s?"full":"plain"}${e?"Picture":""}`}#f(t,{geometry:e,textures:s},i){if(!e)return;let r=this.#t;y.forEach((h,c)=>this.#i.texture(c,s[h]));let{width:n,height:a}=s.color??{};s.color?r.uniform4f(i.place,1-2/n,1-2/a,1/n,1/a):r.uniform4f(i.place,1,1,0,0),i.maps&&r.uniform1i(i.maps,Ee(t,s)),this.#d(e,t.lines?.edges)}#m(t,e){let s=this.#t;y.forEach((r,n)=>this.#i.texture(n,null)),s.activeTexture(s.TEXTURE0);let i=this.#i.color(t.mean);e.maps&&s.uniform1i(e.maps,0),this.#d(t.plain,t.lines?.edges),s.deleteTexture(i)}#d(t,e){let s=this.#t,i=this.#i.bind(t,e);s.drawElements(e?s.LINES:s.TRIANGLES,i,s.UNSIGNED_INT,0)}#p(t,e,s,i){this.#e.add({lines:()=>[U,t]});let r=this.#e.use("lines");return this.#u(r,e,s),this.#t.uniform3fv(r.ink,i),r}#u(t,{sphere:{center:e,radius:s}},i){i&&this.#t.uniformMatrix4fv(t.camera,!1,i.matrix),this.#t.uniform4f(t.world,...e,1/s)}#g(t,e,{camera:s,light:i,environment:r}){let n=this.#t;if(this.#u(t,e,s),n.uniform3fv(t.eye,s.eye),n.uniform1f(t.cut,e.alpha==="mask"?.5:0),t.bump&&n.uniform1f(t.bump,.01),r){n.uniform3fv(t.harmonics,r.harmonics),n.activeTexture(n.TEXTURE0+y.length),n.bindTexture(n.TEXTURE_CUBE_MAP,r.textureOf(n));return}n.uniform3fv(t.lamps,we(s)),n.uniform3fv(t.key,Te(s,i))}#b(t,{camera:e,floor:s}){let i=this.#t;if(e.eye[2]<s)return;let r=this.#e.use("floor");i.uniformMatrix4fv(r.camera,!1,e.matrix),i.uniform1f(r.floorHeight,s),i.activeTexture(i.TEXTURE0+L),i.bindTexture(i.TEXTURE_2D,this.#r.get(t).texture),i.uniform1i(r.shade,L),i.enable(i.BLEND),i.blendFuncSeparate(i.SRC_ALPHA,i.ONE_MINUS_SRC_ALPHA,i.ONE,i.ONE_MINUS_SRC_ALPHA),i.depthMask(!1),i.drawArrays(i.TRIANGLE_STRIP,0,4),i.depthMask(!0)}#E(t,e){let s=t.geometries.length,i=this.#r.get(t);if(i&&i.floor===e&&i.key===s)return;let r=this.#t;r.disable(r.BLEND),r.disable(r.CULL_FACE);let n=this.#v(h=>{this.#u(h,t,null),r.uniform1f(h.floorHeight,e),r.enable(r.DEPTH_TEST);for(let c of t.geometries)this.#d(c,!1)},"height"),a=this.#v(h=>{r.disable(r.DEPTH_TEST),r.activeTexture(r.TEXTURE0+L),r.bindTexture(r.TEXTURE_2D,n),r.uniform1i(h.heights,L),r.drawArrays(r.TRIANGLE_STRIP,0,4)},"shade");r.deleteTexture(n),i&&r.deleteTexture(i.texture),this.#r.set(t,{texture:a,floor:e,key:s})}#v(t,e){let s=this.#t,i=s.createTexture(),r=s.createRenderbuffer(),n=s.createFramebuffer();s.activeTexture(s.TEXTURE0+L),s.bindTexture(s.TEXTURE_2D,i),s.texStorage2D(s.TEXTURE_2D,1,s.RGBA8,T,T),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MIN_FILTER,s.LINEAR);for(let a of[s.TEXTURE_WRAP_S,s.TEXTURE_WRAP_T])s.texParameteri(s.TEXTURE_2D,a,s.CLAMP_TO_EDGE);return s.bindRenderbuffer(s.RENDERBUFFER,r),s.renderbufferStorage(s.RENDERBUFFER,s.DEPTH_COMPONENT16,T,T),s.bindFramebuffer(s.FRAMEBUFFER,n),s.framebufferTexture2D(s.FRAMEBUFFER,s.COLOR_ATTACHMENT0,s.TEXTURE_2D,i,0),s.framebufferRenderbuffer(s.FRAMEBUFFER,s.DEPTH_ATTACHMENT,s.RENDERBUFFER,r),s.viewport(0,0,T,T),s.clearColor(1,1,1,1),s.clear(s.COLOR_BUFFER_BIT|s.DEPTH_BUFFER_BIT),t(this.#e.use(e)),s.deleteFramebuffer(n),s.deleteRenderbuffer(r),i}},be=o=>o,lt=o=>o.parts??[o];function Ee({roles:o},t){return Object.entries(x).reduce((e,[s,{target:i}],r)=>e|(t[i]&&o.includes(s)?1<<r:0),0)}function we({right:o}){let t=[o[1],-o[0],0];return rt.flatMap(([e,s,i])=>{let r=Math.hypot(e,s,i);return E(E([0,0,i/r],o,e/r),t,s/r)})}function Te({right:o,up:t,backward:e},s){let[i,r]=s.map(R),n=Math.cos(r),a=[Math.sin(i)*n,Math.sin(r),Math.cos(i)*n];return[0,1,2].map(h=>bt(a,[o[h],t[h],e[h]]))}var _=class extends Error{};async function Mt(o,t,e,s=null){let i=null;for(let r=0;!t.signal.aborted;){let n=t.received,a=s;s=null;try{let h=await ye(o,t,e,i,r,a);if(i=h.version,a&&h.isPart){await t.running;continue}t.end();return}catch(h){if(t.signal.aborted)return;if(h instanceof _)throw h;if(a&&!t.received)continue;if(r=t.received>n?1:r+1,!(t.received||h.answered)||r>8)throw new Error(`${o} can not be loaded: ${h.message}`);i=n?i??h.version:h.version,t.dispatchEvent({type:"stalled",attempt:r,message:h.message}),await Ae(Math.min(8e3,125*2**r),t.signal)}}}async function ye(o,t,{headers:e,...s},i,r,n){let a=t.received,h=new AbortController,c=()=>h.abort();t.signal.addEventListener("abort",c);let l=setTimeout(c,2e4),u=i,d=r>0;try{let p=new Headers(e);a&&(p.set("Range",`bytes=${a}-`),i&&new URL(o,location).origin===location.origin&&p.set("If-Range",i));let f=await(n??fetch(o,{...s,headers:p,signal:h.signal}));if(a&&f.status===416)return{version:i};if(f.status>=500||f.status===429)throw new Error(`the server says ${f.status}`);if(!f.ok)throw new _(`${o} can not be loaded: the server says ${f.status}`);if(d=!0,u=Re(f.headers.get("ETag"))??f.headers.get("Last-Modified"),a&&i&&u&&u!==i)throw new _(`${o} has changed on the server`);let b=a&&f.status!==206?a:0,g=/^bytes (\d+)-(\d+)\/(.*)/.exec(f.headers.get("Content-Range")??""),A=g!==null&&!(Number(g[2])+1>=Number(g[3]));if(f.status===206&&g&&Number(g[1])!==a)throw new _(`${o} comes from a wrong place`);r&&t.dispatchEvent({type:"resumed"});let Vt=f.body.getReader();for(;;){let{done:Yt,value:N}=await Vt.read();if(Yt)return{version:u,isPart:A};clearTimeout(l),l=setTimeout(c,2e4);let D=Math.min(b,N.length);b-=D,D<N.length&&t.feed(D?N.slice(D):N)}}catch(p){throw Object.assign(h.signal.aborted?new Error("nothing comes any more"):p,{version:u,answered:d})}finally{clearTimeout(l),t.signal.removeEventListener("abort",c)}}function Re(o){return o?.startsWith('"')?o:null}function Ae(o,t){return new Promise(e=>{setTimeout(e,o),globalThis.addEventListener?.("online",e,{once:!0}),t.addEventListener("abort",e,{once:!0})})}var Se=["progress","refine","geometry","error"],X=class extends EventTarget{sphere={center:[0,0,0],radius:1};constructor(t){super(),this.parts=t;for(let e of t){for(let s of Se)e.addEventListener(s,i=>this.#i(s,i.detail));for(let s of["surface","first"])e.addEventListener(s,()=>this.first&&this.#t(s));e.addEventListener("complete",()=>this.complete&&this.#i("complete",{}))}}get first(){return this.parts.every(t=>t.first)}get complete(){return this.parts.every(t=>t.complete)}get received(){return this.#e("received")}get total(){return this.parts.some(t=>t.total===null)?null:this.#e("total")}get texels(){return this.#e("texels")}get quads(){return this.#e("quads")}get charts(){return this.parts.flatMap(t=>t.charts)}get geometries(){return this.parts.flatMap(t=>t.geometries)}get roles(){return[...new Set(this.parts.flatMap(t=>t.roles))]}get shown(){return{bytes:this.#e("received"),coefficients:1,placements:1}}measure(...t){for(let e of this.parts)e.measure(...t)}async settled(){await Promise.all(this.parts.map(t=>t.settled()))}dispose(){for(let t of this.parts)t.dispose()}#t(t){let e=this.sphere;this.sphere=Me(this.parts.map(s=>s.sphere));for(let s of this.parts)s.sphere=this.sphere;this.#i(t,{before:e})}#e(t){return this.parts.reduce((e,s)=>e+(s[t]??0),0)}#i(t,e){this.dispatchEvent(Object.assign(new Event(t),e,{detail:e}))}};function Me(o){let t=n=>[0,1,2].map(a=>Math.max(...o.map(({center:h,radius:c})=>n*h[a]+c))),[e,s]=[t(1),t(-1)],i=e.map((n,a)=>(n-s[a])/2),r=n=>Math.hypot(...i.map((a,h)=>a-n.center[h]))+n.radius;return{center:i,radius:Math.max(...o.map(r))||1}}var _e=globalThis.requestAnimationFrame?.bind(globalThis)??(o=>setTimeout(o,16)),G=class{received=0;total=null;complete=!1;first=!1;#t;#e;#i=new AbortController;#s=[];#r=[];#o=!1;#a=!1;#n=0;#h=null;#c=null;#l=[];#f=!1;#m=!1;#d;#p=new Promise(t=>this.#d=t);#u=0;constructor(t,e,s){this.#t=t,this.#e=s,this.running=new Promise(i=>{t.onmessage=({data:r})=>{i(),this.#g(r)}}),t.onerror=i=>this.fail(new Error(i.message||"the worker uph-worker.js does not start")),t.postMessage({kind:"open",...e})}get signal(){return this.#i.signal}feed(t){this.signal.aborted||(this.#s.push(t),this.received+=t.length,this.send({kind:"feed",bytes:t}),this.#e.notify("progress",{received:this.received,total:this.total,loaded:this.received}))}end(){this.#f=!0,this.send({kind:"end"})}fail(t){this.#m=!0,this.#e.notify("error",{error:t})}dispatchEvent({type:t,...e}){this.#e.notify(t,e)}bytes(){let t=new Uint8Array(this.received),e=0;for(let s of this.#s)t.set(s,e),e+=s.length;return t}send(t){this.#t.postMessage({...t,ticket:++this.#n})}async setExemplar(t){let e=++this.#u,s=await this.#p,i=t===null?null:await(await import("./uph-picture.js")).readPicture(t,s);e===this.#u&&(this.send({kind:"exemplar",picture:i}),await this.settled())}settled(){return new Promise(t=>{this.#l.push(t),this.#y()})}abort(){this.#i.abort()}dispose(){this.abort(),this.#t.terminate(),this.#r=[],this.#a=!1}#g(t){t.kind==="surface"?(this.#a=!0,this.#d(t.exemplar),this.#e.begin(t)):t.kind==="meshes"?this.#e.takeMeshes(t):t.kind==="textures"?(this.#r.push(...t.entries),this.#h=this.#c=t.state,this.#b()):t.kind==="state"?(this.#h=t.state,this.total=t.state.total,this.#y()):t.kind==="error"?this.fail(Object.assign(new Error(t.message),{offset:t.offset})):this.fail(new Error(`uph-worker.js sent a message of unknown kind ${t.kind}`))}#b(){this.#o||(this.#o=!0,_e(()=>{this.#o=!1,this.#a&&this.#E()}))}#E(){let t=[],e=0;for(;this.#r.length&&e<2097152;){let s=this.#r.shift(),i=this.#e.takeTexture(s);i&&t.push(i),s.height&&(e+=s.height*s.width)}if(this.#r.length){this.first&&this.#e.notify("refine",{}),this.#b();return}this.total=this.#c.total,this.#t.postMessage({kind:"shown",buffers:t},t),(this.first||this.#c.placements||this.#c.isBase)&&this.#v()}#v(){let t=!this.first;this.first=!0,this.#e.show(this.#c,t)}#y(){let t=this.#h;if(!(!t?.idle||t.ticket!==this.#n||this.#r.length)){if(this.#f&&this.#c&&!this.first&&this.#v(),this.#f&&!this.complete&&!this.#m)if(this.received===this.total)this.complete=!0,this.#e.notify("complete",{});else{let e=this.total?` of ${this.total.toLocaleString("en")}`:"";this.fail(new Error(`the stream is cut: ${this.received.toLocaleString("en")}${e} bytes have come`))}for(let e of this.#l.splice(0))e()}}};function _t(o,{height:t,width:e},s){let i=4*(e+2);o.set(s.subarray(0,i),0),o.set(s.subarray(i,2*i),(t+1)*i);for(let r=0,n=2*i;r<t;r++,n+=4){let a=(r+1)*i;for(let h=0;h<4;h++)o[a+i-4+h]=s[n+h],o[a+h]=s[n+4*t+h]}}var ke=256;function ut({bendS:o,bendT:t},e,s){return[o,t].map(i=>{let r=Math.log2(Math.sqrt(i*e/(4*s))||1);return 2**Math.ceil(Math.min(Math.max(r,0),Math.log2(ke)))})}var Le=120,Ie=2**19,Fe=1.1,H=class{counts=null;leastPerUnit=0;#t;#e;#i;#s=!1;#r;#o=null;#a=0;constructor(t,e,s,i){this.#t=t,this.#e=e,this.#i=new Float32Array(t.length).fill(s),this.#r=i}measure(t,e){this.counts&&(this.#o||(this.#o=this.counts.slice(),setTimeout(()=>this.#h(),this.#a+Le-performance.now())),this.#n(t,e))}askForLeast(){this.#o??=this.counts.slice();for(let t of this.#t.keys())this.#n(t,0);this.#h()}#n(t,e){let s=ut(this.#t[t],Math.max(e,this.leastPerUnit),this.#e);for(let i=0;i<2;i++){let r=this.counts[2*t+i];(s[i]>r||s[i]<r/2)&&(this.#o[2*t+i]=s[i])}e<=Fe*this.#i[t]||(this.#i[t]=e,this.#s=!0)}#h(){let t=this.#o;if(!t)return;this.#o=null,this.#a=performance.now(),this.#s&&this.#r({kind:"pixels",perUnit:this.#i}),this.#s=!1;let e=()=>t.reduce((s,i,r)=>r%2?s+i*t[r-1]:s,0);for(;e()>Ie&&t.some(s=>s>1);)t.forEach((s,i)=>t[i]=Math.max(1,s>>1));t.every((s,i)=>s===this.counts[i])||(this.counts=t,this.#r({kind:"counts",counts:t}))}};var F={maxTextureSize:4096,maxTexels:2**26,errorPixels:.4},kt=0,I=class extends EventTarget{charts=[];#t={};plain=null;metres=null;mean=[.5,.5,.5];texels=0;shown={bytes:0,coefficients:0,placements:0};roles=[];alpha="opaque";sphere={center:[0,0,0],radius:1};lines=null;#e;#i=null;#s=null;#r;#o=null;#a;constructor(t,{eye:e,pixels:s=1/0,onPage:i,...r}={}){super(),this.onPage=i,this.#r=s;let n={begin:c=>this.#h(c),takeMeshes:c=>this.#l(c),takeTexture:c=>this.#f(c),show:(c,l)=>this.#m(c,l),notify:(c,l)=>this.#n(c,l)},{errorPixels:a,...h}={...F,...r};this.#a=a,this.#e=new G(t,{...h,eye:e,pixels:s,onPage:i,sketches:262144},n)}get client(){return this.#e}get received(){return this.#e.received}get total(){return this.#e.total}get complete(){return this.#e.complete}get first(){return this.#e.first}get geometries(){return[...this.charts.map(({geometry:t})=>t),this.plain].filter(Boolean)}get quads(){return Math.round(this.charts.reduce((t,{geometry:e})=>t+(e?.indices.length??0),0)/6)}setLimit(t){this.#e.send({kind:"limit",...t})}setExemplar(t){return this.#e.setExemplar(t)}settled(){return this.#e.settled()}bytes(){return this.#e.bytes()}abort(){this.#e.abort()}paintInWorker(){this.onPage=!1,this.isBare=!0;for(let t of[...this.charts,...this.#c])t.textures={};this.#e.send({kind:"paint"})}measure(t,e,s){this.#o=({center:i,radius:r})=>e/Math.max(Math.hypot(...i.map((n,a)=>n-t[a]))-r,s),this.charts.forEach(({bounds:i},r)=>this.measureChart(r,this.#o(i)))}measureChart(t,e){this.#i||this.#s?.measure(t,e)}async refineTo(t){let e=this.#s;e.leastPerUnit=t,e.askForLeast(),await this.settled(),e.leastPerUnit=0}dispose(){this.#e.dispose(),this.#s=null}#n(t,e={}){this.dispatchEvent(Object.assign(new Event(t),e,{detail:e}))}#h({bounds:t,sphere:e,plain:s,metres:i}){let r=t.map(n=>({bounds:n,geometry:null,textures:{}}));this.#i={charts:r,plain:s,metres:i,sphere:e},this.#s=new H(t,this.#a,this.#r/e.radius,n=>this.#e.send(n))}get#c(){return(this.#i??this).charts}#l({pieces:t,counts:e}){this.#s.counts||(this.#s.counts=e,this.#o&&this.#c.forEach(({bounds:s},i)=>this.#s.measure(i,this.#o(s))));for(let{chart:s,...i}of t)this.#c[s].geometry=i;this.#i||this.#n("geometry")}#f({chart:t,target:e,height:s,width:i,data:r,gutter:n,role:a,sheet:h,recipe:c,roles:l,...u}){if(h?this.#t[a]={data:r,height:s,width:i,...u}:c&&(this.#c[t].recipe={...c,numbers:r}),h||c||!(r||this.onPage))return null;let{textures:d}=this.#c[t],p=d[e];if(n)return _t(p.data,{height:p.height-2,width:p.width-2},r),p.version=++kt,null;let f={key:p?.key??{},width:i+2,height:s+2,version:++kt},b=r?{data:r}:{recipe:this.#c[t].recipe,sheets:Object.fromEntries(l.map(g=>[g,this.#t[g]]))};return d[e]={...f,...b},this.isBare&&=!r,p?.data?.buffer??null}#m({bytes:t,coefficients:e,placements:s,roles:i,alpha:r="opaque",mean:n,texels:a},h){let c=this.sphere,l=this.#i;this.#i=null,Object.assign(this,{roles:i,alpha:r,mean:n,texels:a,shown:{bytes:t,coefficients:e,placements:s}},l),l&&this.#n("surface",{before:c}),this.#n(h?"first":"refine")}};var ft={texels:268435456,samples:128e5,charts:262144,triangles:1048576};var Vs=2**16;var Ne={samples:[2**16,1],charts:[2**12,256],triangles:[2**12,8]},De=2**31;function Lt({texels:o=ft.texels,...t}={}){let e={texels:o};for(let[s,[i,r]]of Object.entries(Ne))e[s]=t[s]??Math.min(ft[s],Math.max(i,Math.floor(o/r))),delete t[s];for(let s of Object.keys(t))throw new RangeError(`limit ${s} is unknown; allowed: ${Object.keys(e)}`);for(let[s,i]of Object.entries(e)){let r=s==="texels"?De:ft[s];if(!(Number.isInteger(i)&&i>=1&&i<=r))throw new RangeError(`limit of ${s} is ${i}; allowed: 1 to ${r}`)}return e}var Pe={"":1,k:1e3,m:1e6,g:1e9};function Ft({limit:o,maxtexels:t}){let e=It("limit",o),s=It("maxtexels",t)??F.maxTexels;if(s<1||s>F.maxTexels)throw new RangeError(`maxtexels is ${t}; allowed: 1 to ${F.maxTexels}`);return{limits:Lt({texels:e}),maxTexels:s}}function It(o,t){if(t===null)return;let[,e,s]=/^([0-9]{1,10}(?:\.[0-9]{1,6})?)([kmg]?)$/i.exec(t.trim())??[];if(!e)throw new RangeError(`${o} is "${t}"; allowed: a number such as 500k or 4M`);return Math.floor(e*Pe[s.toLowerCase()])}function O(o){if(o<1e3)return`${o} B`;let[t,e]=o<999500?[o/1e3,"kB"]:[o/1e6,"MB"];return`${t<9.95?t.toFixed(1).replace(".0",""):Math.round(t)} ${e}`}var Ue="The picture shows what was loaded before.",Ce={401:["can not be read.","The server asks for a login."],403:["can not be read.","The server refuses access."],404:["was not found.","Check the address."],410:["is no longer there.","Check the address."]},ze=/number of (texels|samples|charts|triangles) is \d+; allowed: 1 to/;function Ot(o,{shown:t,received:e,total:s,name:i}){let r=o.message,n=(h,c)=>({title:h,advice:t?Ue:c,detail:r});if(r.startsWith("the stream is cut"))return{title:`${i} ends after ${O(e)}${s===null?"":` of ${O(s)}`}.`,advice:t?"The picture shows all that it holds; the rest is missing.":"That is too little for a picture.",detail:""};if(/^(limit|maxtexels) /.test(r))return n(`${i} was not loaded: an attribute of this element is wrong.`,"");if(Number.isInteger(o.offset))return ze.test(r)?n(`${i} is larger than this page allows.`,""):!t&&o.offset<8?n(`${i} is no .uph stream.`,"Check the address, or the server that answers."):n(`${i} is damaged after ${O(o.offset)}.`,"Nothing can be shown. Write or download the file again.");let a=Number(/the server says (\d+)/.exec(r)?.[1]??0);if(a){let[h,c]=Ce[a]??["could not be fetched.","The server failed. Try again in a while."];return n(`${i} ${h}`,c)}return r.includes("changed on the server")?n(`${i} was replaced while it was loading.`,"Load it again."):r.includes("can not be loaded")?t?n("The connection was lost.",""):n(`${i} could not be fetched.`,"You may be offline, or its server does not let this page read it (CORS)."):n("Something went wrong.","Nothing can be shown.")}var W=new Set,Nt=o=>[...W].filter(t=>t.address===o).sort((t,e)=>t.places.size-e.places.size),Be=o=>o?new Worker(o,{type:"module"}):new Worker(new URL("./uph-worker.js",import.meta.url),{type:"module"});function dt(o,t=Be(o)){let e={address:o,worker:t,places:new Set};return t.onerror=s=>{W.delete(e);for(let i of e.places)i.onerror(s)},W.add(e),e}function Dt(o){Nt(o)[0]||dt(o)}function $e(o,t){let e=Nt(o),s=e.length>=3||e[0]?.places.size===0?e[0]:null;return e.find(({places:i})=>i.has(t))??s}function pt(o,t=null){let e=globalThis.upholsterEarly;e?.worker&&!o&&(dt(o,e.worker),e.worker=null);let s=$e(o,t)??dt(o),{port1:i,port2:r}=new MessageChannel;return s.worker.postMessage({kind:"join",port:r},[r]),s.places.add(i),i.terminate=()=>{i.postMessage({kind:"close"}),i.close(),s.places.delete(i),!s.places.size&&(s.worker.terminate(),W.delete(s))},i}function Pt(o){let t=globalThis.upholsterEarly;if(!t?.response||new URL(t.url,location).href!==new URL(o,location).href)return null;let{response:e}=t;return t.response=null,e}var Xe=["progress","surface","first","refine","geometry","complete","stalled","resumed","error"],j=class{other=null;limit=null;problem=null;stalled=!1;firstTime=null;completeTime=null;changes=0;#t;#e={};#i=null;#s=performance.now();constructor(t,e,s,i,r,n=null){this.#t=e;try{this.#e={onPage:s.onPage,...Ft(i)}}catch(l){this.#i=l}let a=Array.isArray(t)?t:[t];this.name=typeof a[0]=="string"?He(a[0]):a[0].name,this.failed=new Promise(l=>this.fail=l),this.places=Ge(a,e,n);let h=this.places.map(l=>new I(l,{...s,...this.#e})),c=this.model=h.length>1?new X(h):h[0];for(let l of Xe)c.addEventListener(l,u=>{(l==="surface"||l==="first"||l==="refine"||l==="geometry")&&this.changes++,(l==="stalled"||l==="progress"||l==="resumed")&&(this.stalled=l==="stalled"),!(l==="error"&&!this.#o(u.error))&&r(l,u)});this.received=Promise.all(a.map((l,u)=>this.#r(l,h[u].client)))}get loading(){return!this.problem&&!this.model.complete}get time(){return performance.now()-this.#s}setLimit(t){this.limit=t,this.model.setLimit(t)}compare(){return this.other=new I(pt(this.#t),this.#e),Ut(this.other.client,this.model.bytes()),this.other}settled(){let t=[this.model,this.other].filter(Boolean).map(e=>e.settled());return Promise.race([Promise.all(t),this.model.first?Promise.all(t):this.failed])}dispose(){this.fail(),this.model.dispose(),this.other?.dispose()}async#r(t,e){await null;try{if(this.#i)throw this.#i;typeof t=="string"?await Mt(t,e,{credentials:"same-origin"},Pt(t)):Ut(e,new Uint8Array(await t.arrayBuffer()))}catch(s){e.signal.aborted||e.fail(s)}}#o(t){if(this.problem)return!1;let{first:e,received:s,total:i}=this.model;return this.stalled=!1,this.problem=Ot(t,{shown:e,received:s,total:i,name:this.name||"This"}),this.fail(),!0}};function Ge(o,t,e){return o.map((s,i)=>pt(t,e?.places[i]))}function He(o){let t=o.split(/[?#]/)[0].split("/").at(-1);try{return decodeURIComponent(t)||o}catch{return t}}function Ut(o,t){o.feed(t),o.end()}var[We,je]=[.02,25],[Ct,qe,Ve]=[290,7.2,8],Ye=4,Ke=.0016,Ze=new Float32Array([-1,-1,-1,1,1,1]),q=(o,t,e)=>Math.min(Math.max(o,t),e);function Qe(o,t){return Math.hypot(...o.center.map((s,i)=>s-t.center[i]))<Math.min(o.radius,t.radius)&&Math.max(o.radius/t.radius,t.radius/o.radius)<Ye}var V=class{onchange=()=>{};touched=!1;enabled=!1;dragRotates=!0;zoomToPointer=!0;damping=!0;#t;#e=Ze;#i;#s=1;#r;#o;#a;#n=[0,0];#h=!1;#c=new Map;constructor(t,e,s){this.#t=t,this.#i=e,this.#l();let i=(r,n)=>t.addEventListener(r,n,{signal:s});i("pointerdown",r=>this.#u(r)),i("pointermove",r=>this.#b(r)),i("pointercancel",r=>this.#g(r));for(let r of["pointerup","lostpointercapture"])i(r,({pointerId:n})=>this.#c.delete(n));i("contextmenu",r=>r.preventDefault()),t.addEventListener("wheel",r=>this.#v(r),{signal:s,passive:!1})}set autorotate(t){this.#h=t,this.onchange()}set points(t){this.#e=t,this.touched||this.#l()}set aspect(t){let e=this.#s;if(t===e)return;if(this.#s=t,!this.touched)return this.#l();let s=i=>J(this.#e,i,this.#o).distance;this.#a*=s(t)/s(e)}get view(){return[((this.#o[0]+180)%360+360)%360-180,this.#o[1]]}set view(t){this.#i=t,this.reset()}reset(){this.touched=!1,this.#l(),this.onchange()}keep(t,e){if(!this.touched||!Qe(t,e))return;let s=t.radius/e.radius;this.#r=this.#r.map((i,r)=>s*i+(t.center[r]-e.center[r])/e.radius),this.#a*=s}turn(t,e){this.#f(),this.#m(-t,e)}zoom(t,e=[0,0]){this.#f();let s=this.#a;this.#a=q(s/t,We,je),this.zoomToPointer&&this.#d(e[0]*(s-this.#a),e[1]*(s-this.#a)),this.onchange()}update(t){if(!this.enabled)return;this.#h&&this.#m(-qe*t,0);let[e,s]=this.#n;if(this.#c.size||Math.hypot(e,s)<1)return;this.#m(e*t,s*t);let i=Math.exp(-Ve*t);this.#n=[e*i,s*i]}camera(){let[t,e,s]=S(this.#o),i=E(this.#r,s,this.#a),r=Math.hypot(...i)+9,n=Math.max(Math.hypot(...i)-1.05,.004),[a,h]=[1/(w*this.#s),1/w],[c,l]=[(n+r)/(r-n),-2*n*r/(r-n)],u=f=>-(f[0]*i[0]+f[1]*i[1]+f[2]*i[2]),d=f=>[a*t[f],h*e[f],-c*s[f],-s[f]],p=[a*u(t),h*u(e),-c*u(s)+l,-u(s)];return{eye:i,right:t,up:e,backward:s,near:n,matrix:[...d(0),...d(1),...d(2),...p]}}#l(){Object.assign(this,{touched:!1});let{target:t,distance:e}=J(this.#e,this.#s,this.#i);this.#r=t,this.#a=e,this.#o=[...this.#i],this.#n=[0,0],this.onchange()}#f(){this.touched=!0,this.#h=!1,this.#n=[0,0]}#m(t,e){this.#o=[this.#o[0]+t,q(this.#o[1]+e,-89.9,89.9)],this.onchange()}#d(t,e){let[s,i]=S(this.#o);this.#r=E(E(this.#r,s,t*w),i,e*w)}#p({clientX:t,clientY:e}){let{left:s,top:i,width:r,height:n}=this.#t.getBoundingClientRect();return[(2*(t-s)-r)/n,(n-2*(e-i))/n]}#u(t){this.enabled&&(this.#t.setPointerCapture(t.pointerId),this.#c.set(t.pointerId,{place:this.#p(t),time:t.timeStamp,angles:[...this.#o]}),this.#f(),this.onchange())}#g({pointerId:t}){let e=this.#c.get(t);!e||!this.#c.delete(t)||(this.#o=e.angles,this.#n=[0,0],this.onchange())}#b(t){let e=this.#c.get(t.pointerId);if(!e)return;let s=this.#p(t),[i,r]=[s[0]-e.place[0],s[1]-e.place[1]],n=Math.max(t.timeStamp-e.time,1)/1e3,a=[...this.#c].filter(([h])=>h!==t.pointerId).map(([,{place:h}])=>h);if(Object.assign(e,{place:s,time:t.timeStamp}),a.length)this.#E(a[0],s,[i,r]);else if(t.buttons>1||t.ctrlKey||t.metaKey)this.#d(-i*this.#a,-r*this.#a);else if(this.dragRotates){let[h,c]=[-i*Ct/2,-r*Ct/2];this.#m(h,c),this.damping&&(this.#n=[h/n,c/n].map(l=>q(l,-400,400)))}this.onchange()}#E(t,e,[s,i]){let r=Math.hypot(e[0]-t[0],e[1]-t[1]),n=Math.hypot(e[0]-s-t[0],e[1]-i-t[1]);this.#d(-s/2*this.#a,-i/2*this.#a),n>0&&this.zoom(r/n,[(e[0]+t[0])/2,(e[1]+t[1])/2])}#v(t){if(!this.enabled)return;t.preventDefault();let e=t.deltaY*[1,16,400][t.deltaMode];this.zoom(Math.exp(-Ke*q(t.ctrlKey?4*e:e,-400,400)),this.#p(t))}};function zt(o){if(document.fullscreenElement)return!1;for(let t=o;t;t=t.assignedSlot??t.parentNode??t.host)if(t instanceof Element&&t.scrollHeight>t.clientHeight+1&&Je(t))return!0;return!1}function Je(o){let{overflowY:t}=getComputedStyle(o);if(o!==document.scrollingElement)return/auto|scroll/.test(t);let{body:e}=document,s=t==="visible"&&e&&e!==o?getComputedStyle(e).overflowY:t;return!/hidden|clip/.test(s)}function Bt(o,t){let e=({ctrlKey:i,metaKey:r})=>i||r||o.matches(":focus")||!zt(o);o.addEventListener("wheel",i=>e(i)||i.stopImmediatePropagation(),{capture:!0,signal:t}),o.style.touchAction="pan-y";let s=!1;o.addEventListener("touchstart",()=>s=!zt(o),{passive:!0,signal:t}),o.addEventListener("touchmove",i=>s&&i.cancelable&&i.preventDefault(),{passive:!1,signal:t})}var ts=2,mt=150,es=4e3,ss="50%",Y=class{onlost=()=>{};onseen=()=>{};#t;#e;#i;#s;#r=[];#o=null;#a=[1,1];#n=[0,0];#h=0;#c=0;#l=0;#f=!1;#m=[];#d=nt.light;#p=null;#u=[...it];#g=null;#b;#E=new AbortController;constructor(t,e){this.#t=t,this.#e=M.shared,this.canvas=document.createElement("canvas"),this.canvas.className="empty",this.#i=this.canvas.getContext("bitmaprenderer");let{signal:s}=this.#E;Bt(this.canvas,s),this.#s=new V(this.canvas,e,s),this.#s.onchange=()=>this.invalidate(),t.append(this.canvas),this.#O(),this.#x(s)}show(...t){let e=t[0]!==this.#r[0];e&&t[0]&&this.#r[0]&&this.#s.keep(this.#r[0].sphere,t[0].sphere);for(let s of this.#r)this.#e.models.delete(s);for(let s of t)this.#e.models.add(s);this.#r=t,this.#e.sweep(),this.#s.enabled=t.length>0,this.#s.zoomToPointer=!this.split,this.canvas.classList.toggle("empty",!t.length),t.length?e&&this.#I():this.#p=null,this.#s.aspect=this.#_,this.invalidate()}get split(){return this.#r.length>1&&this.#o===null}set wipe(t){this.#o=t,this.invalidate()}get stacked(){return this.#a[0]<this.#a[1]}refresh({shape:t=!1,before:e=null}={}){let[s]=this.#r;s&&(e&&this.#s.keep(e,s.sphere),t&&(this.#s.touched||this.#I(),this.#e.sweep()),this.invalidate())}setBackground(t,e){this.#d=t==="none"?null:(t&&is(t))??nt[e?"dark":"light"],this.#t.style.background=t??"",this.invalidate()}set environment(t){this.#g=t,this.invalidate()}get view(){return this.#s.view}set view(t){this.#s.view=t}reset(){this.#s.reset()}turn(t,e){this.#s.turn(t,e)}zoom(t){this.#s.zoom(t)}set autorotate(t){this.#s.autorotate=t}set reducedMotion(t){this.#s.damping=!t}get light(){return[...this.#u]}set light(t){let[e,s]=t??it,i=((e+180)%360+360)%360-180;this.#u=[i,Math.min(Math.max(s,-90),90)],this.invalidate()}set dragRotates(t){this.#s.dragRotates=t}get pixels(){let{eye:t,near:e}=this.#s.camera();return this.#T(0,this.#w(1))[3]/2/w/Math.max(Math.hypot(...t)-1,e)}ray(t,e){let[s]=this.#r;if(!s)return null;let{eye:i,right:r,up:n,backward:a}=this.#s.camera(),[h,c]=this.#a,[l,u]=[(2*t/h-1)*w*(h/c),(1-2*e/c)*w],{center:d,radius:p}=s.sphere;return{origin:d.map((f,b)=>f+p*i[b]),direction:[0,1,2].map(f=>l*r[f]+u*n[f]-a[f])}}get isLost(){return this.#e.isLost}invalidate(){this.#h||!this.#f||!this.#r.length||(this.#h=requestAnimationFrame(t=>this.#v(t)))}drawn(){return!this.#f||document.hidden||!this.#r.length?Promise.resolve():(this.invalidate(),new Promise(t=>this.#m.push(t)))}async refine(t){this.#L(t,0,this.#s.camera()),await new Promise(e=>setTimeout(e)),await t.settled()}async settle(){for(let t=0;t<2;t++)await this.drawn(),await new Promise(e=>setTimeout(e,mt));this.#R()}precompile(){!this.#r.length&&!this.#e.warm()&&setTimeout(()=>this.precompile(),20)}picture(){return this.#M(this.#w(1)),this.#e.canvas.convertToBlob({type:"image/png"})}finish(){this.#R(),this.#e.finish()}dispose(){this.show(),cancelAnimationFrame(this.#h),clearTimeout(this.#c),this.#E.abort();for(let t of this.#b)t.disconnect();this.canvas.remove(),this.#y()}#v(t){if(this.#h=0,this.isLost)return;if(this.#e.isBusy(this.#r,this.#g))return this.invalidate();let{quality:e}=this.#e,s=this.#l?Math.min((t-this.#l)/1e3,.1):1/60;this.#s.update(s),this.#h&&this.#l&&e.addFrame(t-this.#l),this.#l=this.#h?t:0,this.#R(this.#w(this.#h||!this.#k?e.quality:1)),this.#y(),clearTimeout(this.#c),this.#h||(this.#c=setTimeout(()=>this.#A(),this.#S?es:mt))}#y(){for(let t of this.#m.splice(0))t()}#A(){let t=this.#w(1);this.#h||!this.#f||document.hidden||t.every((e,s)=>e===this.#n[s])||(this.#e.isBusy(this.#r,this.#g)?this.#c=setTimeout(()=>this.#A(),mt/10):this.#R())}get#S(){return this.#r.some(t=>t.received<t.total)}get#k(){return this.#r.every(({shown:t})=>t.coefficients===1)}#w(t){let e=t*Math.min(devicePixelRatio,ts);return this.#a.map(s=>Math.max(1,Math.round(s*e)))}#R(t=this.#w(1)){!this.#r.length||this.isLost||(this.#M(t),this.#n=t,this.#i.transferFromImageBitmap(this.#e.canvas.transferToImageBitmap()))}#M(t){let e=this.#s.camera(),s=this.#r.map((i,r)=>({model:i,viewport:this.#T(r,t),clip:this.#N(r,t)}));this.#r.forEach((i,r)=>this.#L(i,r,e)),this.#e.draw(t,s,{camera:e,light:this.#u,background:this.#d,floor:this.#p,environment:this.#g})}#L(t,e,{eye:s,near:i}){let{center:r,radius:n}=t.sphere,[,,,a]=this.#T(e,this.#w(1));t.measure(E(r,s,n),a/2/w,i*n)}#N(t,[e,s]){if(this.#r.length<2||this.#o===null)return;let i=Math.round(this.#o*e);return t?[i,0,e-i,s]:[0,0,i,s]}#T(t,[e,s]){if(!this.split)return[0,0,e,s];let i=this.stacked?s>>1:e>>1;return this.stacked?[0,t?0:s-i,e,i]:[t?e-i:0,0,i,s]}get#_(){let[,,t,e]=this.#T(0,this.#a);return t/e}#I(){let{points:t,lowest:e}=Et(this.#r[0]);t.length&&(this.#s.points=t),this.#p=t.length?e-.002:null}#x(t){let e=new ResizeObserver(()=>this.#O()),s=new IntersectionObserver(r=>this.#F(r.at(-1).isIntersecting),{rootMargin:ss});e.observe(this.#t),s.observe(this.#t),this.#b=[e,s],this.canvas.addEventListener("dblclick",()=>this.reset(),{signal:t});let i=()=>{this.invalidate(),this.onlost()};for(let r of["lost","restored"])this.#e.addEventListener(r,i,{signal:t})}#F(t){this.#f=t;for(let e of this.#r)this.#e.models[t?"add":"delete"](e);t?(this.onseen(),this.invalidate()):(this.#e.sweep(),this.#y())}#O(){this.#a=[Math.max(this.#t.clientWidth,1),Math.max(this.#t.clientHeight,1)],this.#s.aspect=this.#_,this.invalidate()}};function is(o){let t=new OffscreenCanvas(1,1).getContext("2d");t.fillStyle="transparent",t.fillStyle=o,t.fillRect(0,0,1,1);let[e,s,i,r]=t.getImageData(0,0,1,1).data;if(r<255)return null;let n=[e,s,i].map(a=>a<=10?a/3294.6:((a/255+.055)/1.055)**2.4);return[n,n]}var rs=`
:host {
  display: block;
  position: relative;
  block-size: 480px;
  contain-intrinsic-block-size: 480px;
  overflow: hidden;
  container-type: size;
  color-scheme: light dark;
  --text: var(--upholster-text, #23272b);
  --muted: var(--upholster-muted, #62696f);
  --surface: var(--upholster-surface, #fbfbfa);
  --accent: var(--upholster-accent, #a5432b);
  --on-accent: var(--upholster-on-accent, #fff);
  --veil: color-mix(in srgb, var(--surface) 88%, transparent);
  font: 13px/1.4 var(--upholster-font, system-ui, sans-serif);
  color: var(--text);
  background: var(--surface);
}
:host([hidden]), [hidden] { display: none !important; }
@media (prefers-color-scheme: dark) {
  .stage { background: linear-gradient(rgb(41 43 46), rgb(63 63 63)); }
  :host {
    --text: var(--upholster-text, #e6e7e8);
    --muted: var(--upholster-muted, #9aa1a7);
    --surface: var(--upholster-surface, #1b1d1f);
    --accent: var(--upholster-accent, #e08a6c);
    --on-accent: var(--upholster-on-accent, #1b1d1f);
  }
}
:host([background='none']) { background: none; }

* { box-sizing: border-box; }
.viewer { position: absolute; inset: 0; display: grid; grid-template: minmax(0, 1fr) auto / minmax(0, 1fr); }
.stack { position: relative; overflow: hidden; container-type: size; }
.stage { position: absolute; inset: 0; background: linear-gradient(rgb(231 232 234), rgb(245 245 244)); }
.stage ::slotted(*) { position: absolute; inset: 0; inline-size: 100%; block-size: 100%; object-fit: contain; }
.above { position: absolute; inset: 0; pointer-events: none; }
.above > .corner, .above > .note { pointer-events: auto; }
canvas { position: absolute; inset: 0; inline-size: 100%; block-size: 100%; display: block; cursor: grab; }
canvas:active { cursor: grabbing; }
canvas.empty { opacity: 0; cursor: default; }
:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; }
canvas:focus-visible { outline-offset: -3px; }
.hidden { position: absolute; inline-size: 1px; block-size: 1px; overflow: hidden; clip-path: inset(50%); white-space: nowrap; }

button {
  font: inherit;
  color: inherit;
  min-inline-size: 40px;
  min-block-size: 40px;
  padding: 0 10px;
  border: 1px solid transparent;
  border-radius: 8px;
  background: none;
  cursor: pointer;
  touch-action: manipulation;
}
button:hover { background: color-mix(in srgb, var(--text) 8%, transparent); }
button[aria-pressed='true'] { color: var(--accent); background: color-mix(in srgb, var(--accent) 13%, transparent); }
button.icon { padding: 0; inline-size: 40px; }
button.main { color: var(--on-accent); background: var(--accent); padding: 0 18px; }
svg { inline-size: 22px; block-size: 22px; display: block; margin: auto; fill: none; stroke: currentColor; stroke-width: 1.6;
  stroke-linecap: round; stroke-linejoin: round; }

.corner { position: absolute; inset-block-start: 8px; inset-inline-end: 8px; display: flex; gap: 2px; padding: 2px;
  border-radius: 10px; background: var(--veil); }
@container (height < 120px) { .corner { display: none; } }
.note { position: absolute; inset-inline: 0; inset-block-end: 12px; inline-size: fit-content; max-inline-size: calc(100% - 24px);
  margin-inline: auto; padding: 8px 14px; border-radius: 10px; background: var(--veil); text-align: center; }
.note p { margin: 0; }
.note .title { font-weight: 600; }
.note .detail { color: var(--muted); font-size: 12px; overflow-wrap: anywhere; }
.note.middle { inset-block: 0; block-size: fit-content; margin-block: auto; background: none; max-inline-size: 440px; }
.note.middle .title { font-size: 17px; margin-block-end: 4px; }
.note.middle .detail { margin-block-start: 8px; }
.note.middle button { margin-block-start: 14px; }
.note:not(.middle):has(button:not([hidden])) { display: grid; grid-template-columns: auto auto; gap: 0 18px; text-align: start; }
.note:not(.middle) button { grid-area: 1 / 2 / span 3; align-self: center; }
.line { position: absolute; inset: 0 0 auto; block-size: 2px; pointer-events: none; }
.line i { display: block; background: var(--accent); block-size: 100%; inline-size: 100%; transform-origin: left; }
@media (forced-colors: active) {
  button { border-color: ButtonText; }
  button[aria-pressed='true'] { border-color: Highlight; color: Highlight; }
  .line i { forced-color-adjust: none; background: Highlight; }
}
`;function ns(o){let t;return()=>(t||(t=new CSSStyleSheet,t.replaceSync(o)),t)}var $t=ns(rs);var Xt="http://www.w3.org/2000/svg";function m(o,t={},...e){let s=document.createElement(o);for(let[i,r]of Object.entries(t))typeof r=="function"?s.addEventListener(i,r):r!==null&&r!==!1&&s.setAttribute(i,r===!0?"":r);return s.append(...e),s}function os(o){let t=document.createElementNS(Xt,"svg"),e=document.createElementNS(Xt,"path");return t.setAttribute("viewBox","0 0 24 24"),t.setAttribute("aria-hidden","true"),e.setAttribute("d",o),t.append(e),t}function Gt(o,t,e,s,i,{toggle:r=!1}={}){let n=s?`${e} (${s})`:e,a=s?{"aria-keyshortcuts":s}:{},h=r?{"aria-pressed":"false"}:{},c=`button ${o}`;return m("button",{type:"button",class:"icon",part:c,title:n,"aria-label":e,...a,...h,click:i},os(t))}var Ht=64,as="M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",K=class{stage=m("div",{class:"stage",part:"stage"},m("slot",{name:"poster"}));above;corner;element;#t;#e=new gt;#i=m("div",{class:"line",part:"progress",hidden:!0},m("i"));#s=m("div",{class:"hidden",role:"status"});constructor(t,{act:e,key:s,retry:i}){this.#t=Gt("fullscreen",as,"Full screen","F",()=>e("fullscreen"),{toggle:!0}),this.#t.hidden=!document.fullscreenEnabled,this.#e.onretry=i,this.corner=m("div",{class:"corner",part:"corner"},this.#t),this.above=m("div",{class:"above"},this.#i,this.#e.element,this.corner);let r=m("div",{class:"stack"},this.stage,this.above);this.element=m("div",{class:"viewer",keydown:s},r,this.#s),t.append(this.element)}set controls(t){this.corner.hidden=!t}set fullscreen(t){this.#t.setAttribute("aria-pressed",String(t))}say(t){this.#s.textContent=t}fail(t,e,{alt:s,children:i}){this.#e.show({title:t,advice:e,detail:s,middle:!i.length}),this.controls=!1}update(t,e,s,i){let r=!!t?.loading,n=!!t?.model.first;this.#i.hidden=!r;let{received:a,total:h}=t?.model??{};this.#i.firstChild.style.scale=`${(Ht*a/h|0)/Ht} 1`,i?this.#e.show({title:"The graphics card was reset.",advice:"The picture comes back when it is ready."}):t?.problem?this.#e.show({...t.problem,middle:!n,retry:!0}):t?.stalled?this.#e.show({title:"Connection lost, trying again\u2026"}):this.#e.hide();let l=`${s}${n?"":r?", loading":", no picture"}. Arrow keys turn it, plus and minus zoom.`;e.ariaLabel!==l&&(e.ariaLabel=l)}},gt=class{onretry=()=>{};#t=m("p",{class:"title"});#e=m("p");#i=m("p",{class:"detail"});#s=m("button",{type:"button",class:"main",part:"button",click:()=>this.onretry()},"Try again");element=m("div",{class:"note",part:"note",hidden:!0},this.#t,this.#e,this.#i,this.#s);show({title:t,advice:e="",detail:s="",middle:i=!1,retry:r=!1}){for(let[n,a]of[[this.#t,t],[this.#e,e],[this.#i,s]])n.textContent=a,n.hidden=!a;this.#s.hidden=!r,this.element.classList.toggle("middle",i),this.element.hidden=!1}hide(){this.element.hidden=!0}};var hs=[30,30],Z=7.5,Wt=1.15,cs={ArrowLeft:"left",ArrowRight:"right",ArrowUp:"up",ArrowDown:"down","+":"nearer","=":"nearer","-":"farther",0:"reset",f:"fullscreen"},{HTMLElement:ls=Object,customElements:vt,matchMedia:qt}=globalThis,jt=qt?.("(prefers-color-scheme: dark)"),Q=qt?.("(prefers-reduced-motion: reduce)"),xt=class extends ls{static observedAttributes=["src","alt","exemplar","view","background","environment","controls","autorotate"];#t;#e=null;#i=null;#s=null;#r=null;#o=null;#a=new Map;#n=null;#h=null;#c=null;#l=0;#f=!1;constructor(){super();let t=this.attachShadow({mode:"open",delegatesFocus:!0});t.adoptedStyleSheets=[$t()],this.#t=new K(t,{act:e=>this.#F(e),key:e=>this.#O(e),retry:()=>this.open(this.#e)})}open(t){let e=t instanceof Blob||t instanceof ArrayBuffer||ArrayBuffer.isView(t);if(!e&&t!==null&&typeof t!="string")throw new TypeError(`stream is ${t}; allowed: an address, Blob, ArrayBuffer or view of one, null`);this.#M(),this.#e=e?new File([t],t.name??""):t,this.isConnected&&t!==null&&this.#A()}async replace(...t){if(!this.#n)throw new Error("the viewer is in no page, or has no WebGL2");let e=this.#r,s=this.#r=this.#k(e??this.#s,t);if(e?.dispose(),await s.received,await s.settled(),s===this.#r&&!s.problem&&await Promise.race([this.#n.refine(s.model),s.failed]),s!==this.#r)return!1;if(this.#r=null,s.problem)throw s.dispose(),new Error(`${s.problem.title} ${s.problem.advice??""}`);return this.#s?.dispose(),this.#s=s,this.#e=new File([t[0]],""),this.#S(),this.#R(),this.#x(),await this.#n.drawn(),s===this.#s}get src(){return this.getAttribute("src")}set src(t){t==null?this.removeAttribute("src"):this.setAttribute("src",t)}get alt(){return this.getAttribute("alt")??""}set alt(t){this.setAttribute("alt",t)}get model(){return this.#s?.model??null}get view(){return this.#n?.view??this.#i??this.#m}set view(t){let e=tt(t);if(!e)throw new RangeError(`view is ${t}; allowed: azimuth and elevation in degrees, elevation from -90 to 90`);this.#i=e,this.#n&&(this.#n.view=e)}async picture(){if(!this.#n)throw new Error("there is no picture");return this.#n.picture()}async compare(...t){if(this.#o?.dispose(),this.#o=null,!t.length)return this.#S();let e=this.#o=this.#k(this.#s,t);await e.received,await e.settled(),e===this.#o&&this.#S()}set wipe(t){this.#n&&(this.#n.wipe=t)}ray(t,e){return this.model&&this.#n?this.#n.ray(t,e):null}overlay(t,e,s=[.13,.4,1]){if(e){let i=Float32Array.from(e),r=Uint32Array.from({length:i.length/3},(n,a)=>a);this.#a.set(t,{geometry:{positions:i,indices:r},shader:wt,ink:s})}else this.#a.delete(t);this.#R()}async settled(){for(let t=0;t<2;){let e=this.#s;if(!e)return;let{changes:s}=e;await e.settled(),await this.#n?.settle(),t=e===this.#s&&e.changes===s?t+1:0}}get fullscreen(){return this.matches(":fullscreen")}set fullscreen(t){if(t===this.fullscreen)return;(t?this.requestFullscreen():document.exitFullscreen()).catch(()=>this.#t.say("Full screen is not allowed here."))}connectedCallback(){if(this.#n)return;this.#e??=this.getAttribute("src");try{this.#n=new Y(this.#t.stage,this.view)}catch(e){setTimeout(()=>this.#p(e));return}this.#c=new AbortController;let{signal:t}=this.#c;for(let e of[jt,Q])e.addEventListener("change",()=>this.#u(),{signal:t});document.addEventListener("fullscreenchange",()=>this.#t.fullscreen=this.fullscreen,{signal:t}),Object.assign(this.#n.canvas,{tabIndex:0,part:"canvas",role:"application",ariaRoleDescription:"3D model"}),this.#n.onlost=()=>this.#x(),this.#n.onseen=()=>this.#y(),this.#u(),this.#g(),this.#E(),this.#e===null&&Dt(this.getAttribute("worker")),this.#x(),requestAnimationFrame(()=>this.#n?.precompile())}disconnectedCallback(){queueMicrotask(()=>{this.isConnected||!this.#n||(this.#M(),this.#c.abort(),this.#n.dispose(),this.#n=null,this.#h?.dispose(),this.#h=null,this.#f=!1)})}attributeChangedCallback(t,e,s){!this.#n||e===s||(t==="src"?this.open(s):t==="view"?this.view=this.#m:t==="autorotate"?this.#g():t==="environment"?this.#E():t==="exemplar"?this.#v():this.#u())}get#m(){return tt(this.getAttribute("view")??"")??hs}get#d(){return this.getAttribute("controls")!=="none"}#p(t){let e="This browser can not show 3D models.",s="It has no WebGL2, or WebGL2 is switched off.";this.#t.fail(e,s,this),this.#T(e,t,s)}#u(){this.#t.controls=this.#d,this.#n.setBackground(this.getAttribute("background"),jt.matches),this.#n.reducedMotion=Q.matches,Q.matches&&this.#g(),this.#b(),this.#x()}#g(){this.#n.autorotate=this.hasAttribute("autorotate")&&!Q.matches}async#b(){let t=this.getAttribute("controls")==="lab";if(t!==(this.#h!==null)){if(!t){this.#h.dispose(),this.#h=null;return}try{let{Lab:e}=await import("./upholster-lab.js");if(this.#h||!this.#n||this.getAttribute("controls")!=="lab")return;this.#h=new e({ui:this.#t,stage:this.#n,viewer:this,session:()=>this.#s,refresh:()=>this.#x()}),this.#x()}catch{this.#t.say("The laboratory, upholster-lab.js, can not be loaded.")}}}async#E(){let t=this.getAttribute("environment");try{let e=t?await(await import("./upholster-environment.js")).loadEnvironment(t):null;this.#n&&t===this.getAttribute("environment")&&(this.#n.environment=e)}catch(e){this.#T(`environment ${t} can not be loaded`,e)}}async#v(){let t=this.getAttribute("exemplar"),{model:e}=this;try{let s=t&&await fetch(t);if(s&&!s.ok)throw new Error(`the server says ${s.status}`);let i=s?await s.blob():null;e&&e===this.model&&t===this.getAttribute("exemplar")&&await e.setExemplar(i)}catch(s){this.#T(`exemplar ${t} can not be shown: ${s.message}`,s)}}#y(){this.#f=!0,!this.#s&&this.#e!==null&&this.#A()}#A(){!this.#n||!(this.#f||typeof this.#e!="string")||(this.#s=this.#w(this.#e),this.hasAttribute("exemplar")&&this.#v(),this.#x())}#S(){let t=[this.#s,this.#o].map(e=>e?.model).filter(e=>e?.first);this.#n?.show(...t)}#k(t,e){let s=e.map(i=>new File([i],""));return this.#w(s.length>1?s:s[0],{before:t,whole:!0})}#w(t,{before:e=null,whole:s=!1}={}){let i=null,r=M.shared.paints(this.getAttribute("painting")),n={eye:S(this.view)[2],pixels:this.#n.pixels,onPage:r,whole:s},a=(c,l)=>{i&&i===this.#s&&this.#L(c,l)},h={limit:this.getAttribute("limit"),maxtexels:this.getAttribute("maxtexels")};return i=new j(t,this.getAttribute("worker"),n,h,a,e),i}#R(){let{model:t}=this;if(t){for(let e of new Set([t,t.parts?.[0]??t]))e.overlays=[...this.#a.values()];this.#n?.invalidate()}}#M(){this.#n?.show();for(let t of[this.#s,this.#r,this.#o])t?.dispose();this.#s=this.#r=this.#o=null,this.#x()}#L(t,e){let s=this.#s,i=this.#n;t==="first"&&(i.show(s.model),this.#R()),t==="refine"&&i.refresh(),(t==="surface"||t==="geometry")&&i.refresh({shape:!0,before:e.before}),this.#x(),(t==="first"||t==="refine"||t==="complete")&&this.#N(s,t),t==="error"&&this.#T(s.problem.title,e.error,s.problem.advice)}async#N(t,e){if(await this.#n.drawn(),t!==this.#s||t.model.isBare&&e!=="complete")return;let{time:s,firstTime:i}=t;e==="refine"&&!i&&(e="first"),e==="first"?t.firstTime=s:e==="complete"&&(t.completeTime=s,this.#t.say(`Loaded: ${O(t.model.received)}.`)),this.#x(),this.#_(e,{...t.model.shown,milliseconds:s})}#T(t,e,s=""){this.#t.say(`${t} ${s}`),this.#_("error",{message:t,error:e})}#_(t,e){this.dispatchEvent(new CustomEvent(t,{detail:e}))}get#I(){return this.alt||this.#s?.name.replace(/\.uph$/,"")||(this.#s?"3D model":"No model")}#x(){this.#l||=requestAnimationFrame(()=>{this.#l=0,this.#n&&(this.#t.update(this.#s,this.#n.canvas,this.#I,this.#n.isLost),this.#h?.update(this.#s))})}#F(t){let e=this.#n;e&&(t==="left"||t==="right"?e.turn(t==="left"?Z:-Z,0):t==="up"||t==="down"?e.turn(0,t==="up"?Z:-Z):t==="nearer"||t==="farther"?e.zoom(t==="nearer"?Wt:1/Wt):t==="reset"?e.reset():this.fullscreen=!this.fullscreen)}#O(t){if(t.ctrlKey||t.metaKey||t.altKey||t.defaultPrevented||t.target.matches("input")&&/^(Arrow|Home|End|Page)/.test(t.key))return;let e=t.key.length===1?t.key.toLowerCase():t.key,s=cs[e];if(s&&(this.#d||s!=="fullscreen"))this.#F(s);else if(!this.#h?.key(e))return;t.preventDefault()}};vt&&!vt.get("upholster-viewer")&&vt.define("upholster-viewer",xt);export{xt as UpholsterViewer};
