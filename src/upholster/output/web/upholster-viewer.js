/*! upholster, SPDX-License-Identifier: MIT, see LICENSES.txt */
var A=n=>n*Math.PI/180;var E=Math.tan(A(30)/2),Et=(n,t)=>n[0]*t[0]+n[1]*t[1]+n[2]*t[2],w=(n,t,e=1)=>[n[0]+e*t[0],n[1]+e*t[1],n[2]+e*t[2]];function M([n,t]){let[e,s]=[Math.cos(A(n)),Math.sin(A(n))],[i,r]=[Math.cos(A(t)),Math.sin(A(t))];return[[e,s,0],[-s*r,e*r,i],[s*i,-e*i,r]]}function et(n,t,e){let[s,i,r]=M(e),o=.875*E,a=[-1/0,-1/0,-1/0,-1/0],h=-1/0;for(let u=0;u<n.length;u+=3){let[d,m,f]=[n[u],n[u+1],n[u+2]],b=s[0]*d+s[1]*m+s[2]*f,g=i[0]*d+i[1]*m+i[2]*f,R=r[0]*d+r[1]*m+r[2]*f;a[0]=Math.max(a[0],b+o*t*R),a[1]=Math.max(a[1],-b+o*t*R),a[2]=Math.max(a[2],g+o*R),a[3]=Math.max(a[3],-g+o*R),h=Math.max(h,R)}let c=Math.max((a[0]+a[1])/(2*o*t),(a[2]+a[3])/(2*o),h+.05),l=w([0,0,0],s,(a[0]-a[1])/2);return{target:w(l,i,(a[2]-a[3])/2),distance:c}}function st(n){let t=String(n).split(",").map(Number);return t.length===2&&t.every(Number.isFinite)&&Math.abs(t[1])<=90?t:null}function yt(n){let{center:t,radius:e}=n.sphere,s=n.geometries.map(({positions:a})=>a),i=new Float32Array(s.reduce((a,{length:h})=>a+h,0)),r=0,o=1/0;for(let a of s)for(let h=0;h<a.length;h++,r++)i[r]=(a[h]-t[h%3])/e;for(let a=2;a<i.length;a+=3)o=Math.min(o,i[a]);return{points:i,lowest:o}}var Tt=`#version 300 es
precision highp float;
uniform vec3 ink;
out vec4 color;
void main() {
  color = vec4(ink, 1);
}`;var x={albedo:{target:"color",isColor:!0},normal:{target:"normal"},roughness:{target:"surface",channel:1,neutral:.8},metallic:{target:"surface",channel:2,neutral:0,isSharp:!0},ao:{target:"surface",channel:0,neutral:1},height:{target:"height"},opacity:{target:"color",channel:3,isSharp:!0},emission:{target:"emission",isColor:!0}},P={};for(let[n,{target:t}]of Object.entries(x))(P[t]??=[]).push(n);var At=n=>P[n].some(t=>x[t].isColor);var S=7,C=8,St=3,Rt=S+1,Mt=[0];for(let n=1;n<2*Rt;n++)Mt.push(Mt[n-1]+Math.min(n,2*Rt-n));var nt=[-35.7,38.2],ot=[[.85,.1,.5,1.5,12],[-.75,-.55,.35,1,14],[.35,-.8,.5,.8,10]],at={light:[[.8,.81,.82],[.92,.92,.91]],dark:[[.022,.024,.027],[.05,.05,.051]]},[ht,y]=[2,64],T=Object.keys(P),v=`#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
`,L=`${v}
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.;
  gl_Position = vec4(2. * at - 1., 0, 1);
}`,ct=`
float noise() {
  return (fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(.06711056, .00583715)))) - .5) / 255.;
}
vec3 coded(vec3 c) {
  return mix(12.92 * c, 1.055 * pow(max(c, 1e-5), vec3(1. / 2.4)) - .055, step(.0031308, c)) + noise();
}`,z=`${v}
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
}`,ee=`
uniform vec3 lamps[3], key;
const vec2 LAMPS[3] = vec2[](${ot.map(([,,,n,t])=>`vec2(${n}, ${t})`).join()});
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
}`,se=`
vec3 toned(vec3 c) {
  float peak = max(c.r, max(c.g, c.b));
  if (peak < .76) return c;
  float most = 1. - .0576 / (peak - .52);
  c *= most / peak;
  return mix(vec3(most), c, 1. / (.15 * (peak - most) + 1.));
}`,ie=`
uniform sampler2D normalMap, surfaceMap, emissionMap, heightMap;
const int ${Object.keys(x).map((n,t)=>`${n.toUpperCase()} = ${t}`).join()};
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
}`,it=n=>"rgb"[x[n].channel],rt=n=>`float(${x[n].neutral})`,_t=(n,t)=>`${v}
in vec3 P, N;
in vec4 T;
in vec2 uv;
out vec4 color;
uniform sampler2D colorMap;
uniform vec3 eye;
uniform float cut;
${ct}${se}${t}${n?ie:""}
void main() {
  vec4 albedo = texture(colorMap, uv);
  if (albedo.a < cut) discard;
  float alpha = cut > 0. ? 1. : albedo.a, rough = ${rt("roughness")}, metal = ${rt("metallic")}, open = ${rt("ao")};
  vec3 v = normalize(eye - P), n = normalize(gl_FrontFacing ? N : -N), glow = vec3(0);
  ${n?`n = bent(n);
  vec3 shown = texture(surfaceMap, uv).rgb;
  if (has(AO)) open = shown.${it("ao")};
  if (has(ROUGHNESS)) rough = shown.${it("roughness")};
  if (has(METALLIC)) metal = shown.${it("metallic")};
  if (has(EMISSION)) glow = texture(emissionMap, uv).rgb;`:""}
  float facing = max(dot(n, v), 0.), x = 1. - rough, q = min(x * x, exp2(-9.28 * facing)) * x + .0425 - .0275 * rough;
  vec3 f = mix(vec3(.04), albedo.rgb, metal) * (1.04 - .572 * rough - 1.04 * q) + max(.022 * rough - .04 + 1.04 * q, 0.);
  // What any matt surface mirrors veils its colour, and is left out.
  vec3 mirror = max(f * mirrored(reflect(-v, n), rough, facing) - 0.02 * (1. - metal), 0.);
  vec3 light = albedo.rgb * (1. - metal) * open * arriving(n, facing) + open * mirror + glow;
  color = vec4(coded(toned(light)) * alpha, alpha);
}`,re=`${v}
in vec2 at;
out vec4 color;
uniform vec3 top, bottom;
${ct}
void main() {
  color = vec4(coded(mix(bottom, top, at.y)), 1);
}`,ne=`${v}
uniform mat4 camera;
uniform float floorHeight;
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = camera * vec4(${ht}. * (2. * at - 1.), floorHeight, 1);
}`,oe=`${v}
in vec2 at;
out vec4 color;
uniform sampler2D shade;
${ct}
void main() {
  vec2 rim = smoothstep(0., .2, at) * smoothstep(0., .2, 1. - at);
  float dark = .62 * texture(shade, at).r * rim.x * rim.y;
  // What is blended are coded colours, not light: hence the power.
  color = vec4(0, 0, 0, dark > 0. ? 1. - pow(1. - dark, 1. / 2.2) + noise() : 0.);
}`,ae=`${v}
uniform vec4 world;
uniform float floorHeight;
in vec3 position;
out float h;
void main() {
  vec3 P = (position - world.xyz) * world.w;
  h = clamp((P.z - floorHeight) / 2., 0., 1.);
  gl_Position = vec4(P.xy / ${ht}., 2. * h - 1., 1);
}`,he=`${v}
in float h;
out vec4 color;
void main() {
  float coarse = floor(h * 255.) / 255.;
  color = vec4(coarse, (h - coarse) * 255., 0, 1);
}`,ce=`${v}
uniform sampler2D heights;
out vec4 color;
void main() {
  const float side = ${2*ht}. / ${y}., area = side * side;
  float sum = 0.;
  for (int i = 0; i < ${y}; i++) for (int j = 0; j < ${y}; j++) {
    vec4 found = texelFetch(heights, ivec2(i, j), 0);
    vec2 apart = (vec2(i, j) + .5 - gl_FragCoord.xy) * side;
    float h = 2. * (found.r + found.g / 255.) + .02, d = dot(apart, apart) + h * h;
    sum += (1. - found.b) * h * h * area / (d * (3.14159 * d + area));
  }
  color = vec4(min(sum, 1.), 0, 0, 1);
}`,lt=(n,t="")=>({[`plain${t}`]:()=>[z,_t(!1,n)],[`full${t}`]:()=>[z,_t(!0,n)]}),kt={...lt(ee),backdrop:()=>[L,re],floor:()=>[ne,oe],height:()=>[ae,he],shade:()=>[L,ce]};var Lt=`
uniform bool isColor;
vec4 stored(vec3 c) {
  return vec4(isColor ? mix(c / 12.92, pow((c + .055) / 1.055, vec3(2.4)), step(.04045, c)) : c, 1);
}
ivec2 turned(ivec2 c, int top, ivec2 turn) {
  ivec2 n = 2 * c - top;
  return clamp((n * turn.y + ivec2(-n.y, n.x) * turn.x + 8192 * (top + 1)) >> 14, 0, top);
}`,It=`${v}
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
  uvec3 c = sampled(at, p, m, ${St});
  return ivec3(isWide ? c + 128u >> 8 : c);
}`,le=`${It}
uniform ivec2 cells;
out ivec4 tone;
void main() {
  ivec2 at = ivec2(gl_FragCoord.yx), low = max(at - ${S}, 0), high = min(at + ${S}, cells - 1);
  ivec4 head = four(9);
  int first = number(13), own = number(head.w + at.x * head.z + at.y), count = 0, covered = 0;
  int named[${C}], weights[${C}];
  for (int i = low.x; i <= high.x; i++) {
    for (int j = low.y; j <= high.y; j++) {
      int label = number(head.w + i * head.z + j), weight = (${S+1} - abs(i - at.x)) * (${S+1} - abs(j - at.y)), n = 0;
      covered += weight;
      if (label == own) continue;
      while (n < count && named[n] != label) n++;
      if (n == ${C}) continue;
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
}`,ue=`${It}
${Lt}
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
}`,fe=`${v}
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
}`,de=`${v}
${Lt}
uniform sampler2D lines;
flat in ivec2 from;
flat in ivec2 turn;
out vec4 color;
void main() {
  vec3 c = texelFetch(lines, from, 0).rgb;
  c.xy = vec2(turned(ivec2(c.xy * 255. + .5), 255, turn)) / 255.;
  color = stored(c);
}`,ut={tones:()=>[L,le],chart:()=>[L,ue],gutter:()=>[fe,de]};var $=class{#t;#e;#i;#s=new Map;#r;#o=[];constructor(t,e,s){this.#t=t,this.#e=e,e.add(ut),this.#i=s,this.#r=t.createFramebuffer()}ready(){return this.#e.ready(...Object.keys(ut))}paint({charts:t}){let e=new Set,s=t.flatMap(({textures:i})=>Object.entries(i).filter(([,r])=>r.recipe));for(let[i,r]of s){let o=this.#i.target(r,i);o&&(this.#a(r,i,o),e.add(r))}if(!e.size)return!1;for(let[i,r]of s){let o=this.#i.known(r),a=e.has(r);for(let{chart:h,points:c,height:l,width:u}of r.recipe.gutters){let d=t[h].textures[i];!(d?.recipe&&d.height===l+2&&d.width===u+2)||!(e.has(r)||e.has(d))||(this.#c(r,i,o,c,this.#i.known(d).lines),a=!0)}a&&this.#i.finish(o)}return!0}sweep(t){let e=t.flatMap(({charts:i})=>i.flatMap(({textures:r})=>Object.values(r))),s=new Set(e.flatMap(({recipe:i,sheets:r})=>i?[i,...Object.values(r),...i.gutters.map(({points:o})=>o)]:[]));for(let[i,{texture:r,array:o,buffer:a}]of this.#s)s.has(i)||(r&&this.#t.deleteTexture(r),o&&this.#t.deleteVertexArray(o),a&&this.#t.deleteBuffer(a),this.#s.delete(i))}#a({recipe:t,sheets:e,height:s,width:i},r,o){let a=this.#t,h=Math.max(s,i)-2;o.length!==h&&(a.deleteTexture(o.lines),o.lines=this.#m(a.TEXTURE_2D),a.texImage2D(a.TEXTURE_2D,0,a.RGBA8,h,4,0,a.RGBA,a.UNSIGNED_BYTE,null),o.length=h);let{texture:c}=this.#l(t,()=>this.#f(t.numbers));a.disable(a.BLEND);let l=Object.values(e).map((d,m)=>this.#n(t,c,d,r,m)),u=this.#e.use("chart");a.uniform2i(u.size,s-2,i-2),a.uniform1i(u.isNormal,r==="normal"),this.#u(0,a.TEXTURE_2D,c,u.numbers);for(let d of[0,1]){this.#g(d?o.lines:o.texture,d?h:i,d?4:s),a.uniform1i(u.isLines,d),a.uniform1i(u.isColor,!d&&o.isColor),a.clearColor(1,1,1,1),a.clear(a.COLOR_BUFFER_BIT);for(let[m,[f,b]]of Object.entries(e).entries())this.#h(b,u),this.#u(2,a.TEXTURE_2D,l[m],u.tones),a.uniform1i(u.isSharp,!!x[f].isSharp),a.colorMask(...[0,1,2].map(g=>(x[f].channel??g)===g),!0),a.drawArrays(a.TRIANGLE_STRIP,0,4);a.colorMask(!0,!0,!0,!0)}}#n({numbers:t},e,s,i,r){let o=this.#t,[a,h]=[t[8],t[8]&&t[11]],c=this.#o[r]??={texture:this.#m(o.TEXTURE_2D),size:""},l=[Math.max(h,1),Math.max(a,1)];if(c.size!==`${l}`&&(this.#u(0,o.TEXTURE_2D,c.texture),o.texImage2D(o.TEXTURE_2D,0,o.RGBA32I,...l,0,o.RGBA_INTEGER,o.INT,null),c.size=`${l}`),!a)return c.texture;let u=this.#e.use("tones");return this.#g(c.texture,...l),o.uniform2i(u.cells,a,h),o.uniform1i(u.isNormal,i==="normal"),this.#u(0,o.TEXTURE_2D,e,u.numbers),this.#h(s,u),o.drawArrays(o.TRIANGLE_STRIP,0,4),c.texture}#h(t,e){let s=this.#t;this.#u(1,s.TEXTURE_2D_ARRAY,this.#l(t,()=>this.#p(t)).texture,e.sheet),s.uniform2i(e.sheetSize,...t.size),s.uniform1i(e.isWide,t.data instanceof Uint16Array)}#c({height:t,width:e},s,i,r,o){let a=this.#t,{array:h}=this.#l(r,()=>this.#d(r));this.#g(i.texture,e,t);let c=this.#e.use("gutter");a.uniform2i(c.size,t,e),a.uniform1i(c.isColor,i.isColor),this.#u(0,a.TEXTURE_2D,o,c.lines),a.bindVertexArray(h),a.drawArrays(a.POINTS,0,r.length/6),a.bindVertexArray(null)}#l(t,e){return this.#s.has(t)||this.#s.set(t,e()),this.#s.get(t)}#f(t){let e=this.#t,s=this.#m(e.TEXTURE_2D);return e.texImage2D(e.TEXTURE_2D,0,e.R32I,4096,t.length/4096,0,e.RED_INTEGER,e.INT,t),{texture:s}}#p({data:t,width:e,height:s,count:i}){let r=this.#t,o=this.#m(r.TEXTURE_2D_ARRAY),[a,h]=t instanceof Uint16Array?[r.RGBA16UI,r.UNSIGNED_SHORT]:[r.RGBA8UI,r.UNSIGNED_BYTE];return r.texImage3D(r.TEXTURE_2D_ARRAY,0,a,e,s,i,0,r.RGBA_INTEGER,h,t),{texture:o}}#d(t){let e=this.#t,s=e.createVertexArray(),i=e.createBuffer();e.bindVertexArray(s),e.bindBuffer(e.ARRAY_BUFFER,i),e.bufferData(e.ARRAY_BUFFER,t,e.STATIC_DRAW);for(let[r,o]of[4,2].entries())e.enableVertexAttribArray(r),e.vertexAttribPointer(r,o,e.FLOAT,!1,24,16*r);return e.bindVertexArray(null),{array:s,buffer:i}}#m(t){let e=this.#t,s=e.createTexture();this.#u(0,t,s);for(let i of[e.TEXTURE_MIN_FILTER,e.TEXTURE_MAG_FILTER])e.texParameteri(t,i,e.NEAREST);return s}#u(t,e,s,i){let r=this.#t;r.activeTexture(r.TEXTURE0+t),r.bindTexture(e,s),i&&r.uniform1i(i,t)}#g(t,e,s){let i=this.#t;if(i.bindFramebuffer(i.FRAMEBUFFER,this.#r),i.framebufferTexture2D(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0,i.TEXTURE_2D,t,0),i.checkFramebufferStatus(i.FRAMEBUFFER)!==i.FRAMEBUFFER_COMPLETE&&!i.isContextLost())throw new Error("the card can not paint");i.viewport(0,0,e,s)}};var me=["position","normal","tangent","parameter"],B=class{#t;#e;#i=new Map;#s={...kt};constructor(t){this.#t=t,this.#e=t.getExtension("KHR_parallel_shader_compile")}add(t){Object.assign(this.#s,t)}ready(...t){for(let e of t)this.#i.has(e)||this.#i.set(e,this.#r(e));return this.#e?t.every(e=>this.#t.getProgramParameter(this.#i.get(e).program,this.#e.COMPLETION_STATUS_KHR)):!0}use(t){this.ready(t);let e=this.#i.get(t);return this.#t.useProgram(e.program),e.uniforms??=this.#o(e.program),e.uniforms}#r(t){let e=this.#t,s=e.createProgram();return this.#s[t]().forEach((i,r)=>{let o=e.createShader(r?e.FRAGMENT_SHADER:e.VERTEX_SHADER);e.shaderSource(o,i),e.compileShader(o),e.attachShader(s,o)}),me.forEach((i,r)=>e.bindAttribLocation(s,r,i)),e.linkProgram(s),{program:s}}#o(t){let e=this.#t;if(!e.getProgramParameter(t,e.LINK_STATUS)&&!e.isContextLost())throw new Error(e.getProgramInfoLog(t));let s={};for(let i=e.getProgramParameter(t,e.ACTIVE_UNIFORMS)-1;i>=0;i--){let{name:r}=e.getActiveUniform(t,i);s[r.replace("[0]","")]=e.getUniformLocation(t,r)}return T.forEach((i,r)=>s[`${i}Map`]&&e.uniform1i(s[`${i}Map`],r)),s.sky&&e.uniform1i(s.sky,T.length),s}};var[pe,ge]=[45,22],ve=.35,xe=/swiftshader|llvmpipe|softpipe|software|basic render/i,H=class{quality=1;isSoftware;#t=0;#e=0;constructor(t){let e=t.getExtension("WEBGL_debug_renderer_info");this.isSoftware=xe.test(t.getParameter(e?.UNMASKED_RENDERER_WEBGL??t.RENDERER)),this.isSoftware&&(this.quality=.4)}addFrame(t){this.#t=t>pe?this.#t+1:0,this.#e=t<ge?this.#e+1:0,this.#t>=2?this.#i(this.quality*.71):this.#e>=30&&this.#i(this.quality*1.41)}#i(t){this.quality=Math.min(Math.max(t,ve),1),this.#t=this.#e=0}};var be=8,we=8,Ee=[["positions",3],["normals",3],["tangents",4],["parameters",2]],G=class{#t;#e=new Map;#i=new Map;#s=new Map;#r;#o;constructor(t){this.#t=t,this.#r=t.getExtension("EXT_texture_filter_anisotropic"),this.#o=this.color([1,1,1])}upload(t){let e=performance.now()+we;for(let{charts:s,geometries:i}of t){for(let r of i)if(!this.#e.has(r)){if(performance.now()>e)return!1;this.bind(r)}for(let{textures:r}of s)for(let[o,a]of T.entries())if(!(!r[a]?.data||this.known(r[a]).version===r[a].version)){if(performance.now()>e)return!1;this.texture(o,r[a])}}return!0}bind(t,e=null){let s=this.#e.get(t);s||this.#e.set(t,s={arrays:new Map,buffers:[]}),s.arrays.has(e)||s.arrays.set(e,this.#n(e?e(t):t,s.buffers));let{array:i,count:r}=s.arrays.get(e);return this.#t.bindVertexArray(i),r}texture(t,e){if(!e)return this.#a({texture:this.#o},t);let s=this.known(e);this.#a(s,t),e.data&&s.version!==e.version&&this.#h(s,e,T[t])}known({key:t}){return this.#i.has(t)||this.#i.set(t,{texture:this.#t.createTexture(),version:0,width:0,height:0,lines:null}),this.#i.get(t)}target(t,e){let s=this.known(t);return s.version===t.version?null:(this.#a(s),this.#c(s,t,e),s.version=t.version,s)}finish(t){this.#a(t),this.#t.generateMipmap(this.#t.TEXTURE_2D)}#a({texture:t},e=0){this.#t.activeTexture(this.#t.TEXTURE0+e),this.#t.bindTexture(this.#t.TEXTURE_2D,t)}color(t){let e=this.#t,s=e.createTexture();e.bindTexture(e.TEXTURE_2D,s);let i=new Uint8Array([...t.map(r=>Math.round(255*r)),255]);return e.texImage2D(e.TEXTURE_2D,0,e.SRGB8_ALPHA8,1,1,0,e.RGBA,e.UNSIGNED_BYTE,i),e.texParameteri(e.TEXTURE_2D,e.TEXTURE_MIN_FILTER,e.LINEAR),s}sweep(t){let e=new Set(t.flatMap(s=>ye(s)));for(let[s,i]of this.#i)e.has(s)||(this.#t.deleteTexture(i.texture),this.#t.deleteTexture(i.lines),this.#i.delete(s));for(let[s,{arrays:i,buffers:r}]of this.#e)if(!e.has(s)){for(let{array:o}of i.values())this.#t.deleteVertexArray(o);for(let o of r)this.#t.deleteBuffer(o);this.#e.delete(s)}}#n(t,e){let s=this.#t,i=s.createVertexArray();s.bindVertexArray(i);let r=(a,h)=>{let c=s.createBuffer();e.push(c),s.bindBuffer(a,c),s.bufferData(a,h,s.STATIC_DRAW)},o=(a,h,c)=>{r(s.ARRAY_BUFFER,h),s.enableVertexAttribArray(a),s.vertexAttribPointer(a,c,s.FLOAT,!1,0,0)};return Ee.forEach(([a,h],c)=>t[a]&&o(c,t[a],h)),r(s.ELEMENT_ARRAY_BUFFER,Uint32Array.from(t.indices)),{array:i,count:t.indices.length}}#h(t,e,s){let i=this.#t;this.#c(t,e,s),i.texSubImage2D(i.TEXTURE_2D,0,0,0,t.width,t.height,i.RGBA,i.UNSIGNED_BYTE,e.data),i.generateMipmap(i.TEXTURE_2D),t.version=e.version}#c(t,{width:e,height:s},i){if(t.width===e&&t.height===s)return;let r=this.#t,o=At(i);r.texImage2D(r.TEXTURE_2D,0,o?r.SRGB8_ALPHA8:r.RGBA8,e,s,0,r.RGBA,r.UNSIGNED_BYTE,null);for(let h of[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T])r.texParameteri(r.TEXTURE_2D,h,r.CLAMP_TO_EDGE);r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MIN_FILTER,r.LINEAR_MIPMAP_LINEAR);let a=this.#r;a&&r.texParameterf(r.TEXTURE_2D,a.TEXTURE_MAX_ANISOTROPY_EXT,be),Object.assign(t,{width:e,height:s,isColor:o})}};function ye({charts:n,geometries:t,overlays:e=[]}){let s=n.flatMap(i=>Object.values(i.textures).map(r=>r.key));return[...t,...e.map(({geometry:i})=>i),...s]}var I=6,Te=null,_=class n extends EventTarget{canvas=new OffscreenCanvas(1,1);models=new Set;#t;#e;#i;#s;#r=new Map;#o=null;static get shared(){return Te??=new n}constructor(){super();let t=this.canvas.getContext("webgl2",{powerPreference:"high-performance"});if(!t)throw new Error("there is no WebGL2");this.#t=t,this.quality=new H(t),this.#a(),this.canvas.addEventListener("webglcontextlost",e=>{e.preventDefault(),this.dispatchEvent(new Event("lost"))}),this.canvas.addEventListener("webglcontextrestored",()=>{this.#a(),this.dispatchEvent(new Event("restored"))})}#a(){this.#e=new B(this.#t),this.#i=new G(this.#t),this.#s=new $(this.#t,this.#e,this.#i),this.#r.clear(),this.#o=null,this.#e.ready("plain","backdrop","floor","height","shade")}get isLost(){return this.#t.isContextLost()}paints(t){let e=t==="card"||t!=="worker"&&!this.quality.isSoftware;return e&&this.#s.ready(),e}isBusy(t,e){let s=this.#t;this.#o&&s.getSyncParameter(this.#o,s.SYNC_STATUS)!==s.UNSIGNALED&&(s.deleteSync(this.#o),this.#o=null);let i=t.flatMap(ft),r=i.map(o=>this.#l(o,e));return i.some(o=>o.onPage&&!this.#s.ready())||this.#o!==null||!this.#e.ready("backdrop","floor","height","shade",...r)?!0:!this.#i.upload(i)}warm(){if(this.isBusy([],null)||!this.#e.ready("plain"))return!1;let t=new Uint8Array(4),e={positions:new Float32Array(9),normals:new Float32Array(9),tangents:new Float32Array(12),parameters:new Float32Array(6),indices:new Uint16Array([0,1,2])},r={charts:[{geometry:e,textures:{color:{key:t,data:t,width:1,height:1,version:1}}}],geometries:[e],roles:[],alpha:"opaque",sphere:{center:[0,0,0],radius:1},plain:null},o={eye:[0,0,9],right:[1,0,0],up:[0,1,0],backward:[0,0,1],matrix:new Float32Array(16)};return this.draw([1,1],[{model:r,viewport:[0,0,1,1]}],{camera:o,light:[0,0],background:null,floor:-1,environment:null}),this.#r.delete(r),this.#i.sweep([...this.models]),!0}draw([t,e],s,i){let r=this.#t,{canvas:o}=this;(o.width!==t||o.height!==e)&&Object.assign(o,{width:t,height:e});for(let{model:a}of s)for(let h of ft(a))this.#n(h);for(let{model:a}of s)i.floor!==null&&this.#w(a,i.floor);r.bindFramebuffer(r.FRAMEBUFFER,null),r.enable(r.SCISSOR_TEST);for(let{model:a,viewport:h,clip:c=h}of s){r.viewport(...h),r.scissor(...c),r.clearColor(0,0,0,0),r.clear(r.COLOR_BUFFER_BIT|r.DEPTH_BUFFER_BIT),r.disable(r.DEPTH_TEST),i.background&&this.#h(i.background),r.enable(r.DEPTH_TEST);for(let l of ft(a))this.#c(l,i);i.floor!==null&&this.#b(a,i)}r.disable(r.SCISSOR_TEST),this.#o&&r.deleteSync(this.#o),this.#o=r.fenceSync(r.SYNC_GPU_COMMANDS_COMPLETE,0),r.flush()}finish(){this.#t.readPixels(0,0,1,1,this.#t.RGBA,this.#t.UNSIGNED_BYTE,new Uint8Array(4))}sweep(){this.#i.sweep([...this.models]),this.#s.sweep([...this.models]);for(let[t,{texture:e}]of this.#r)this.models.has(t)||(this.#t.deleteTexture(e),this.#r.delete(t))}#n(t){try{t.onPage&&this.#s.paint(t)&&this.#s.sweep([...this.models,t])}catch{t.paintInWorker()}}#h([t,e]){let s=this.#t,i=this.#e.use("backdrop");s.uniform3fv(i.top,t),s.uniform3fv(i.bottom,e),s.disable(s.BLEND),s.drawArrays(s.TRIANGLE_STRIP,0,4)}#c(t,e){let s=this.#t,{camera:i,environment:r}=e,{edges:o,borders:a,ink:h}=t.lines??{},c=o?this.#m(t.lines.shader,t,i,t.mean):this.#e.use(this.#l(t,r));o||this.#g(c,t,e);let l=t.alpha==="blend";s[l?"enable":"disable"](s.BLEND),s.blendFunc(s.ONE,s.ONE_MINUS_SRC_ALPHA);for(let u of l?[s.FRONT,s.BACK]:[null]){s[u?"enable":"disable"](s.CULL_FACE),u&&s.cullFace(u);for(let d of t.charts)this.#f(t,d,c)}if(s.disable(s.CULL_FACE),t.plain&&this.#p(t,c),a){this.#m(t.lines.shader,t,i,h);for(let{geometry:u}of t.charts)u&&this.#d(u,a)}for(let{geometry:u,shader:d,ink:m}of t.overlays??[])this.#m(d,t,i,m),this.#d(u,Ae)}#l({roles:t},e){let s=t.some(i=>x[i]?.target!=="color");return e&&this.#e.add(lt(e.light,"Picture")),`${s?"full":"plain"}${e?"Picture":""}`}#f(t,{geometry:e,textures:s},i){if(!e)return;let r=this.#t;T.forEach((h,c)=>this.#i.texture(c,s[h]));let{width:o,height:a}=s.color??{};s.color?r.uniform4f(i.place,1-2/o,1-2/a,1/o,1/a):r.uniform4f(i.place,1,1,0,0),i.maps&&r.uniform1i(i.maps,Re(t,s)),this.#d(e,t.lines?.edges)}#p(t,e){let s=this.#t;T.forEach((r,o)=>this.#i.texture(o,null)),s.activeTexture(s.TEXTURE0);let i=this.#i.color(t.mean);e.maps&&s.uniform1i(e.maps,0),this.#d(t.plain,t.lines?.edges),s.deleteTexture(i)}#d(t,e){let s=this.#t,i=this.#i.bind(t,e);s.drawElements(e?s.LINES:s.TRIANGLES,i,s.UNSIGNED_INT,0)}#m(t,e,s,i){this.#e.add({lines:()=>[z,t]});let r=this.#e.use("lines");return this.#u(r,e,s),this.#t.uniform3fv(r.ink,i),r}#u(t,{sphere:{center:e,radius:s}},i){i&&this.#t.uniformMatrix4fv(t.camera,!1,i.matrix),this.#t.uniform4f(t.world,...e,1/s)}#g(t,e,{camera:s,light:i,environment:r}){let o=this.#t;if(this.#u(t,e,s),o.uniform3fv(t.eye,s.eye),o.uniform1f(t.cut,e.alpha==="mask"?.5:0),t.bump&&o.uniform1f(t.bump,.01),r){o.uniform3fv(t.harmonics,r.harmonics),o.activeTexture(o.TEXTURE0+T.length),o.bindTexture(o.TEXTURE_CUBE_MAP,r.textureOf(o));return}o.uniform3fv(t.lamps,Me(s)),o.uniform3fv(t.key,Se(s,i))}#b(t,{camera:e,floor:s}){let i=this.#t;if(e.eye[2]<s)return;let r=this.#e.use("floor");i.uniformMatrix4fv(r.camera,!1,e.matrix),i.uniform1f(r.floorHeight,s),i.activeTexture(i.TEXTURE0+I),i.bindTexture(i.TEXTURE_2D,this.#r.get(t).texture),i.uniform1i(r.shade,I),i.enable(i.BLEND),i.blendFuncSeparate(i.SRC_ALPHA,i.ONE_MINUS_SRC_ALPHA,i.ONE,i.ONE_MINUS_SRC_ALPHA),i.depthMask(!1),i.drawArrays(i.TRIANGLE_STRIP,0,4),i.depthMask(!0)}#w(t,e){let s=t.geometries.length,i=this.#r.get(t);if(i&&i.floor===e&&i.key===s)return;let r=this.#t;r.disable(r.BLEND),r.disable(r.CULL_FACE);let o=this.#v(h=>{this.#u(h,t,null),r.uniform1f(h.floorHeight,e),r.enable(r.DEPTH_TEST);for(let c of t.geometries)this.#d(c,!1)},"height"),a=this.#v(h=>{r.disable(r.DEPTH_TEST),r.activeTexture(r.TEXTURE0+I),r.bindTexture(r.TEXTURE_2D,o),r.uniform1i(h.heights,I),r.drawArrays(r.TRIANGLE_STRIP,0,4)},"shade");r.deleteTexture(o),i&&r.deleteTexture(i.texture),this.#r.set(t,{texture:a,floor:e,key:s})}#v(t,e){let s=this.#t,i=s.createTexture(),r=s.createRenderbuffer(),o=s.createFramebuffer();s.activeTexture(s.TEXTURE0+I),s.bindTexture(s.TEXTURE_2D,i),s.texStorage2D(s.TEXTURE_2D,1,s.RGBA8,y,y),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_MIN_FILTER,s.LINEAR);for(let a of[s.TEXTURE_WRAP_S,s.TEXTURE_WRAP_T])s.texParameteri(s.TEXTURE_2D,a,s.CLAMP_TO_EDGE);return s.bindRenderbuffer(s.RENDERBUFFER,r),s.renderbufferStorage(s.RENDERBUFFER,s.DEPTH_COMPONENT16,y,y),s.bindFramebuffer(s.FRAMEBUFFER,o),s.framebufferTexture2D(s.FRAMEBUFFER,s.COLOR_ATTACHMENT0,s.TEXTURE_2D,i,0),s.framebufferRenderbuffer(s.FRAMEBUFFER,s.DEPTH_ATTACHMENT,s.RENDERBUFFER,r),s.viewport(0,0,y,y),s.clearColor(1,1,1,1),s.clear(s.COLOR_BUFFER_BIT|s.DEPTH_BUFFER_BIT),t(this.#e.use(e)),s.deleteFramebuffer(o),s.deleteRenderbuffer(r),i}},Ae=n=>n,ft=n=>n.parts??[n];function Re({roles:n},t){return Object.entries(x).reduce((e,[s,{target:i}],r)=>e|(t[i]&&n.includes(s)?1<<r:0),0)}function Me({right:n}){let t=[n[1],-n[0],0];return ot.flatMap(([e,s,i])=>{let r=Math.hypot(e,s,i);return w(w([0,0,i/r],n,e/r),t,s/r)})}function Se({right:n,up:t,backward:e},s){let[i,r]=s.map(A),o=Math.cos(r),a=[Math.sin(i)*o,Math.sin(r),Math.cos(i)*o];return[0,1,2].map(h=>Et(a,[n[h],t[h],e[h]]))}var k=class extends Error{};async function Ft(n,t,e,s=null){let i=null;for(let r=0;!t.signal.aborted;){let o=t.received,a=s;s=null;try{let h=await _e(n,t,e,i,r,a);if(i=h.version,a&&h.isPart){await t.running;continue}t.end();return}catch(h){if(t.signal.aborted)return;if(h instanceof k)throw h;if(a&&!t.received)continue;if(r=t.received>o?1:r+1,!(t.received||h.answered)||r>8)throw new Error(`${n} can not be loaded: ${h.message}`);i=o?i??h.version:h.version,t.dispatchEvent({type:"stalled",attempt:r,message:h.message}),await Le(Math.min(8e3,125*2**r),t.signal)}}}async function _e(n,t,{headers:e,...s},i,r,o){let a=t.received,h=new AbortController,c=()=>h.abort();t.signal.addEventListener("abort",c);let l=setTimeout(c,2e4),u=i,d=r>0;try{let m=new Headers(e);a&&(m.set("Range",`bytes=${a}-`),i&&new URL(n,location).origin===location.origin&&m.set("If-Range",i));let f=await(o??fetch(n,{...s,headers:m,signal:h.signal}));if(a&&f.status===416)return{version:i};if(f.status>=500||f.status===429)throw new Error(`the server says ${f.status}`);if(!f.ok)throw new k(`${n} can not be loaded: the server says ${f.status}`);if(d=!0,u=ke(f.headers.get("ETag"))??f.headers.get("Last-Modified"),a&&i&&u&&u!==i)throw new k(`${n} has changed on the server`);let b=a&&f.status!==206?a:0,g=/^bytes (\d+)-(\d+)\/(.*)/.exec(f.headers.get("Content-Range")??""),R=g!==null&&!(Number(g[2])+1>=Number(g[3]));if(f.status===206&&g&&Number(g[1])!==a)throw new k(`${n} comes from a wrong place`);r&&t.dispatchEvent({type:"resumed"});let Jt=f.body.getReader();for(;;){let{done:te,value:D}=await Jt.read();if(te)return{version:u,isPart:R};clearTimeout(l),l=setTimeout(c,2e4);let U=Math.min(b,D.length);b-=U,U<D.length&&t.feed(U?D.slice(U):D)}}catch(m){throw Object.assign(h.signal.aborted?new Error("nothing comes any more"):m,{version:u,answered:d})}finally{clearTimeout(l),t.signal.removeEventListener("abort",c)}}function ke(n){return n?.startsWith('"')?n:null}function Le(n,t){return new Promise(e=>{setTimeout(e,n),globalThis.addEventListener?.("online",e,{once:!0}),t.addEventListener("abort",e,{once:!0})})}var Ie=["progress","refine","geometry","error"],X=class extends EventTarget{sphere={center:[0,0,0],radius:1};constructor(t){super(),this.parts=t;for(let e of t){for(let s of Ie)e.addEventListener(s,i=>this.#i(s,i.detail));for(let s of["surface","first"])e.addEventListener(s,()=>this.first&&this.#t(s));e.addEventListener("complete",()=>this.complete&&this.#i("complete",{}))}}get first(){return this.parts.every(t=>t.first)}get complete(){return this.parts.every(t=>t.complete)}get received(){return this.#e("received")}get total(){return this.parts.some(t=>t.total===null)?null:this.#e("total")}get texels(){return this.#e("texels")}get quads(){return this.#e("quads")}get charts(){return this.parts.flatMap(t=>t.charts)}get geometries(){return this.parts.flatMap(t=>t.geometries)}get roles(){return[...new Set(this.parts.flatMap(t=>t.roles))]}get shown(){return{bytes:this.#e("received"),coefficients:1,placements:1}}measure(...t){for(let e of this.parts)e.measure(...t)}async settled(){await Promise.all(this.parts.map(t=>t.settled()))}dispose(){for(let t of this.parts)t.dispose()}#t(t){let e=this.sphere;this.sphere=Fe(this.parts.map(s=>s.sphere));for(let s of this.parts)s.sphere=this.sphere;this.#i(t,{before:e})}#e(t){return this.parts.reduce((e,s)=>e+(s[t]??0),0)}#i(t,e){this.dispatchEvent(Object.assign(new Event(t),e,{detail:e}))}};function Fe(n){let t=o=>[0,1,2].map(a=>Math.max(...n.map(({center:h,radius:c})=>o*h[a]+c))),[e,s]=[t(1),t(-1)],i=e.map((o,a)=>(o-s[a])/2),r=o=>Math.hypot(...i.map((a,h)=>a-o.center[h]))+o.radius;return{center:i,radius:Math.max(...n.map(r))||1}}var Oe=globalThis.requestAnimationFrame?.bind(globalThis)??(n=>setTimeout(n,16)),W=class{received=0;total=null;complete=!1;first=!1;#t;#e;#i=new AbortController;#s=[];#r=[];#o=!1;#a=!1;#n=0;#h=null;#c=null;#l=[];#f=!1;#p=!1;#d;#m=new Promise(t=>this.#d=t);#u=0;constructor(t,e,s){this.#t=t,this.#e=s,this.running=new Promise(i=>{t.onmessage=({data:r})=>{i(),this.#g(r)}}),t.onerror=i=>this.fail(new Error(i.message||"the worker uph-worker.js does not start")),t.postMessage({kind:"open",...e})}get signal(){return this.#i.signal}feed(t){this.signal.aborted||(this.#s.push(t),this.received+=t.length,this.send({kind:"feed",bytes:t}),this.#e.notify("progress",{received:this.received,total:this.total,loaded:this.received}))}end(){this.#f=!0,this.send({kind:"end"})}fail(t){this.#p=!0,this.#e.notify("error",{error:t})}dispatchEvent({type:t,...e}){this.#e.notify(t,e)}bytes(){let t=new Uint8Array(this.received),e=0;for(let s of this.#s)t.set(s,e),e+=s.length;return t}send(t){this.#t.postMessage({...t,ticket:++this.#n})}async setExemplar(t){let e=++this.#u,s=await this.#m,i=t===null?null:await(await import("./uph-picture.js")).readPicture(t,s);e===this.#u&&(this.send({kind:"exemplar",picture:i}),await this.settled())}settled(){return new Promise(t=>{this.#l.push(t),this.#T()})}abort(){this.#i.abort()}dispose(){this.abort(),this.#t.terminate(),this.#r=[],this.#a=!1}#g(t){t.kind==="surface"?(this.#a=!0,this.#d(t.exemplar),this.#e.begin(t)):t.kind==="meshes"?this.#e.takeMeshes(t):t.kind==="textures"?(this.#r.push(...t.entries),this.#h=this.#c=t.state,this.#b()):t.kind==="state"?(this.#h=t.state,this.total=t.state.total,this.#T()):t.kind==="error"?this.fail(Object.assign(new Error(t.message),{offset:t.offset})):this.fail(new Error(`uph-worker.js sent a message of unknown kind ${t.kind}`))}#b(){this.#o||(this.#o=!0,Oe(()=>{this.#o=!1,this.#a&&this.#w()}))}#w(){let t=[],e=0;for(;this.#r.length&&e<2097152;){let s=this.#r.shift(),i=this.#e.takeTexture(s);i&&t.push(i),s.height&&(e+=s.height*s.width)}if(this.#r.length){this.first&&this.#e.notify("refine",{}),this.#b();return}this.total=this.#c.total,this.#t.postMessage({kind:"shown",buffers:t},t),(this.first||this.#c.placements||this.#c.isBase)&&this.#v()}#v(){let t=!this.first;this.first=!0,this.#e.show(this.#c,t)}#T(){let t=this.#h;if(!(!t?.idle||t.ticket!==this.#n||this.#r.length)){if(this.#f&&this.#c&&!this.first&&this.#v(),this.#f&&!this.complete&&!this.#p)if(this.received===this.total)this.complete=!0,this.#e.notify("complete",{});else{let e=this.total?` of ${this.total.toLocaleString("en")}`:"";this.fail(new Error(`the stream is cut: ${this.received.toLocaleString("en")}${e} bytes have come`))}for(let e of this.#l.splice(0))e()}}};function Ot(n,{height:t,width:e},s){let i=4*(e+2);n.set(s.subarray(0,i),0),n.set(s.subarray(i,2*i),(t+1)*i);for(let r=0,o=2*i;r<t;r++,o+=4){let a=(r+1)*i;for(let h=0;h<4;h++)n[a+i-4+h]=s[o+h],n[a+h]=s[o+4*t+h]}}var Ne=256;function dt({bendS:n,bendT:t},e,s){return[n,t].map(i=>{let r=Math.log2(Math.sqrt(i*e/(4*s))||1);return 2**Math.ceil(Math.min(Math.max(r,0),Math.log2(Ne)))})}var De=120,Ue=2**19,Pe=1.1,j=class{counts=null;leastPerUnit=0;#t;#e;#i;#s=!1;#r;#o=null;#a=0;constructor(t,e,s,i){this.#t=t,this.#e=e,this.#i=new Float32Array(t.length).fill(s),this.#r=i}measure(t,e){this.counts&&(this.#o||(this.#o=this.counts.slice(),setTimeout(()=>this.#h(),this.#a+De-performance.now())),this.#n(t,e))}askForLeast(){this.#o??=this.counts.slice();for(let t of this.#t.keys())this.#n(t,0);this.#h()}#n(t,e){let s=dt(this.#t[t],Math.max(e,this.leastPerUnit),this.#e);for(let i=0;i<2;i++){let r=this.counts[2*t+i];(s[i]>r||s[i]<r/2)&&(this.#o[2*t+i]=s[i])}e<=Pe*this.#i[t]||(this.#i[t]=e,this.#s=!0)}#h(){let t=this.#o;if(!t)return;this.#o=null,this.#a=performance.now(),this.#s&&this.#r({kind:"pixels",perUnit:this.#i}),this.#s=!1;let e=()=>t.reduce((s,i,r)=>r%2?s+i*t[r-1]:s,0);for(;e()>Ue&&t.some(s=>s>1);)t.forEach((s,i)=>t[i]=Math.max(1,s>>1));t.every((s,i)=>s===this.counts[i])||(this.counts=t,this.#r({kind:"counts",counts:t}))}};var O={maxTextureSize:4096,maxTexels:2**26,errorPixels:.4},Nt=0,F=class extends EventTarget{charts=[];#t={};plain=null;metres=null;mean=[.5,.5,.5];texels=0;shown={bytes:0,coefficients:0,placements:0};roles=[];alpha="opaque";sphere={center:[0,0,0],radius:1};lines=null;#e;#i=null;#s=null;#r;#o=null;#a;constructor(t,{eye:e,pixels:s=1/0,onPage:i,...r}={}){super(),this.onPage=i,this.#r=s;let o={begin:c=>this.#h(c),takeMeshes:c=>this.#l(c),takeTexture:c=>this.#f(c),show:(c,l)=>this.#p(c,l),notify:(c,l)=>this.#n(c,l)},{errorPixels:a,...h}={...O,...r};this.#a=a,this.#e=new W(t,{...h,eye:e,pixels:s,onPage:i,sketches:262144},o)}get client(){return this.#e}get received(){return this.#e.received}get total(){return this.#e.total}get complete(){return this.#e.complete}get first(){return this.#e.first}get geometries(){return[...this.charts.map(({geometry:t})=>t),this.plain].filter(Boolean)}get quads(){return Math.round(this.charts.reduce((t,{geometry:e})=>t+(e?.indices.length??0),0)/6)}setLimit(t){this.#e.send({kind:"limit",...t})}setExemplar(t){return this.#e.setExemplar(t)}settled(){return this.#e.settled()}bytes(){return this.#e.bytes()}abort(){this.#e.abort()}paintInWorker(){this.onPage=!1,this.isBare=!0;for(let t of[...this.charts,...this.#c])t.textures={};this.#e.send({kind:"paint"})}measure(t,e,s){this.#o=({center:i,radius:r})=>e/Math.max(Math.hypot(...i.map((o,a)=>o-t[a]))-r,s),this.charts.forEach(({bounds:i},r)=>this.measureChart(r,this.#o(i)))}measureChart(t,e){this.#i||this.#s?.measure(t,e)}async refineTo(t){let e=this.#s;e.leastPerUnit=t,e.askForLeast(),await this.settled(),e.leastPerUnit=0}dispose(){this.#e.dispose(),this.#s=null}#n(t,e={}){this.dispatchEvent(Object.assign(new Event(t),e,{detail:e}))}#h({bounds:t,sphere:e,plain:s,metres:i}){let r=t.map(o=>({bounds:o,geometry:null,textures:{}}));this.#i={charts:r,plain:s,metres:i,sphere:e},this.#s=new j(t,this.#a,this.#r/e.radius,o=>this.#e.send(o))}get#c(){return(this.#i??this).charts}#l({pieces:t,counts:e}){this.#s.counts||(this.#s.counts=e,this.#o&&this.#c.forEach(({bounds:s},i)=>this.#s.measure(i,this.#o(s))));for(let{chart:s,...i}of t)this.#c[s].geometry=i;this.#i||this.#n("geometry")}#f({chart:t,target:e,height:s,width:i,data:r,gutter:o,role:a,sheet:h,recipe:c,roles:l,...u}){if(h?this.#t[a]={data:r,height:s,width:i,...u}:c&&(this.#c[t].recipe={...c,numbers:r}),h||c||!(r||this.onPage))return null;let{textures:d}=this.#c[t],m=d[e];if(o)return Ot(m.data,{height:m.height-2,width:m.width-2},r),m.version=++Nt,null;let f={key:m?.key??{},width:i+2,height:s+2,version:++Nt},b=r?{data:r}:{recipe:this.#c[t].recipe,sheets:Object.fromEntries(l.map(g=>[g,this.#t[g]]))};return d[e]={...f,...b},this.isBare&&=!r,m?.data?.buffer??null}#p({bytes:t,coefficients:e,placements:s,roles:i,alpha:r="opaque",mean:o,texels:a},h){let c=this.sphere,l=this.#i;this.#i=null,Object.assign(this,{roles:i,alpha:r,mean:o,texels:a,shown:{bytes:t,coefficients:e,placements:s}},l),l&&this.#n("surface",{before:c}),this.#n(h?"first":"refine")}};var mt={texels:268435456,samples:128e5,charts:262144,triangles:1048576};var ei=2**16;var ze={samples:[2**16,1],charts:[2**12,256],triangles:[2**12,8]},$e=2**31;function Dt({texels:n=mt.texels,...t}={}){let e={texels:n};for(let[s,[i,r]]of Object.entries(ze))e[s]=t[s]??Math.min(mt[s],Math.max(i,Math.floor(n/r))),delete t[s];for(let s of Object.keys(t))throw new RangeError(`limit ${s} is unknown; allowed: ${Object.keys(e)}`);for(let[s,i]of Object.entries(e)){let r=s==="texels"?$e:mt[s];if(!(Number.isInteger(i)&&i>=1&&i<=r))throw new RangeError(`limit of ${s} is ${i}; allowed: 1 to ${r}`)}return e}var Be={"":1,k:1e3,m:1e6,g:1e9};function Pt({limit:n,maxtexels:t}){let e=Ut("limit",n),s=Ut("maxtexels",t)??O.maxTexels;if(s<1||s>O.maxTexels)throw new RangeError(`maxtexels is ${t}; allowed: 1 to ${O.maxTexels}`);return{limits:Dt({texels:e}),maxTexels:s}}function Ut(n,t){if(t===null)return;let[,e,s]=/^([0-9]{1,10}(?:\.[0-9]{1,6})?)([kmg]?)$/i.exec(t.trim())??[];if(!e)throw new RangeError(`${n} is "${t}"; allowed: a number such as 500k or 4M`);return Math.floor(e*Be[s.toLowerCase()])}function N(n){if(n<1e3)return`${n} B`;let[t,e]=n<999500?[n/1e3,"kB"]:[n/1e6,"MB"];return`${t<9.95?t.toFixed(1).replace(".0",""):Math.round(t)} ${e}`}var He="The picture shows what was loaded before.",Ge={401:["can not be read.","The server asks for a login."],403:["can not be read.","The server refuses access."],404:["was not found.","Check the address."],410:["is no longer there.","Check the address."]},Xe=/number of (texels|samples|charts|triangles) is \d+; allowed: 1 to/;function Ct(n,{shown:t,received:e,total:s,name:i}){let r=n.message,o=(h,c)=>({title:h,advice:t?He:c,detail:r});if(r.startsWith("the stream is cut"))return{title:`${i} ends after ${N(e)}${s===null?"":` of ${N(s)}`}.`,advice:t?"The picture shows all that it holds; the rest is missing.":"That is too little for a picture.",detail:""};if(/^(limit|maxtexels) /.test(r))return o(`${i} was not loaded: an attribute of this element is wrong.`,"");if(Number.isInteger(n.offset))return Xe.test(r)?o(`${i} is larger than this page allows.`,""):!t&&n.offset<8?o(`${i} is no .uph stream.`,"Check the address, or the server that answers."):o(`${i} is damaged after ${N(n.offset)}.`,"Nothing can be shown. Write or download the file again.");let a=Number(/the server says (\d+)/.exec(r)?.[1]??0);if(a){let[h,c]=Ge[a]??["could not be fetched.","The server failed. Try again in a while."];return o(`${i} ${h}`,c)}return r.includes("changed on the server")?o(`${i} was replaced while it was loading.`,"Load it again."):r.includes("can not be loaded")?t?o("The connection was lost.",""):o(`${i} could not be fetched.`,"You may be offline, or its server does not let this page read it (CORS)."):o("Something went wrong.","Nothing can be shown.")}var q=new Set,zt=n=>[...q].filter(t=>t.address===n).sort((t,e)=>t.places.size-e.places.size),We=n=>n?new Worker(n,{type:"module"}):new Worker(new URL("./uph-worker.js",import.meta.url),{type:"module"});function pt(n,t=We(n)){let e={address:n,worker:t,places:new Set};return t.onerror=s=>{q.delete(e);for(let i of e.places)i.onerror(s)},q.add(e),e}function $t(n){zt(n)[0]||pt(n)}function je(n,t){let e=zt(n),s=e.length>=3||e[0]?.places.size===0?e[0]:null;return e.find(({places:i})=>i.has(t))??s}function gt(n,t=null){let e=globalThis.upholsterEarly;e?.worker&&!n&&(pt(n,e.worker),e.worker=null);let s=je(n,t)??pt(n),{port1:i,port2:r}=new MessageChannel;return s.worker.postMessage({kind:"join",port:r},[r]),s.places.add(i),i.terminate=()=>{i.postMessage({kind:"close"}),i.close(),s.places.delete(i),!s.places.size&&(s.worker.terminate(),q.delete(s))},i}function Bt(n){let t=globalThis.upholsterEarly;if(!t?.response||new URL(t.url,location).href!==new URL(n,location).href)return null;let{response:e}=t;return t.response=null,e}var qe=["progress","surface","first","refine","geometry","complete","stalled","resumed","error"],V=class{other=null;limit=null;problem=null;stalled=!1;firstTime=null;completeTime=null;changes=0;#t;#e={};#i=null;#s=performance.now();constructor(t,e,s,i,r,o=null){this.#t=e;try{this.#e={onPage:s.onPage,...Pt(i)}}catch(l){this.#i=l}let a=Array.isArray(t)?t:[t];this.name=typeof a[0]=="string"?Ye(a[0]):a[0].name,this.failed=new Promise(l=>this.fail=l),this.places=Ve(a,e,o);let h=this.places.map(l=>new F(l,{...s,...this.#e})),c=this.model=h.length>1?new X(h):h[0];for(let l of qe)c.addEventListener(l,u=>{(l==="surface"||l==="first"||l==="refine"||l==="geometry")&&this.changes++,(l==="stalled"||l==="progress"||l==="resumed")&&(this.stalled=l==="stalled"),!(l==="error"&&!this.#o(u.error))&&r(l,u)});this.received=Promise.all(a.map((l,u)=>this.#r(l,h[u].client)))}get loading(){return!this.problem&&!this.model.complete}get time(){return performance.now()-this.#s}setLimit(t){this.limit=t,this.model.setLimit(t)}compare(){return this.other=new F(gt(this.#t),this.#e),Ht(this.other.client,this.model.bytes()),this.other}settled(){let t=[this.model,this.other].filter(Boolean).map(e=>e.settled());return Promise.race([Promise.all(t),this.model.first?Promise.all(t):this.failed])}dispose(){this.fail(),this.model.dispose(),this.other?.dispose()}async#r(t,e){await null;try{if(this.#i)throw this.#i;typeof t=="string"?await Ft(t,e,{credentials:"same-origin"},Bt(t)):Ht(e,new Uint8Array(await t.arrayBuffer()))}catch(s){e.signal.aborted||e.fail(s)}}#o(t){if(this.problem)return!1;let{first:e,received:s,total:i}=this.model;return this.stalled=!1,this.problem=Ct(t,{shown:e,received:s,total:i,name:this.name||"This"}),this.fail(),!0}};function Ve(n,t,e){return n.map((s,i)=>gt(t,e?.places[i]))}function Ye(n){let t=n.split(/[?#]/)[0].split("/").at(-1);try{return decodeURIComponent(t)||n}catch{return t}}function Ht(n,t){n.feed(t),n.end()}var[Ke,Ze]=[.02,25],[Gt,Qe,Je]=[290,7.2,8],ts=4,es=.0016,ss=new Float32Array([-1,-1,-1,1,1,1]),Y=(n,t,e)=>Math.min(Math.max(n,t),e);function is(n,t){return Math.hypot(...n.center.map((s,i)=>s-t.center[i]))<Math.min(n.radius,t.radius)&&Math.max(n.radius/t.radius,t.radius/n.radius)<ts}var K=class{onchange=()=>{};touched=!1;enabled=!1;dragRotates=!0;zoomToPointer=!0;damping=!0;#t;#e=ss;#i;#s=1;#r;#o;#a;#n=[0,0];#h=!1;#c=new Map;constructor(t,e,s){this.#t=t,this.#i=e,this.#l();let i=(r,o)=>t.addEventListener(r,o,{signal:s});i("pointerdown",r=>this.#u(r)),i("pointermove",r=>this.#b(r)),i("pointercancel",r=>this.#g(r));for(let r of["pointerup","lostpointercapture"])i(r,({pointerId:o})=>this.#c.delete(o));i("contextmenu",r=>r.preventDefault()),t.addEventListener("wheel",r=>this.#v(r),{signal:s,passive:!1})}set autorotate(t){this.#h=t,this.onchange()}set points(t){this.#e=t,this.touched||this.#l()}set aspect(t){let e=this.#s;if(t===e)return;if(this.#s=t,!this.touched)return this.#l();let s=i=>et(this.#e,i,this.#o).distance;this.#a*=s(t)/s(e)}get view(){return[((this.#o[0]+180)%360+360)%360-180,this.#o[1]]}set view(t){this.#i=t,this.reset()}reset(){this.touched=!1,this.#l(),this.onchange()}keep(t,e){if(!this.touched||!is(t,e))return;let s=t.radius/e.radius;this.#r=this.#r.map((i,r)=>s*i+(t.center[r]-e.center[r])/e.radius),this.#a*=s}turn(t,e){this.#f(),this.#p(-t,e)}zoom(t,e=[0,0]){this.#f();let s=this.#a;this.#a=Y(s/t,Ke,Ze),this.zoomToPointer&&this.#d(e[0]*(s-this.#a),e[1]*(s-this.#a)),this.onchange()}update(t){if(!this.enabled)return;this.#h&&this.#p(-Qe*t,0);let[e,s]=this.#n;if(this.#c.size||Math.hypot(e,s)<1)return;this.#p(e*t,s*t);let i=Math.exp(-Je*t);this.#n=[e*i,s*i]}camera(){let[t,e,s]=M(this.#o),i=w(this.#r,s,this.#a),r=Math.hypot(...i)+9,o=Math.max(Math.hypot(...i)-1.05,.004),[a,h]=[1/(E*this.#s),1/E],[c,l]=[(o+r)/(r-o),-2*o*r/(r-o)],u=f=>-(f[0]*i[0]+f[1]*i[1]+f[2]*i[2]),d=f=>[a*t[f],h*e[f],-c*s[f],-s[f]],m=[a*u(t),h*u(e),-c*u(s)+l,-u(s)];return{eye:i,right:t,up:e,backward:s,near:o,matrix:[...d(0),...d(1),...d(2),...m]}}#l(){Object.assign(this,{touched:!1});let{target:t,distance:e}=et(this.#e,this.#s,this.#i);this.#r=t,this.#a=e,this.#o=[...this.#i],this.#n=[0,0],this.onchange()}#f(){this.touched=!0,this.#h=!1,this.#n=[0,0]}#p(t,e){this.#o=[this.#o[0]+t,Y(this.#o[1]+e,-89.9,89.9)],this.onchange()}#d(t,e){let[s,i]=M(this.#o);this.#r=w(w(this.#r,s,t*E),i,e*E)}#m({clientX:t,clientY:e}){let{left:s,top:i,width:r,height:o}=this.#t.getBoundingClientRect();return[(2*(t-s)-r)/o,(o-2*(e-i))/o]}#u(t){this.enabled&&(this.#t.setPointerCapture(t.pointerId),this.#c.set(t.pointerId,{place:this.#m(t),time:t.timeStamp,angles:[...this.#o]}),this.#f(),this.onchange())}#g({pointerId:t}){let e=this.#c.get(t);!e||!this.#c.delete(t)||(this.#o=e.angles,this.#n=[0,0],this.onchange())}#b(t){let e=this.#c.get(t.pointerId);if(!e)return;let s=this.#m(t),[i,r]=[s[0]-e.place[0],s[1]-e.place[1]],o=Math.max(t.timeStamp-e.time,1)/1e3,a=[...this.#c].filter(([h])=>h!==t.pointerId).map(([,{place:h}])=>h);if(Object.assign(e,{place:s,time:t.timeStamp}),a.length)this.#w(a[0],s,[i,r]);else if(t.buttons>1||t.ctrlKey||t.metaKey)this.#d(-i*this.#a,-r*this.#a);else if(this.dragRotates){let[h,c]=[-i*Gt/2,-r*Gt/2];this.#p(h,c),this.damping&&(this.#n=[h/o,c/o].map(l=>Y(l,-400,400)))}this.onchange()}#w(t,e,[s,i]){let r=Math.hypot(e[0]-t[0],e[1]-t[1]),o=Math.hypot(e[0]-s-t[0],e[1]-i-t[1]);this.#d(-s/2*this.#a,-i/2*this.#a),o>0&&this.zoom(r/o,[(e[0]+t[0])/2,(e[1]+t[1])/2])}#v(t){if(!this.enabled)return;t.preventDefault();let e=t.deltaY*[1,16,400][t.deltaMode];this.zoom(Math.exp(-es*Y(t.ctrlKey?4*e:e,-400,400)),this.#m(t))}};function Xt(n){if(document.fullscreenElement)return!1;for(let t=n;t;t=t.assignedSlot??t.parentNode??t.host)if(t instanceof Element&&t.scrollHeight>t.clientHeight+1&&rs(t))return!0;return!1}function rs(n){let{overflowY:t}=getComputedStyle(n);if(n!==document.scrollingElement)return/auto|scroll/.test(t);let{body:e}=document,s=t==="visible"&&e&&e!==n?getComputedStyle(e).overflowY:t;return!/hidden|clip/.test(s)}function Wt(n,t){let e=({ctrlKey:i,metaKey:r})=>i||r||n.matches(":focus")||!Xt(n);n.addEventListener("wheel",i=>e(i)||i.stopImmediatePropagation(),{capture:!0,signal:t}),n.style.touchAction="pan-y";let s=!1;n.addEventListener("touchstart",()=>s=!Xt(n),{passive:!0,signal:t}),n.addEventListener("touchmove",i=>s&&i.cancelable&&i.preventDefault(),{passive:!1,signal:t})}var ns=2,vt=150,os=4e3,as="50%",Z=class{onlost=()=>{};onseen=()=>{};#t;#e;#i;#s;#r=[];#o=null;#a=[1,1];#n=[0,0];#h=0;#c=0;#l=0;#f=!1;#p=[];#d=at.light;#m=null;#u=[...nt];#g=null;#b;#w=new AbortController;constructor(t,e){this.#t=t,this.#e=_.shared,this.canvas=document.createElement("canvas"),this.canvas.className="empty",this.#i=this.canvas.getContext("bitmaprenderer");let{signal:s}=this.#w;Wt(this.canvas,s),this.#s=new K(this.canvas,e,s),this.#s.onchange=()=>this.invalidate(),t.append(this.canvas),this.#O(),this.#x(s)}show(...t){let e=t[0]!==this.#r[0];e&&t[0]&&this.#r[0]&&this.#s.keep(this.#r[0].sphere,t[0].sphere);for(let s of this.#r)this.#e.models.delete(s);for(let s of t)this.#e.models.add(s);this.#r=t,this.#e.sweep(),this.#s.enabled=t.length>0,this.#s.zoomToPointer=!this.split,this.canvas.classList.toggle("empty",!t.length),t.length?e&&this.#I():this.#m=null,this.#s.aspect=this.#_,this.invalidate()}get split(){return this.#r.length>1&&this.#o===null}set wipe(t){this.#o=t,this.invalidate()}get stacked(){return this.#a[0]<this.#a[1]}refresh({shape:t=!1,before:e=null}={}){let[s]=this.#r;s&&(e&&this.#s.keep(e,s.sphere),t&&(this.#s.touched||this.#I(),this.#e.sweep()),this.invalidate())}setBackground(t,e){this.#d=t==="none"?null:(t&&hs(t))??at[e?"dark":"light"],this.#t.style.background=t??"",this.invalidate()}set environment(t){this.#g=t,this.invalidate()}get view(){return this.#s.view}set view(t){this.#s.view=t}reset(){this.#s.reset()}turn(t,e){this.#s.turn(t,e)}zoom(t){this.#s.zoom(t)}set autorotate(t){this.#s.autorotate=t}set reducedMotion(t){this.#s.damping=!t}get light(){return[...this.#u]}set light(t){let[e,s]=t??nt,i=((e+180)%360+360)%360-180;this.#u=[i,Math.min(Math.max(s,-90),90)],this.invalidate()}set dragRotates(t){this.#s.dragRotates=t}get pixels(){let{eye:t,near:e}=this.#s.camera();return this.#y(0,this.#E(1))[3]/2/E/Math.max(Math.hypot(...t)-1,e)}ray(t,e){let[s]=this.#r;if(!s)return null;let{eye:i,right:r,up:o,backward:a}=this.#s.camera(),[h,c]=this.#a,[l,u]=[(2*t/h-1)*E*(h/c),(1-2*e/c)*E],{center:d,radius:m}=s.sphere;return{origin:d.map((f,b)=>f+m*i[b]),direction:[0,1,2].map(f=>l*r[f]+u*o[f]-a[f])}}get isLost(){return this.#e.isLost}invalidate(){this.#h||!this.#f||!this.#r.length||(this.#h=requestAnimationFrame(t=>this.#v(t)))}drawn(){return!this.#f||document.hidden||!this.#r.length?Promise.resolve():(this.invalidate(),new Promise(t=>this.#p.push(t)))}async refine(t){this.#L(t,0,this.#s.camera()),await new Promise(e=>setTimeout(e)),await t.settled()}async settle(){for(let t=0;t<2;t++)await this.drawn(),await new Promise(e=>setTimeout(e,vt));this.#A()}precompile(){!this.#r.length&&!this.#e.warm()&&setTimeout(()=>this.precompile(),20)}picture(){return this.#S(this.#E(1)),this.#e.canvas.convertToBlob({type:"image/png"})}finish(){this.#A(),this.#e.finish()}dispose(){this.show(),cancelAnimationFrame(this.#h),clearTimeout(this.#c),this.#w.abort();for(let t of this.#b)t.disconnect();this.canvas.remove(),this.#T()}#v(t){if(this.#h=0,this.isLost)return;if(this.#e.isBusy(this.#r,this.#g))return this.invalidate();let{quality:e}=this.#e,s=this.#l?Math.min((t-this.#l)/1e3,.1):1/60;this.#s.update(s),this.#h&&this.#l&&e.addFrame(t-this.#l),this.#l=this.#h?t:0,this.#A(this.#E(this.#h||!this.#k?e.quality:1)),this.#T(),clearTimeout(this.#c),this.#h||(this.#c=setTimeout(()=>this.#R(),this.#M?os:vt))}#T(){for(let t of this.#p.splice(0))t()}#R(){let t=this.#E(1);this.#h||!this.#f||document.hidden||t.every((e,s)=>e===this.#n[s])||(this.#e.isBusy(this.#r,this.#g)?this.#c=setTimeout(()=>this.#R(),vt/10):this.#A())}get#M(){return this.#r.some(t=>t.received<t.total)}get#k(){return this.#r.every(({shown:t})=>t.coefficients===1)}#E(t){let e=t*Math.min(devicePixelRatio,ns);return this.#a.map(s=>Math.max(1,Math.round(s*e)))}#A(t=this.#E(1)){!this.#r.length||this.isLost||(this.#S(t),this.#n=t,this.#i.transferFromImageBitmap(this.#e.canvas.transferToImageBitmap()))}#S(t){let e=this.#s.camera(),s=this.#r.map((i,r)=>({model:i,viewport:this.#y(r,t),clip:this.#N(r,t)}));this.#r.forEach((i,r)=>this.#L(i,r,e)),this.#e.draw(t,s,{camera:e,light:this.#u,background:this.#d,floor:this.#m,environment:this.#g})}#L(t,e,{eye:s,near:i}){let{center:r,radius:o}=t.sphere,[,,,a]=this.#y(e,this.#E(1));t.measure(w(r,s,o),a/2/E,i*o)}#N(t,[e,s]){if(this.#r.length<2||this.#o===null)return;let i=Math.round(this.#o*e);return t?[i,0,e-i,s]:[0,0,i,s]}#y(t,[e,s]){if(!this.split)return[0,0,e,s];let i=this.stacked?s>>1:e>>1;return this.stacked?[0,t?0:s-i,e,i]:[t?e-i:0,0,i,s]}get#_(){let[,,t,e]=this.#y(0,this.#a);return t/e}#I(){let{points:t,lowest:e}=yt(this.#r[0]);t.length&&(this.#s.points=t),this.#m=t.length?e-.002:null}#x(t){let e=new ResizeObserver(()=>this.#O()),s=new IntersectionObserver(r=>this.#F(r.at(-1).isIntersecting),{rootMargin:as});e.observe(this.#t),s.observe(this.#t),this.#b=[e,s],this.canvas.addEventListener("dblclick",()=>this.reset(),{signal:t});let i=()=>{this.invalidate(),this.onlost()};for(let r of["lost","restored"])this.#e.addEventListener(r,i,{signal:t})}#F(t){this.#f=t;for(let e of this.#r)this.#e.models[t?"add":"delete"](e);t?(this.onseen(),this.invalidate()):(this.#e.sweep(),this.#T())}#O(){this.#a=[Math.max(this.#t.clientWidth,1),Math.max(this.#t.clientHeight,1)],this.#s.aspect=this.#_,this.invalidate()}};function hs(n){let t=new OffscreenCanvas(1,1).getContext("2d");t.fillStyle="transparent",t.fillStyle=n,t.fillRect(0,0,1,1);let[e,s,i,r]=t.getImageData(0,0,1,1).data;if(r<255)return null;let o=[e,s,i].map(a=>a<=10?a/3294.6:((a/255+.055)/1.055)**2.4);return[o,o]}var cs=`
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
`;function ls(n){let t;return()=>(t||(t=new CSSStyleSheet,t.replaceSync(n)),t)}var jt=ls(cs);var qt="http://www.w3.org/2000/svg";function p(n,t={},...e){let s=document.createElement(n);for(let[i,r]of Object.entries(t))typeof r=="function"?s.addEventListener(i,r):r!==null&&r!==!1&&s.setAttribute(i,r===!0?"":r);return s.append(...e),s}function us(n){let t=document.createElementNS(qt,"svg"),e=document.createElementNS(qt,"path");return t.setAttribute("viewBox","0 0 24 24"),t.setAttribute("aria-hidden","true"),e.setAttribute("d",n),t.append(e),t}function Vt(n,t,e,s,i,{toggle:r=!1}={}){let o=s?`${e} (${s})`:e,a=s?{"aria-keyshortcuts":s}:{},h=r?{"aria-pressed":"false"}:{},c=`button ${n}`;return p("button",{type:"button",class:"icon",part:c,title:o,"aria-label":e,...a,...h,click:i},us(t))}var Yt=64,fs="M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",Q=class{stage=p("div",{class:"stage",part:"stage"},p("slot",{name:"poster"}));above;corner;element;#t;#e=new xt;#i=p("div",{class:"line",part:"progress",hidden:!0},p("i"));#s=p("div",{class:"hidden",role:"status"});constructor(t,{act:e,key:s,retry:i}){this.#t=Vt("fullscreen",fs,"Full screen","F",()=>e("fullscreen"),{toggle:!0}),this.#t.hidden=!document.fullscreenEnabled,this.#e.onretry=i,this.corner=p("div",{class:"corner",part:"corner"},this.#t),this.above=p("div",{class:"above"},this.#i,this.#e.element,this.corner);let r=p("div",{class:"stack"},this.stage,this.above);this.element=p("div",{class:"viewer",keydown:s},r,this.#s),t.append(this.element)}set controls(t){this.corner.hidden=!t}set fullscreen(t){this.#t.setAttribute("aria-pressed",String(t))}say(t){this.#s.textContent=t}fail(t,e,{alt:s,children:i}){this.#e.show({title:t,advice:e,detail:s,middle:!i.length}),this.controls=!1}update(t,e,s,i){let r=!!t?.loading,o=!!t?.model.first;this.#i.hidden=!r;let{received:a,total:h}=t?.model??{};this.#i.firstChild.style.scale=`${(Yt*a/h|0)/Yt} 1`,i?this.#e.show({title:"The graphics card was reset.",advice:"The picture comes back when it is ready."}):t?.problem?this.#e.show({...t.problem,middle:!o,retry:!0}):t?.stalled?this.#e.show({title:"Connection lost, trying again\u2026"}):this.#e.hide();let l=`${s}${o?"":r?", loading":", no picture"}. Arrow keys turn it, plus and minus zoom.`;e.ariaLabel!==l&&(e.ariaLabel=l)}},xt=class{onretry=()=>{};#t=p("p",{class:"title"});#e=p("p");#i=p("p",{class:"detail"});#s=p("button",{type:"button",class:"main",part:"button",click:()=>this.onretry()},"Try again");element=p("div",{class:"note",part:"note",hidden:!0},this.#t,this.#e,this.#i,this.#s);show({title:t,advice:e="",detail:s="",middle:i=!1,retry:r=!1}){for(let[o,a]of[[this.#t,t],[this.#e,e],[this.#i,s]])o.textContent=a,o.hidden=!a;this.#s.hidden=!r,this.element.classList.toggle("middle",i),this.element.hidden=!1}hide(){this.element.hidden=!0}};var ds=[30,30],J=7.5,Kt=1.15,ms={ArrowLeft:"left",ArrowRight:"right",ArrowUp:"up",ArrowDown:"down","+":"nearer","=":"nearer","-":"farther",0:"reset",f:"fullscreen"},{HTMLElement:ps=Object,customElements:bt,matchMedia:Qt}=globalThis,Zt=Qt?.("(prefers-color-scheme: dark)"),tt=Qt?.("(prefers-reduced-motion: reduce)"),wt=class extends ps{static observedAttributes=["src","alt","exemplar","view","background","environment","controls","autorotate"];#t;#e=null;#i=null;#s=null;#r=null;#o=null;#a=new Map;#n=null;#h=null;#c=null;#l=0;#f=!1;constructor(){super();let t=this.attachShadow({mode:"open",delegatesFocus:!0});t.adoptedStyleSheets=[jt()],this.#t=new Q(t,{act:e=>this.#F(e),key:e=>this.#O(e),retry:()=>this.open(this.#e)})}open(t){let e=t instanceof Blob||t instanceof ArrayBuffer||ArrayBuffer.isView(t);if(!e&&t!==null&&typeof t!="string")throw new TypeError(`stream is ${t}; allowed: an address, Blob, ArrayBuffer or view of one, null`);this.#S(),this.#e=e?new File([t],t.name??""):t,this.isConnected&&t!==null&&this.#R()}async replace(...t){if(!this.#n)throw new Error("the viewer is in no page, or has no WebGL2");let e=this.#r,s=this.#r=this.#k(e??this.#s,t);if(e?.dispose(),await s.received,await s.settled(),s===this.#r&&!s.problem&&await Promise.race([this.#n.refine(s.model),s.failed]),s!==this.#r)return!1;if(this.#r=null,s.problem)throw s.dispose(),new Error(`${s.problem.title} ${s.problem.advice??""}`);return this.#s?.dispose(),this.#s=s,this.#e=new File([t[0]],""),this.#M(),this.#A(),this.#x(),await this.#n.drawn(),s===this.#s}get src(){return this.getAttribute("src")}set src(t){t==null?this.removeAttribute("src"):this.setAttribute("src",t)}get alt(){return this.getAttribute("alt")??""}set alt(t){this.setAttribute("alt",t)}get model(){return this.#s?.model??null}get view(){return this.#n?.view??this.#i??this.#p}set view(t){let e=st(t);if(!e)throw new RangeError(`view is ${t}; allowed: azimuth and elevation in degrees, elevation from -90 to 90`);this.#i=e,this.#n&&(this.#n.view=e)}async picture(){if(!this.#n)throw new Error("there is no picture");return this.#n.picture()}async compare(...t){if(this.#o?.dispose(),this.#o=null,!t.length)return this.#M();let e=this.#o=this.#k(this.#s,t);await e.received,await e.settled(),e===this.#o&&this.#M()}set wipe(t){this.#n&&(this.#n.wipe=t)}ray(t,e){return this.model&&this.#n?this.#n.ray(t,e):null}overlay(t,e,s=[.13,.4,1]){if(e){let i=Float32Array.from(e),r=Uint32Array.from({length:i.length/3},(o,a)=>a);this.#a.set(t,{geometry:{positions:i,indices:r},shader:Tt,ink:s})}else this.#a.delete(t);this.#A()}async settled(){for(let t=0;t<2;){let e=this.#s;if(!e)return;let{changes:s}=e;await e.settled(),await this.#n?.settle(),t=e===this.#s&&e.changes===s?t+1:0}}get fullscreen(){return this.matches(":fullscreen")}set fullscreen(t){if(t===this.fullscreen)return;(t?this.requestFullscreen():document.exitFullscreen()).catch(()=>this.#t.say("Full screen is not allowed here."))}connectedCallback(){if(this.#n)return;this.#e??=this.getAttribute("src");try{this.#n=new Z(this.#t.stage,this.view)}catch(e){setTimeout(()=>this.#m(e));return}this.#c=new AbortController;let{signal:t}=this.#c;for(let e of[Zt,tt])e.addEventListener("change",()=>this.#u(),{signal:t});document.addEventListener("fullscreenchange",()=>this.#t.fullscreen=this.fullscreen,{signal:t}),Object.assign(this.#n.canvas,{tabIndex:0,part:"canvas",role:"application",ariaRoleDescription:"3D model"}),this.#n.onlost=()=>this.#x(),this.#n.onseen=()=>this.#T(),this.#u(),this.#g(),this.#w(),this.#e===null&&$t(this.getAttribute("worker")),this.#x(),requestAnimationFrame(()=>this.#n?.precompile())}disconnectedCallback(){queueMicrotask(()=>{this.isConnected||!this.#n||(this.#S(),this.#c.abort(),this.#n.dispose(),this.#n=null,this.#h?.dispose(),this.#h=null,this.#f=!1)})}attributeChangedCallback(t,e,s){!this.#n||e===s||(t==="src"?this.open(s):t==="view"?this.view=this.#p:t==="autorotate"?this.#g():t==="environment"?this.#w():t==="exemplar"?this.#v():this.#u())}get#p(){return st(this.getAttribute("view")??"")??ds}get#d(){return this.getAttribute("controls")!=="none"}#m(t){let e="This browser can not show 3D models.",s="It has no WebGL2, or WebGL2 is switched off.";this.#t.fail(e,s,this),this.#y(e,t,s)}#u(){this.#t.controls=this.#d,this.#n.setBackground(this.getAttribute("background"),Zt.matches),this.#n.reducedMotion=tt.matches,tt.matches&&this.#g(),this.#b(),this.#x()}#g(){this.#n.autorotate=this.hasAttribute("autorotate")&&!tt.matches}async#b(){let t=this.getAttribute("controls")==="lab";if(t!==(this.#h!==null)){if(!t){this.#h.dispose(),this.#h=null;return}try{let{Lab:e}=await import("./upholster-lab.js");if(this.#h||!this.#n||this.getAttribute("controls")!=="lab")return;this.#h=new e({ui:this.#t,stage:this.#n,viewer:this,session:()=>this.#s,refresh:()=>this.#x()}),this.#x()}catch{this.#t.say("The laboratory, upholster-lab.js, can not be loaded.")}}}async#w(){let t=this.getAttribute("environment");try{let e=t?await(await import("./upholster-environment.js")).loadEnvironment(t):null;this.#n&&t===this.getAttribute("environment")&&(this.#n.environment=e)}catch(e){this.#y(`environment ${t} can not be loaded`,e)}}async#v(){let t=this.getAttribute("exemplar"),{model:e}=this;try{let s=t&&await fetch(t);if(s&&!s.ok)throw new Error(`the server says ${s.status}`);let i=s?await s.blob():null;e&&e===this.model&&t===this.getAttribute("exemplar")&&await e.setExemplar(i)}catch(s){this.#y(`exemplar ${t} can not be shown: ${s.message}`,s)}}#T(){this.#f=!0,!this.#s&&this.#e!==null&&this.#R()}#R(){!this.#n||!(this.#f||typeof this.#e!="string")||(this.#s=this.#E(this.#e),this.hasAttribute("exemplar")&&this.#v(),this.#x())}#M(){let t=[this.#s,this.#o].map(e=>e?.model).filter(e=>e?.first);this.#n?.show(...t)}#k(t,e){let s=e.map(i=>new File([i],""));return this.#E(s.length>1?s:s[0],{before:t,whole:!0})}#E(t,{before:e=null,whole:s=!1}={}){let i=null,r=_.shared.paints(this.getAttribute("painting")),o={eye:M(this.view)[2],pixels:this.#n.pixels,onPage:r,whole:s},a=(c,l)=>{i&&i===this.#s&&this.#L(c,l)},h={limit:this.getAttribute("limit"),maxtexels:this.getAttribute("maxtexels")};return i=new V(t,this.getAttribute("worker"),o,h,a,e),i}#A(){let{model:t}=this;if(t){for(let e of new Set([t,t.parts?.[0]??t]))e.overlays=[...this.#a.values()];this.#n?.invalidate()}}#S(){this.#n?.show();for(let t of[this.#s,this.#r,this.#o])t?.dispose();this.#s=this.#r=this.#o=null,this.#x()}#L(t,e){let s=this.#s,i=this.#n;t==="first"&&(i.show(s.model),this.#A()),t==="refine"&&i.refresh(),(t==="surface"||t==="geometry")&&i.refresh({shape:!0,before:e.before}),this.#x(),(t==="first"||t==="refine"||t==="complete")&&this.#N(s,t),t==="error"&&this.#y(s.problem.title,e.error,s.problem.advice)}async#N(t,e){if(await this.#n.drawn(),t!==this.#s||t.model.isBare&&e!=="complete")return;let{time:s,firstTime:i}=t;e==="refine"&&!i&&(e="first"),e==="first"?t.firstTime=s:e==="complete"&&(t.completeTime=s,this.#t.say(`Loaded: ${N(t.model.received)}.`)),this.#x(),this.#_(e,{...t.model.shown,milliseconds:s})}#y(t,e,s=""){this.#t.say(`${t} ${s}`),this.#_("error",{message:t,error:e})}#_(t,e){this.dispatchEvent(new CustomEvent(t,{detail:e}))}get#I(){return this.alt||this.#s?.name.replace(/\.uph$/,"")||(this.#s?"3D model":"No model")}#x(){this.#l||=requestAnimationFrame(()=>{this.#l=0,this.#n&&(this.#t.update(this.#s,this.#n.canvas,this.#I,this.#n.isLost),this.#h?.update(this.#s))})}#F(t){let e=this.#n;e&&(t==="left"||t==="right"?e.turn(t==="left"?J:-J,0):t==="up"||t==="down"?e.turn(0,t==="up"?J:-J):t==="nearer"||t==="farther"?e.zoom(t==="nearer"?Kt:1/Kt):t==="reset"?e.reset():this.fullscreen=!this.fullscreen)}#O(t){if(t.ctrlKey||t.metaKey||t.altKey||t.defaultPrevented||t.target.matches("input")&&/^(Arrow|Home|End|Page)/.test(t.key))return;let e=t.key.length===1?t.key.toLowerCase():t.key,s=ms[e];if(s&&(this.#d||s!=="fullscreen"))this.#F(s);else if(!this.#h?.key(e))return;t.preventDefault()}};bt&&!bt.get("upholster-viewer")&&bt.define("upholster-viewer",wt);export{wt as UpholsterViewer};
