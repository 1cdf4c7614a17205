"""Islands that are larger than a page are cut in the atlas; their charts, and all that they show, stay."""

from typing import Any

import numpy as np
import pytest

from upholster.base.errors import InputError
from upholster.charts.mesh_layout import chart_places, mesh_charts
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.model.atlas import build_atlas
from upholster.model.islands import pack_islands
from upholster.model.mesh_on_charts import mesh_on_charts
from upholster.quilt.model import Texels

BOX = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
"""Corners of a cube's sides, counter-clockwise from outside; corner 4x + 2y + z."""


def box(side: float) -> MeshSurface:
    """A closed cube of two triangles a side: one island of three sides in a row, three of one side."""
    positions = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) * side
    triangles = np.concatenate([BOX[:, :3], BOX[:, [0, 2, 3]]])
    square = np.array([[0, 0], [side, 0], [side, side], [0, side]])
    parameters = np.concatenate([np.tile(square[list(k)], (6, 1, 1)) for k in ((0, 1, 2), (0, 2, 3))])
    island = np.tile([0, 0, 0, 1, 2, 3], 2)
    parameters[:, :, 1] += side * np.tile([0, 1, 2, 0, 0, 0], 2)[:, None]
    normals = np.cross(*(positions[triangles][:, k] - positions[triangles][:, 0] for k in (1, 2)))
    normals = np.repeat(normals[:, None] / side**2, 3, axis=1)
    mesh = TriangleMesh(
        positions, triangles, np.tile([0, 0, 1, 1, 1, 1], 2), ("a", "b"), parameters / side, normals
    )
    return MeshSurface(mesh, island, parameters)


def shown(surface: MeshSurface, charts: Any, layout: Any, texels: Texels) -> tuple[Any, Any]:
    """Texels of the atlas at points of the cut triangles, and those points' places on the uncut charts."""
    cut = layout.cuts
    pixels = build_atlas(cut.texels(texels), (), layout).pixels
    share = np.random.default_rng(1).dirichlet((1, 1, 1), 40)
    on_pieces = np.einsum("kc,tca->tka", share, chart_places(cut.surface, cut.charts))
    origin = np.array([(cell.row, cell.column) for cell in layout.cells])[cut.surface.island]
    rows, columns = np.floor(on_pieces + origin[:, None]).astype(int).reshape(-1, 2).T
    first = np.array([(chart.s0, chart.t0) for chart in charts])
    whole = np.array([window[0] for window in cut.windows])[cut.surface.island]
    places = np.einsum("kc,tca->tka", share, cut.surface.parameters) - first[whole][:, None]
    return pixels[rows, columns], np.concatenate(
        [np.floor(places + 1e-9), np.broadcast_to(whole[:, None, None], (*places.shape[:2], 1))], axis=2
    ).reshape(-1, 3)


@pytest.mark.parametrize(("side", "size"), [(700.0, 512), (700.0, 256), (200.0, 512)])
def test_a_cut_island_shows_what_its_chart_shows(side: float, size: int) -> None:
    surface = box(side)
    charts = mesh_charts(surface, 1.0)
    layout = pack_islands(surface, charts, gutter=8, size=size)
    assert layout.cuts is not None
    assert layout.cuts.halved == (side > size)
    assert {(page.height, page.width) for page in layout.pages} == {(size, size)}
    arrays = tuple(
        np.stack(
            [*np.indices((chart.height, chart.width)), np.full((chart.height, chart.width), n)], -1
        ).astype(np.float32)
        for n, chart in enumerate(charts)
    )
    found, expected = shown(
        surface, charts, layout, Texels(charts, tuple(a.astype(np.float32) for a in arrays))
    )
    near = np.abs(found - expected).max(axis=1)
    assert near.max() <= 1  # a point on the border of two texels may show either
    assert (near == 0).mean() > 0.999


def test_halved_triangles_leave_no_gaps_and_keep_their_data() -> None:
    surface = box(700.0)
    layout = pack_islands(surface, mesh_charts(surface, 1.0), gutter=8, size=256)
    assert layout.cuts is not None
    mesh = layout.cuts.surface.mesh
    assert mesh.areas.sum() == pytest.approx(surface.mesh.areas.sum())
    assert (mesh.neighbours >= 0).all()
    assert (np.diff(mesh.part[np.argsort(mesh.part, kind="stable")]) >= 0).all()
    assert mesh.normals is not None
    assert mesh.uv is not None
    np.testing.assert_allclose(mesh.normals, np.repeat(mesh.flat_normals[:, None], 3, axis=1), atol=1e-12)
    np.testing.assert_allclose(mesh.uv, layout.cuts.surface.parameters / 700.0, atol=1e-12)
    sides = np.abs(mesh.normals[:, 0]).argmax(axis=1)
    assert ((sides == 0) == (mesh.part == 0)).all()
    on_charts = mesh_on_charts(layout.cuts.surface, layout.cuts.charts)
    page, uv = layout.page_coordinates(on_charts)
    assert uv.min() >= 0
    assert uv.max() <= 1
    assert (page[on_charts.triangles] == page[on_charts.triangles[:, :1]]).all()


def test_an_island_that_fits_is_not_cut() -> None:
    surface = box(70.0)
    assert pack_islands(surface, mesh_charts(surface, 1.0), gutter=8, size=256).cuts is None
    assert pack_islands(box(700.0), mesh_charts(box(700.0), 1.0), gutter=8).cuts is None


def test_padding_leaves_room_for_pieces() -> None:
    surface = box(700.0)
    with pytest.raises(InputError, match=r"padding is 240 on pages of 256 x 256 .*: less padding"):
        pack_islands(surface, mesh_charts(surface, 1.0), gutter=240, size=256)
