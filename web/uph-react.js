/** `<upholster-viewer>` for React 19, which takes elements as they are: the types beside this module are all that is added. */

import './upholster-viewer.js'
