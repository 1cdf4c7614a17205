/** How the viewer looks. A constructable style sheet: a page's strict content security policy does not touch it. */

const css = `
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
`

/** A function that makes a style sheet once, for all viewers of a page. */
export function sheetOf(text) {
  let sheet
  return () => {
    if (!sheet) {
      sheet = new CSSStyleSheet()
      sheet.replaceSync(text)
    }
    return sheet
  }
}

export const style = sheetOf(css)
