// What the mesher promises: run with `node --test`, also by test_web_mesh.py.
import assert from 'node:assert/strict'
import { readFileSync } from 'node:fs'
import { test } from 'node:test'

import { basis, evaluate } from '../../web/mesh/bezier.js'
import { builtInPatches } from '../../web/mesh/built-in.js'
import { SurfaceMesher, countsFor } from '../../web/uph-mesh.js'
import { UphDecoder } from '../../web/uph.js'

/** A surface whose patches lie in grids of so many [rows, columns]; whole edges of patches that lie so near each other meet. */
function laid(surface, grids, tolerance = 1e-6) {
  let patchCount = 0
  const faces = grids.map(([rows, columns]) => {
    patchCount += rows * columns
    return { rows, columns, firstPatch: patchCount - rows * columns }
  })
  return { ...surface, faces, patchCount, ...meetings(surface.patches ?? builtInPatches(surface.kind, surface.params), faces, tolerance) }
}

/** What a stream tells of edges of faces: found by comparing all edges of patches on them, at nine places each. */
function meetings(patches, faces, tolerance) {
  const edges = faces.flatMap(({ rows, columns, firstPatch }, face) =>
    Array.from({ length: rows * columns }, (_, k) => [Math.floor(k / columns), k % columns]).flatMap(([i, j], k) =>
      [0, 1, 2, 3]
        .filter((edge) => [i === 0, j === columns - 1, i === rows - 1, j === 0][edge])
        .map((edge) => ({ edge: 4 * face + edge, low: edge & 1 ? i : j, line: lineOf(patches[firstPatch + k], edge) })),
    ),
  )
  const near = (p, q) => p.every((point, k) => Math.hypot(...point.map((x, c) => x - q[k][c])) <= tolerance)
  const [shared, points] = [[], []]
  edges.forEach(({ edge, low, line }, n) => {
    if (near(line, line.map(() => line[4]))) {
      const before = points.find((point) => point.edge === edge && point.high === low)
      if (before) before.high++
      else points.push({ edge, low, high: low + 1 })
    } else {
      for (const other of edges.slice(n + 1)) {
        const [b0, b1] = [other.low, other.low + 1]
        const seam = { a: edge, b: other.edge, a0: low, a1: low + 1 }
        if (near(line, other.line)) shared.push({ ...seam, b0, b1 })
        else if (near(line, [...other.line].reverse())) shared.push({ ...seam, b0: b1, b1: b0 })
      }
    }
  })
  return { shared, points }
}

/** Nine points along an edge of a patch. */
function lineOf(patch, edge) {
  const [at, us] = [[[0, 1, 1, 0][edge]], Array.from({ length: 9 }, (_, k) => k / 8)]
  const v = evaluate(patch, basis(patch.m, edge & 1 ? us : at), basis(patch.n, edge & 1 ? at : us))
  return us.map((_, k) => [...v.subarray(9 * k, 9 * k + 3)])
}
const builtIn = (kind, params, ...grids) => laid({ kind, params }, grids)
const alone = (count) => Array.from({ length: count }, () => [1, 1])

// Per surface: what it is, Euler characteristic, and its volume if it is closed.
const SURFACES = {
  cyclide: [builtIn('cyclide', { a: 6, c: 2, mu: 3, spans: [4, 4] }, [4, 4]), 0, 1329.271],
  pinched: [builtIn('cyclide', { a: 6, c: 2, mu: 6, spans: [4, 4] }, [4, 4]), 1, null],
  torus: [builtIn('torus', { R: 2, r: 0.7, spans: [6, 4] }, [6, 4]), 0, 2 * Math.PI ** 2 * 2 * 0.49],
  sphere: [builtIn('sphere', { r: 1, tiling: 0 }, ...alone(6)), 2, (4 / 3) * Math.PI],
  octants: [builtIn('sphere', { r: 2, tiling: 1 }, [2, 4]), 2, (32 / 3) * Math.PI],
  ellipsoid: [builtIn('ellipsoid', { rx: 1.5, ry: 1, rz: 0.75 }, [2, 4]), 2, 1.5 * Math.PI],
  vase: [builtIn('vase', { radius: 0.8, height: 2.4, spans: 4 }, [10, 4]), 2, 0.78298],
  plane: [builtIn('plane', { width: 2, height: 1, spans: [2, 3] }, [2, 3]), 1],
  cylinder: [builtIn('cylinder', { r: 1, h: 2, spans: 3 }, [1, 3]), 0],
  cone: [builtIn('cone', { r1: 1, r2: 0.4, h: 1.5, spans: 4 }, [1, 4]), 0],
  tip: [builtIn('cone', { r1: 1, r2: 0, h: 1.5, spans: 5 }, [1, 5]), 1],
}

