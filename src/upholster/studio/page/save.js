/** The dialog that saves: every kind of file, each made as it is looked at, with its size; the project; the words that make the same. */

import * as api from './api.js'
import { button, make, openDialog } from './dom.js'

const KINDS = [
  ['glb', 'GLB', 'for the web, Blender, engines'],
  ['usdz', 'USDZ', 'for iPhone and iPad'],
  ['obj', 'OBJ', 'with its texture beside it'],
  ['3mf', '3MF', 'for printers, in relief'],
  ['uph', 'Stream', 'any part of it is a whole model'],
  ['html', 'Page', 'viewer and model in one file'],
  ['png', 'Picture', 'of the model'],
  ['atlas', 'Texture', 'the atlas as an image'],
]

const amount = (bytes) => (bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toPrecision(3)} MB`)

/** Open the dialog for what is shown: `told` is what the server told of it, `canKeep` whether it may write files itself. */
export function openSave(told, canKeep) {
  const { name, revision } = told
  let isOpen = true
  const rows = [...KINDS, ['project', 'Project', 'to go on later, here or by command']].map(([kind, label, hint]) => {
    const size = make('td', { className: 'number' }, '…')
    const get = make('td', {}, '')
    const target = kind === 'project' ? 'project' : kind === 'atlas' ? `atlas:${name}_texture.png` : `${name}.${kind}`
    return { target, size, get, row: make('tr', {}, make('td', {}, make('b', {}, label)), make('td', {}, hint), size, get) }
  })
  const words = (label, text) =>
    make(
      'details',
      {},
      make('summary', {}, label),
      make('textarea', { readOnly: true, value: text, ariaLabel: label }),
      button('Copy', (event) => navigator.clipboard.writeText(text).then(() => (event.target.textContent = 'Copied'))),
    )
  const close = openDialog(
    'Save',
    make('table', {}, make('tbody', {}, ...rows.map(({ row }) => row))),
    words('The same as a command', told.command),
    words('The same in Python', told.python),
    make('div', { className: 'end' }, button('Close', () => close())),
  )
  document.getElementById('dialog').addEventListener('close', () => (isOpen = false), { once: true })

  const fill = async ({ target, size, get }) => {
    try {
      const made = await api.save(revision, [target])
      const { files } = made
      const one = files.length === 1 ? `/saved/${made.id}/${encodeURIComponent(files[0].name)}` : `/saved/${made.id}.zip`
      size.textContent = amount(files.reduce((sum, { bytes }) => sum + bytes, 0))
      const link = make('a', { className: 'button', href: one, download: files.length === 1 ? files[0].name : `${name}.zip` }, 'Save')
      get.append(link)
      if (canKeep) get.append(' ', keeper(made.id))
    } catch (error) {
      size.textContent = ''
      get.replaceChildren(make('span', { className: 'wrong', title: error.message }, 'not for this model'))
    }
  }
  const fillAll = async () => {
    for (const one of rows) if (isOpen) await fill(one)
  }
  return fillAll()
}

function keeper(id) {
  const own = button('Put in folder', async () => {
    try {
      await api.keep(id, own.textContent.startsWith('Replace'))
      own.textContent = 'There it is'
    } catch (error) {
      own.textContent = 'Replace it'
      own.title = error.message
    }
  })
  return own
}
