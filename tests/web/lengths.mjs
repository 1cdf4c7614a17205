// Prints the lines of every function of the files named, as JSON: run in web/ by test_web_build.py.
import { readFileSync } from 'node:fs'
import { createRequire } from 'node:module'

const ts = createRequire(`${process.cwd()}/package.json`)('typescript')

const found = []
for (const file of process.argv.slice(2)) {
  const source = ts.createSourceFile(file, readFileSync(file, 'utf8'), ts.ScriptTarget.Latest, true)
  const lineOf = (position) => source.getLineAndCharacterOfPosition(position).line + 1
  const visit = (node) => {
    if (ts.isFunctionLike(node)) {
      const line = lineOf(node.getStart(source))
      found.push({ file, line, lines: lineOf(node.getEnd()) - line + 1 })
    }
    ts.forEachChild(node, visit)
  }
  visit(source)
}
console.log(JSON.stringify(found))