let state = 7
const random = () => (state = (state * 48271) % 2147483647) / 2147483647
const below = (count) => Math.floor(random() * count)
/** A chart on each patch. */
const whole = ({ faces }) =>
  faces.flatMap(({ rows, columns }, face) =>
    Array.from({ length: rows * columns }, (_, k) => {
      const [s0, t0] = [Math.floor(k / columns), k % columns]
      return { face, s0, s1: s0 + 1, t0, t1: t0 + 1 }
    }),
  )
/** A chart on each face. */
const wide = ({ faces }) => faces.map(({ rows, columns }, face) => ({ face, s0: 0, s1: rows, t0: 0, t1: columns }))
const anyCounts = (charts, most = 5) => Uint16Array.from({ length: 2 * charts.length }, () => 2 ** below(most + 1))
const allOf = (count, charts) => new Uint16Array(2 * charts.length).fill(count)
const distinct = (values) => new Set(values).size

/** Some of the charts halved, one way or the other. */
function halved(charts) {
  return charts.flatMap((chart) => {
    const [s, t] = [(chart.s0 + chart.s1) / 2, (chart.t0 + chart.t1) / 2]
    return [
      [chart],
      [{ ...chart, s1: s }, { ...chart, s0: s }],
      [{ ...chart, t0: t }, { ...chart, t1: t }],
    ][below(3)]
  })
}

const meshes = (mesher, charts, counts) => charts.map((_, n) => mesher.mesh(n, counts))

/** Euler characteristic, edges without an opposite, edges used twice one way, volume: by position. */
function topology(all) {
  const ids = new Map()
  const used = new Set()
  const edges = new Map()
  let [faces, volume] = [0, 0]
  for (const { positions, indices } of all) {
    const points = Array.from({ length: positions.length / 3 }, (_, k) => [...positions.subarray(3 * k, 3 * k + 3)])
    const names = points.map((point) => {
      const key = point.map((x) => x + 0).join()
      if (!ids.has(key)) ids.set(key, ids.size)
      return ids.get(key)
    })
    for (let k = 0; k < indices.length; k += 3) {
      const corners = indices.subarray(k, k + 3)
      const triangle = [...corners].map((v) => names[v])
      assert.equal(distinct(triangle), 3, 'a triangle is none')
      faces++
      triangle.forEach((a, e) => {
        used.add(a)
        const key = a * 2 ** 26 + triangle[(e + 1) % 3]
        edges.set(key, (edges.get(key) ?? 0) + 1)
      })
      const [a, b, c] = [...corners].map((v) => points[v])
      for (const [i, j, l] of [[0, 1, 2], [1, 2, 0], [2, 0, 1]]) volume += a[i] * (b[j] * c[l] - b[l] * c[j])
    }
  }
  let [open, twice] = [0, 0]
  for (const [key, uses] of edges) {
    if (uses > 1) twice++
    if (!edges.has((key % 2 ** 26) * 2 ** 26 + Math.floor(key / 2 ** 26))) open++
  }
  return { euler: used.size - (edges.size + open) / 2 + faces, open, twice, volume: volume / 6 }
}

