/** Pictures of surroundings as light, for `<upholster-viewer environment="…">`: loaded by the viewer where one is named. */

export { loadEnvironment } from './viewer/environment.js'
