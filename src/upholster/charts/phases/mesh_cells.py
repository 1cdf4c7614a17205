"""Phases over meshes: cells are pieces of islands in which the field has about one direction."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.charts._multigrid_kernels import ComplexArray
from upholster.charts.charted import ChartedSurface
from upholster.charts.phases.chart_cells import MOST_CELLS
from upholster.charts.phases.field import phase_units
from upholster.charts.phases.links import Links, matched_waves
from upholster.charts.phases.solving import solved_phases
from upholster.charts.warp_fields import triangle_frames
from upholster.types import FloatArray, IntArray

__all__ = ["MeshPhases", "mesh_phases"]

_HEAVIEST = 1e3
"""Of the weights of links, which have no unit."""


@dataclass(frozen=True, eq=False, slots=True)
class MeshPhases:
    """Phases of waves over a mesh.

    Attributes
    ----------
    waves
        (n, 2) cycles per exemplar pixel.
    cell
        (T,) int32: which cell each triangle lies in.
    centres
        (cells, 3) points.
    axes
        (cells, 2, 3) exemplar pixels per model unit: down the sample's columns and along its rows.
    phases
        (n, cells) complex: the phases at the centres.
    """

    waves: FloatArray
    cell: IntArray
    centres: FloatArray
    axes: FloatArray
    phases: ComplexArray

    def at(self, triangles: IntArray, points: FloatArray) -> NDArray[np.int16]:
        """Return the phases at points (m, 3) in triangles (m,): (n, m) int16, in 1/65536 turn."""
        cell = self.cell[triangles]
        read = _product(self.axes[cell], points - self.centres[cell])
        own = self.phases[:, cell]
        return phase_units(np.arctan2(own.imag, own.real) / (2 * np.pi) + self.waves @ read.T)


def mesh_phases(
    surface: ChartedSurface, vectors: FloatArray, scale: float, waves: FloatArray, side: float
) -> MeshPhases:
    """Find the phases that follow a mesh's directions best.

    Over an edge at which directions jump by quarter turns a wave goes on as its opposite or as another one;
    where it can not, it starts anew.

    Parameters
    ----------
    surface
        Its islands; triangles are short where directions turn.
    vectors
        (T, 3, 3), unit vectors at the triangles' corners: which way the exemplar's rows run.
    scale
        Exemplar pixels per model unit.
    waves
        (n, 2) cycles per exemplar pixel.
    side
        About the side of a cell in model units.
    """
    mesh = surface.mesh
    along, down = triangle_frames(mesh, vectors)
    areas = np.maximum(mesh.areas, 1e-12 * mesh.size**2)
    side = max(side, float(np.sqrt(areas.sum() / MOST_CELLS)))
    flat = surface.places[:, 1:] - surface.places[:, :1]
    steps = 0.5 * np.abs(flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0]).sum()
    cell = _cells(surface, along, side * float(np.sqrt(steps / areas.sum())))
    count = int(cell.max()) + 1
    total: FloatArray = np.bincount(cell, areas, count).astype(np.float64)
    middles = mesh.corners.mean(axis=1)
    centres = _mean(cell, areas, middles, total)
    axes = np.stack([_unit(_mean(cell, areas, of, total)) for of in (down, along)], axis=1) * scale
    own = np.stack([down, along], axis=1) * scale
    links = _links(surface, cell, centres, axes, own, waves)
    total = total * scale**2
    return MeshPhases(waves, cell, centres, axes, solved_phases(links, total, waves))


def _cells(surface: ChartedSurface, along: FloatArray, side: float) -> IntArray:
    # Squares of each island, by the quarter of the circle in which directions lie there: over a jump of the
    # field begins another cell.
    places = surface.places.mean(axis=1)
    edges = surface.mesh.corners[:, 1:] - surface.mesh.corners[:, :1]
    flat = surface.places[:, 1:] - surface.places[:, :1]
    one, other = (np.einsum("ti,ti->t", edges[:, k], along) for k in (0, 1))
    # The direction's own edges on the island, up to a factor: the gradient of the way along.
    across = np.stack(
        [one * flat[:, 1, 1] - other * flat[:, 0, 1], other * flat[:, 0, 0] - one * flat[:, 1, 0]], axis=1
    )
    quarter = 2 * (across[:, 0] > 0) + (across[:, 1] > 0)
    # Row, column, island and quarter as one number.
    rows, columns = (np.floor((of - of.min()) / side).astype(np.int64) for of in places.T)
    keys = (surface.chart * (rows.max() + 1) + rows) * (4 * (columns.max() + 1)) + 4 * columns + quarter
    _, cell = np.unique(keys, return_inverse=True)
    return cell.reshape(-1).astype(np.int32)


def _links(
    surface: ChartedSurface,
    cell: IntArray,
    centres: FloatArray,
    axes: FloatArray,
    own: FloatArray,
    waves: FloatArray,
) -> Links:
    # A link for each two cells that share edges.
    mesh = surface.mesh
    triangle, edge = np.nonzero(surface.across > 3 * np.arange(len(cell))[:, None] + 2)
    other, met = np.divmod(surface.across[triangle, edge], 3)
    apart = cell[triangle] != cell[other]
    triangle, edge, other, met = triangle[apart], edge[apart], other[apart], met[apart]
    # All edges between two cells are one link, from the lower cell on.
    back = cell[triangle] > cell[other]
    triangle, other = np.where(back, other, triangle), np.where(back, triangle, other)
    edge, met = np.where(back, met, edge), np.where(back, edge, met)
    ends = mesh.corners[triangle, edge], mesh.corners[triangle, (edge + 1) % 3]
    tangent = ends[1] - ends[0]
    # Beyond the edge of a tile its middle lies at the other end.
    sides = (triangle, edge), (other, met)
    middle, beyond = (0.5 * (mesh.corners[of, k] + mesh.corners[of, (k + 1) % 3]) for of, k in sides)
    a, b = cell[triangle], cell[other]
    keys, number = np.unique(a * np.int64(len(centres)) + b, return_inverse=True)
    first, second = np.divmod(keys, len(centres))
    # The same edge as both sides read it, (down, along), is turned from one to the other.
    before, after = _product(own[triangle], tangent), _product(own[other], tangent)
    length = np.maximum(np.sqrt((before**2).sum(axis=1)), 1e-12)
    real = (before * after).sum(axis=1) / length
    imaginary = (before[:, 1] * after[:, 0] - before[:, 0] * after[:, 1]) / length
    here = _product(0.5 * (axes[a] + own[triangle]), middle - centres[a]) * length[:, None]
    there = _product(0.5 * (axes[b] + own[other]), centres[b] - beyond) * length[:, None]
    whole = np.bincount(number, length, len(keys))
    sums = [np.bincount(number, of, len(keys)) / whole for of in (*here.T, *there.T, real, imaginary)]
    here, there = np.stack(sums[:2], axis=1), np.stack(sums[2:4], axis=1)
    turn = np.stack([sums[4], sums[5], -sums[5], sums[4]], axis=1).reshape(-1, 2, 2)
    goes_on = matched_waves(waves, np.broadcast_to(np.eye(2), turn.shape), turn)
    away = np.sqrt((here**2).sum(axis=1)) + np.sqrt((there**2).sum(axis=1))
    weights = np.clip(whole / np.maximum(away, 1e-12), 1 / _HEAVIEST, _HEAVIEST)
    return Links(first.astype(np.int32), second.astype(np.int32), here, there, weights, goes_on)


def _product(axes: FloatArray, steps: FloatArray) -> FloatArray:
    found: FloatArray = np.einsum("nai,ni->na", axes, steps)
    return found


def _mean(cell: IntArray, weights: FloatArray, vectors: FloatArray, total: FloatArray) -> FloatArray:
    sums = [np.bincount(cell, weights * vectors[:, axis], len(total)) for axis in range(3)]
    found: FloatArray = np.stack(sums, axis=1) / total[:, None]
    return found


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    unit: FloatArray = vectors / np.maximum(length, 1e-12)
    return unit
