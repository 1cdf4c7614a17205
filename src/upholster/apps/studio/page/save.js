/** The dialog that saves: every kind of file, made while the dialog is open, with its size; the project; the equivalent commands. */

import * as api from './api.js'
import { button, make, openDialog } from './dom.js'

const amount = (bytes) => (bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toPrecision(3)} MB`)

/** The dialog's row for the project, which is no output. */
const PROJECT = { title: 'Project', purpose: 'to continue later, here or on the command line' }

/**
 * Open the dialog for the model shown: `answer` is the server's answer for it; `given` has the `outputs` and `save_to`, whether the server
 * may write files itself; `reliefs` is what to begin with in files for printers: the depth, and `hasHeights`, whether there is a height map.
 */
export function openSave(answer, given, reliefs) {
  const { name, revision } = answer
  let isOpen = true
  const rows = [...given.outputs, PROJECT].map((output) => {
    const size = make('td', { className: 'number' }, '…')
    const get = make('td', {}, '')
    const target = output === PROJECT ? 'project' : `${output.prefix}${name}${output.ending}`
    const about = make('td', {}, output.purpose)
    const row = { target, size, get, row: make('tr', {}, make('td', {}, make('b', {}, output.title)), about, size, get) }
    if (output.solid) about.append((row.relief = relief(reliefs, () => fill(row))))
    return row
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

  const fill = async (row) => {
    const { target, size, get, relief } = row
    const asked = (row.asked = {}) // a later depth replaces it
    size.textContent = '…'
    get.replaceChildren()
    try {
      const made = await api.save(revision, [target], relief?.depth)
      if (asked !== row.asked) return
      const { files } = made
      const one = files.length === 1 ? `/saved/${made.id}/${encodeURIComponent(files[0].name)}` : `/saved/${made.id}.zip`
      size.textContent = amount(files.reduce((sum, { bytes }) => sum + bytes, 0))
      const link = make('a', { className: 'button', href: one, download: files.length === 1 ? files[0].name : `${name}.zip` }, 'Save')
      get.append(link)
      if (given.save_to) get.append(' ', keeper(made.id))
    } catch (error) {
      if (asked !== row.asked) return
      size.textContent = ''
      get.replaceChildren(make('span', { className: 'wrong', title: error.message }, relief ? error.message : 'not for this model'))
    }
  }
  const fillAll = async () => {
    for (const one of rows) if (isOpen && !one.asked) await fill(one)
  }
  return fillAll()
}

/** Asks for the depth of a relief; returns an element with `depth`, a text: it is flat if that is empty. */
function relief({ depth, hasHeights }, onchange) {
  const input = make('input', { type: 'text', value: depth, className: 'short', placeholder: 'none', ariaLabel: 'Depth of the relief', spellcheck: false })
  const words = make('code', {})
  const says = make('span', { className: 'note' })
  const element = make('label', { className: 'relief' }, ', in a relief of depth', input, words, says)
  const show = () => {
    element.depth = input.value.trim()
    says.textContent = !element.depth
      ? 'Flat: only the shape, without the sample.'
      : hasHeights
        ? 'By the height map of the material.'
        : 'Bright is high: the sample has no height map.'
    words.textContent = element.depth ? `--displace ${element.depth}${hasHeights ? '' : ' --displace-by luminance'}` : ''
  }
  input.onchange = () => {
    show()
    onchange()
  }
  show()
  return element
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
