"""Meshes in streams beside Draco, over the meshes of a folder.

For each mesh of a folder (GLB, OBJ, PLY, STL, OFF; at most 150,000 triangles): bytes of its code with
positions and parameters of 12 bits each, and Draco's of the same charts, laid on a square of 12 bits, at the
best of its levels 7 and 10. Then bytes at the precision that streams have for so many texels: 1/8 texel.
"""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import Request
from benchmarks.tables import Table
from upholster.base.types import FloatArray
from upholster.charts.unwrap.flat_islands import unwrap
from upholster.codec.stream.mesh.mesh_code import TEXEL_STEPS, MeshPrecision, pack_mesh
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh, welded

__all__ = ["measured"]

SUFFIXES = (".glb", ".obj", ".ply", ".stl", ".off")
MOST_TRIANGLES = 150_000
BITS = 12
TEXELS = 1_000_000


def measured(request: Request) -> Table:
    """Compare with Draco over the meshes."""
    rows, ratios = [], []
    for path in request.listed(SUFFIXES):
        mesh = _read(path)
        if mesh is None:
            continue
        surface = unwrap(mesh)[0]
        uv, side = _on_square(surface)
        ours = pack_mesh(surface, MeshPrecision(BITS, side / (2**BITS - 1)))
        theirs = _draco(surface, uv)
        texel = float(np.sqrt(mesh.areas.sum() / TEXELS))
        fine = pack_mesh(surface, MeshPrecision(BITS, texel / TEXEL_STEPS))
        ratios.append(len(ours) / theirs)
        sizes = [f"{size:,}" for size in (len(mesh.triangles), surface.islands, len(ours), theirs)]
        rows.append([path.name, *sizes, f"{ratios[-1]:.3f}", f"{len(fine):,}"])
    rows.append(["mean", "", "", "", "", f"{np.mean(ratios):.3f}", ""])
    columns = ("mesh", "triangles", "islands", "bytes", "Draco", "ratio", f"bytes, 1/{TEXEL_STEPS} texel")
    return Table(columns, rows)


def _read(path: Path) -> TriangleMesh | None:
    import trimesh

    try:
        loaded: Any = trimesh.load(path, process=False, force="mesh")
        positions, vertex = welded(loaded.vertices)
        triangles = vertex[np.asarray(loaded.faces)]
    except Exception as error:  # what a file has that trimesh can not read is its own matter
        print(f"{path.name}: {error}")
        return None
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    if not 1 <= whole.sum() <= MOST_TRIANGLES:
        return None
    return TriangleMesh(positions, triangles[whole], name=path.stem)


def _on_square(surface: MeshSurface) -> tuple[FloatArray, float]:
    """Return texture coordinates of islands in rows on a square, and the square's side in model units."""
    extents = surface.boxes[:, 1] - surface.boxes[:, 0]
    width = 1.1 * float(np.sqrt(extents.prod(axis=1).sum()))
    places, place, row = np.zeros_like(extents), np.zeros(2), 0.0
    for n in np.argsort(-extents[:, 0], kind="stable"):
        if place[1] + extents[n, 1] > width:
            place, row = np.array([place[0] + row, 0.0]), 0.0
        places[n] = place
        place, row = place + np.array([0.0, extents[n, 1]]), max(row, float(extents[n, 0]))
    laid = surface.parameters + (places - surface.boxes[:, 0])[surface.island][:, None]
    side = float(laid.max())
    return laid / side, side


def _draco(surface: MeshSurface, uv: FloatArray) -> int:
    import DracoPy

    corners = surface.mesh.triangles.reshape(-1)
    keys = np.column_stack([corners, uv.reshape(-1, 2)])
    _, first, vertex = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    points = surface.mesh.positions[corners[first]].astype(np.float32)
    faces = vertex.reshape(-1, 3).astype(np.uint32)
    return min(
        len(
            DracoPy.encode(
                points,
                faces,
                quantization_bits=BITS,
                compression_level=level,
                tex_coord=np.ascontiguousarray(uv.reshape(-1, 2)[first]),
                tex_coord_quantization_bits=BITS,
            )
        )
        for level in (7, 10)
    )