/** Whether a mesh has the vertices of its own grid, on the chart's edges as well. */
function hasGrid({ parameters }, rows, columns) {
  const there = new Set()
  for (let k = 0; k < parameters.length; k += 2) there.add(`${parameters[k]} ${parameters[k + 1]}`)
  const lines = (count) => Array.from({ length: count + 1 }, (_, k) => k / count)
  return lines(rows).every((s) => lines(columns).every((t) => there.has(`${s} ${t}`)))
}

for (const [name, [surface, euler, volume]] of Object.entries(SURFACES)) {
  for (const layout of [whole, wide]) test(`${name}: watertight on ${layout.name} charts, halved or not`, () => {
    let charts = layout(surface)
    for (let round = 0; round < 4; round++) {
      const mesher = new SurfaceMesher(surface, charts)
      const counts = anyCounts(charts)
      const all = meshes(mesher, charts, counts)
      all.forEach((mesh, n) => assert.ok(hasGrid(mesh, counts[2 * n], counts[2 * n + 1])))
      const found = topology(all)
      assert.equal(found.euler, euler)
      assert.equal(found.twice, 0)
      if (volume !== undefined) assert.equal(found.open, 0)
      else assert.ok(found.open > 0)
      if (volume !== undefined) assert.ok(found.volume > 0)
      if (round === 1 && volume) {
        const fine = topology(meshes(mesher, charts, allOf(layout === wide ? 128 : 32, charts))).volume
        assert.ok(Math.abs(fine / volume - 1) < 0.01, `volume ${fine}`)
      }
      charts = halved(charts)
    }
  })

  test(`${name}: triangles face outward, frames are orthonormal, arrays fit`, () => {
    const charts = halved(halved((random() < 0.5 ? whole : wide)(surface)))
    const mesher = new SurfaceMesher(surface, charts)
    for (const mesh of meshes(mesher, charts, allOf(16, charts))) {
      const { positions: p, normals, tangents, parameters, indices, outline } = mesh
      const count = p.length / 3
      assert.deepEqual([normals.length, tangents.length, parameters.length], [3 * count, 4 * count, 2 * count])
      for (const values of [p, normals, tangents, parameters, outline]) assert.ok(values.every(Number.isFinite))
      for (let k = 0; k < count; k++) {
        const n = normals.subarray(3 * k, 3 * k + 3)
        const t = tangents.subarray(4 * k, 4 * k + 4)
        assert.ok(Math.abs(Math.hypot(...n) - 1) < 1e-6 && Math.abs(Math.hypot(t[0], t[1], t[2]) - 1) < 1e-6)
        assert.ok(Math.abs(n[0] * t[0] + n[1] * t[1] + n[2] * t[2]) < 1e-6)
        assert.equal(t[3], 1)
      }
      assert.ok(indices instanceof Uint16Array && indices.length % 3 === 0)
      for (let k = 0; k < indices.length; k += 3) {
        const [a, b, c] = [...indices.subarray(k, k + 3)]
        const [u, v] = [b, c].map((x) => [0, 1, 2].map((i) => p[3 * x + i] - p[3 * a + i]))
        const facing = [0, 1, 2].reduce((sum, i) => {
          const [j, l] = [(i + 1) % 3, (i + 2) % 3]
          return sum + (u[j] * v[l] - u[l] * v[j]) * (normals[3 * a + i] + normals[3 * b + i] + normals[3 * c + i])
        }, 0)
        // Normals turn fast next to the point where the ring is pinched.
        assert.ok(facing > (name === 'pinched' ? -0.01 : 0))
      }
      // The outline runs once round the chart.
      assert.equal(outline.length % 6, 0)
      for (let k = 0; k < outline.length; k += 6) {
        const after = (k + 6) % outline.length
        assert.deepEqual(outline.slice(k + 3, k + 6), outline.slice(after, after + 3))
      }
    }
  })

  for (const layout of [whole, wide]) test(`${name}: seams of ${layout.name} charts look alike from both sides`, () => {
    const charts = halved(halved(layout(surface)))
    const mesher = new SurfaceMesher(surface, charts)
    let count = 0
    charts.forEach((_, chart) => {
      for (let edge = 0; edge < 4; edge++) {
        let covered = 0
        for (const one of mesher.seams(chart, edge)) {
          assert.ok(one.start >= covered && one.stop > one.start && one.stop <= 1)
          covered = one.stop
          const [otherStart, otherStop] = one.otherStart < one.otherStop ? [one.start, one.stop] : [one.stop, one.start]
          const [start, stop] = [one.otherStart, one.otherStop].sort((a, b) => a - b)
          const back = { start, stop, chart, edge, otherStart, otherStop }
          assert.ok(mesher.seams(one.chart, one.edge).some((two) => JSON.stringify(two) === JSON.stringify(back)))
          count++
        }
      }
    })
    assert.ok(count > charts.length || layout === wide)
  })
}

