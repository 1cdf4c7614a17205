/** A picture of surroundings, all round (2:1, the horizon in the middle), as light: for rough surfaces and smooth ones. */

const [WIDTH, HEIGHT] = [128, 64] // of the picture as it is used
const [SIDE, LEVELS] = [64, 6] // of the cube that smooth surfaces mirror; each level is rougher
const SAMPLES = 96

/** What a surface mirrors of a picture, and how much light arrives: `sky` has it ever rougher, `harmonics` its light (R. Ramamoorthi, P. Hanrahan, SIGGRAPH 2001). */
const LIGHT = `
uniform samplerCube sky;
uniform vec3 harmonics[9];
vec3 mirrored(vec3 R, float rough, float facing) {
  return textureLod(sky, R, rough * 5.).rgb;
}
vec3 arriving(vec3 n, float facing) {
  vec3 x = harmonics[0] + harmonics[1] * n.y + harmonics[2] * n.z + harmonics[3] * n.x;
  x += harmonics[4] * n.x * n.y + harmonics[5] * n.y * n.z + harmonics[6] * (3. * n.z * n.z - 1.);
  return max(x + harmonics[7] * n.x * n.z + harmonics[8] * (n.x * n.x - n.y * n.y), 0.);
}`

/**
 * Load a picture; its path is from the page. Brightness is what is in the picture: 1 at most.
 *
 * @returns {Promise<{ light: string, harmonics: Float32Array, textureOf: (gl: WebGL2RenderingContext) => WebGLTexture }>}
 */
export async function loadEnvironment(address) {
  const response = await fetch(address)
  if (!response.ok) throw new Error(`the server says ${response.status}`)
  const bitmap = await createImageBitmap(await response.blob(), { resizeWidth: WIDTH, resizeHeight: HEIGHT, resizeQuality: 'high' })
  const context = new OffscreenCanvas(WIDTH, HEIGHT).getContext('2d')
  context.drawImage(bitmap, 0, 0)
  const { data } = context.getImageData(0, 0, WIDTH, HEIGHT)
  const radiance = Float32Array.from({ length: 3 * WIDTH * HEIGHT }, (_, n) => linear(data[4 * Math.floor(n / 3) + (n % 3)]))
  const cubes = await mirroredBy(radiance)
  const textures = new WeakMap()
  const textureOf = (gl) => {
    let known = textures.get(gl)
    if (!known || !gl.isTexture(known)) textures.set(gl, (known = newTexture(gl, cubes)))
    return known
  }
  return { light: LIGHT, harmonics: harmonicsOf(radiance), textureOf }
}

const linear = (byte) => (byte <= 10 ? byte / 3294.6 : ((byte / 255 + 0.055) / 1.055) ** 2.4)

/** The direction to a pixel's middle; z is up, the picture's middle lies toward +y. */
function directionOf(column, row) {
  const [azimuth, height] = [((column + 0.5) / WIDTH - 0.5) * 2 * Math.PI, (0.5 - (row + 0.5) / HEIGHT) * Math.PI]
  return [Math.sin(azimuth) * Math.cos(height), Math.cos(azimuth) * Math.cos(height), Math.sin(height)]
}

/** Light on a surface over π, as nine coefficients for each colour (R. Ramamoorthi, P. Hanrahan, SIGGRAPH 2001). */
function harmonicsOf(radiance) {
  const sums = new Float32Array(27)
  for (let row = 0; row < HEIGHT; row++) {
    const weight = ((2 * Math.PI) / WIDTH) * (Math.PI / HEIGHT) * Math.cos((0.5 - (row + 0.5) / HEIGHT) * Math.PI)
    for (let column = 0; column < WIDTH; column++) {
      const [x, y, z] = directionOf(column, row)
      const basis = [1, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y]
      basis.forEach((value, n) => {
        for (let k = 0; k < 3; k++) sums[3 * n + k] += weight * value * radiance[3 * (row * WIDTH + column) + k]
      })
    }
  }
  // Squared norms of the basis, times how much a cosine keeps of each band.
  const [first, second, third] = [1 / (4 * Math.PI), ((3 / (4 * Math.PI)) * 2) / 3, 1 / 4]
  const squares = [15 / (4 * Math.PI), 5 / (16 * Math.PI), 15 / (16 * Math.PI)]
  const factors = [first, second, second, second, third * squares[0], third * squares[0], third * squares[1], third * squares[0], third * squares[2]]
  return sums.map((sum, n) => sum * factors[Math.floor(n / 3)])
}

