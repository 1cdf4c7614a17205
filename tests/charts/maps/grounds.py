"""What maps are evaluated on in tests, and plain versions of what they do there."""

from typing import Any

import numpy as np
from meshes import on_charts

from upholster.charts.charted_surface import ChartedSurface, charted_patches, charted_plane
from upholster.charts.layout import density_layout
from upholster.charts.maps.map_ground import MapGround
from upholster.charts.maps.map_text import parse_map
from upholster.charts.unwrap.flat_islands import unwrap
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.geometry.model_files.model_file import ModelFile, ModelPart
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart


def on_mesh(mesh: TriangleMesh, density: float = 20.0, **more: Any) -> MapGround:
    """Return a mesh laid out flat, with so many steps a unit; as a model's of its parts."""
    surface, _ = unwrap(mesh)
    parts = tuple(ModelPart(name) for name in mesh.parts)
    model = ModelFile("model.glb", surface.mesh, parts, uv=mesh.uv, **more)
    return MapGround(on_charts(surface, density), model, surface, False)


def on_patches(surface: Surface, texels: int = 20_000) -> MapGround:
    """Return a surface of patches under about so many steps."""
    charts = density_layout(surface, texels=texels)
    return MapGround(charted_patches(surface, charts), None, surface, False)


def on_flat(height: int = 30, width: int = 40, *, tile: bool = False) -> MapGround:
    """Return a flat texture."""
    from upholster.geometry.built_in.plane import plane

    return MapGround(charted_plane(Chart(0, height, width), tile=tile), None, plane(), True)


def steps_of(charted: ChartedSurface) -> list[tuple[np.ndarray, ...]]:
    """Find by comparing with all triangles which steps of each chart are inside one.

    Returns for each chart the row and column of those steps, their triangles, and their barycentric
    coordinates there (n, 3).
    """
    out = []
    for number, chart in enumerate(charted.charts):
        found = np.full((chart.height, chart.width), -1)
        weights = np.zeros((chart.height, chart.width, 3))
        for t in np.flatnonzero(charted.chart == number):
            p = charted.places[t]
            system = np.concatenate([p.T, np.ones((1, 3))])
            if abs(np.linalg.det(system)) < 1e-9:
                continue
            (top, left), (bottom, right) = (
                np.floor(p.min(axis=0)).astype(int),
                np.ceil(p.max(axis=0)).astype(int),
            )
            rows, columns = (part.ravel() for part in np.mgrid[top:bottom, left:right])
            places = np.stack([rows + 0.5, columns + 0.5, np.ones(len(rows))])
            shares = np.linalg.solve(system, places).T
            inside = shares.min(axis=1) > 1e-9
            found[rows[inside], columns[inside]] = t
            weights[rows[inside], columns[inside]] = shares[inside]
        row, column = np.nonzero(found >= 0)
        out.append((row, column, found[row, column], weights[row, column]))
    return out


def map_values(text: str, ground: MapGround) -> np.ndarray:
    """Return a map's values at the steps of `steps_of`, all charts' together."""
    values = parse_map(text).values(ground)
    steps = steps_of(ground.charted)
    return np.concatenate([v[rows, columns] for v, (rows, columns, *_) in zip(values, steps, strict=True)])


def at_steps(corners: np.ndarray, ground: MapGround) -> np.ndarray:
    """Return corners' values (T, 3, …) at the steps of `steps_of`, all charts' together."""
    return np.concatenate(
        [np.einsum("nk,nk...->n...", weights, corners[t]) for *_, t, weights in steps_of(ground.charted)]
    )
