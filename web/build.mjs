// Bundles the viewer and what it loads for the Python package: ../src/upholster/web.
//
//     npm ci && npm run build      writes the files
//     npm run check                compares them with what would be written
//
// The same sources and the pinned versions of esbuild and terser give the same bytes on any machine.

import { mkdir, readFile, writeFile } from 'node:fs/promises'
import { fileURLToPath } from 'node:url'
import { build } from 'esbuild'
import { minify } from 'terser'

const here = (path) => fileURLToPath(new URL(path, import.meta.url))
const SHOWN = 'src/upholster/web'

/** Files by name, and what each is made of. What a viewer loads on demand stays a file of its own. */
const BUNDLES = {
  'upholster-viewer.js': 'upholster-viewer.js',
  'upholster-lab.js': 'upholster-lab.js',
  'upholster-environment.js': 'upholster-environment.js',
  'uph-worker.js': 'uph-worker-lean.js',
  'uph-rare.js': 'uph-rare.js',
}
/** In a function of its own: it may stand before the worker in one script. */
const WRAPPED = ['uph-rare.js']
const ON_DEMAND = ['./upholster-lab.js', './upholster-environment.js', './uph-rare.js']

/** Returns the notice that goes with copies. */
async function notice() {
  const text = await readFile(here('../LICENSE'), 'utf8')
  return `upholster\n\n${text.replaceAll('\r\n', '\n').trim()}`
}

/** Returns a bundle, minified. */
async function bundle(source) {
  const { outputFiles } = await build({
    absWorkingDir: here('.'),
    entryPoints: [source],
    bundle: true,
    minify: true,
    format: WRAPPED.includes(source) ? 'iife' : 'esm',
    target: 'es2022',
    write: false,
    external: ON_DEMAND.filter((name) => name !== `./${source}`),
    logLevel: 'silent', // errors are thrown, and told once, below
    legalComments: 'none', // all is ours; LICENSES.txt has the notice
  })
  // Of what esbuild leaves, terser takes 4 % (gzipped): a page with its stream has to stay small.
  const { code } = await minify(outputFiles[0].text, { module: true, ecma: 2020, compress: { passes: 4, inline: 1, unsafe_arrows: true, unsafe_methods: true } })
  // The graphics card's programs and the style sheet need no indentation, comments, or spaces round signs.
  const plain = code
    .replace(/ \/\/ [^\\"`]*(?=\\n)/g, '')
    .replace(/\\n(?:\\n|\\t| )+/g, '\\n')
  return `/*! upholster, SPDX-License-Identifier: MIT, see LICENSES.txt */\n${plain}\n`
}

/** Returns what belongs into the folder, by name. */
async function made() {
  const text = await notice()
  const files = {}
  for (const [name, source] of Object.entries(BUNDLES)) files[name] = await bundle(source)
  return { ...files, 'LICENSES.txt': `The files of this folder are built from web/, by web/build.mjs.\n\n${text}\n` }
}

/** Returns a line that says which file is not as it would be made; none: ''. */
async function difference(files) {
  for (const [name, text] of Object.entries(files)) {
    const there = await readFile(here(`../${SHOWN}/${name}`), 'utf8').catch(() => null)
    if (there === null) return `${SHOWN}/${name} is missing: run "npm run build" in web/`
    if (there !== text) return `${SHOWN}/${name} is not what web/build.mjs makes: run "npm run build" in web/`
  }
  return ''
}

async function write(files) {
  await mkdir(here(`../${SHOWN}`), { recursive: true })
  for (const [name, text] of Object.entries(files)) await writeFile(here(`../${SHOWN}/${name}`), text)
}

try {
  const files = await made()
  if (process.argv.includes('--check')) {
    const line = await difference(files)
    if (line) throw new Error(line)
  } else {
    await write(files)
  }
} catch (error) {
  console.error(error.message)
  process.exitCode = 1
}
