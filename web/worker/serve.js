/** Streams of a page in one worker: the worker's own messages are one's, each port that joins brings another's. */

import { Session } from './session.js'

/** Serve what comes from a port, or from the worker's own scope. */
export function serve(port) {
  let session = null
  port.onmessage = ({ data }) => {
    if (data.kind === 'join') serve(data.port)
    else (session ??= new Session((message, transfer = []) => port.postMessage(message, transfer))).receive(data)
  }
}
