"""Unfolding and fitted sheets: on developable surfaces a block's map is that of the plane."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from laying import Folded, cone, cylinder, folded, hinge, plane
from laying_kernels import unfold
from plain_laying import barycentric
from tests.charts.meshes import sphere

from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.subdivision import subdivided
from upholster.charts.surface_to_cover import as_covered
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt.ground import field_arrays, ground_of
from upholster.synthesis.quilt.kernels._lay_kernels import Ground
from upholster.synthesis.quilt.kernels._sheet_kernels import FIT, MOST_SHEETS, SheetScratch
from upholster.synthesis.quilt.kernels._unfold_kernels import Footprint, UnfoldScratch
from upholster.synthesis.setup import prepare


class Block:
    """A block unfolded round a place (shares) of a triangle."""

    def __init__(self, ground: Ground, triangle: int, half: float, scale: float, shares: Any = (1, 1, 1)):
        mesh, self.ground = ground.mesh, ground
        self.shares = np.array(shares, float) / np.sum(shares)
        out = Footprint.of(1 << 13)
        self.fits, sizes = np.zeros((MOST_SHEETS, FIT)), np.zeros(2, np.int64)
        place = self.shares @ mesh.places[triangle]
        root = np.array([mesh.chart[triangle], *place, 0, 0, mesh.turns[triangle]], float)
        unfolding = UnfoldScratch.of(len(mesh.first) - 1, len(mesh.triangles))
        sheets = SheetScratch.of(len(mesh.triangles))
        unfold(
            mesh,
            ground.field,
            triangle,
            self.shares @ mesh.corners[triangle],
            root,
            half,
            scale,
            unfolding,
            sheets,
            out,
            self.fits,
            sizes,
        )
        count, self.pieces = sizes.tolist()
        self.triangles, self.sheets = out.triangles[:count], out.sheets[:count]
        self.maps = out.maps[:count]
        # Scratch is left as it was found.
        assert not unfolding.state.any()
        assert (unfolding.local == -1).all()
        assert (sheets.local == -1).all()

    def shown(self, sheet: int, places: np.ndarray, field: Any) -> np.ndarray:
        """Return where places (n, 2) of a sheet's chart read: s + ½ (C + M(q)) (q − c)."""
        fit = self.fits[sheet]
        both = 0.5 * (fit[6:10].reshape(2, 2) + field.at(places[:, 0], places[:, 1]))
        return np.asarray(fit[4:6] + np.einsum("nij,nj->ni", both, places - fit[2:4]))


def off(surface: Folded, flat: np.ndarray, block: Block, triangle: int) -> np.ndarray:
    """Return by how much corners of a block's triangles are off where the plane has them, in pixels."""
    middle = block.shares @ flat[triangle]
    corners = flat[block.triangles] - middle
    exact = surface.scale * np.stack([-corners[..., 1], corners[..., 0]], axis=2)
    return np.abs(block.maps - exact).max(axis=2)


def held(triangles: np.ndarray) -> np.ndarray:
    """Return which places of a block's square lie in some of the triangles."""
    places = np.stack(np.meshgrid(*2 * [np.linspace(-13.9, 13.9, 40)]), axis=-1).reshape(-1, 2)
    return np.any([barycentric(p, places).min(axis=1) >= -1e-9 for p in triangles], axis=0)


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
@pytest.mark.parametrize(("make", "scale"), [(plane, 1.0), (cylinder, 0.7), (cone, 1.0), (hinge, 0.7)])
def test_over_what_is_folded_from_the_plane_the_map_is_the_planes(
    make: Callable[..., Folded], scale: float
) -> None:
    surface = make(scale=scale)
    ground, flat = surface.ground(9.0)
    for triangle in range(5, len(flat), 83):
        block = Block(ground, triangle, 14.0, scale, (1, 2, 3))
        assert off(surface, flat, block, triangle).max() < 1e-6
        assert len(set(block.triangles.tolist())) == len(block.triangles)
        assert block.pieces == 1
        # What lies in the square is there, and nothing that lies beside it.
        corners = scale * (flat - block.shares @ flat[triangle])
        beside = ((corners.min(axis=1) > 14.001) | (corners.max(axis=1) < -14.001)).any(axis=1)
        assert not beside[block.triangles].any()
        wanted, found = (held(corners[one]) for one in (~beside, block.triangles))
        np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize(("turned", "stretched"), [(0, 1), (90, 1), (-140, 1), (0, 1.25), (33, 0.8)])
