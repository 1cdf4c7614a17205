/** Files that are dropped, chosen or pasted: sent to the server and sorted by kind. */

import * as api from './api.js'

/**
 * Call take(drops) for everything that is dropped anywhere on the page, or pasted. Each drop is `{files, isFolder, isMade}`, with [file, path]
 * for every file; a folder is a drop of its own, with all files in it, and paths begin with its name; what is pasted is `isMade`, no file.
 */
export function listenForFiles(take, wrong) {
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
    const items = [...event.dataTransfer.items].filter(({ kind }) => kind === 'file')
    const found = items.map((item) => [item.webkitGetAsEntry?.() ?? null, item.getAsFile()]) // before anything is awaited
    const folders = found.map(([entry]) => entry).filter((entry) => entry?.isDirectory)
    const files = found.filter(([entry]) => !entry?.isDirectory).map(([, file]) => [file, file.name])
    const drops = files.length ? [{ files, isFolder: false }] : []
    for (const folder of folders) {
      try {
        drops.push({ files: await filesIn(folder), isFolder: true })
      } catch (error) {
        wrong(new Error(`${folder.name} can not be read: ${error.message}`))
      }
    }
    take(drops)
  })
  addEventListener('paste', (event) => {
    const files = [...(event.clipboardData?.files ?? [])].map((file) => [file, file.name || 'pasted.png'])
    if (files.length) take([{ files, isFolder: false, isMade: true }])
  })
}

/** Let the user choose files. */
export function chooseFiles(take) {
  const input = Object.assign(document.createElement('input'), { type: 'file', multiple: true })
  input.onchange = () => take([{ files: [...input.files].map((file) => [file, file.name]), isFolder: false }])
  input.click()
}

/** All files in a folder and in its folders, without hidden ones. */
async function filesIn(folder) {
  const reader = folder.createReader()
  const found = []
  for (;;) {
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject))
    if (!some.length) return found
    for (const one of some.filter(({ name }) => !name.startsWith('.'))) {
      if (one.isDirectory) found.push(...(await filesIn(one)))
      else found.push([await new Promise((resolve, reject) => one.file(resolve, reject)), one.fullPath.slice(1)])
    }
  }
}

const COMPANION = /\.(bin|mtl)$/i
const REFERRING = /\.(gltf|obj|mtl|stp|step|json)$/i // texts that name other files
const IMAGE = /\.(png|jpe?g|webp|tiff?|exr|heic|heif|avif)$/i
const MOST_TEXT = 2 ** 28

const baseOf = (path) => path.split('/').at(-1)
const folderOf = (path) => path.split('/').slice(0, -1).join('/')

/**
 * Send the files of one drop; returns `[{path, kind}]`, without files that others of them use. Files that belong together have one entry: a
 * folder, or the maps of a material, with all their paths.
 * @param {(text: string) => void} say called with the progress
 * @param {(error: Error) => void} wrong called for every file that is not taken
 */
export async function send({ files, isFolder, isMade }, say, wrong) {
  const used = await namedByOthers(files)
  const isModel = files.some(([, path]) => COMPANION.test(path) || /\.gltf$/i.test(path)) || used.size > 0
  const images = files.map(([, path]) => path).filter((path) => IMAGE.test(path) && !used.has(path))
  const roles = images.length > 1 ? await api.roles(images.map(baseOf)) : []
  const isMaterial = roles.length > 0 && roles.every(Boolean)
  let group
  const found = []
  for (const [file, path] of files) {
    say(`sending ${baseOf(path)}`)
    try {
      const stored = await api.upload(file, path, { group, made: isMade || undefined })
      if (isFolder || isMaterial || isModel) group = stored.group
      if (!used.has(path)) found.push(stored)
    } catch (error) {
      if (!(error instanceof api.RefusedError)) throw error
      wrong(error)
    }
  }
  const [maps, others] = [true, false].map((is) => found.filter(({ kind }) => (kind === 'image') === is))
  if (!isFolder) return [...(isMaterial ? [{ path: maps.map(({ path }) => path), kind: 'material' }] : maps), ...others]
  if (!roles.some(Boolean)) return [...maps, ...others]
  const materials = [...new Set(maps.map(({ path }) => folderOf(path)))].map((path) => {
    const own = maps.filter((one) => folderOf(one.path) === path)
    return own.length > 1 ? { path, kind: 'material' } : own[0]
  })
  return [...materials, ...others]
}

/** The paths of files whose names stand in other files among them. */
async function namedByOthers(files) {
  const used = new Set()
  for (const [file, path] of files) {
    if (!REFERRING.test(path) || file.size > MOST_TEXT) continue
    const text = await file.text()
    for (const [, other] of files) if (other !== path && isNamed(baseOf(other), text)) used.add(other)
  }
  return used
}

function isNamed(name, text) {
  const spellings = [name, encodeURI(name), encodeURIComponent(name)].map((one) => one.replace(/[.*+?^${}()|[\]\\]/g, '\\$&'))
  return new RegExp(`(^|[\\s"'/\\\\])(${spellings.join('|')})($|[\\s"'])`, 'm').test(text)
}
