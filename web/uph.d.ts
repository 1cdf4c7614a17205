/** A damaged file: `message` is one line, `offset` the byte at which it was found. */
export class UphError extends Error {
  constructor(what: string, offset: number)
  /** The byte that is wrong, or at which the damaged chunk begins: up to there the file can be used. */
  readonly offset: number
}

/** An image: `data` holds height × width × channels samples, row by row, channels together. */
export interface Picture {
  height: number
  width: number
  channels: number
  data: Samples
}

export type Samples = Uint8Array | Uint16Array | Float32Array

/** The grid of steps over a rectangle of a face, across its patches: rows follow s, from s0 to s1, columns follow t. Texels are painted on it. */
export interface Chart {
  face: number
  height: number
  width: number
  s0: number
  s1: number
  t0: number
  t1: number
}

/** A rational Bézier patch of degree (m, n): `net` holds (m + 1) × (n + 1) points (w·x, w·y, w·z, w). */
export interface Patch {
  m: number
  n: number
  net: Float64Array
}

/** A grid of patches, numbered row by row from `firstPatch` on: s runs from 0 to its rows, t from 0 to its columns. */
export interface Face {
  rows: number
  columns: number
  firstPatch: number
}

/** The interval a0 < a1 of one face's edge, 4·face + edge, meets b0 to b1 of another one's: the map is linear. */
export interface Shared {
  a: number
  b: number
  a0: number
  a1: number
  b0: number
  b1: number
}

/** An interval of a face's edge, 4·face + edge, that is a point. */
export interface Collapsed {
  edge: number
  low: number
  high: number
}

export type Surface =
  | {
      kind: 'cyclide' | 'torus' | 'sphere' | 'plane' | 'ellipsoid' | 'cylinder' | 'cone' | 'vase'
      /** Parameters by their names in SPEC.md, defaults filled in. */
      params: Record<string, number | [number, number]>
      faces: Face[]
      patchCount: number
      shared: Shared[]
      points: Collapsed[]
    }
  | {
      kind: 'mesh'
      name: string
      /** Length of the model's unit in metres; null if it is not stored. */
      metres: number | null
      parts: string[]
      /** One null for each island: a chart's face is its island. */
      faces: null[]
      /** Per triangle three vertices, counter-clockwise seen from outside; its island, −1 for none; its part. */
      triangles: Int32Array
      island: Int32Array
      part: Int32Array
      /** Per corner, whether the edge that begins there is a seam or a border. */
      seams: Uint8Array
      /** x, y, z of each vertex. */
      positions: Float64Array
      /** s, t of each corner on its island. */
      parameters: Float64Array
    }
  | { kind: 'nets'; name: string; tolerance: number; faces: Face[]; patches: Patch[]; patchCount: number; shared: Shared[]; points: Collapsed[] }

/** Changes from a piece of a stream. */
export interface Changes {
  /** Whether another surface has arrived, with its charts: a base, or the surface itself. */
  surface: boolean
  /** Whether the exemplar has improved, and with it the texels of every chart. */
  exemplar: boolean
  /** New or improved maps, by role; 'albedo' is the exemplar. */
  roles: string[]
  /** Charts with new placements, labels or nodes of their warp fields, in rising order. */
  charts: number[]
}

/** Limits of a stream's demands, within those of the format (SPEC.md, 9). A limit that is not given follows from the texels. */
export interface Limits {
  /** Texels of all charts together, in steps and as painted by default, 1 to 2³¹; 2²⁸ by default. */
  texels?: number
  /** Height × width × channels of all maps together; by default one per texel, 65,536 to 12.8 million. */
  samples?: number
  /** By default one per 256 texels, 4096 to 262,144. */
  charts?: number
  /** Triangles of a mesh; by default one per 8 texels, 4096 to 1,048,576. */
  triangles?: number
}

/** The map and the rows to paint. */
export interface Painting {
  /** The map; 'albedo' by default. */
  role?: string
  /** Texels per step, each way, 1/64 to 64; by default the stream's own density. */
  density?: number
  /** Rows [start, stop) of the painted chart; all of them by default. */
  start?: number
  stop?: number
}

