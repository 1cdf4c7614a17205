"""Mesh surfaces made by hand, quilts over them, and what stays of a mesh in a stream."""

from typing import Any

import numpy as np
from streams import anything

from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt


def flattened(mesh: Any, island: Any) -> Any:
    """Each island laid out by looking along its mean normal: enough for islands that bend little."""
    parameters = np.zeros((len(mesh.triangles), 3, 2))
    for n in range(island.max() + 1):
        some = island == n
        out = mesh.flat_normals[some].sum(axis=0)
        out /= max(np.linalg.norm(out), 1e-12)
        down = np.cross(np.eye(3)[np.argmin(np.abs(out))], out)
        down /= max(np.linalg.norm(down), 1e-12)
        right = np.cross(out, down)
        parameters[some] = mesh.corners[some] @ np.stack([down, right], axis=1)
    return MeshSurface(mesh, island, parameters)


def cube(cells: Any = 1, sides: Any = 6, **options: Any) -> Any:
    """A cube with an island for each of its first sides; of others triangles are left plain."""
    points, triangles, island = [], [], []
    for side in range(6):
        axis, sign = side // 2, 1 - 2 * (side % 2)
        first = len(points)
        u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3] * sign
        steps = np.arange(cells + 1)[:, None] * 2 / cells - 1
        points += list((sign * np.eye(3)[axis] + steps[:, None] * u + steps * v).reshape(-1, 3))
        for i in range(cells):
            for j in range(cells):
                a = first + i * (cells + 1) + j
                triangles += [(a, a + cells + 1, a + cells + 2), (a, a + cells + 2, a + 1)]
                island += [side if side < sides else -1] * 2
    return flattened(joined(points, triangles, **options), np.array(island, np.int32))


def joined(points: Any, triangles: Any, **options: Any) -> Any:
    """A mesh whose vertices at one place are one."""
    places, vertex = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    return TriangleMesh(places, vertex.reshape(-1)[np.asarray(triangles)], **options)


def icosphere(steps: Any = 2, each: Any = False) -> Any:
    """A sphere of two islands, upper and lower, or of one for each triangle."""
    g = (1 + 5**0.5) / 2
    points = np.array([(x, y * g, 0) for x in (-1, 1) for y in (-1, 1)], float)
    points = np.concatenate([np.roll(points, k, axis=1) for k in range(3)])
    edge = np.linalg.norm(points[:, None] - points, axis=2) < 2.1
    triangles = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if edge[i, j] and edge[j, k] and edge[i, k]
    ]
    corners = points[np.array(triangles)]
    inward = np.linalg.det(corners) < 0
    corners[inward] = corners[inward][:, ::-1]
    for _ in range(steps):
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = np.concatenate(
            [np.stack(part, axis=1) for part in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
        )
    corners /= np.linalg.norm(corners, axis=2, keepdims=True)
    mesh = joined(corners.reshape(-1, 3), np.arange(corners.shape[0] * 3).reshape(-1, 3), name="icosphere")
    count = len(mesh.triangles)
    lower = mesh.corners.mean(axis=1)[:, 2] < 0
    return flattened(mesh, np.arange(count, dtype=np.int32) if each else lower.astype(np.int32))


def grid(rows: Any, columns: Any, wrap: Any = (False, False), holes: Any = ()) -> Any:
    """A sheet, a ring or a torus of squares without some of them; one island."""
    tall, wide = rows + (not wrap[0]), columns + (not wrap[1])
    u, v = np.meshgrid(np.arange(tall) / rows, np.arange(wide) / columns, indexing="ij")
    if any(wrap):
        around, through = 2 * np.pi * v, 2 * np.pi * u
        out = 3 + np.cos(through) if wrap[0] else 3
        points = np.stack([out * np.cos(around), out * np.sin(around), np.sin(through)], axis=-1)
    else:
        points = np.stack([v, -u, 0.1 * np.sin(5 * u) * v], axis=-1)
    triangles = []
    for i in range(rows):
        for j in range(columns):
            if (i, j) in holes:
                continue
            a, b = i * wide + j, i * wide + (j + 1) % wide
            c, d = (i + 1) % tall * wide + j, (i + 1) % tall * wide + (j + 1) % wide
            triangles += [(a, c, d), (a, d, b)]
    mesh = TriangleMesh(points.reshape(-1, 3), np.array(triangles))
    return flattened(mesh, np.zeros(len(triangles), np.int32))


def soup(seed: Any, vertices: Any = 12, triangles: Any = 60, islands: Any = 5, parts: Any = 3) -> Any:
    """Triangles between random vertices: edges of many triangles, vertices twice in one, islands anywhere."""
    rng = np.random.default_rng(seed)
    chosen = rng.integers(0, vertices, (triangles, 3))
    island = rng.integers(-1, islands, triangles).astype(np.int32)
    island[:islands] = np.arange(islands)
    part = rng.integers(0, parts, triangles)
    mesh = TriangleMesh(
        rng.normal(size=(vertices, 3)),
        chosen,
        part,
        tuple(f"part {n}" for n in range(parts)),
        name="soup",
        metres=0.01,
    )
    at_vertices = rng.integers(0, 40, (islands + 1, vertices, 2)) / 8.0
    parameters = at_vertices[island[:, None], chosen]
    loose = rng.random((triangles, 3)) < 0.2
    parameters[loose] += rng.integers(0, 3, (int(loose.sum()), 2)) / 8.0
    return MeshSurface(mesh, island, parameters)


def charts_of(surface: Any, texels_a_unit: Any = 16.0, margin: Any = 2) -> Any:
    """A chart for each island, of square texels, with a margin."""
    size, charts = 1 / texels_a_unit, []
    for face, (low, high) in enumerate(surface.boxes):
        first = np.floor(low / size) - margin
        counts = np.ceil(high / size) + margin - first
        ends = [(size * a, size * (a + n)) for a, n in zip(first, counts, strict=True)]
        charts.append(Chart(face, int(counts[0]), int(counts[1]), *map(float, (*ends[0], *ends[1]))))
    return tuple(charts)


def sheets(rng: Any, charts: Any, shape: Any, blocks: Any, fields: Any = ()) -> Any:
    """A quilt of blocks whose matrices have offsets."""
    quilt = anything(rng, shape, charts, blocks, 1)
    placed = quilt.placements.copy()
    angle = rng.uniform(0, 2 * np.pi, len(placed))
    turn = np.stack([np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)], axis=1)
    placed["offset"] = np.rint(turn * 4096)
    return Quilt(tuple(charts), shape, placed, quilt.labels, tuple(fields))


def in_steps(surface: Any, step: Any, unit: Any) -> Any:
    """The triangles of a surface in whole steps, each from its least corner on, in order."""
    mesh, low = surface.mesh, surface.mesh.box[0]
    p = np.rint((mesh.corners - low) / step)
    q = np.where(surface.island[:, None, None] >= 0, np.rint(surface.parameters / unit), 0)
    rows = np.concatenate([p, q], axis=2)
    turns = np.stack([np.roll(rows, -k, axis=1).reshape(len(rows), -1) for k in range(3)], axis=1)
    best = np.array([min(map(tuple, three)) for three in turns.tolist()])
    group = np.stack([surface.island, mesh.part], axis=1)
    both = np.concatenate([group, best], axis=1)
    return both[np.lexsort(both.T[::-1])]
