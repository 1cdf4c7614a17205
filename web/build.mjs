// Bundles the viewer, the loader for three.js and the decoder for the Python package: ../src/upholster/output/web.
//
//     npm ci && npm run build      writes the files
//     npm run check                compares them with what would be written
//
// The same sources and the pinned version of esbuild give the same bytes on any machine. Each script is self-contained:
// pages that hold viewer and stream in one file can load nothing.

import { mkdir, readFile, writeFile } from 'node:fs/promises'
import { fileURLToPath } from 'node:url'
import { build } from 'esbuild'

const here = (path) => fileURLToPath(new URL(path, import.meta.url))
const SHOWN = 'src/upholster/output/web'

/** What viewer and loader load on demand. */
const ON_DEMAND = ['upholster-lab.js', 'upholster-environment.js', 'uph-picture.js', 'uph-glb.js']
const SCRIPTS = ['upholster-viewer.js', 'uph-worker.js', 'uph-three.js', 'uph.js', 'uph-mesh.js', ...ON_DEMAND]
const TYPES = ['upholster-viewer.d.ts', 'uph-three.d.ts', 'uph.d.ts', 'uph-mesh.d.ts']

const readText = async (path) => (await readFile(here(path), 'utf8')).replaceAll('\r\n', '\n')

/** Returns a script with all that it imports. */
async function bundled(name) {
  const { outputFiles } = await build({
    absWorkingDir: here('.'),
    entryPoints: [name],
    bundle: true,
    minify: true,
    format: 'esm',
    target: 'es2022',
    write: false,
    external: ['three', ...ON_DEMAND.filter((other) => other !== name).map((other) => `./${other}`)],
    legalComments: 'none', // all code is our own; LICENSES.txt has the notice
    banner: { js: '/*! upholster, SPDX-License-Identifier: MIT, see LICENSES.txt */' },
    logLevel: 'silent', // errors are thrown, and printed once, below
  })
  return outputFiles[0].text
}

/** Returns what belongs into the folder, by name. */
async function made() {
  const files = {}
  for (const name of SCRIPTS) files[name] = await bundled(name)
  for (const name of TYPES) files[name] = await readText(name)
  const notice = (await readText('../LICENSE')).trim()
  files['LICENSES.txt'] = `The files of this folder are built from web/, by web/build.mjs.\n\nupholster\n\n${notice}\n`
  return files
}

try {
  await mkdir(here(`../${SHOWN}`), { recursive: true })
  for (const [name, text] of Object.entries(await made())) {
    const path = here(`../${SHOWN}/${name}`)
    if (!process.argv.includes('--check')) await writeFile(path, text)
    else {
      const there = await readFile(path, 'utf8').catch(() => null)
      if (there === null) throw new Error(`${SHOWN}/${name} is missing: run "npm run build" in web/`)
      if (there !== text) throw new Error(`${SHOWN}/${name} is not what web/build.mjs makes: run "npm run build" in web/`)
    }
  }
} catch (error) {
  console.error(error.message)
  process.exitCode = 1
}
