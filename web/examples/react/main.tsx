import { useRef, useState } from 'react'
import { createRoot } from 'react-dom/client'
import 'upholster/react'
import type { UpholsterViewer } from 'upholster/viewer'

function Ring() {
  const viewer = useRef<UpholsterViewer>(null)
  const [shown, setShown] = useState('loading')
  return (
    <main>
      <upholster-viewer
        ref={viewer}
        src="ring.uph"
        view="150,32"
        onfirst={({ detail }) => setShown(`${detail.bytes} bytes`)}
        oncomplete={({ detail }) => setShown(`complete, ${detail.bytes} bytes`)}
        onerror={({ detail }) => setShown(detail.message)}
      />
      <p>{shown}</p>
      <button onClick={() => viewer.current && (viewer.current.view = [30, 30])}>From the front</button>
    </main>
  )
}

createRoot(document.getElementById('root')!).render(<Ring />)
