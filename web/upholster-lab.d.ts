/** The laboratory of `<upholster-viewer controls="lab">`, which the viewer loads by itself. Its names are internal to the viewer. */
export {}
