// A model as GLB (glTF 2.0, binary): for other programs, and for the viewers of phones. Loaded when somebody asks for it.

import { drawPage, packCharts } from './glb/atlas.js'
import { encodePng } from './glb/png.js'
import { GlbWriter } from './glb/write.js'
import { ROLES, TARGETS } from './uph/roles.js'

/**
 * Write a model; resolves with the file's bytes.
 *
 * `model` has `name`; `charts`, each with its `size` {height, width}, its `geometry` {positions, normals, tangents, parameters, indices}
 * and its `textures` by target (color, normal, surface, emission; as `uph-worker.js` paints them, with a gutter of one texel:
 * {height, width, data}); `plain`, the triangles on no chart, or null, and their colour `mean`; `metres`, the length of its unit, or null; `roles`, and `alpha`: 'opaque', 'mask'
 * or 'blend'. What is read of it is read before the first wait.
 */
export async function writeGlb(model) {
  const { name, charts, plain, metres, alpha } = model
  const writer = new GlbWriter(name, metres ?? 1)
  const drawn = packCharts(charts.map(({ size }) => size)).map((page) => ({
    page,
    mesh: joined(page, charts),
    pictures: targetsOf(model).map((target) => [target, drawPage(page, (chart) => charts[chart].textures[target])]),
  }))
  for (const { page, mesh, pictures } of drawn) {
    const textures = {}
    for (const [target, picture] of pictures) {
      const file = await encodePng(picture, target === 'color' && alpha !== 'opaque' ? 4 : 3)
      textures[target] = writer.addTexture(`${name} ${target}`, file)
    }
    const { indices, ...arrays } = mesh
    writer.addTriangles(arrays, indices, materialOf(model, textures), { charts: page.charts })
  }
  if (plain) {
    const { positions, normals, indices } = plain
    writer.addTriangles({ POSITION: positions, NORMAL: normals }, Uint32Array.from(indices), plainMaterial(model))
  }
  return writer.finish()
}

/** Targets that glTF has and of which there is a texture. */
function targetsOf({ charts, roles }) {
  const isShown = (target) => target === 'color' || (target !== 'height' && TARGETS[target].some((role) => roles.includes(role)))
  return Object.keys(TARGETS).filter((target) => isShown(target) && charts.some(({ textures }) => textures[target]))
}

/** The charts of a page as one mesh. */
function joined(page, charts) {
  const total = (key) => page.charts.reduce((sum, { chart }) => sum + charts[chart].geometry[key].length, 0)
  const count = total('positions') / 3
  const mesh = {
    POSITION: new Float32Array(3 * count),
    NORMAL: new Float32Array(3 * count),
    TANGENT: new Float32Array(4 * count),
    TEXCOORD_0: new Float32Array(2 * count),
    indices: new Uint32Array(total('indices')),
  }
  let [first, at] = [0, 0]
  for (const { chart, row, column, height, width } of page.charts) {
    const { positions, normals, tangents, parameters, indices } = charts[chart].geometry
    mesh.POSITION.set(positions, 3 * first)
    mesh.NORMAL.set(normals, 3 * first)
    mesh.TANGENT.set(tangents, 4 * first)
    for (let n = 0; n < parameters.length; n += 2) {
      mesh.TEXCOORD_0[2 * first + n] = (column + parameters[n + 1] * width) / page.width
      mesh.TEXCOORD_0[2 * first + n + 1] = (row + parameters[n] * height) / page.height
    }
    for (let n = 0; n < indices.length; n++) mesh.indices[at++] = first + indices[n]
    first += positions.length / 3
  }
  return mesh
}

function materialOf({ name, roles, alpha }, { color, normal, surface, emission }) {
  const has = (role) => Boolean(surface) && roles.includes(role)
  const factor = (role) => (has(role) ? 1 : ROLES[role].neutral)
  const material = {
    name,
    pbrMetallicRoughness: {
      baseColorTexture: color,
      metallicFactor: factor('metallic'),
      roughnessFactor: factor('roughness'),
    },
    doubleSided: true,
  }
  if (alpha !== 'opaque') material.alphaMode = alpha.toUpperCase()
  if (normal) material.normalTexture = normal
  if (has('ao')) material.occlusionTexture = surface
  if (has('roughness') || has('metallic')) material.pbrMetallicRoughness.metallicRoughnessTexture = surface
  if (emission) Object.assign(material, { emissiveTexture: emission, emissiveFactor: [1, 1, 1] })
  return material
}

function plainMaterial({ name, mean }) {
  const linear = mean.map((code) => (code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4))
  const plain = { baseColorFactor: [...linear, 1], metallicFactor: ROLES.metallic.neutral, roughnessFactor: ROLES.roughness.neutral }
  return { name: `${name} plain`, pbrMetallicRoughness: plain, doubleSided: true }
}
