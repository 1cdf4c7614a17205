/** Textures of charts and the materials that they are part of. */

import {
  Color,
  DataTexture,
  LinearFilter,
  LinearMipmapLinearFilter,
  MirroredRepeatWrapping,
  NoColorSpace,
  RGBAFormat,
  SRGBColorSpace,
  UnsignedByteType,
} from 'three'

/** Of a material that says nothing about it, as in the GLB. */
export const ROUGHNESS = 0.8

const ANISOTROPY = 8

/** An empty texture for what a material shows as `target`: 'color', 'normal' … */
export function newTexture(target) {
  const texture = new DataTexture(null, 1, 1, RGBAFormat, UnsignedByteType)
  texture.colorSpace = target === 'color' || target === 'emission' ? SRGBColorSpace : NoColorSpace
  texture.generateMipmaps = true
  texture.minFilter = LinearMipmapLinearFilter
  texture.magFilter = LinearFilter
  texture.anisotropy = ANISOTROPY
  return texture
}

/** The exemplar, which charts without placements repeat, mirrored. */
export class Preview {
  #texture = newTexture('color')

  constructor() {
    this.#texture.wrapS = this.#texture.wrapT = MirroredRepeatWrapping
  }

  /** Take over a better exemplar, `repeat` of its pixels to a texel. */
  update({ height, width, data, repeat }, materials, sizes) {
    this.#texture.image = { data, height, width }
    this.#texture.needsUpdate = true
    materials.forEach(({ userData }, n) => {
      const size = sizes[n]
      userData.preview ??= this.#texture.clone()
      userData.preview.needsUpdate = true
      // From a texture with a gutter to pixels of the exemplar, the chart's first texel on its first pixel.
      userData.preview.repeat.set((repeat * (size.width + 2)) / width, (repeat * (size.height + 2)) / height)
      userData.preview.offset.set(-repeat / width, -repeat / height)
    })
  }

  dispose() {
    this.#texture.dispose()
  }
}

/** Let a material have the maps that are known; `radius` is that of the model. */
export function updateMaterial(material, roles, alpha, radius) {
  const { color, preview, normal, surface, emission, height } = material.userData
  const has = (role) => roles.includes(role)
  const maps = {
    map: color ?? preview,
    normalMap: has('normal') ? normal : null,
    aoMap: has('ao') ? surface : null,
    roughnessMap: has('roughness') ? surface : null,
    metalnessMap: has('metallic') ? surface : null,
    emissiveMap: has('emission') ? emission : null,
    bumpMap: has('height') && !has('normal') ? height : null,
  }
  for (const [name, texture] of Object.entries(maps)) {
    if (material[name] === (texture ?? null)) continue
    material[name] = texture ?? null
    material.needsUpdate = true
  }
  material.roughness = maps.roughnessMap ? 1 : ROUGHNESS
  material.metalness = maps.metalnessMap ? 1 : 0
  material.bumpScale = radius / 100
  material.emissive = new Color(maps.emissiveMap ? 0xffffff : 0x000000)
  material.transparent = alpha === 'blend'
  material.alphaTest = alpha === 'mask' ? 0.5 : 0
}
