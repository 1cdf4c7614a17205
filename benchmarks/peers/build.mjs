// node build.mjs OUT: the peers' pages and scripts as a careful site sends them: minified, and as Brotli at its best.

import { readFileSync, writeFileSync } from 'node:fs'
import { basename, join } from 'node:path'
import { brotliCompressSync } from 'node:zlib'
import { build } from 'esbuild'

const out = process.argv[2]
const here = (name) => new URL(name, import.meta.url).pathname
const modules = (name) => here(`node_modules/${name}`)

const { outputFiles } = await build({ entryPoints: [here('three.js')], bundle: true, minify: true, format: 'esm', write: false })
const files = { 'three.js': Buffer.from(outputFiles[0].contents) }
for (const path of [
  modules('@google/model-viewer/dist/model-viewer.min.js'),
  modules('three/examples/jsm/libs/draco/gltf/draco_wasm_wrapper.js'),
  modules('three/examples/jsm/libs/draco/gltf/draco_decoder.wasm'),
  here('model-viewer.html'),
  here('three.html'),
]) {
  files[basename(path)] = readFileSync(path)
}
for (const [name, data] of Object.entries(files)) {
  writeFileSync(join(out, name), data)
  writeFileSync(join(out, `${name}.br`), brotliCompressSync(data))
}
