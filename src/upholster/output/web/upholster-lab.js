/*! upholster, SPDX-License-Identifier: MIT, see LICENSES.txt */
var T="http://www.w3.org/2000/svg";function a(n,t={},...e){let i=document.createElement(n);for(let[o,r]of Object.entries(t))typeof r=="function"?i.addEventListener(o,r):r!==null&&r!==!1&&i.setAttribute(o,r===!0?"":r);return i.append(...e),i}function F(n){let t=document.createElementNS(T,"svg"),e=document.createElementNS(T,"path");return t.setAttribute("viewBox","0 0 24 24"),t.setAttribute("aria-hidden","true"),e.setAttribute("d",n),t.append(e),t}function E(n,t,e,i,o,{toggle:r=!1}={}){let s=i?`${e} (${i})`:e,l=i?{"aria-keyshortcuts":i}:{},c=r?{"aria-pressed":"false"}:{},p=`button ${n}`;return a("button",{type:"button",class:"icon",part:p,title:s,"aria-label":e,...l,...c,click:o},F(t))}var I={reset:"M4.6 14.5a8 8 0 1 0 1.6-8.1L3.8 8.8M3.8 4v4.8h4.8",light:"M12 8a4 4 0 1 0 0 8a4 4 0 0 0 0-8M12 2.6v2M12 19.4v2M2.6 12h2M19.4 12h2M5.4 5.4l1.4 1.4M17.2 17.2l1.4 1.4M5.4 18.6l1.4-1.4M17.2 6.8l1.4-1.4",wireframe:"M3.5 19.5L12 4.5l8.5 15zM7.75 12h8.5L12 19.5z",borders:"M4 4.5h16v15H4zM4 13.5h9.5M13.5 4.5v15",split:"M3.5 5h17v14h-17zM12 3v18",picture:"M3.5 8H7l2-2.8h6L17 8h3.5v11h-17zM12 10a3.2 3.2 0 1 0 0 6.4a3.2 3.2 0 0 0 0-6.4",numbers:"M4 20h16M7 16.5v-5M12 16.5V4.5M17 16.5V9",help:"M9 9.2a3 3 0 1 1 4.4 2.7c-1 .6-1.4 1.2-1.4 2.6M12 18v.2",close:"M6 6l12 12M18 6L6 18"};function m(n,...t){return E(n,I[n],...t)}var M=n=>n.toLocaleString("en");function f(n){if(n<1e3)return`${n} B`;let[t,e]=n<999500?[n/1e3,"kB"]:[n/1e6,"MB"];return`${t<9.95?t.toFixed(1).replace(".0",""):Math.round(t)} ${e}`}function h(n){let t=100*n;return t>0&&t<1?"under 1 %":`${t<100?Math.min(Math.round(t),99):100} %`}function k(n){return n<995?`${Math.round(n)} ms`:`${(n/1e3).toFixed(n<9950?1:0)} s`}var H=[[["\u2190 \u2191 \u2192 \u2193"],"turn"],[["+","\u2212"],"nearer, farther"],[["0"],"show the whole model; also a double click"],[["L"],"drag to move the light; also drag with Shift"],[["W"],"wireframe"],[["B"],"borders of the charts"],[["S"],"compare with full quality"],[["P"],"save a picture"],[["I"],"numbers"],[["F"],"full screen"],[["?"],"this help"]];function S(n,t,e,...i){let o=a("header",{},a("h2",{},t),m("close",`Close: ${t.toLowerCase()}`,"",e));return a("section",{class:`card ${n}`,part:`card ${n}`,"aria-label":t,hidden:!0},o,...i)}function B(n){let t=H.flatMap(([e,i])=>[a("dt",{},...e.flatMap(o=>[a("kbd",{},o)," "])),a("dd",{},i)]);return S("help","Keys",n,a("dl",{},...t))}var w=class{#t;#e;constructor(t,e){let i=(s,l)=>a("input",{type:"range",part:"slider",min:-l,max:l,step:1,"aria-label":s,input:()=>this.#o(e)});this.#t=[i("Light from the side, in degrees",180),i("Light from above, in degrees",90)],this.#e=[a("output"),a("output")];let o=["Side","Height"].map((s,l)=>a("label",{},s,this.#e[l],this.#t[l])),r=a("button",{type:"button",part:"button",click:()=>e(null)},"Reset");this.element=S("light narrow","Light",t,...o,r)}set direction(t){t.forEach((e,i)=>{let o=`${Math.round(e)}\xB0`;this.#t[i].value=Math.round(e),this.#t[i].setAttribute("aria-valuetext",o),this.#e[i].textContent=o})}#o(t){t(this.#t.map(({value:e})=>Number(e)))}},y=class{#t={};#e;#o;constructor(t,e){this.#o=e,this.#e=a("button",{type:"button",part:"button",click:()=>this.#i()},"Measure");let o=["Shown","Coefficients","Placements","Texels","Triangles","Maps","First view","Complete","Frame"].flatMap(r=>[a("dt",{},r),this.#t[r]=a("dd",{},"\u2013")]);this.element=S("numbers narrow","Numbers",t,a("dl",{},...o),this.#e)}update({total:t,shown:e,texels:i,triangles:o,roles:r,first:s,complete:l}){let c=t===null?"":` of ${f(t)}`,p={Shown:`${f(e.bytes)}${c}`,Coefficients:h(e.coefficients),Placements:h(e.placements),Texels:M(i),Triangles:M(o),Maps:r.length?r.join(", "):"\u2013","First view":s===null?"\u2013":k(s),Complete:l===null?"\u2013":k(l)};for(let[u,d]of Object.entries(p))this.#t[u].textContent=d}async#i(){this.#t.Frame.textContent="\u2026";let t=await _(this.#o);this.#t.Frame.textContent=Number.isNaN(t)?"\u2013":t<10?`${t.toFixed(1)} ms`:k(t)}};async function _(n,t=9){let e=[];for(let i=0;i<t;i++){await new Promise(r=>setTimeout(r));let o=performance.now();n(),e.push(performance.now()-o)}return e.sort((i,o)=>i-o)[t>>1]}function j(n,t,{starts:e,moves:i,signal:o}){n.addEventListener("pointerdown",r=>{if(r.target!==t||!r.isPrimary||r.button!==0||!e(r))return;r.stopPropagation(),t.setPointerCapture(r.pointerId);let s=new AbortController,l=(u,d)=>{let g=x=>x.pointerId===r.pointerId&&d(x);t.addEventListener(u,g,{signal:s.signal})},[c,p]=[r.clientX,r.clientY];l("pointermove",({clientX:u,clientY:d})=>{i(u-c,d-p),[c,p]=[u,d]});for(let u of["pointerup","pointercancel","lostpointercapture"])l(u,()=>s.abort())},{capture:!0,signal:o})}var W=`
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
`;function $(n){let t;return()=>(t||(t=new CSSStyleSheet,t.replaceSync(n)),t)}var at=$(W);var D=`
:host { --line: var(--upholster-line, #d9dbdc); --track: var(--upholster-track, #e3e5e6); }
@media (prefers-color-scheme: dark) {
  :host { --line: var(--upholster-line, #34383b); --track: var(--upholster-track, #3a3f43); }
}
.above > .card { pointer-events: auto; }
canvas.light { cursor: move; }
button[aria-disabled='true'] { opacity: 0.4; cursor: default; }
/* On the stage */
.card { position: absolute; inset-block-start: 8px; inset-inline-start: 8px; max-inline-size: calc(100% - 160px);
  max-block-size: calc(100% - 16px); overflow: auto; padding: 10px 14px; border-radius: 10px; background: var(--veil);
  scrollbar-width: thin; }
.card.narrow { inline-size: 248px; }
.card > button { border-color: var(--line); }
.card header { display: flex; align-items: center; justify-content: space-between; gap: 16px; margin: -6px -8px 0 0; }
h2 { font-size: 13px; font-weight: 600; margin: 0; }
dl { display: grid; grid-template-columns: auto 1fr; gap: 3px 14px; margin: 2px 0 6px; }
dt { color: var(--muted); }
dd { margin: 0; text-align: end; font-variant-numeric: tabular-nums; }
kbd { font: inherit; display: inline-block; min-inline-size: 22px; padding: 0 5px; border: 1px solid var(--line); border-radius: 5px;
  text-align: center; }
.help dl { grid-template-columns: auto 1fr; align-items: baseline; }
.help dt { color: inherit; white-space: nowrap; }
.help dd { text-align: start; color: var(--muted); }
.light label { display: grid; grid-template-columns: 1fr auto; color: var(--muted); }
.light output { color: var(--text); font-variant-numeric: tabular-nums; }
.light input { grid-column: 1 / -1; }
.halves span { position: absolute; inset-block-end: 8px; inset-inline-start: 8px; padding: 2px 9px; border-radius: 7px; background: var(--veil); }
.halves span:last-child { inset-inline-start: calc(50% + 8px); }
.halves::after { content: ''; position: absolute; background: var(--line); inset: 0 auto 0 50%; inline-size: 1px; pointer-events: none; }
.halves.stacked span:first-child { inset-block-end: calc(50% + 8px); }
.halves.stacked span:last-child { inset-inline-start: 8px; }
.halves.stacked::after { inset: 50% 0 auto 0; inline-size: auto; block-size: 1px; }

/* Below it */
.panel { display: grid; grid-template-columns: minmax(0, 1fr) auto auto; align-items: center; gap: 4px 20px; padding: 8px 14px;
  border-block-start: 1px solid var(--line); background: var(--surface); }
.data { min-inline-size: 0; }
.data p { display: flex; justify-content: space-between; gap: 12px; margin: 0; white-space: nowrap; font-variant-numeric: tabular-nums; }
.data p span { color: var(--muted); overflow: hidden; text-overflow: ellipsis; }
.group { display: flex; gap: 2px; }
.group button { padding: 0 4px; min-inline-size: 44px; white-space: nowrap; font-variant-numeric: tabular-nums; }
.group button.word { padding: 0 10px; }
.tools { display: flex; gap: 2px; }

input[type='range'] { appearance: none; display: block; inline-size: 100%; block-size: 40px; margin: 0; background: none; cursor: pointer;
  touch-action: pan-y; border-radius: 8px; }
input[type='range']::-webkit-slider-runnable-track { block-size: 4px; border-radius: 2px; background: var(--bar, var(--track)); }
input[type='range']::-moz-range-track { block-size: 4px; border-radius: 2px; background: var(--bar, var(--track)); }
input[type='range']::-webkit-slider-thumb { appearance: none; inline-size: 18px; block-size: 18px; margin-block-start: -7px; border-radius: 50%;
  border: 0; background: var(--accent); box-shadow: 0 0 0 3px var(--surface); }
input[type='range']::-moz-range-thumb { inline-size: 18px; block-size: 18px; border-radius: 50%; border: 0; background: var(--accent);
  box-shadow: 0 0 0 3px var(--surface); }
input[type='range']:disabled { opacity: 0.45; cursor: default; }
.data input { block-size: 28px; --bar: linear-gradient(to right, color-mix(in srgb, var(--accent) 45%, var(--track)) calc(9px +
  (100% - 18px) * var(--here, 0)), var(--track) 0); }
.ticks { position: relative; block-size: 15px; margin: -4px 9px 0; font-size: 11px; color: var(--muted); font-variant-numeric: tabular-nums; }
.ticks span { position: absolute; translate: -50%; white-space: nowrap; }
.ticks span:last-child { translate: calc(-100% + 9px); }
@media (forced-colors: active) {
  input[type='range']::-webkit-slider-runnable-track { forced-color-adjust: none; background: ButtonText; }
  input[type='range']::-moz-range-track { background: ButtonText; }
  input[type='range']::-webkit-slider-thumb { forced-color-adjust: none; background: Highlight; box-shadow: 0 0 0 3px Canvas; }
  input[type='range']::-moz-range-thumb { background: Highlight; }
}
@media (pointer: coarse) { .data input { block-size: 40px; } }

@container (max-width: 860px) {
  .panel { grid-template-columns: minmax(0, 1fr) auto; }
  .data { grid-column: 1 / -1; }
}
@container (max-width: 619px) {
  .card { inset-block-start: 60px; max-inline-size: calc(100% - 16px); max-block-size: calc(100% - 68px); }
  .panel { grid-template-columns: minmax(0, 1fr); padding: 8px 12px; }
  .group, .tools { justify-content: space-between; }
  .group button { flex: 1 1 40px; min-inline-size: 40px; }
}
@container (max-height: 460px) and (min-width: 520px) {
  .viewer { grid-template: minmax(0, 1fr) / minmax(0, 1fr) auto; }
  .panel { inline-size: 268px; grid-template-columns: minmax(0, 1fr); align-content: center; gap: 8px; border-block-start: 0;
    border-inline-start: 1px solid var(--line); overflow: auto; padding: 8px 12px; }
  .data { grid-column: auto; }
  .group { display: grid; grid-template-columns: repeat(3, 1fr); }
  .tools { justify-content: space-between; }
}
`,C=$(D);var A=[.13,.4,1],R=`#version 300 es
precision highp float;
uniform vec3 ink;
out vec4 color;
void main() {
  color = vec4(ink, 1);
}`;function N({positions:n,normals:t,tangents:e,parameters:i,indices:o}){let r=l=>l%3===2?l-2:l+1,s=(l,c)=>o[c&1?r(c>>1):c>>1];return{positions:n,normals:t,tangents:e,parameters:i,indices:Uint32Array.from({length:2*o.length},s)}}function P({outline:n}){return{positions:n,indices:n.subarray(0,n.length/3).map((t,e)=>e)}}var K=[.03,.05,.07,.15,1],L=200,b=1e3,U=(n,t)=>Math.round(b*((1+t/b)**n-1)),v=(n,t)=>t>0?Math.log1p(n/b)/Math.log1p(t/b):0;function q(n,t){let e=2;for(;v(b*e,n)-v(b,n)<t&&b*e<n;)e*=2;let i=[];for(let o=b;o<n;o*=e){let r=v(o,n);r>t/2&&r<1-1.5*t&&i.push({bytes:o,place:r})}return[...i,{bytes:n,place:1}]}var V=[["reset","Show the whole model","0",!1],["light","Move the light","L",!0],["wireframe","Wireframe","W",!0],["borders","Borders of the charts","B",!0],["split","Compare with full quality","S",!0],["picture","Save a picture","P",!1]],z=class{#t;#e=a("output",{part:"amount"});#o=a("span");#i=a("div",{class:"ticks","aria-hidden":"true"});#s;#n={};#a=null;#c=0;#r=null;constructor({act:t,limit:e}){this.#t=a("input",{type:"range",part:"slider",min:0,max:L,value:0,disabled:!0,"aria-label":"Bytes of the stream shown",input:()=>this.#l(e)});let i=s=>a("button",{type:"button",part:"button","aria-pressed":"false","aria-label":s<1?`Show ${h(s)} of the coefficients`:"Show all that the stream has",title:s<1?`${h(s)} of the coefficients`:"The whole stream",click:()=>e({coefficients:s})},s<1?`${Math.round(100*s)} %`:"All"),o=a("button",{type:"button",class:"word",part:"button","aria-pressed":"true",title:"Show the stream as it arrives",click:()=>e(null)},"Live");this.#s=new Map([[null,o],...K.map(s=>[s,i(s)])]);for(let[s,l,c,p]of V)this.#n[s]=m(s,l,c,()=>t(s),{toggle:p});let r=(s,l,...c)=>a("div",{class:l,part:l,role:"group","aria-label":s},...c);this.element=r("Controls","panel",a("div",{class:"data"},a("p",{},this.#e,this.#o),this.#t,this.#i),r("Share of the coefficients","group",...this.#s.values()),r("View","tools",...Object.values(this.#n)))}press(t,e){this.#n[t].setAttribute("aria-pressed",String(e))}enable(t,e){this.#n[t].setAttribute("aria-disabled",String(!e))}update({received:t,total:e,limit:i,shown:o}){let r=e??t;this.#t.disabled=e===null;let s=this.#i.clientWidth;if(e!==null&&(e!==this.#a||s!==this.#c)){this.#a=e,this.#c=s;let u=q(e,44/Math.max(s,100));this.#i.replaceChildren(...u.map(({bytes:d,place:g})=>{let x=a("span",{},f(d));return x.style.left=`${100*g}%`,x}))}let l=Math.min(i?.bytes??o.bytes,r);this.#t.style.setProperty("--here",v(t,r).toFixed(4)),this.#r&&i?.bytes===this.#r||(this.#t.value=Math.round(L*v(l,r)));let c=e===null?f(t):`${f(Math.min(l,t))} of ${f(e)}`;this.#t.setAttribute("aria-valuetext",c),this.#e.textContent=c;let p=e!==null&&o.bytes>=e?"complete, ":"";this.#o.textContent=`${p}${h(o.coefficients)} coefficients`;for(let[u,d]of this.#s){let g=u===null?i===null:i?.coefficients===u;d.setAttribute("aria-pressed",String(g))}}#l(t){let e=Number(this.#t.value)/L;this.#r=e<1?U(e,this.#a):null,t(e<1?{bytes:this.#r}:null)}};var Y={coefficients:.07},G={l:"light",w:"wireframe",b:"borders",s:"split",p:"picture",i:"numbers","?":"help",Escape:"close"},J={received:0,total:null,limit:null,shown:{bytes:0,coefficients:0,placements:0},texels:0,triangles:0,roles:[],first:null,complete:null};function Q(n){if(!n)return J;let{received:t,total:e,shown:i,texels:o,geometries:r,roles:s}=n.model,l=r.reduce((c,{indices:p})=>c+p.length/3,0);return{received:t,total:e,shown:i,texels:o,triangles:l,roles:s,limit:n.limit,first:n.firstTime,complete:n.completeTime}}var O=class{#t;#e;#o;#i;#s;#n;#a;#c;#r;#l;#b;#p=a("div",{class:"halves",part:"halves",hidden:!0},a("span",{part:"half"}),a("span",{part:"half"}));#m=null;#g=new AbortController;#u={wireframe:!1,borders:!1};constructor({ui:t,stage:e,viewer:i,session:o,refresh:r}){this.#t=t,this.#e=e,this.#o=i,this.#i=o,this.#s=r;let s=()=>this.#h(null),l=p=>this.#x(p);this.#n=new z({act:l,limit:p=>this.#w(p)}),this.#a=new w(s,p=>{e.light=p,this.#a.direction=e.light}),this.#c=new y(s,()=>e.finish()),this.#r={light:this.#a.element,numbers:this.#c.element,help:B(s)};let c=(p,u,d)=>m(p,u,d,()=>l(p),{toggle:!0});this.#l={numbers:c("numbers","Numbers","I"),help:c("help","Keys","?")},this.#b=[this.#p,...Object.values(this.#r),...Object.values(this.#l),this.#n.element],t.corner.prepend(...Object.values(this.#l)),t.above.prepend(this.#p),t.corner.before(...Object.values(this.#r)),t.element.firstChild.after(this.#n.element),t.element.getRootNode().adoptedStyleSheets.push(C()),this.#a.direction=e.light,this.#k(t.stage,e)}dispose(){this.#h(null);let t=this.#t.element.getRootNode();t.adoptedStyleSheets=t.adoptedStyleSheets.filter(e=>e!==C());for(let e of this.#b)e.remove();this.#g.abort()}#k(t,e){j(t,e.canvas,{signal:this.#g.signal,starts:i=>!!this.#i()?.model.first&&(i.shiftKey||this.#d==="light"),moves:(i,o)=>{let[r,s]=e.light;e.light=[r+i/2,s-o/2],this.#a.direction=e.light}})}update(t){let e=Q(t),i=!!t?.model.first;this.#f(t),this.#n.update(e),this.#n.enable("split",i&&!t.loading),this.#n.enable("picture",i),this.#n.press("split",!!t?.other),this.#d==="numbers"&&this.#c.update(e);let{split:o,stacked:r}=this.#e;this.#p.hidden=!o,this.#p.classList.toggle("stacked",r),this.#p.firstChild.textContent=`${h(e.shown.coefficients)} of coefficients`,this.#p.lastChild.textContent="Full quality"}key(t){let e=G[t];return!e||e==="close"&&!this.#d?!1:(this.#x(e),!0)}#x(t){t==="light"||t==="numbers"||t==="help"?this.#h(this.#d===t?null:t):t==="close"?this.#h(null):t==="reset"?this.#e.reset():t==="split"?this.#y():t==="picture"?this.#z():(this.#u[t]=!this.#u[t],this.#v(t,this.#u[t]),this.#f(this.#i()),this.#e.refresh())}get#d(){return Object.keys(this.#r).find(t=>!this.#r[t].hidden)??null}#h(t){let e=this.#t.element.getRootNode().activeElement;for(let[i,o]of Object.entries(this.#r)){let r=i===t,s=!r&&o.contains(e);o.hidden!==!r&&(o.hidden=!r,this.#v(i,r),s&&!t&&this.#m?.focus())}this.#e.dragRotates=t!=="light",this.#e.canvas.classList.toggle("light",t==="light"),this.#s(),t&&(Object.values(this.#r).some(i=>i.contains(e))||(this.#m=e),this.#r[t].querySelector("button").focus())}#v(t,e){this.#l[t]?this.#l[t].setAttribute("aria-pressed",String(e)):this.#n.press(t,e)}#w(t){this.#i()?.setLimit(t),this.#s()}#f(t){let{wireframe:e,borders:i}=this.#u,o={shader:R,ink:A,edges:e?N:null,borders:i?P:null};for(let r of[t?.model,t?.other])r&&(r.lines=o)}#y(){let t=this.#i(),e=this.#e;if(!t||t.loading||!t.model.first){this.#t.say("Comparing needs the whole stream, which is still loading.");return}if(t.other)e.show(t.model),t.other.dispose(),t.other=null;else{t.limit||t.setLimit(Y);let i=t.compare(),o=()=>t===this.#i()&&t.other===i,r=()=>{t.changes++,this.#f(t),this.#s()};i.settled().then(()=>{o()&&(r(),e.show(t.model,i))});for(let s of["refine","geometry"])i.addEventListener(s,()=>{o()&&(r(),e.refresh())})}this.#s()}async#z(){let t=this.#i();if(!t?.model.first)return;let e=URL.createObjectURL(await this.#o.picture());a("a",{href:e,download:`${t.name.replace(/\.uph$/,"")||"model"}.png`}).click(),setTimeout(()=>URL.revokeObjectURL(e),1e4),this.#t.say("Picture saved.")}};export{O as Lab};
