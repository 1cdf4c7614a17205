/** The roles of maps. A test compares them with Python's (`MAP_ROLES` in src/upholster/image/roles.py), so each is one line of plain values. */

/**
 * Roles in Python's order. `target`: the texture that shows the map. `channel`: the map's channel of that texture, if it has only one.
 * `neutral`: the value where a material has no such map. `isColor`: the map's integers are sRGB-coded. `isSharp`: its values are one or the other, and get no tones.
 */
export const ROLES = {
  albedo: { target: 'color', isColor: true },
  normal: { target: 'normal' },
  roughness: { target: 'surface', channel: 1, neutral: 0.8 },
  metallic: { target: 'surface', channel: 2, neutral: 0, isSharp: true },
  ao: { target: 'surface', channel: 0, neutral: 1 },
  height: { target: 'height' },
  opacity: { target: 'color', channel: 3, isSharp: true },
  emission: { target: 'emission', isColor: true },
}

/** The textures of a material: for each, the roles that it is made of. */
export const TARGETS = {}
for (const [role, { target }] of Object.entries(ROLES)) (TARGETS[target] ??= []).push(role)

/** Whether a texture is sRGB-coded. */
export const isColorTarget = (target) => TARGETS[target].some((role) => ROLES[role].isColor)
