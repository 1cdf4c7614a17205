"""Where to cut faces into charts: where derivatives jump, or where texels would be uneven.

Each piece is cut separately. It is halved along the parameter along which texels vary more: at the patch
border nearest to its middle or, within a patch, at a half, a quarter, … of the patch.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np

from upholster.base.types import FloatArray, frozen_array
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.surface import Surface

__all__ = ["ChartPiece", "Halving"]

WANTED = np.log(2.1)
"""A chart is cut no further once ln(99th / 1st percentile of texel area) is below this."""

HELPS = 0.1
"""A cut helps only along an axis where texels vary by at least this share of their variation along the
other."""

MOST_SAMPLES, FINEST = 512, 32
"""Samples along a face, and within a patch: each way."""

DOWN, RIGHT, AREA = 0, 1, 2
"""Logarithms stored: of |S_s|, of |S_t|, and of the area element."""


@dataclass(frozen=True, slots=True)
class ChartPiece:
    """A rectangle of a face, in samples: top to bottom along s, left to right along t.

    `root` numbers the rectangle that it was cut from; lines where derivatives jump bound it.
    """

    face: int
    root: int
    top: int
    bottom: int
    left: int
    right: int

    def ends(self, axis: int) -> tuple[int, int]:
        """Return where the piece begins and ends along s (axis 0) or t (axis 1)."""
        return (self.left, self.right) if axis else (self.top, self.bottom)

    def halves(self, axis: int, at: int) -> tuple["ChartPiece", "ChartPiece"]:
        """Return the parts before and after a cut."""
        if axis:
            return (
                ChartPiece(self.face, self.root, self.top, self.bottom, self.left, at),
                ChartPiece(self.face, self.root, self.top, self.bottom, at, self.right),
            )
        return (
            ChartPiece(self.face, self.root, self.top, at, self.left, self.right),
            ChartPiece(self.face, self.root, at, self.bottom, self.left, self.right),
        )


class FaceSamples:
    """The area element of a face, sampled evenly.

    Attributes
    ----------
    steps
        Samples per patch along s and along t, powers of two.
    area
        (rows·steps, columns·steps): area of each sample, in squared model units.
    logs
        (3, …): `DOWN`, `RIGHT`, `AREA`; lengths are per patch parameter.
    """

    def __init__(self, face: Face, size: float) -> None:
        self.steps = tuple(
            min(FINEST, 1 << max(1, int(np.log2(MOST_SAMPLES / count))))
            for count in (face.rows, face.columns)
        )
        s, t = (
            (np.arange(count * step) + 0.5) / step
            for count, step in zip((face.rows, face.columns), self.steps, strict=True)
        )
        _, by_s, by_t = face.derivatives_grid(s, t)
        down, right = (np.einsum("ijk,ijk->ij", v, v) for v in (by_s, by_t))
        both = np.einsum("ijk,ijk->ij", by_s, by_t)
        element = np.sqrt(np.maximum(down * right - both * both, 0))
        self.area = element / (self.steps[0] * self.steps[1])
        # A pole's derivative vanishes, and so does its weight: any finite logarithm will do.
        least = 1e-60 * size**2
        self.logs = np.stack(
            [0.5 * np.log(np.maximum(x, least)) for x in (down, right)] + [np.log(np.maximum(element, least))]
        )

    def window(self, piece: ChartPiece) -> tuple[FloatArray, FloatArray]:
        """Return the areas and logarithms of a piece's samples: (h, w) and (3, h, w)."""
        rows, columns = slice(piece.top, piece.bottom), slice(piece.left, piece.right)
        return np.maximum(self.area[rows, columns], 1e-300), self.logs[:, rows, columns]

    def spread(self, piece: ChartPiece) -> float:
        """Return the logarithm of texel area's 99th over its 1st percentile on a piece."""
        area, (*_, element) = self.window(piece)
        order = np.argsort(element, axis=None)
        below = np.cumsum(area.ravel()[order])
        first, last = np.searchsorted(below, np.array([0.01, 0.99]) * below[-1])
        values = element.ravel()[order]
        return float(values[min(last, len(values) - 1)] - values[first])

    def varies(self, piece: ChartPiece, axis: int) -> float:
        """Return the variance along an axis of the mean logarithm of texel area."""
        area, (*_, element) = self.window(piece)
        weight = area.sum(axis=1 - axis)
        means = (area * element).sum(axis=1 - axis) / weight
        middle = np.average(means, weights=weight)
        return float(np.average((means - middle) ** 2, weights=weight))


