/** How the viewer looks. A constructable style sheet: a page's strict content security policy does not touch it. */

const css = `
:host {
  display: block;
  position: relative;
  block-size: 480px;
  min-block-size: 200px;
  overflow: hidden;
  container-type: size;
  color-scheme: light dark;
  --text: var(--upholster-text, #23272b);
  --muted: var(--upholster-muted, #62696f);
  --surface: var(--upholster-surface, #fbfbfa);
  --line: var(--upholster-line, #d9dbdc);
  --track: var(--upholster-track, #e3e5e6);
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
    --line: var(--upholster-line, #34383b);
    --track: var(--upholster-track, #3a3f43);
    --accent: var(--upholster-accent, #e08a6c);
    --on-accent: var(--upholster-on-accent, #1b1d1f);
  }
}
:host([background='none']) { background: none; }

* { box-sizing: border-box; }
.viewer { display: grid; grid-template: minmax(0, 1fr) auto / minmax(0, 1fr); block-size: 100%; }
.stack { position: relative; min-block-size: 0; overflow: hidden; }
.stage { position: absolute; inset: 0; background: linear-gradient(rgb(231 232 234), rgb(245 245 244)); }
.above { position: absolute; inset: 0; pointer-events: none; }
.above > .corner, .above > .card, .above > .note { pointer-events: auto; }
canvas { position: absolute; inset: 0; inline-size: 100%; block-size: 100%; display: block; cursor: grab; }
canvas:active { cursor: grabbing; }
canvas.empty { opacity: 0; cursor: default; }
canvas.light { cursor: move; }
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
button[aria-disabled='true'] { opacity: 0.4; cursor: default; }
button.icon { padding: 0; inline-size: 40px; }
button.main { color: var(--on-accent); background: var(--accent); padding: 0 18px; }
svg { inline-size: 22px; block-size: 22px; display: block; margin: auto; fill: none; stroke: currentColor; stroke-width: 1.6;
  stroke-linecap: round; stroke-linejoin: round; }

/* On the stage */
.corner { position: absolute; inset-block-start: 8px; inset-inline-end: 8px; display: flex; gap: 2px; padding: 2px;
  border-radius: 10px; background: var(--veil); }
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
.halves span { position: absolute; inset-block-end: 8px; inset-inline-start: 8px; padding: 2px 9px; border-radius: 7px; background: var(--veil); }
.halves span:last-child { inset-inline-start: calc(50% + 8px); }
.halves::after { content: ''; position: absolute; background: var(--line); inset: 0 auto 0 50%; inline-size: 1px; pointer-events: none; }
.halves.stacked span:first-child { inset-block-end: calc(50% + 8px); }
.halves.stacked span:last-child { inset-inline-start: 8px; }
.halves.stacked::after { inset: 50% 0 auto 0; inline-size: auto; block-size: 1px; }
.loading { position: absolute; inset: 0; display: grid; place-content: center; justify-items: center; gap: 8px; color: var(--muted);
  font-variant-numeric: tabular-nums; pointer-events: none; }
.loading i, .line i { display: block; background: var(--accent); block-size: 100%; inline-size: 100%; transform-origin: left;
  transform: scaleX(var(--share, 0)); }
.loading div { inline-size: min(220px, 50cqw); block-size: 3px; border-radius: 2px; overflow: hidden; background: var(--track); }
.line { position: absolute; inset: 0 0 auto; block-size: 2px; pointer-events: none; }
@media (prefers-reduced-motion: no-preference) {
  .loading i, .line i { transition: transform 0.2s; }
}

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
`

let sheet

/** The style sheet, made once for all viewers of a page. */
export function style() {
  if (!sheet) {
    sheet = new CSSStyleSheet()
    sheet.replaceSync(css)
  }
  return sheet
}
