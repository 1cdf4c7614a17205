"""Samples and surfaces for tests of laying, and what was laid on them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from plain_laying import SYMMETRIES
from warp_fields import quantised

from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.charted_surface import ChartedSurface
from upholster.charts.layout import TextureScale
from upholster.charts.subdivision import subdivided
from upholster.charts.surface_to_cover import as_covered
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.quilt.chart import Chart
from upholster.quilt.model import Quilt
from upholster.quilt.warp_field import WarpField
from upholster.runtime.parallel import running
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt.emit import emitted_quilt, label_pieces
from upholster.synthesis.quilt.ground import PlacedGround, field_arrays, ground_of
from upholster.synthesis.quilt.kernels._block_kernels import LayNumbers
from upholster.synthesis.quilt.kernels._lay_kernels import Ground
from upholster.synthesis.quilt.laid_blocks import Drawn
from upholster.synthesis.quilt.lay_plan import LayPlan
from upholster.synthesis.quilt.laying import lay_parcel
from upholster.synthesis.quilt.method import laid_quilt, lay_plan
from upholster.synthesis.quilt.quilt_options import QuiltOptions
from upholster.synthesis.quilt.scene import Scene
from upholster.synthesis.setup import prepare


def texture(
    height: int = 56, width: int = 48, channels: int = 3, seed: int = 0, passes: int = 5
) -> np.ndarray:
    """Return a smooth random texture, uint8: blocks of it differ, and match better or worse."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(height, width, channels))
    for axis in (0, 1):
        for _ in range(passes):
            noise = (noise + np.roll(noise, 1, axis)) / 2
    noise = (noise - noise.min()) / np.ptp(noise)
    return np.rint(noise * 255).astype(np.uint8)


@dataclass(frozen=True)
class Folded:
    """A developable surface, and where it lies in the plane that it was folded from.

    `flat` (T, 3, 2) are x and y of corners there; `vectors` (T, 3, 3) run along x.
    """

    charted: ChartedSurface
    flat: np.ndarray
    vectors: np.ndarray
    fields: tuple[WarpField, ...]
    scale: float

    def placed(self, longest: float, crease: float | None = None) -> tuple[PlacedGround, np.ndarray]:
        """Return the ground for blocks, and where its triangles lie in the plane."""
        fine = subdivided(self.charted, self.vectors, longest)
        turns = np.zeros(len(fine.surface.chart), np.int32)
        placed = ground_of(fine, field_arrays(self.fields, 0), crease=crease, fold=1, turns=turns).bare()
        return placed, self.in_plane(fine.surface, fine.parent)

    def ground(self, longest: float, crease: float | None = None) -> tuple[Ground, np.ndarray]:
        """Return the same, as kernels take it."""
        placed, flat = self.placed(longest, crease)
        return placed.ground, flat

    def in_plane(self, surface: ChartedSurface, parent: np.ndarray) -> np.ndarray:
        """Return where corners of triangles cut out of others lie in the plane."""
        out = np.empty((len(parent), 3, 2))
        for n, t in enumerate(parent):
            a = self.charted.places[t]
            system = (a[1:] - a[0]).T
            shares = np.linalg.solve(system, (surface.places[n] - a[0]).T).T
            out[n] = self.flat[t][0] + shares @ (self.flat[t][1:] - self.flat[t][0])
        return out

    def plan(self, exemplar: np.ndarray, *, seed: int = 0, **options: Any) -> LayPlan:
        """Return what it is laid by."""
        turns = np.zeros(len(self.charted.chart), np.int32)
        scale = TextureScale(self.scale, self.scale, exemplar.shape[1] / self.scale, 0)
        scene = Scene(self.charted, self.vectors, self.fields, QuiltOptions(**options), turns, scale=scale)
        return lay_plan(scene, Exemplar(exemplar), seed=seed)

    def laid(self, exemplar: np.ndarray, *, threads: int | None = 1, **choices: Any) -> "Run":
        """Cover it with a quilt."""
        return Run.of(self.plan(exemplar, **choices), threads)


