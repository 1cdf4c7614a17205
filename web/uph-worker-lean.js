// The same worker as `uph-worker.js`, without what few streams need: that is loaded when a stream needs it.

import { Session } from './worker/session.js'

const session = new Session((message, transfer = []) => postMessage(message, transfer), () => import('./uph-rare.js'))
onmessage = ({ data }) => session.receive(data)
