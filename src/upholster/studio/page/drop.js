/** Files that are dropped, chosen or pasted: sent to the server and sorted by kind. */

import * as api from './api.js'

/** Call take(files) with [file, name] for everything that is dropped anywhere on the page, or pasted; for folders with all of their files. */
export function listenForFiles(take) {
  let depth = 0
  const holds = (event) => [...(event.dataTransfer?.types ?? [])].includes('Files')
  const mark = () => document.body.classList.toggle('dropping', depth > 0)
  addEventListener('dragenter', (event) => holds(event) && (depth++, mark()))
  addEventListener('dragleave', (event) => holds(event) && ((depth = Math.max(0, depth - 1)), mark()))
  addEventListener('dragover', (event) => holds(event) && event.preventDefault())
  addEventListener('drop', async (event) => {
    if (!holds(event)) return
    event.preventDefault()
    depth = 0
    mark()
    const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry?.() ?? null)
    const files = [...event.dataTransfer.files]
    if (entries.some((entry) => entry?.isDirectory)) {
      for (const entry of entries.filter(Boolean)) take(await filesOf(entry), entry.isDirectory)
    } else take(files.map((file) => [file, file.name]), false)
  })
  addEventListener('paste', (event) => {
    const files = [...(event.clipboardData?.files ?? [])]
    if (files.length) take(files.map((file) => [file, file.name || 'pasted.png']), false)
  })
}

/** Let the user choose files. */
export function chooseFiles(take) {
  const input = Object.assign(document.createElement('input'), { type: 'file', multiple: true })
  input.onchange = () => take([...input.files].map((file) => [file, file.name]), false)
  input.click()
}

async function filesOf(entry) {
  if (entry.isFile) return [[await new Promise((resolve, reject) => entry.file(resolve, reject)), entry.name]]
  const reader = entry.createReader()
  const found = []
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject))
    if (!some.length) break
    for (const one of some) if (one.isFile) found.push(...(await filesOf(one)))
  }
  return found
}

const COMPANION = /\.(bin|mtl)$/i
const IN_PARTS = /\.gltf$/i
const IMAGE = /\.(png|jpe?g|webp|tiff?|exr|heic|heif|avif)$/i

/**
 * Send files; returns `[{path, kind}]`. Files that belong together have one entry: a folder, or the maps of a material, with their group's path.
 */
export async function send(files, isFolder, say) {
  const found = []
  const images = files.map(([, name]) => name).filter((name) => IMAGE.test(name))
  const isMaterial = images.length > 1 && (isFolder || (await api.roles(images)).every(Boolean))
  // A model of several files; a photo dropped with only an OBJ is a sample.
  const isModel = files.some(([, name]) => COMPANION.test(name) || IN_PARTS.test(name))
  const together = isFolder || isMaterial || isModel
  let group
  for (const [file, name] of files) {
    say(`sending ${name}`)
    const stored = await api.upload(file, name, group)
    if (together) group = stored.group
    found.push(stored)
  }
  if (!together) return found
  const models = found.filter(({ kind }) => kind === 'model' || kind === 'project')
  return models.length ? models : [{ path: isMaterial && !isFolder ? found.map(({ path }) => path) : String(group), kind: 'material' }]
}
