/** The laboratory of `<upholster-viewer controls="lab">`, which the viewer loads by itself. Its names are the viewer's own matter. */
export {}
