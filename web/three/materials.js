/** Textures of charts and the materials that they are part of. */

import {
  DataTexture,
  DoubleSide,
  LinearFilter,
  LinearMipmapLinearFilter,
  MeshStandardMaterial,
  NoColorSpace,
  RGBAFormat,
  SRGBColorSpace,
  UnsignedByteType,
} from 'three'
import { ROLES, isColorTarget } from '../uph/roles.js'

/** What a material without maps is like. */
export const PLAIN = { roughness: ROLES.roughness.neutral, metalness: ROLES.metallic.neutral }

const ANISOTROPY = 8

/** An empty texture for what a material shows as `target`: 'color', 'normal' … */
export function newTexture(target) {
  const texture = new DataTexture(null, 1, 1, RGBAFormat, UnsignedByteType)
  texture.colorSpace = isColorTarget(target) ? SRGBColorSpace : NoColorSpace
  texture.generateMipmaps = true
  texture.minFilter = LinearMipmapLinearFilter
  texture.magFilter = LinearFilter
  texture.anisotropy = ANISOTROPY
  return texture
}

/** Let a texture show texels, where they are others. They have a gutter of one round them, which its coordinates leave out. */
export function setTexels(texture, { height, width, data, version }) {
  if (texture.image.version === version) return
  if (texture.image.width !== width || texture.image.height !== height) texture.dispose() // the card's memory is of one size
  texture.image = { data, width, height, version }
  texture.offset.set(1 / width, 1 / height)
  texture.repeat.set(1 - 2 / width, 1 - 2 / height)
  texture.needsUpdate = true
}

/** What was last set on each material that was made here: what has another value since is its user's. */
const LAST_SET = new WeakMap()

/** A material that `updateMaterial` looks after. */
export function newMaterial() {
  const material = new MeshStandardMaterial({ side: DoubleSide, ...PLAIN })
  LAST_SET.set(material, {})
  return material
}

/**
 * Let a material have the maps that are known, `textures` of a chart; `radius` is that of the model.
 *
 * What somebody has set on the material stays. In a material of somebody's own, textures of the chart are kept the newest ones, and
 * nothing else is touched.
 */
export function updateMaterial(material, textures, roles, alpha, radius) {
  const { color } = textures
  const map = (role) => (roles.includes(role) && textures[ROLES[role].target]) || null
  const maps = {
    map: color ?? null,
    normalMap: map('normal'),
    aoMap: map('ao'),
    roughnessMap: map('roughness'),
    metalnessMap: map('metallic'),
    emissiveMap: map('emission'),
    bumpMap: map('normal') ? null : map('height'),
  }
  const last = LAST_SET.get(material)
  if (!last) {
    if (material.map && material.map === color) set(material, 'map', maps.map)
    return
  }
  const wanted = {
    ...maps,
    roughness: maps.roughnessMap ? 1 : PLAIN.roughness,
    metalness: maps.metalnessMap ? 1 : PLAIN.metalness,
    bumpScale: radius / 100,
    emissive: maps.emissiveMap ? 0xffffff : 0x000000,
    transparent: alpha === 'blend',
    alphaTest: alpha === 'mask' ? 0.5 : 0,
  }
  for (const [name, value] of Object.entries(wanted)) {
    if (name in last && valueOf(material, name) !== last[name]) continue
    set(material, name, value)
    last[name] = value
  }
}

const valueOf = (material, name) => (name === 'emissive' ? material.emissive.getHex() : material[name])

function set(material, name, value) {
  if (valueOf(material, name) === value) return
  if (name === 'emissive') material.emissive.setHex(value)
  else material[name] = value
  material.needsUpdate = true
}
