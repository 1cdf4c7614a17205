/** How the laboratory looks, on top of the viewer's own style. */

import { sheetOf } from './style.js'

const css = `
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
`

export const labStyle = sheetOf(css)