test('poles have one position, and the normal of the axis', () => {
  for (const [name, height] of [['octants', 2], ['ellipsoid', 0.75]]) {
    const charts = whole(SURFACES[name][0])
    const mesher = new SurfaceMesher(SURFACES[name][0], charts)
    for (let n = 0; n < 4; n++) {
      const { positions, normals, parameters } = mesher.mesh(n, anyCounts(charts))
      let count = 0
      for (let k = 0; k < parameters.length / 2; k++) {
        if (parameters[2 * k]) continue
        assert.deepEqual([...positions.subarray(3 * k, 3 * k + 3)].map((x) => x + 0), [0, 0, height])
        assert.ok(normals[3 * k + 2] > 1 - 1e-6)
        count++
      }
      assert.ok(count >= 3)
    }
  }
})

test("a chart's mesh depends on its own counts and its neighbours' only", () => {
  const charts = whole(SURFACES.torus[0])
  const mesher = new SurfaceMesher(SURFACES.torus[0], charts)
  const counts = anyCounts(charts)
  const near = new Set([0, 1, 2, 3].flatMap((edge) => mesher.seams(0, edge).map(({ chart }) => chart)))
  assert.equal(near.size, 4)
  const others = counts.map((count, k) => (k < 2 || near.has(k >> 1) ? count : 256 / count))
  assert.deepEqual(mesher.mesh(0, others), mesher.mesh(0, counts))
})

test('meshes of streams are watertight', () => {
  for (const [name, euler] of [['nets_16_bit', 2], ['quilt', 0]]) {
    const decoder = new UphDecoder()
    decoder.feed(new Uint8Array(readFileSync(new URL(`../vectors/${name}.uph`, import.meta.url))))
    const { surface, charts } = decoder
    const found = topology(meshes(new SurfaceMesher(surface, charts), charts, anyCounts(charts)))
    assert.deepEqual([found.euler, found.open, found.twice], [euler, 0, 0], name)
  }
})

test('large meshes have long indices, and 1 counts as 2', () => {
  const charts = whole(SURFACES.sphere[0])
  const mesher = new SurfaceMesher(SURFACES.sphere[0], charts)
  const { indices, positions } = mesher.mesh(0, allOf(256, charts))
  assert.ok(indices instanceof Uint32Array)
  assert.equal(positions.length, 3 * 257 ** 2)
  assert.equal(indices.length, 6 * 256 ** 2)
  assert.deepEqual(mesher.mesh(1, allOf(1, charts)), mesher.mesh(1, allOf(2, charts)))
})

test('counts keep chords near the surface', () => {
  const charts = whole(SURFACES.sphere[0])
  const bounds = new SurfaceMesher(SURFACES.sphere[0], charts).bounds(0)
  let before = 0
  for (const pixels of [0.001, 1, 10, 100, 1000, 1e4]) {
    const counts = countsFor(bounds, pixels, 0.5)
    for (const [n, bend] of [
      [counts[0], bounds.bendS],
      [counts[1], bounds.bendT],
    ]) {
      assert.ok(Number.isInteger(Math.log2(n)) && n >= 1 && n <= 256 && n >= before)
      assert.ok((pixels * bend) / (8 * n * n) <= 0.25 || n === 256)
      assert.ok(n === 1 || (pixels * bend) / (8 * (n / 2) ** 2) > 0.25)
    }
    before = counts[0]
  }
  assert.deepEqual(countsFor({ bendS: 0, bendT: Infinity }, 100, 0.5), [1, 256])
  assert.deepEqual(countsFor({ bendS: NaN, bendT: 1e9 }, 100, 0.5), [1, 256])
})