class Halving:
    """The pieces of all faces, from which charts are made.

    Parameters
    ----------
    surface
        The surface to cut; at first it is cut only where derivatives jump.

    Attributes
    ----------
    pieces
        Sorted by face, then by top and left.
    """

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._samples = [FaceSamples(face, surface.size) for face in surface.faces]
        self._extents: dict[ChartPiece, FloatArray] = {}  # callers ask for the same pieces repeatedly
        roots: list[ChartPiece] = []
        for index, (face, samples) in enumerate(zip(surface.faces, self._samples, strict=True)):
            lines = [
                [step * line for line in (0, *breaks, count)]
                for step, breaks, count in zip(
                    samples.steps, face.breaks, (face.rows, face.columns), strict=True
                )
            ]
            for (top, bottom), (left, right) in product(pairwise(lines[0]), pairwise(lines[1])):
                roots.append(ChartPiece(index, len(roots), top, bottom, left, right))
        self._pieces = set(roots)
        self.whole = np.array([self.extents(root) for root in roots])

    @property
    def pieces(self) -> list[ChartPiece]:
        """All pieces, sorted."""
        return sorted(self._pieces, key=lambda one: (one.face, one.top, one.left))

    @cached_property
    def total_area(self) -> float:
        """The surface's area, in squared model units."""
        return float(sum(samples.area.sum() for samples in self._samples))

    def extents(self, piece: ChartPiece) -> FloatArray:
        """Return the typical height and width (2,) of a piece, in model units.

        They are area-weighted geometric means of the derivatives' lengths, corrected for the angle between
        them, so that their product is the typical area.
        """
        found = self._extents.get(piece)
        if found is None:
            samples = self._samples[piece.face]
            area, logs = samples.window(piece)
            down, right, element = (logs * area).sum(axis=(1, 2)) / area.sum()
            sine = 0.5 * (element - down - right)
            spans = [
                (last - first) / step
                for (first, last), step in zip(map(piece.ends, (0, 1)), samples.steps, strict=True)
            ]
            found = self._extents[piece] = frozen_array(np.exp([down + sine, right + sine]) * spans)
        return found

    def parameters(self, piece: ChartPiece) -> tuple[float, float, float, float]:
        """Return s0, s1, t0, t1 of a piece."""
        (s0, s1), (t0, t1) = (
            [end / self._samples[piece.face].steps[axis] for end in piece.ends(axis)] for axis in (0, 1)
        )
        return s0, s1, t0, t1

    def even_out(self, density: float, smallest: int, thinnest: int) -> None:
        """Cut until the texels of each chart have similar areas, unless charts would become too small.

        Parameters
        ----------
        density
            Texels per model unit.
        smallest, thinnest
            Least height and width of a chart in texels, as for `density_layout`.
        """
        least = (np.clip(self.whole * density, thinnest, smallest) / density).tolist()
        waiting = self.pieces
        while waiting:
            piece = waiting.pop()
            samples = self._samples[piece.face]
            if samples.spread(piece) <= WANTED:
                continue
            # Pieces that are equal up to rounding are cut alike.
            varies = [float(f"{samples.varies(piece, axis):.6g}") for axis in (0, 1)]
            for axis in (0, 1) if varies[0] >= varies[1] else (1, 0):
                halves = self._halves(piece, axis, least[piece.root][axis])
                if halves and varies[axis] > HELPS * max(varies):
                    self._pieces.remove(piece)
                    self._pieces.update(halves)
                    waiting += halves
                    break

    def cut_longest(self, most: float) -> bool:
        """Cut each piece longer than `most` model units, once; return whether all of them could be cut."""
        for piece in self.pieces:
            extents = self.extents(piece)
            if extents.max() > most:
                halves = self._halves(piece, int(np.argmax(extents)), 0.0)
                if not halves:
                    return False
                self._pieces.remove(piece)
                self._pieces.update(halves)
        return True

    def _halves(self, piece: ChartPiece, axis: int, least: float) -> tuple[ChartPiece, ...]:
        """Return both halves across an axis; none if one is shorter than `least` or no cut is possible."""
        first, last = piece.ends(axis)
        step = self._samples[piece.face].steps[axis]
        # Within a patch, cut at its middle; across several, at the border nearest to the middle.
        unit = step if last - first > step else (last - first) // 2
        if unit == 0:
            return ()
        halves = piece.halves(axis, unit * ((first + last) // (2 * unit)))
        return halves if min(float(self.extents(half)[axis]) for half in halves) >= least else ()
