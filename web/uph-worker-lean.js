// The same worker as `uph-worker.js`, without what many streams do not need: that is loaded when a stream needs it.

import { serve } from './worker/serve.js'

serve(globalThis, () => import('./uph-rare.js'))
