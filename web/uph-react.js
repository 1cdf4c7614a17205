/** `<upholster-viewer>` for React 19, which supports custom elements: this module only adds types. */

import './upholster-viewer.js'
