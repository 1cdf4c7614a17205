// Bundles the viewer (with three.js inside) and the worker for the Python package: ../src/upholster/web.
//
//     npm ci && npm run build      writes the files
//     npm run check                compares them with what would be written
//
// The same sources and the pinned versions of esbuild, terser and three.js give the same bytes on any machine.

import { mkdir, readFile, writeFile } from 'node:fs/promises'
import { fileURLToPath } from 'node:url'
import { build } from 'esbuild'
import { minify } from 'terser'

const here = (path) => fileURLToPath(new URL(path, import.meta.url))
const SHOWN = 'src/upholster/web'

/** Returns the notices that every copy has to carry. */
async function notices() {
  const read = async (path) => (await readFile(here(path), 'utf8')).replaceAll('\r\n', '\n').trim()
  return {
    ours: `upholster\n\n${await read('../LICENSE')}`,
    three: `three.js (https://threejs.org), in upholster-viewer.js\n\n${await read('node_modules/three/LICENSE')}`,
  }
}

/** Returns a bundle, minified, behind its notices. */
async function bundle(source, texts) {
  const { outputFiles } = await build({
    absWorkingDir: here('.'),
    entryPoints: [source],
    bundle: true,
    minify: true,
    format: 'esm',
    target: 'es2022',
    write: false,
    logLevel: 'silent', // errors are thrown, and told once, below
    legalComments: 'none', // the notices stand in full at the top
  })
  // Of what esbuild leaves, terser takes 4 % (gzipped): a page with its stream has to stay small.
  const { code } = await minify(outputFiles[0].text, { module: true, ecma: 2020, compress: { passes: 3 } })
  // The graphics card's programs and the style sheet need no indentation, empty lines, or comments.
  const plain = code
    .replace(/ \/\/ [^\\"`]*(?=\\n)/g, '')
    .replace(/\\n(?:\\n|\\t| )+/g, '\\n')
  return `/*!\n${texts.join('\n\n').replaceAll('*/', '* /')}\n*/\n${plain}\n`
}

/** Returns what belongs into the folder, by name. */
async function made() {
  const { ours, three } = await notices()
  return {
    'upholster-viewer.js': await bundle('upholster-viewer.js', [ours, three]),
    'uph-worker.js': await bundle('uph-worker.js', [ours]),
    'LICENSES.txt': `The files of this folder are built from web/, by web/build.mjs.\n\n${ours}\n\n\n${three}\n`,
  }
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
