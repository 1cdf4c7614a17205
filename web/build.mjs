// Bundles the viewer and what it loads for the Python package: ../src/upholster/web.
//
//     npm ci && npm run build      writes the files
//     npm run check                compares them with what would be written
//
// The same sources and the pinned versions of esbuild and terser give the same bytes on any machine. Beside each script lies what a server
// sends of it to whoever takes Brotli, a tenth less than gzip; of that only what it holds is compared.

import { mkdir, readFile, writeFile } from 'node:fs/promises'
import { relative, resolve } from 'node:path'
import { fileURLToPath } from 'node:url'
import { brotliCompressSync, brotliDecompressSync } from 'node:zlib'
import { build, transform } from 'esbuild'
import { minify } from 'terser'

const here = (path) => fileURLToPath(new URL(path, import.meta.url))
const SHOWN = 'src/upholster/web'

/** Files by name, and what each is made of. What a viewer loads on demand stays a file of its own. */
const BUNDLES = {
  'upholster-viewer.js': 'upholster-viewer.js',
  'upholster-lab.js': 'upholster-lab.js',
  'upholster-environment.js': 'upholster-environment.js',
  'uph-picture.js': 'uph-picture.js',
  'uph-worker.js': 'uph-worker-lean.js',
  'uph-rare.js': 'uph-rare.js',
}
/** Parts of the worker: in functions of their own, for they may stand behind it in one script. They use its modules, not copies of them. */
const WORKER = 'uph-worker-lean.js'
const PARTS = ['uph-rare.js']
const ON_DEMAND = Object.keys(BUNDLES).filter((name) => !['upholster-viewer.js', 'uph-worker.js'].includes(name)).map((name) => `./${name}`)

/** Whose names pages use. */
const TYPES = 'upholster-viewer.d.ts'

/** Returns the notice that goes with copies. */
async function notice() {
  const text = await readFile(here('../LICENSE'), 'utf8')
  return `upholster\n\n${text.replaceAll('\r\n', '\n').trim()}`
}

