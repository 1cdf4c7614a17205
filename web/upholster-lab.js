/** The laboratory of `<upholster-viewer controls="lab">`: loaded by the viewer where it is asked for. */

export { Lab } from './viewer/lab.js'