@pytest.mark.parametrize("make", [cylinder, cone])
def test_sheets_of_two_charts_read_on_in_each_other(
    make: Callable[..., Folded], turned: float, stretched: float
) -> None:
    whole = make()
    columns = len(whole.flat) // 12
    surface = make(
        islands=np.tile(np.arange(columns) * 2 // columns, 12), turned=(0.0, turned), stretched=stretched
    )
    ground, flat = surface.ground(9.0)
    mesh = ground.mesh
    # Steps are taken over the seam by how the second chart is turned and stretched.
    a, over = np.radians(turned), mesh.crossing[mesh.seam[(mesh.seam >= 0) & (mesh.chart == 0)[:, None]]]
    exact = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) * (1, stretched)
    np.testing.assert_allclose(over, np.broadcast_to(exact.T, over.shape), atol=1e-9)
    # Blocks about a seam's edges, inside the surface.
    near = np.flatnonzero((mesh.seam >= 0).any(axis=1))[::4]
    assert len(near) >= 3
    for triangle in near.tolist():
        block = Block(ground, triangle, 14.0, 1.0)
        assert set(block.sheets.tolist()) == {0, 1}
        assert (block.fits[:2, 0] == 1).all()
        assert off(surface, flat, block, triangle).max() < 1e-6
        place = {t: n for n, t in enumerate(block.triangles.tolist())}
        for t, n in place.items():
            for k in np.flatnonzero(mesh.seam[t] >= 0):
                across = mesh.neighbours[t, k]
                other, last = across // 3, across % 3
                if other not in place:
                    continue
                a = mesh.places[t, [k, (k + 1) % 3]]
                b = mesh.places[other, [(last + 1) % 3, last]]
                sheets = block.sheets[[n, place[other]]]
                reads = [
                    block.shown(sheet, ends, surface.fields[int(block.fits[sheet, 1])])
                    for sheet, ends in zip(sheets, (a, b), strict=True)
                ]
                inside = np.abs(reads[0]).max(axis=1) < 14
                assert (np.abs(reads[0] - reads[1])[inside] < 0.1).all()


def test_blocks_end_at_creases_and_where_the_surface_is_left_plain() -> None:
    surface = hinge(60.0)
    ground, flat = surface.ground(9.0, crease=40)
    beyond = flat[..., 0].mean(axis=1) > 40
    triangle = int(np.abs(flat.mean(axis=1) - (35, 30)).sum(axis=1).argmin())
    assert not beyond[Block(ground, triangle, 14.0, 1.0).triangles].any()
    ground, _ = surface.ground(9.0, crease=80)
    assert beyond[Block(ground, triangle, 14.0, 1.0).triangles].any()
    ground.mesh.chart[beyond] = -1
    assert not beyond[Block(ground, triangle, 14.0, 1.0).triangles].any()


def cube_laid_out(count: int) -> MeshSurface:
    """Return a sphere laid out by the six sides of a cube round it, each seen from its axis."""
    mesh = sphere(count)
    axis = np.abs(mesh.flat_normals).argmax(axis=1)
    sign = np.sign(np.take_along_axis(mesh.flat_normals, axis[:, None], 1)[:, 0])
    parameters = np.empty((len(axis), 3, 2))
    for n, (k, s) in enumerate(zip(axis, sign, strict=True)):
        right, up = np.eye(3)[(k + 1) % 3], np.eye(3)[(k + 2) % 3] * s
        parameters[n] = np.stack([-mesh.corners[n] @ up, mesh.corners[n] @ right], axis=1)
    return MeshSurface(mesh, np.unique(2 * axis + (sign > 0), return_inverse=True)[1], parameters)


