/** The worker: a script to be started by its address, which gives no names. */
export {}
