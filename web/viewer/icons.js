/** The laboratory's buttons. */

import { iconButton } from './dom.js'

const PATHS = {
  reset: 'M4.6 14.5a8 8 0 1 0 1.6-8.1L3.8 8.8M3.8 4v4.8h4.8',
  light:
    'M12 8a4 4 0 1 0 0 8a4 4 0 0 0 0-8M12 2.6v2M12 19.4v2M2.6 12h2M19.4 12h2M5.4 5.4l1.4 1.4M17.2 17.2l1.4 1.4' +
    'M5.4 18.6l1.4-1.4M17.2 6.8l1.4-1.4',
  wireframe: 'M3.5 19.5L12 4.5l8.5 15zM7.75 12h8.5L12 19.5z',
  borders: 'M4 4.5h16v15H4zM4 13.5h9.5M13.5 4.5v15',
  split: 'M3.5 5h17v14h-17zM12 3v18',
  picture: 'M3.5 8H7l2-2.8h6L17 8h3.5v11h-17zM12 10a3.2 3.2 0 1 0 0 6.4a3.2 3.2 0 0 0 0-6.4',
  numbers: 'M4 20h16M7 16.5v-5M12 16.5V4.5M17 16.5V9',
  help: 'M9 9.2a3 3 0 1 1 4.4 2.7c-1 .6-1.4 1.2-1.4 2.6M12 18v.2',
  close: 'M6 6l12 12M18 6L6 18',
}

/** A button with one of the drawings. */
export function labButton(name, ...rest) {
  return iconButton(name, PATHS[name], ...rest)
}
