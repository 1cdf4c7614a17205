// Unpacks the content of the page, and opens it. Old syntax, so that an old browser can still report what it lacks.
(function () {
  'use strict'
  var note = document.getElementById('note')

  function say(text) {
    note.textContent = text
    note.hidden = false
  }

  // Two characters of 91 are 13 bits; line ends that an editor put between them are skipped.
  function bytesOf(id) {
    var element = document.getElementById(id)
    var text = element.textContent
    var bytes = new Uint8Array(Number(element.getAttribute('data-bytes')))
    var at = 0
    var held = 0
    var bits = 0
    var first = -1
    for (var n = 0; n < text.length; n++) {
      var code = text.charCodeAt(n)
      if (code < 33 || code > 126 || code === 38 || code === 60 || code === 62) continue
      var digit = code - 33 - (code > 38) - (code > 60) - (code > 62)
      if (first < 0) {
        first = digit
        continue
      }
      held = ((held & 255) << 13) | (first * 91 + digit)
      first = -1
      for (bits += 13; bits >= 8; ) bytes[at++] = held >> (bits -= 8)
    }
    if (at < bytes.length) throw new Error('part "' + id + '" of this file is cut')
    return bytes
  }

  function unpacked(id) {
    var packed = new Blob([bytesOf(id)]).stream()
    return new Response(packed.pipeThrough(new DecompressionStream('gzip'))).text()
  }

  function start(viewer, worker, stream) {
    var script = document.createElement('script')
    script.type = 'module'
    script.textContent = viewer
    document.head.appendChild(script)
    return customElements.whenDefined('upholster-viewer').then(function () {
      var element = document.createElement('upholster-viewer')
      // On a page from a file, Chromium starts no module worker from a blob: URL.
      element.setAttribute('worker', 'data:text/javascript,' + encodeURIComponent(worker))
      // The page cannot load anything later.
      element.setAttribute('painting', 'worker')
      document.body.appendChild(element)
      // The picture of the whole model stays until the viewer shows it all, fails, or is touched.
      ;['complete', 'error', 'pointerdown', 'keydown'].forEach(function (type) {
        element.addEventListener(type, function () {
          var poster = document.getElementById('poster')
          if (poster) poster.remove()
        })
      })
      return element.open(stream)
    })
  }

  if (!window.DecompressionStream || !window.customElements || !('adoptedStyleSheets' in document)) {
    say('This page shows a textured model. This browser cannot unpack it: one from 2023 or later can.')
    return
  }
  if (!document.createElement('canvas').getContext('webgl2')) {
    say('This page shows a textured model. It needs WebGL 2, which this browser lacks or has switched off.')
    return
  }
  function failed(error) {
    if (!document.querySelector('upholster-viewer')) {
      say('The model cannot be shown: ' + ((error && error.message) || error) + '.')
    } // otherwise the viewer reports it
  }
  window.addEventListener('error', failed)
  Promise.all([unpacked('viewer'), unpacked('worker')])
    .then(function (texts) {
      return start(texts[0], texts[1], bytesOf('stream'))
    })
    .catch(failed)
})()