/** Decodes a `.uph` stream as its bytes arrive, in pieces of any size. */
export class UphDecoder {
  /** A stream that exceeds the limits is refused. Throws `RangeError` for wrong limits. */
  constructor(options?: { limits?: Limits })
  /** Bytes fed so far. */
  readonly received: number
  /** Length of the whole file; null before its header has arrived. */
  readonly total: number | null
  /** Least number of missing bytes until something can be shown: 0 from then on. */
  readonly needed: number
  /** Whether the whole file has arrived and every CRC is right. */
  readonly complete: boolean
  /** The surface, or, before it and its charts have arrived, a base: a coarse mesh. */
  readonly surface: Surface | null
  /** Whether `surface` is a base. */
  readonly isBase: boolean
  /** Number of surfaces that have arrived: bases, then the surface itself. */
  readonly surfaceNumber: number
  readonly charts: readonly Chart[]
  /** Number of charts that have a placement of their own; the others show the middle of the exemplar. */
  readonly chartsKnown: number
  /** Number of known placements, and of all; 0 before that is known. They are coded from coarse to fine, over all charts. */
  readonly placements: { known: number; count: number }
  /** Whether all placements and labels have arrived. */
  readonly placed: boolean
  /** Share of the exemplar's coefficients, 0 to 1, at which its decoding ends, even if more bytes arrive; initially 1. */
  mostCoefficients: number
  /** Take further bytes. Throws `UphError` for a damaged stream, also in all later calls. */
  feed(bytes: Uint8Array): Changes
  /** Roles of the maps announced so far: 'albedo', the exemplar's, is the first. */
  readonly roles: string[]
  /** Number of a map's coefficients that are significant so far, number of all, and whether decoding is complete. */
  coefficients(role?: string): { known: number; count: number; complete: boolean }
  /** A map of the exemplar from the bytes received. Throws `RangeError` while bytes are needed. */
  exemplar(role?: string): Picture
  /**
   * Paint with another picture of the exemplar's height and width, as `upholster.paint` does; null: with the exemplar again. Where the
   * sizes differ, painting throws `RangeError`.
   */
  replaceExemplar(picture: Picture | null): void
  /** Height and width of the exemplar, and so of every map, once no bytes are needed. */
  readonly exemplarSize: { height: number; width: number }
  /** A map of the exemplar from the bytes received, as RGBA of 8 bits for the screen, see `rgba`. */
  exemplarRgba(role?: string): { height: number; width: number; data: Uint8Array }
  /** The mean of a map from the bytes received, as one pixel of RGBA of 8 bits. */
  meanRgba(role?: string): Uint8Array
  /** The stream's own density, in texels per step each way; 1 before it is known. */
  readonly density: number
  /** Height and width in texels of a painted chart; `density` is `this.density` by default, 1/64 to 64. */
  paintedSize(index: number, density?: number): { height: number; width: number }
  /**
   * Texels of a chart from the bytes received, in the form of `exemplar(role).data`. Those of 'normal' are in the texels' own frame: their vectors are
   * turned with the texture. Where labels have not arrived, each place shows the nearest placement. Any density shows the same picture.
   */
  texels(index: number, options?: Painting): Samples
  /**
   * The same for the screen: RGBA of 8 bits, written into `into`, which is created if missing, and returned. Grey
   * becomes RGB, alpha is 255 where a map has none; 16 bits are rounded to 8, and floats, which are linear, become
   * sRGB codes where the map is a colour ('albedo', 'emission'). Throws `RangeError` where it does not fit.
   */
  rgba<Into extends Uint8Array | Uint8ClampedArray = Uint8ClampedArray>(
    index: number,
    options?: Painting & {
      into?: Into
      /** Texels from one row of `into` to the next; the painted chart's width by default. */
      stride?: number
      /** Index in `into` of the first sample; 0 by default. */
      offset?: number
    },
  ): Into
}

/** Decodes an `.ezw` image as its bytes arrive, in pieces of any size. */
export class EzwDecoder {
  /** An image with more samples than the limits allow is refused. */
  constructor(options?: { limits?: Limits })
  readonly received: number
  readonly needed: number
  readonly complete: boolean
  /** Take further bytes; returns whether the image changed. Throws `UphError` for a damaged file. */
  feed(bytes: Uint8Array): boolean
  /** The image from the bytes received. Throws `RangeError` while bytes are needed. */
  image(): Picture
}