test('frames on both sides of an edge are turned against each other by one angle', () => {
  for (const name of ['sphere', 'octants', 'vase', 'torus']) {
    const [surface] = SURFACES[name]
    const charts = whole(surface)
    const mesher = new SurfaceMesher(surface, charts)
    let most = 0
    for (const n of charts.keys()) {
      for (let edge = 0; edge < 4; edge++) {
        for (const there of mesher.seams(n, edge)) {
          const [here, beyond] = [mesher.frameAngles(n, edge, 8), mesher.frameAngles(there.chart, there.edge, 8)]
          here.forEach((angle, k) => {
            const back = beyond[there.otherStart < there.otherStop ? k : 7 - k]
            assert.ok(Math.abs(Math.sin(angle + back)) < 1e-3 && Math.cos(angle + back) > 0.99, `${name} ${n} ${edge}`)
            most = Math.max(most, Math.abs(angle))
          })
        }
      }
    }
    // Patches of revolution run on alike; on the six faces of a sphere frames meet at any angle.
    assert.equal(most > 0.1, name === 'sphere', `${name} ${most}`)
  }
  // A quarter turn: two squares side by side, the second with its parameters turned.
  const square = (points) => ({ m: 1, n: 1, net: Float64Array.from(points.flatMap((p) => [...p, 1])) })
  const patches = [
    square([[0, 1, 0], [1, 1, 0], [0, 0, 0], [1, 0, 0]]),
    square([[1, 0, 0], [1, 1, 0], [2, 0, 0], [2, 1, 0]]),
  ]
  const surface = laid({ kind: 'nets', name: '', tolerance: 1e-6, patches }, alone(2))
  const mesher = new SurfaceMesher(surface, whole(surface))
  for (const angle of mesher.frameAngles(0, 1, 5)) assert.ok(Math.abs(angle - Math.PI / 2) < 1e-6, `${angle}`)
})

test('what cannot be is refused in one line', () => {
  const [surface] = SURFACES.cone
  const charts = whole(surface)
  const mesher = new SurfaceMesher(surface, charts)
  const refused = [
    () => mesher.mesh(4, allOf(2, charts)),
    () => mesher.bounds(-1),
    () => mesher.mesh(0, new Uint16Array(2)),
    () => mesher.mesh(0, new Float64Array(8).fill(NaN)),
  ]
  for (const attempt of refused) assert.throws(attempt, (error) => error instanceof RangeError && !/\n/.test(error))
})

/** A surface of nets, from that of another one: its patches are faces each, or lie in grids as there. */
const asNets = (surface, grids = alone(surface.patchCount)) => {
  const patches = new SurfaceMesher(surface, []).patches.map(({ m, n, net }) => ({ m, n, net: net.slice() }))
  return laid({ kind: 'nets', name: '', tolerance: 1e-9, patches }, grids)
}
const gridsOf = ({ faces }) => faces.map(({ rows, columns }) => [rows, columns])

test('patches that meet only nearly have no gaps', () => {
  for (const name of ['cyclide', 'torus', 'sphere', 'octants', 'ellipsoid']) {
    const [surface, euler] = SURFACES[name]
    for (const grids of [alone(surface.patchCount), gridsOf(surface)]) {
      const loose = asNets(surface, grids)
      for (const { net } of loose.patches) net.forEach((x, k) => (net[k] = k % 4 < 3 ? x + 1e-4 * random() : x))
      let charts = random() < 0.5 ? whole(loose) : wide(loose)
      for (let round = 0; round < 3; round++) {
        const found = topology(meshes(new SurfaceMesher(loose, charts), charts, anyCounts(charts)))
        assert.deepEqual([found.euler, found.open, found.twice], [euler, 0, 0], name)
        charts = halved(charts)
      }
    }
  }
})

