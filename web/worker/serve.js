/** Streams of a page in one worker: the worker's own messages are one's, each port that joins brings another's. */

import { Samples } from './samples.js'
import { StreamSession } from './stream-session.js'

/** Serve what comes from a port, or from the worker's own scope. All of a worker's streams share `samples`. */
export function serve(port, samples = new Samples()) {
  let session = null
  port.onmessage = ({ data }) => {
    if (data.kind === 'join') return serve(data.port, samples)
    session ??= new StreamSession((message, transfer = []) => port.postMessage(message, transfer), samples)
    session.receive(data)
    if (data.kind === 'close') port.close()
  }
}