def test_on_a_sphere_a_block_keeps_size_and_direction() -> None:
    rng = np.random.default_rng(1)
    exemplar = rng.integers(0, 256, (64, 64, 1), dtype=np.uint8)
    prepared = prepare(
        Exemplar(exemplar), cube_laid_out(16), SynthesisOptions(texels=80_000, sample_size=0.8, block=24)
    )
    assert prepared.field is not None
    assert prepared.scale is not None
    scale = prepared.scale.scale
    fine = subdivided(prepared.charted, prepared.field.corner_vectors, 0.4 * 24 / scale)
    turns = np.zeros(len(fine.parent), np.int32)
    ground = ground_of(fine, field_arrays(prepared.fields, 0), crease=None, fold=1, turns=turns).bare().ground
    mesh = ground.mesh
    chosen = np.flatnonzero(np.abs(mesh.corners.mean(axis=1)[:, 2]) < 0.5)[::197]
    for triangle in chosen.tolist():
        block = Block(ground, triangle, 12.0, scale)
        assert block.triangles[0] == triangle
        edges = block.maps[:, 1:] - block.maps[:, :1]
        shown = 0.5 * np.linalg.det(edges) / scale**2
        corners = mesh.corners[block.triangles]
        area = 0.5 * np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        assert np.abs(shown / area - 1).mean() < 0.05
        assert 1 < shown.sum() * (scale / 24) ** 2 < 2  # whole triangles
        kept = block.sheets >= 0
        off_field = [
            _off_field(mesh, prepared.fields, t, block, sheet, scale)
            for t, sheet in zip(block.triangles[kept], block.sheets[kept], strict=True)
        ]
        assert np.median(off_field) < 1


def _off_field(mesh: Any, fields: Any, t: int, block: Block, sheet: int, scale: float) -> float:
    # What a sheet shows of a triangle's corners, against where they lie in the field: 1 for 5° or 5 %.
    shown = block.shown(sheet, mesh.places[t], fields[int(block.fits[sheet, 1])])
    true = scale * np.stack([mesh.corners[t] @ mesh.down[t], mesh.corners[t] @ mesh.along[t]], axis=1)
    turned = (shown[1:] - shown[0]).T @ np.linalg.inv((true[1:] - true[0]).T)
    angle, size = abs(turned[0, 1]) / turned[0, 0], np.sqrt(np.linalg.det(turned))
    return float(max(angle / 0.0875, abs(size - 1) / 0.05))


def test_sheets_beyond_the_most_are_left_out_rather_than_wrong() -> None:
    # Every triangle a chart of its own.
    whole = cylinder(60, 60, 6)
    count = len(whole.flat)
    surface = cylinder(60, 60, 6, islands=np.arange(count), turned=(0.0,) * count)
    ground, flat = surface.ground(30.0)
    triangle = int(np.abs(flat.mean(axis=1) - (30, 30)).sum(axis=1).argmin())
    block = Block(ground, triangle, 40.0, 1.0)
    assert block.pieces == MOST_SHEETS
    assert block.sheets.max() < MOST_SHEETS
    assert (block.sheets == -1).any()
    assert (block.fits[block.sheets[block.sheets >= 0], 0] == 1).all()
    assert off(surface, flat, block, triangle).max() < 1e-6


def test_surfaces_that_touch_have_vertices_of_their_own() -> None:
    # Two pieces of the plane share a vertex in their middle alone.
    flat = np.array([(0, 0), (40, 0), (40, 40), (0, 40), (80, 40), (80, 80), (40, 80)], float)
    triangles = np.array([(0, 1, 2), (0, 2, 3), (2, 4, 5), (2, 5, 6)])
    surface = folded(
        flat,
        np.column_stack([flat, 0 * flat[:, 0]]),
        triangles,
        islands=np.array([0, 0, 1, 1]),
        turned=(0, 0),
    )
    ground, lies = surface.ground(9.0)
    own = [set(ground.mesh.triangles[ground.mesh.chart == n].ravel().tolist()) for n in (0, 1)]
    assert not own[0] & own[1]
    triangle = int(np.abs(lies.mean(axis=1) - (36, 36)).sum(axis=1).argmin())
    found = Block(ground, triangle, 14.0, 1.0).triangles
    assert (ground.mesh.chart[found] == 0).all()


def test_text_forms_have_grounds_without_gaps() -> None:
    # Each edge of a closed surface of patches has a neighbour, however charts are tessellated.
    surface = as_covered("sphere").surface
    image = np.zeros((64, 64, 1), np.uint8)
    prepared = prepare(Exemplar(image), surface, SynthesisOptions(texels=5000, sample_size=1.0))
    assert (prepared.charted.mesh.neighbours >= 0).all()
    assert prepared.charted.is_seam.any()
