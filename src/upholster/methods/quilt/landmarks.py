"""What catches the eye in a sample, and where it is shown: so that it does not recur near by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upholster.geometry import Surface
from upholster.methods.quilt._block_kernels import COLUMN, ROW
from upholster.methods.quilt._landmark_kernels import LandmarkUses
from upholster.quilt.chart import Chart
from upholster.quilt.warp_field import WarpField
from upholster.types import FloatArray, IntArray

__all__ = ["LandmarkRules", "ShownBlocks", "find_landmarks", "mesh_uses"]

_MOST = 16
_APART = 10
"""Landmarks lie no nearer to one another than the sample's shorter side over this."""

_BLUR = 32
"""The shorter side over this is the size of what is looked at."""

_RARE = 4
"""Times the mean salience: what is less salient is no landmark."""

_RAREST = 16
"""What is so many times as salient as the mean, or more, counts in full."""

_REACH = 0.8
"""Sides of the sample (the root of its area) within which a landmark is not to be shown again."""

_WEIGHT = 4.0
"""What a landmark costs shown twice in one place, times variety and the exemplar's variance."""


def find_landmarks(form: NDArray[np.uint8]) -> IntArray:
    """Return the places of a sample that differ most from what is usual in it.

    Salience is the squared distance from the mean colour of the average over 1/32 of the shorter side,
    each component over its own variance, which are independent of each other: the Mahalanobis distance.
    All in whole numbers: every machine finds the same.

    Parameters
    ----------
    form
        (H, W, K) principal components, see `pca_features`.

    Returns
    -------
    ndarray
        (n, 3), n at most 16: row, column, and how much each counts, 1 to 256; the most salient first.
    """
    shorter = min(form.shape[:2])
    size = max(1, shorter // _BLUR)
    salience = np.zeros((form.shape[0] - size + 1, form.shape[1] - size + 1), np.int64)
    for k in range(form.shape[2]):
        away = _box_sums(form[:, :, k], size).astype(np.int64)
        away = (away - int(away.sum()) // away.size) // size
        squares = away * away
        salience += 256 * squares // max(1, int(squares.sum()) // squares.size)
    mean = max(1, int(salience.sum()) // salience.size)
    apart = shorter // _APART
    found: list[tuple[int, int, int]] = []
    while len(found) < _MOST:
        row, column = divmod(int(salience.argmax()), salience.shape[1])
        most = int(salience[row, column])
        if most <= _RARE * mean:
            break
        found.append((row + size // 2, column + size // 2, min(256, 256 * (most // mean) // _RAREST)))
        top, left = max(0, row - apart), max(0, column - apart)
        around = salience[top : row + apart + 1, left : column + apart + 1]
        rows, columns = np.ogrid[: around.shape[0], : around.shape[1]]
        around[(rows + top - row) ** 2 + (columns + left - column) ** 2 < apart**2] = 0
    return np.array(found, np.int32).reshape(-1, 3)


def _box_sums(plane: NDArray[np.uint8], size: int) -> NDArray[np.uint32]:
    # Sums over all squares of a plane; those of whole rows and columns may pass 2^32, the squares' do not.
    sums = np.zeros((plane.shape[0] + 1, plane.shape[1] + 1), np.uint32)
    np.cumsum(plane, axis=1, dtype=np.uint32, out=sums[1:, 1:])
    np.cumsum(sums, axis=0, out=sums)
    rows = sums[size:] - sums[:-size]
    found: NDArray[np.uint32] = rows[:, size:] - rows[:, :-size]
    return found


@dataclass(frozen=True, eq=False, slots=True)
class ShownBlocks:
    """Blocks of a finished chart that show landmarks: where they lie, and which; see `LandmarkUses`."""

    places: FloatArray
    shown: NDArray[np.int64]


@dataclass(frozen=True, eq=False, slots=True)
class LandmarkRules:
    """What stays the same while charts are laid.

    Attributes
    ----------
    marks
        See `find_landmarks`.
    surface, charts
        The layout.
    scale
        Exemplar pixels per unit of the surface; None where texels are pixels, on a flat texture.
    reach
        Exemplar pixels within which a landmark costs that is shown again.
    weight
        What it costs in one place.
    step
        Exemplar pixels from one block to the next, about.
    shape
        Of usage for one symmetry.
    wrap
        Whether the one chart's opposite edges meet.
    """

    marks: IntArray
    surface: Surface
    charts: Sequence[Chart]
    scale: float | None
    reach: float
    weight: float
    step: float
    shape: tuple[int, int]
    wrap: bool

    @classmethod
    def of(
        cls,
        form: NDArray[np.uint8],
        surface: Surface,
        charts: Sequence[Chart],
        fields: Sequence[WarpField],
        *,
        weight: float,
        block: int,
        shape: tuple[int, int],
        wrap: bool,
    ) -> "LandmarkRules":
        """Find the landmarks of a sample, (H, W, K) principal components.

        `weight` is the option variety times the sample's variance; `block` the side of a block in
        pixels; `shape` that of usage for one symmetry.
        """
        flat = len(charts) == 1 and fields[0].is_identity
        reach = _reach(form)
        scale = None if flat else _pixels_per_unit(surface, charts, fields)
        marks = find_landmarks(form) if weight > 0 else np.zeros((0, 3), np.int32)
        return cls(marks, surface, charts, scale, reach, _WEIGHT * weight, 0.7 * block, shape, wrap)

    def uses(
        self, index: int, blocks: IntArray, level: int, across: int, finished: Sequence[ShownBlocks | None]
    ) -> LandmarkUses:
        """Return what a chart's blocks are told of landmarks: those shown on finished charts near it."""
        own = self._places(index, blocks[:, ROW], blocks[:, COLUMN])
        low, high = own.min(axis=0) - self.reach, own.max(axis=0) + self.reach
        done = [part for part in finished if part is not None]
        places = np.concatenate([np.zeros((0, 3)), *(part.places for part in done)])
        shown = np.concatenate([np.zeros(0, np.int64), *(part.shown for part in done)])
        near = ((places > low) & (places < high)).all(axis=1)
        places = np.concatenate([places[near], own])
        shown = np.concatenate([shown[near], np.zeros(len(own), np.int64)])
        marks = self.marks.copy()
        marks[:, :2] >>= level
        chart = self.charts[index]
        period = (float(chart.height), float(chart.width)) if self.wrap else (np.inf, np.inf)
        return LandmarkUses(
            marks,
            shown,
            places,
            len(places) - len(own),
            across * (1 + int(self.reach / self.step)),
            self.reach,
            period,
            self.weight,
            _usual(),
            np.zeros(len(marks)),
            np.zeros(self.shape),
        )

    def shown(self, uses: LandmarkUses) -> ShownBlocks:
        """Return what the blocks of a chart that has been laid show."""
        kept = uses.before + np.flatnonzero(uses.shown[uses.before :])
        return ShownBlocks(uses.places[kept], uses.shown[kept])

    def _places(self, index: int, rows: IntArray, columns: IntArray) -> FloatArray:
        chart = self.charts[index]
        if self.scale is None:
            return np.stack([rows, columns, np.zeros_like(rows)], axis=1).astype(np.float64)
        return self.scale * self.surface.faces[chart.face].points(*_parameters(chart, rows, columns))


def mesh_uses(form: NDArray[np.uint8], weight: float, level: int, shape: tuple[int, int]) -> LandmarkUses:
    """Return what blocks on a mesh are told of landmarks, before the first is laid.

    Parameters
    ----------
    form
        The sample, (H, W, K) principal components.
    weight
        The option variety times the sample's variance.
    level
        That blocks read.
    shape
        Of usage.
    """
    marks = find_landmarks(form) if weight > 0 else np.zeros((0, 3), np.int32)
    marks[:, :2] >>= level
    places, none = np.zeros((0, 3)), (np.inf, np.inf)
    shown, costs = np.zeros(0, np.int64), np.zeros(len(marks))
    return LandmarkUses(
        marks, shown, places, 0, 2**31, _reach(form), none, _WEIGHT * weight, _usual(), costs, np.zeros(shape)
    )


def _reach(form: NDArray[np.uint8]) -> float:
    return _REACH * float(np.sqrt(form.shape[0] * form.shape[1]))


def _usual() -> float:
    # What `LandmarkUses` calls usual: (1 - (d/r)²)² over the half disc in which blocks are laid already, of
    # landmarks of which there is one in each area of the sample.
    return float(np.pi) * _REACH**2 / 6


def _parameters(chart: Chart, rows: IntArray, columns: IntArray) -> tuple[FloatArray, FloatArray]:
    # The face's parameters at texels; beyond the chart those at its edges.
    down, along = np.clip((rows + 0.5) / chart.height, 0, 1), np.clip((columns + 0.5) / chart.width, 0, 1)
    return chart.s0 + (chart.s1 - chart.s0) * down, chart.t0 + (chart.t1 - chart.t0) * along


def _pixels_per_unit(surface: Surface, charts: Sequence[Chart], fields: Sequence[WarpField]) -> float:
    # The exemplar's pixels per unit of the surface: the median over charts' middles.
    found = []
    for chart, field in zip(charts, fields, strict=True):
        row, column = np.array([chart.height // 2]), np.array([chart.width // 2])
        _, by_s, by_t = surface.faces[chart.face].derivatives(*_parameters(chart, row, column))
        texel = (chart.s1 - chart.s0) / chart.height * (chart.t1 - chart.t0) / chart.width
        area = float(np.linalg.norm(np.cross(by_s, by_t))) * abs(texel)
        pixels = abs(float(np.linalg.det(field.at(row.astype(float), column.astype(float))[0])))
        if area > 0:
            found.append(np.sqrt(pixels / area))
    return float(np.median(found))
