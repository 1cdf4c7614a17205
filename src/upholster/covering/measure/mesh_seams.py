"""Whether seams between charts show, compared with the exemplar at the same places."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.base.types import FloatArray, PixelArray
from upholster.charts.charted_surface import charted_surface
from upholster.charts.creases import CREASE
from upholster.covering.measure.cuts import check_measured, sampled
from upholster.covering.measure.places import SeamPlaces
from upholster.covering.measure.samples import Window, coded
from upholster.covering.measure.seams import MeanDifference
from upholster.covering.measure.trace import Trace, step_sources
from upholster.geometry.any_surface import AnySurface
from upholster.quilt.model import Quilt, Texels
from upholster.quilt.placement import SYMMETRIES

__all__ = ["MeshSeams", "mesh_seams"]

Index = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class MeshSeams:
    """Whether seams between charts show, compared with the exemplar at the same places.

    Attributes
    ----------
    ratio
        Across seams over which the texture continues: 1.0 is as smooth as the exemplar, more shows, less is
        blur; None if there are none.
    creases
        Share of the seams' length where the texture starts again, which `ratio` leaves out.
    over_creases
        The same ratio over creases; None if there are none.
    """

    ratio: float | None
    creases: float
    over_creases: float | None


def mesh_seams(
    surface: AnySurface,
    quilt: Quilt,
    texels: Texels,
    exemplar: PixelArray,
    *,
    crease: float = CREASE,
    least: float = 0.0,
    by_normals: bool = False,
) -> MeshSeams:
    """Measure whether seams between charts show, compared with the exemplar at the same places.

    A surface of few charts has few edges, and single lines of a regular texture differ from its mean. So the
    mean absolute difference between a texel next to a seam and the one across it is divided by the mean of
    two differences in the exemplar: over the same step from the first texel's place, as its own placement
    maps it, and back from the second's. At most 2^17 pairs are examined.

    Over sharp edges the texture starts again. Such a seam is intended, and does not show how well a texture
    continues. These seams are left out, and measured separately.

    Parameters
    ----------
    surface, quilt, texels, exemplar
        What was covered, the quilt, its painted texels, and the exemplar (H, W, C).
    crease
        Degrees: edges at which the surface turns by at least this are creases.
    least
        Degrees: edges at which it turns by less are ignored.
    by_normals
        Whether turns are measured between the surface's own normals, as for a CAD model, whose facets turn
        where the surface is smooth.

    Raises
    ------
    InputError
        If a chart names a face that the surface does not have, or the charts of the texels or the shape of
        the exemplar are not the quilt's.
    """
    check_measured(quilt, texels, exemplar)
    charted = charted_surface(surface, quilt.charts)
    found = SeamPlaces.of(charted, crease=crease, least=least, by_normals=by_normals)
    if found is None:
        return MeshSeams(None, 0.0, None)
    channels, levels = exemplar.shape[2], [exemplar]
    # On either side, the painted texel, and the exemplar at the texel and a step farther.
    painted = np.empty((len(found.chart), 2, channels), np.float32)
    own = np.empty((len(found.chart), 2, 2, channels), np.float32)
    for index in np.unique(found.chart).tolist():
        chart = quilt.charts[index]
        trace = Trace.of(quilt, Window(index, 0, 0, chart.height, chart.width))
        at = found.chart == index
        painted[at] = coded(texels.arrays[index][tuple(found.texel[at].T)])
        own[at] = _looked_up(trace, found.texel[at], found.step[at], levels)
    ratios: list[float | None] = []
    for sharp in (False, True):
        at = found.is_sharp == sharp
        seen, expected = MeanDifference(), MeanDifference()
        seen.add(painted[at, 0], painted[at, 1])
        expected.add(own[at, :, 0], own[at, :, 1])
        ratios.append(seen.over(expected))
    return MeshSeams(ratios[0], float(found.is_sharp.mean()), ratios[1])


def _looked_up(trace: Trace, texel: Index, step: FloatArray, levels: list[PixelArray]) -> NDArray[np.float32]:
    # The exemplar for texels (n, 2), and a step (n, 2) of texels farther: (n, 2, C).
    owner = trace.placements[trace.owners[tuple(texel.T)]]
    place = step_sources(trace.field, owner, *texel.T).T / 16
    matrices = trace.field.at(*texel.T)
    pixels = SYMMETRIES[owner["symmetry"]].reshape(-1, 2, 2) @ matrices @ step[:, :, None]
    there = place + pixels[:, :, 0]
    return np.stack([sampled(trace, owner, at, levels) for at in (place, there)], axis=1)