/** What the graphics card's programs and style sheets need no spaces for. */
const texts = {
  name: 'texts',
  setup({ onLoad }) {
    onLoad({ filter: /viewer.(shading|painting)\.js$/ }, async ({ path }) => {
      const text = await readFile(path, 'utf8')
      return { contents: text.replace(/\n\s*\/\/ .*/g, '').replace(/ ([-+*/=<>?:&|]+|[{}]) (?!\S*\*\/)/g, '$1').replace(/([,;{]) /g, '$1') }
    })
    onLoad({ filter: /viewer.(lab-)?style\.js$/ }, async ({ path }) => {
      const [before, css, ...after] = (await readFile(path, 'utf8')).split('`')
      const { code } = await transform(css, { loader: 'css', minify: true, target: 'es2022' })
      return { contents: [before, code.trim(), ...after].join('`') }
    })
  },
}

/** Returns what esbuild makes of a source, its variables with short names. */
function bundled(source, options = {}) {
  return build({
    absWorkingDir: here('.'),
    entryPoints: [source],
    bundle: true,
    minify: true,
    plugins: [texts],
    format: 'esm',
    target: 'es2022',
    write: false,
    external: ON_DEMAND.filter((name) => name !== `./${source}`),
    logLevel: 'silent', // errors are thrown, and told once, below
    legalComments: 'none', // all is ours; LICENSES.txt has the notice
    metafile: true,
    ...options,
  })
}

/**
 * Has parts of the worker use its modules, those with these paths, instead of copies: what is imported of them is noted in `shared`, by name,
 * and once `order` is filled, taken from the list `uphShared`.
 */
const sharing = (modules, shared, order) => ({
  name: 'sharing',
  setup({ onResolve, onLoad }) {
    onResolve({ filter: /^\./ }, async ({ path, resolveDir, importer }) => {
      const whole = resolve(resolveDir, path)
      if (!importer || !modules.has(relative(here('.'), whole).replaceAll('\\', '/'))) return undefined
      const text = await readFile(importer, 'utf8')
      const names = new RegExp(`(?:^|\\n)(?:im|ex)port \\{([^}]*)\\} from '${path}'`).exec(text)?.[1].match(/\w+/g)
      if (!names) throw new Error(`${importer} imports no names of ${path}`)
      for (const name of names) shared.set(name, whole)
      return { path: whole, namespace: 'shared', sideEffects: false }
    })
    onLoad({ filter: /./, namespace: 'shared' }, ({ path }) => {
      const names = order.filter((name) => shared.get(name) === path).map((name) => `${order.indexOf(name)}: ${name}`)
      return { contents: order.length ? `export const { ${names} } = globalThis.uphShared` : 'module.exports = {}' }
    })
  },
})

/** Returns bundles of the worker and its parts, by source. */
async function workers() {
  const { metafile } = await bundled(WORKER)
  const [{ inputs }] = Object.values(metafile.outputs)
  const modules = new Set(Object.keys(inputs).filter((path) => inputs[path].bytesInOutput))
  const [shared, order, found] = [new Map(), [], {}]
  const plugins = [sharing(modules, shared, order)]
  for (const part of PARTS) await bundled(part, { plugins })
  order.push(...[...shared.keys()].sort())
  for (const part of PARTS) found[part] = await bundled(part, { plugins, format: 'iife' })
  const imports = order.map((name) => `import { ${name} } from ${JSON.stringify(shared.get(name))}\n`)
  const contents = `import './${WORKER}'\n${imports.join('')}globalThis.uphShared = [${order}]`
  found[WORKER] = await bundled(WORKER, { entryPoints: undefined, stdin: { contents, resolveDir: here('.') } })
  return found
}

/**
 * What may get a short name: members of our classes, `this.name` and `name() {…}`, and keys of objects, `{ name: … }`, that are read as `.name`.
 * But not what the typed interface names, nor what a text names, such as a key that is looked up, or the uniforms of the graphics card's
 * programs. Terser leaves out what browsers name.
 */
async function privateNames(bundles) {
  const members = /\bthis\.([\w$]+)|(?<!function )\b(?!(?:if|for|while|switch|catch|with)\b)([a-z][\w$]+)\([^()]*\)\{/g
  const namesIn = (pattern) => bundles.flatMap((text) => [...text.matchAll(pattern)].map(([, field, method]) => field ?? method))
  const read = new Set(namesIn(/\w\.([a-z]\w+)/g))
  const names = new Set([...namesIn(members), ...namesIn(/[{,]([a-z]\w+):/g).filter((key) => read.has(key))])
  const keep = (text) => text.match(/[A-Za-z_$][\w$]*/g)?.forEach((name) => names.delete(name))
  const types = await readFile(here(TYPES), 'utf8')
  keep(types.replace(/\/\*\*[^]*?\*\//g, '')) // what its comments say is no name
  for (const text of bundles) {
    for (const [literal] of text.matchAll(/"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*'|`(?:[^`\\]|\\.)*`/g)) {
      if (/^.[\w$]+.$/.test(literal)) keep(literal)
      for (const [uniforms] of literal.matchAll(/uniform [^;]*/g)) keep(uniforms)
    }
  }
  return new RegExp(`^(${[...names].join('|')})$`)
}

/** Returns a bundle with short names of properties too, by `cache` the same ones in all bundles: they hand objects to each other. */
async function minified(text, regex, cache) {
  // Of what esbuild leaves, terser takes 6 % (gzipped): a page with its stream has to stay small.
  const { code } = await minify(text, {
    module: true,
    ecma: 2020,
    compress: { passes: 4, inline: 1, pure_getters: true, unsafe: true, unsafe_arrows: true, unsafe_methods: true },
    mangle: { properties: { regex, keep_quoted: true, cache } },
  })
  // The graphics card's programs need no indentation, and hardly a line.
  const plain = code.replace(/\\n(?:\\n|\\t| )+/g, '\\n').replace(/([;{}])\\n/g, '$1')
  return `/*! upholster, SPDX-License-Identifier: MIT, see LICENSES.txt */\n${plain}\n`
}

/** Returns what belongs into the folder, by name. */
async function made() {
  const text = await notice()
  const files = {}
  const made = await workers()
  for (const [name, source] of Object.entries(BUNDLES)) files[name] = (made[source] ?? (await bundled(source))).outputFiles[0].text
  const names = await privateNames(Object.values(files))
  const cache = { props: new Map() }
  for (const name of Object.keys(files)) files[name] = await minified(files[name], names, cache)
  return { ...files, 'LICENSES.txt': `The files of this folder are built from web/, by web/build.mjs.\n\n${text}\n` }
}

/** The scripts among files. */
const scriptsOf = (files) => Object.entries(files).filter(([name]) => name.endsWith('.js'))

/** What a file of Brotli holds; '' if it is none. */
function unpacked(data) {
  try {
    return brotliDecompressSync(data).toString()
  } catch {
    return ''
  }
}

/** Returns a line that says which file is not as it would be made; none: ''. */
async function difference(files) {
  const wanted = [...Object.entries(files), ...scriptsOf(files).map(([name, text]) => [`${name}.br`, text])]
  for (const [name, text] of wanted) {
    const there = await readFile(here(`../${SHOWN}/${name}`)).catch(() => null)
    if (there === null) return `${SHOWN}/${name} is missing: run "npm run build" in web/`
    const found = name.endsWith('.br') ? unpacked(there) : there.toString()
    if (found !== text) return `${SHOWN}/${name} is not what web/build.mjs makes: run "npm run build" in web/`
  }
  return ''
}

async function write(files) {
  await mkdir(here(`../${SHOWN}`), { recursive: true })
  for (const [name, text] of Object.entries(files)) await writeFile(here(`../${SHOWN}/${name}`), text)
  for (const [name, text] of scriptsOf(files)) await writeFile(here(`../${SHOWN}/${name}.br`), brotliCompressSync(text))
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
