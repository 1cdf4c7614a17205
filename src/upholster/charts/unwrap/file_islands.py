"""Islands of the texture coordinates in a mesh's file."""

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.types import FloatArray, IntArray
from upholster.charts.unwrap._raster_kernels import coverage
from upholster.charts.unwrap.flat_piece import percentile, signed_areas
from upholster.charts.unwrap.pieces import pieces_of
from upholster.geometry.meshes.triangle_mesh import TriangleMesh

__all__ = ["kept_islands"]

_SIDE = 2048
"""Samples along the longer side, for measuring overlaps."""
_MOST_OVERLAP = 0.01
_MOST_SPREAD = 2.5
_MOST_UNEVEN = 0.01
"""Share of the area whose islands may be less even: these are left out."""


def kept_islands(mesh: TriangleMesh, across: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the islands of a mesh's own texture coordinates, each scaled to its area in space.

    Parameters
    ----------
    mesh
        A mesh with texture coordinates.
    across
        (T, 3) as `TriangleMesh.neighbours`: edges with −1 are always seams.

    Returns
    -------
    island
        (T,) int32; −1 for triangles of islands of uneven density, which have at most 1 % of the area.
    parameters
        (T, 3, 2).

    Raises
    ------
    InputError
        If there are no texture coordinates, if more than 1 % of the area that they cover is covered twice, or
        if on islands with more than 1 % of the area the density's 1st and 99th percentile differ by more than
        a factor of 2.5, as in inverted triangles.
    """
    if mesh.uv is None:
        raise InputError("the mesh has no texture coordinates to keep; allowed: new charts")
    corners = np.ascontiguousarray(mesh.uv[:, :, ::-1])
    overlap = _overlap(corners)
    if overlap > _MOST_OVERLAP:
        raise InputError(
            f"{overlap:.0%} of the area of the texture coordinates overlaps; allowed: {_MOST_OVERLAP:.0%}, "
            "or new charts"
        )
    linked = np.where(_goes_on(corners, across), across, -1).astype(np.int32)
    island, parameters = np.full(len(across), -1, np.int32), np.zeros(corners.shape)
    count, uneven, worst = 0, 0.0, ""
    for piece in pieces_of(linked, np.ones(len(across), bool)):
        own = piece.triangles
        flat = _true_to_size(corners[own], mesh.areas[own])
        if isinstance(flat, str):
            area = float(mesh.areas[own].sum())
            uneven, worst = uneven + area, worst or f"{flat} on an island of {len(own)} triangles"
        else:
            island[own], parameters[own] = count, flat
            count += 1
    if uneven > _MOST_UNEVEN * float(mesh.areas.sum()) or not count:
        raise InputError(
            f"the density of the texture coordinates {worst}, and such islands have "
            f"{uneven / float(mesh.areas.sum()):.0%} of the area; allowed: a factor of {_MOST_SPREAD} but on "
            f"{_MOST_UNEVEN:.0%}, or new charts"
        )
    return island, parameters


def _goes_on(corners: FloatArray, across: IntArray) -> NDArray[np.bool_]:
    """Return which edges have the same coordinates on both sides, (T, 3)."""
    other, edge = across // 3, across % 3
    met_first, met_last = corners[other, (edge + 1) % 3], corners[other, edge]
    same = (met_first == corners) & (met_last == np.roll(corners, -1, axis=1))
    return np.asarray(same.all(axis=2) & (across >= 0))


def _true_to_size(corners: FloatArray, areas: FloatArray) -> FloatArray | str:
    """Orient an island correctly and scale it to its area in space; or return what is wrong with it."""
    out: FloatArray = corners - corners.min(axis=(0, 1))
    turned = signed_areas(out)
    if turned.sum() < 0:
        out[:, :, 1] *= -1.0
        turned = -turned
    real = areas > 0
    if not real.any():
        return 0.0 * out
    low, high = percentile(turned[real] / areas[real], areas[real], (0.01, 0.99))
    if not low > 0:
        return "vanishes or turns over"
    if high > _MOST_SPREAD * low:
        return f"differs by a factor of {high / low:.3g}"
    scaled: FloatArray = out * np.sqrt(areas.sum() / turned.sum())
    return scaled


def _overlap(corners: FloatArray) -> float:
    """Estimate from samples the share of the covered area that is covered more than once."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    step = max(float((high - low).max()) / _SIDE, 1e-300)
    rows, columns = (int(count) + 1 for count in (high - low) / step)
    times = np.zeros((rows, columns), np.int32)
    coverage((corners - low) / step, times)
    covered = int(times.sum())
    return (covered - int((times > 0).sum())) / covered if covered else 0.0
