/** The worker: a script that is started by its address; it exports nothing. */
export {}
