/** Work in slices, with the worker's messages heard in between. */

/** Milliseconds of work before messages are looked at. */
export const SLICE = 25

/** Let messages in. */
export function yieldToMessages() {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel()
    port1.onmessage = () => {
      port1.close()
      resolve()
    }
    port2.postMessage(null)
  })
}