def folded(
    flat: np.ndarray,
    positions: np.ndarray,
    triangles: np.ndarray,
    *,
    density: float = 1.0,
    scale: float = 1.0,
    islands: np.ndarray | None = None,
    turned: tuple[float, ...] = (0.0,),
    stretched: float = 1.0,
) -> Folded:
    """Return a surface whose triangles have their lengths in the plane.

    Charts are turned by some degrees, and all but the first are stretched along their rows.
    """
    mesh = TriangleMesh(positions, triangles)
    plane = flat[triangles]
    edges, there = plane[:, 1:] - plane[:, :1], mesh.corners[:, 1:] - mesh.corners[:, :1]
    np.testing.assert_allclose(np.linalg.norm(edges, axis=2), np.linalg.norm(there, axis=2), atol=1e-9)
    along = (there.transpose(0, 2, 1) @ np.linalg.inv(edges.transpose(0, 2, 1)))[:, :, 0]
    islands = np.zeros(len(triangles), int) if islands is None else islands
    places, charts, fields = np.empty(plane.shape), [], []
    for n, degrees in enumerate(turned):
        own, a = islands == n, np.radians(degrees)
        turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
        stretch = np.array([1.0, stretched if n else 1.0])
        steps = density * np.stack([-plane[own][..., 1], plane[own][..., 0]], axis=2) @ turn * stretch
        steps -= np.floor(steps.min(axis=(0, 1))) - 8
        places[own] = steps
        height, width = np.ceil(steps.max(axis=(0, 1))).astype(int) + 8
        charts.append(Chart(n, int(height), int(width)))
        fields.append(quantised(np.tile(scale / density * turn / stretch, (2, 2, 1, 1))))
    charted = ChartedSurface(mesh, islands.astype(np.int32), places, tuple(charts), mesh.neighbours)
    return Folded(charted, plane, np.repeat(along[:, None], 3, axis=1), tuple(fields), scale)


def net(rows: int, columns: int) -> np.ndarray:
    """Return the triangles of a grid of (rows + 1)·(columns + 1) vertices, row after row, y upward."""
    i, j = (x.ravel() for x in np.mgrid[:rows, :columns])
    at = [(i + a) * (columns + 1) + j + b for a, b in ((0, 0), (0, 1), (1, 1), (1, 0))]
    return np.concatenate([np.stack(at[:3], axis=1), np.stack([at[0], at[2], at[3]], axis=1)])


def flat_net(height: float, width: float, rows: int, columns: int) -> np.ndarray:
    """Return the vertices of such a grid in the plane, x and y."""
    y, x = np.meshgrid(np.linspace(0, height, rows + 1), np.linspace(0, width, columns + 1), indexing="ij")
    return np.stack([x.ravel(), y.ravel()], axis=1)


def plane(height: float = 90, width: float = 75, **more: Any) -> Folded:
    """Return a rectangle; sizes are in model units, a step each if nothing else is asked for."""
    flat = flat_net(height, width, 1, 1)
    return folded(flat, np.column_stack([flat, 0 * flat[:, 0]]), net(1, 1), **more)


def cylinder(
    height: float = 90, width: float = 120, columns: int = 12, turn: float = 30, **more: Any
) -> Folded:
    """Return a part of a prism: facets beside each other, each turned by some degrees against the last."""
    flat, facet = flat_net(height, width, 6, columns), width / columns
    angles = np.radians(turn) * np.arange(columns)
    x = np.concatenate([[0], np.cumsum(facet * np.cos(angles))])
    z = -np.concatenate([[0], np.cumsum(facet * np.sin(angles))])
    n = np.tile(np.arange(columns + 1), 7)
    return folded(flat, np.column_stack([x[n], flat[:, 1], z[n]]), net(6, columns), **more)