/** Per level the six sides of a cube, RGBA coded as sRGB: what surfaces ever rougher mirror. */
async function mirroredBy(radiance) {
  const levels = []
  for (let level = 0; level < LEVELS; level++) {
    const side = SIDE >> level
    const alpha = (level / (LEVELS - 1)) ** 2
    levels.push([])
    for (let face = 0; face < 6; face++) {
      await new Promise((resolve) => setTimeout(resolve))
      levels[level].push(faceOf(radiance, face, side, alpha))
    }
  }
  return levels
}

function faceOf(radiance, face, side, alpha) {
  const data = new Uint8Array(4 * side * side).fill(255)
  const count = alpha ? SAMPLES : 1
  for (let row = 0; row < side; row++) {
    for (let column = 0; column < side; column++) {
      const normal = faceDirection(face, (2 * column + 1) / side - 1, (2 * row + 1) / side - 1)
      const sum = [0, 0, 0]
      let weights = 0
      for (let n = 0; n < count; n++) {
        const [direction, weight] = lobe(normal, n / count + 0.5 / count, (n * 0.618034) % 1, alpha)
        if (weight <= 0) continue
        const color = lookUp(radiance, direction)
        for (let k = 0; k < 3; k++) sum[k] += weight * color[k]
        weights += weight
      }
      sum.forEach((x, k) => (data[4 * (row * side + column) + k] = Math.round(255 * coded(x / weights))))
    }
  }
  return data
}

const coded = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055)

/** A direction that a surface of GGX's roughness mirrors toward its normal, and its weight. */
function lobe([x, y, z], u, v, alpha) {
  const cosine = Math.sqrt((1 - u) / (1 + (alpha * alpha - 1) * u))
  const [sine, angle] = [Math.sqrt(1 - cosine * cosine), 2 * Math.PI * v]
  const sign = z >= 0 ? 1 : -1
  const [a, b] = [-1 / (sign + z), (-x * y) / (sign + z)]
  const [t, s] = [[1 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]]
  const half = [x, y, z].map((n, k) => cosine * n + sine * (Math.cos(angle) * t[k] + Math.sin(angle) * s[k]))
  return [half.map((h, k) => 2 * cosine * h - [x, y, z][k]), 2 * cosine * cosine - 1]
}

function lookUp(radiance, [x, y, z]) {
  const column = Math.min(WIDTH - 1, Math.floor((Math.atan2(x, y) / (2 * Math.PI) + 0.5) * WIDTH))
  const row = Math.min(HEIGHT - 1, Math.floor((0.5 - Math.asin(Math.min(Math.max(z, -1), 1)) / Math.PI) * HEIGHT))
  const at = 3 * (row * WIDTH + column)
  return [radiance[at], radiance[at + 1], radiance[at + 2]]
}

/** Where a place on a side of a cube lies, as WebGL has it. */
function faceDirection(face, u, v) {
  const [x, y, z] = [[1, -v, -u], [-1, -v, u], [u, 1, v], [u, -1, -v], [u, -v, 1], [-u, -v, -1]][face]
  const length = Math.hypot(x, y, z)
  return [x / length, y / length, z / length]
}

function newTexture(gl, levels) {
  const texture = gl.createTexture()
  gl.bindTexture(gl.TEXTURE_CUBE_MAP, texture)
  levels.forEach((faces, level) => {
    const side = SIDE >> level
    faces.forEach((data, face) => {
      gl.texImage2D(gl.TEXTURE_CUBE_MAP_POSITIVE_X + face, level, gl.SRGB8_ALPHA8, side, side, 0, gl.RGBA, gl.UNSIGNED_BYTE, data)
    })
  })
  gl.texParameteri(gl.TEXTURE_CUBE_MAP, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR)
  gl.texParameteri(gl.TEXTURE_CUBE_MAP, gl.TEXTURE_MAX_LEVEL, LEVELS - 1)
  return texture
}
