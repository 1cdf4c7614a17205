"""Meshes laid out flat: islands, stretch, density, overlaps, seconds.

``python -m benchmarks unwrap FOLDER`` reads the models in a folder by trimesh; without a folder it makes a
torus of 100,000 triangles.
"""

import time
from pathlib import Path

import numpy as np

from benchmarks.measure import Results
from upholster.charts.unwrap import unwrap
from upholster.charts.unwrap._raster_kernels import coverage
from upholster.charts.unwrap.flattening import signed_areas
from upholster.geometry.triangle_mesh import MeshSurface, TriangleMesh, welded

__all__ = ["unwrapping"]

_SUFFIXES = {".glb", ".gltf", ".obj", ".off", ".ply", ".stl"}
_SIDE = 512


def unwrapping(results: Results, *, folder: Path | None = None) -> None:
    """Lay out every model of a folder, or a torus."""
    if folder is None:
        _one(results, _torus())
        return
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() in _SUFFIXES:
            try:
                mesh = _read(path)
            except Exception as error:  # trimesh raises anything; the table goes on
                results.add(f"unwrap {path.name}", float("nan"), "s", remark=f"not read: {error}"[:80])
                continue
            _one(results, mesh)


def _one(results: Results, mesh: TriangleMesh) -> None:
    start = time.perf_counter()
    surface, report = unwrap(mesh)
    seconds = time.perf_counter() - start
    real = (surface.island >= 0) & (mesh.areas > 0)
    flips = int((signed_areas(surface.parameters[real]) <= 0).sum())
    density, stretch = (", ".join(f"{x:.2f}" for x in values) for values in (report.density, report.stretch))
    remark = (
        f"{len(mesh.triangles)} triangles, {report.islands} islands; density {density} (p99/p1 "
        f"{report.spread:.2f}); stretch {stretch}; flips {flips}, overlaps {_overlap(surface):.2%}"
    )
    results.add(f"unwrap {mesh.name}", seconds, "s", remark=remark)


def _overlap(surface: MeshSurface) -> float:
    """Return how much of the islands' samples lies under several triangles of one island."""
    total, several = 0, 0
    order = np.argsort(surface.island, kind="stable")
    first = np.searchsorted(surface.island[order], np.arange(surface.islands + 1))
    for island, (low, high) in enumerate(surface.boxes):
        corners = surface.parameters[order[first[island] : first[island + 1]]]
        times = np.zeros((_SIDE, _SIDE), np.int32)
        coverage((corners - low) / max(float((high - low).max()), 1e-300) * _SIDE, times)
        total += int((times > 0).sum())
        several += int((times > 1).sum())
    return several / max(total, 1)


def _read(path: Path) -> TriangleMesh:
    import trimesh

    read = trimesh.load(path, process=False)
    whole = read.to_geometry() if isinstance(read, trimesh.Scene) else read
    positions, vertex = welded(np.asarray(whole.vertices, np.float64))
    return TriangleMesh(positions, vertex[np.asarray(whole.faces)], name=path.name)


def _torus(rows: int = 160, columns: int = 312) -> TriangleMesh:
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    a, b = 2 * np.pi * i / rows, 2 * np.pi * j / columns
    positions = np.stack([(3 + np.cos(a)) * np.cos(b), (3 + np.cos(a)) * np.sin(b), np.sin(a)], axis=-1)
    here, right = i * columns + j, i * columns + (j + 1) % columns
    down, both = (i + 1) % rows * columns + j, (i + 1) % rows * columns + (j + 1) % columns
    triangles = np.stack([here, right, both, here, both, down], axis=-1).reshape(-1, 3)
    return TriangleMesh(positions.reshape(-1, 3), triangles.astype(np.int32), name="torus")