def cone(near: float = 60, far: float = 150, columns: int = 16, **more: Any) -> Folded:
    """Return a part of a pyramid of many sides, whose apex is cut off: a sector of the plane, folded."""
    angle, opening = np.radians(6), np.radians(35)
    n, r = np.tile(np.arange(columns + 1), 7), np.repeat(np.linspace(near, far, 7), columns + 1)
    flat = np.column_stack([-r * np.cos(n * angle), r * np.sin(n * angle)])
    side = 2 * np.arcsin(np.sin(angle / 2) / np.sin(opening))
    around = r * np.sin(opening)
    positions = np.column_stack([-around * np.cos(n * side), around * np.sin(n * side), -r * np.cos(opening)])
    return folded(flat, positions, net(6, columns), **more)


def hinge(degrees: float = 60, **more: Any) -> Folded:
    """Return two facets that meet at an angle, each of two triangles."""
    return cylinder(60, 80, 2, degrees, **more)


@dataclass(frozen=True)
class Run:
    """A quilt, and what was laid for it, with blocks of which sizes."""

    quilt: Quilt
    numbers: LayNumbers
    laid: Drawn

    @classmethod
    def of(cls, plan: LayPlan, threads: int | None = 1) -> "Run":
        """Lay a surface that is one parcel."""
        with running(threads):
            _, drawn = lay_parcel(plan, 0, ())
        assert drawn is not None
        assert not drawn.placed.corners.any()  # places in windows are those on charts
        return cls(emitted_quilt(plan, label_pieces(plan, drawn)), plan.numbers, drawn)

    @property
    def ground(self) -> Ground:
        """What blocks lie on."""
        return self.laid.placed.ground

    def on(self, chart: int, name: str) -> np.ndarray:
        """Return what canvases have for a chart's steps."""
        canvases = self.ground.canvases
        first, shape = canvases.firsts[chart], (canvases.heights[chart], canvases.widths[chart])
        whole = getattr(canvases, name)
        return whole[first : first + shape[0] * shape[1]].reshape(*shape, *whole.shape[1:])

    def shown(self, chart: int, at: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """Return where steps of a chart read, in pixels of the level: s + ½ (C + M(q)) (q − c), turned.

        As records do, it counts the pixels of the fringe.
        """
        own = self.on(chart, "owners")[at]
        fit = self.laid.fits[self.laid.firsts[own] + self.on(chart, "sheets")[at]]
        turns = np.array(SYMMETRIES).reshape(-1, 2, 2)
        places = np.stack(at, axis=1).astype(float)
        field = self.quilt.fields[chart].at(*places.T) / (1 << self.numbers.level)
        both = 0.5 * (fit[:, 6:10].reshape(-1, 2, 2) + turns[fit[:, 10].astype(int)] @ field)
        seen = fit[:, 4:6] + np.einsum("nij,nj->ni", both, places - fit[:, 2:4])
        records = self.laid.records[own]
        return np.asarray(records[:, :2] + np.einsum("nij,nj->ni", turns[records[:, 2]], seen))


def covered(exemplar: Any, surface: Any, *, seed: int = 0, threads: int | None = 1, **choices: Any) -> Run:
    """Cover a surface, or what its text form tells."""
    if not isinstance(surface, MeshSurface):
        surface = as_covered(surface).surface
    sample = Exemplar(exemplar)
    scene = prepare(sample, surface, SynthesisOptions(**choices))
    assert isinstance(scene, Scene)
    return Run.of(lay_plan(scene, sample, seed=seed), threads)


def quilt_on(threads: int, plan: LayPlan) -> Quilt:
    """Return the quilt of a plan, laid on this many threads."""
    with running(threads):
        return laid_quilt(plan)


def alike(a: Quilt, b: Quilt) -> bool:
    """Return whether two quilts are the same to the bit."""
    return np.array_equal(a.placements, b.placements) and all(
        np.array_equal(one[0].labels, other[0].labels) for one, other in zip(a.labels, b.labels, strict=True)
    )
