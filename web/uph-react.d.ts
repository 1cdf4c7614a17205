/**
 * `<upholster-viewer>` in TypeScript with React 19, which sets the element's properties and listens to its events:
 *
 *     import 'upholster/react'
 *
 *     <upholster-viewer src="ring.uph" onfirst={({ detail }) => console.log(detail.bytes)} />
 */

import './upholster-viewer.js'
import type { DetailedHTMLProps, HTMLAttributes } from 'react'
import type { UpholsterViewer, UpholsterViewerEventMap } from './upholster-viewer.js'

/** The element's attributes, described in `upholster-viewer.d.ts`. */
export interface UpholsterViewerAttributes extends HTMLAttributes<UpholsterViewer> {
  src?: string | null
  alt?: string
  exemplar?: string
  worker?: string
  painting?: 'card' | 'worker'
  limit?: string | number
  maxtexels?: string | number
  view?: string
  background?: string
  environment?: string
  controls?: 'none' | 'lab'
  autorotate?: boolean
  onfirst?: (event: UpholsterViewerEventMap['first']) => void
  onrefine?: (event: UpholsterViewerEventMap['refine']) => void
  oncomplete?: (event: UpholsterViewerEventMap['complete']) => void
  onerror?: (event: UpholsterViewerEventMap['error']) => void
}

declare module 'react' {
  namespace JSX {
    interface IntrinsicElements {
      'upholster-viewer': DetailedHTMLProps<UpholsterViewerAttributes, UpholsterViewer>
    }
  }
}
