// Prints the lines of every function of the files named, as JSON: run in web/ by test_web_build.py.
import { readFileSync } from 'node:fs'
import { createRequire } from 'node:module'

const { parse } = createRequire(`${process.cwd()}/package.json`)('acorn')

function* functions(node) {
  if (typeof node?.type !== 'string') return
  if (/Function/.test(node.type)) yield node.loc
  for (const value of Object.values(node)) {
    for (const child of Array.isArray(value) ? value : [value]) yield* functions(child)
  }
}

const found = process.argv.slice(2).flatMap((file) => {
  const options = { ecmaVersion: 'latest', sourceType: 'module', locations: true }
  const program = parse(readFileSync(file, 'utf8'), options)
  return [...functions(program)].map(({ start, end }) => ({ file, line: start.line, lines: end.line - start.line + 1 }))
})
console.log(JSON.stringify(found))
