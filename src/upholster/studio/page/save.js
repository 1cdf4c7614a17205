/** The dialog that saves: every kind of file, made while the dialog is open, with its size; the project; the equivalent commands. */

import * as api from './api.js'
import { button, make, openDialog } from './dom.js'

const KINDS = [
  ['glb', 'GLB', 'for the web, Blender, engines'],
  ['usdz', 'USDZ', 'for iPhone and iPad'],
  ['obj', 'OBJ', 'with its texture in a file of its own'],
  ['3mf', '3MF', 'for printers, in relief'],
  ['uph', 'Stream', 'any first part of it is a complete model'],
  ['html', 'Page', 'viewer and model in one file'],
  ['png', 'Picture', 'of the model'],
  ['atlas', 'Texture', 'the atlas as an image'],
]

const amount = (bytes) => (bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toPrecision(3)} MB`)

/** Open the dialog for the model shown: `answer` is the server's answer for it, `canKeep` whether the server may write files itself. */
export function openSave(answer, canKeep) {
  const { name, revision } = answer
  let isOpen = true
  const rows = [...KINDS, ['project', 'Project', 'to continue later, here or on the command line']].map(([kind, label, hint]) => {
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
    words('The same as a command', answer.command),
    words('The same in Python', answer.python),
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
      own.textContent = 'Done'
    } catch (error) {
      own.textContent = 'Replace it'
      own.title = error.message
    }
  })
  return own
}