test('damaged nets, seams and overlapping charts give a mesh or a refusal', { timeout: 600_000 }, () => {
  const names = Object.keys(SURFACES)
  let [refused, made] = [0, 0]
  for (let round = 0; round < 300; round++) {
    const [model] = SURFACES[names[round % names.length]]
    const grids = round % 2 ? gridsOf(model) : alone(model.patchCount)
    const surface = asNets(model, grids)
    const { patches } = surface
    for (let k = below(6); k >= 0; k--) {
      const one = patches[below(patches.length)]
      const at = below(one.net.length)
      const what = 1 + below(6)
      if (what === 1) one.net.fill(one.net[at] || 1)
      else if (what === 2) one.net.copyWithin(4 * below(one.net.length / 4), 0)
      else if (what === 3) patches[below(patches.length)] = { ...one, net: one.net.slice() }
      else if (what === 4) for (let c = 0; c < one.net.length; c += 4) one.net[c] = 0
      else if (what === 5) one.net[at] += 0.01 * random()
      else one.net.reverse().forEach((x, c) => (one.net[c] = c % 4 === 3 ? Math.abs(x) + 1e-3 : x))
    }
    for (const seam of surface.shared) if (!below(5)) seam.b = below(4 * surface.faces.length)
    for (const point of surface.points) if (!below(5)) point.edge = below(4 * surface.faces.length)
    const charts = halved(halved(round % 3 ? whole(surface) : wide(surface)))
    for (let k = below(9); k > 0; k--) {
      const [s, t] = [random(), random()]
      const box = { s0: s / 2, s1: (1 + s) / 2, t0: t / 2, t1: (1 + t) / 2 }
      charts.push(k % 2 ? { ...charts[below(charts.length)] } : { face: below(surface.faces.length), ...box })
    }
    try {
      const mesher = new SurfaceMesher(surface, charts)
      const counts = anyCounts(charts, 3)
      charts.forEach((_, n) => {
        const mesh = mesher.mesh(n, counts)
        assert.ok(mesh.normals.every(Number.isFinite) && mesh.tangents.every(Number.isFinite))
        assert.ok(mesh.indices.every((v) => v < mesh.positions.length / 3))
        countsFor(mesher.bounds(n), 100, 0.5)
      })
      made++
    } catch (error) {
      assert.ok(error instanceof RangeError, error.stack)
      refused++
    }
  }
  assert.ok(made > 200, `${refused} refused, ${made} made`)
})

test('many charts and seams along an edge are no trap', { timeout: 600_000 }, () => {
  const charts = Array.from({ length: 50_000 }, () => ({ face: 0, s0: 0, s1: 1, t0: 0, t1: 1 }))
  const mesher = new SurfaceMesher(SURFACES.octants[0], charts)
  assert.ok(mesher.mesh(0, allOf(4, charts)).indices.length > 0)
  const count = 100_000
  const [sheet] = SURFACES.plane
  const shared = Array.from({ length: count }, (_, k) => ({ a: 0, b: 2, a0: (3 * k) / count, a1: (3 * k + 3) / count, b0: (3 * k) / count, b1: (3 * k + 3) / count }))
  const points = Array.from({ length: count }, (_, k) => ({ edge: 1, low: (2 * k) / count, high: (2 * k + 2) / count }))
  const strips = Array.from({ length: 20_000 }, (_, k) => ({ face: 0, s0: 0, s1: 2, t0: (3 * k) / 20_000, t1: (3 * k + 3) / 20_000 }))
  assert.ok(new SurfaceMesher({ ...sheet, shared, points }, strips).mesh(0, allOf(2, strips)).indices.length > 0)
})
