"""Where faces are cut into charts: where derivatives jump, where texels would be uneven, or charts large.

Each piece is cut on its own: halved along one of its parameters, at the border of two patches next to its
middle or, within a patch, at a half, a quarter, … of it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from math import ceil, floor

import numpy as np

from upholster.geometry import Face, FaceSeam, Surface
from upholster.types import FloatArray, frozen_array

__all__ = ["Halving", "Piece"]

WANTED = np.log(2.03)
"""No more cuts once texel area's 99th over its 1st percentile is below the exponential of this."""

AT_ONCE = 0.7
"""Cuts that are nearly as good as the best one are made with it."""

SHORT = 0.7
"""A cut for evenness may leave a half this much smaller than a chart should be: it gets more texels."""

ROUND = 4
"""Charts round a closed face: the opposite ones do not touch and can be laid at once."""

ROOMY = 64
"""Texels: charts round a closed face are not made narrower than this for that."""

LARGE, ENOUGH = 6, 16
"""What holds more than a sixth of the surface keeps a thread alone: it is cut into sixteenths."""

LONG = 256
"""Texels: least height and width of what is cut because it is large."""

EPS = 1e-6
"""In face parameters: intervals shorter than this are none."""

BINS = 1024
"""Of a histogram of log texel area over its chart's typical one, from −4 to 4."""

MOST_SAMPLES, FINEST = 512, 32
"""Samples along a face, and within a patch: each way."""

DOWN, RIGHT, AREA = 0, 1, 2
"""Logarithms kept: of |S_s|, of |S_t|, and of the area element."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A rectangle of a face, in samples: top to bottom along s, left to right along t.

    `root` numbers the rectangle between lines where derivatives jump that it was cut from.
    """

    face: int
    root: int
    top: int
    bottom: int
    left: int
    right: int

    def ends(self, axis: int) -> tuple[int, int]:
        """Return where it begins and ends along s (axis 0) or t (axis 1)."""
        return (self.left, self.right) if axis else (self.top, self.bottom)

    def halves(self, axis: int, at: int) -> tuple["Piece", "Piece"]:
        """Return what is before and behind a cut."""
        if axis:
            return (
                Piece(self.face, self.root, self.top, self.bottom, self.left, at),
                Piece(self.face, self.root, self.top, self.bottom, at, self.right),
            )
        return (
            Piece(self.face, self.root, self.top, at, self.left, self.right),
            Piece(self.face, self.root, at, self.bottom, self.left, self.right),
        )


@dataclass(frozen=True, slots=True)
class _Cut:
    """A piece, its two halves, and how much more even texels are for it."""

    piece: Piece
    halves: tuple[Piece, Piece]
    gain: float

    def order(self) -> tuple[float, int, int, int, int]:
        """Return what sorts cuts, best first; what differs by rounding only must not decide anything."""
        one = self.halves[1]
        return -float(f"{self.gain:.6g}"), one.face, one.top, one.left, one.right


class FaceSamples:
    """The area element of a face, sampled evenly, with sums that tell any rectangle's moments at once.

    Attributes
    ----------
    steps
        Samples per patch along s and along t, powers of two.
    area
        (rows·steps, columns·steps): area of each sample, in squared model units.
    logs
        (3, …): `DOWN`, `RIGHT`, `AREA`; lengths per patch parameter.
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
        # A pole's derivative vanishes, and so does its weight: any finite logarithm does.
        least = 1e-60 * size**2
        self.logs = np.stack(
            [0.5 * np.log(np.maximum(x, least)) for x in (down, right)] + [np.log(np.maximum(element, least))]
        )
        self._middle = float(np.average(self.logs[AREA], weights=self.area + 1e-300))
        x = self.logs[AREA] - self._middle
        terms = np.stack([np.ones_like(x), self.logs[DOWN], self.logs[RIGHT], x, x**2, x**3, x**4])
        self._unevenness: dict[Piece, float] = {}
        self._sums = np.zeros((len(terms), x.shape[0] + 1, x.shape[1] + 1))
        weighted = np.maximum(self.area, 1e-300) * terms
        self._sums[:, 1:, 1:] = weighted.cumsum(axis=1).cumsum(axis=2)

    def moments(self, piece: Piece) -> FloatArray:
        """Return a piece's area, and the sums over it of area times `DOWN`, `RIGHT`, and powers of `AREA`."""
        sums = self._sums
        found: FloatArray = (
            sums[:, piece.bottom, piece.right]
            - sums[:, piece.top, piece.right]
            - sums[:, piece.bottom, piece.left]
            + sums[:, piece.top, piece.left]
        )
        return found

    def means(self, piece: Piece) -> FloatArray:
        """Return the area-weighted means (3,) of the logarithms."""
        area, down, right, element = self.moments(piece)[:4]
        return np.array([down / area, right / area, element / area + self._middle])

    def unevenness(self, piece: Piece) -> float:
        """Return the area-weighted sum of the fourth power of log area element less its mean."""
        found = self._unevenness.get(piece)
        if found is None:
            area, _, _, *sums = self.moments(piece)
            first, second, third, fourth = (one / area for one in sums)
            central = fourth - 4 * first * third + 6 * first**2 * second - 3 * first**4
            found = self._unevenness[piece] = float(area * max(central, 0.0))
        return found


class Halving:
    """The pieces of all faces: charts-to-be.

    Parameters
    ----------
    surface
        What is cut, to begin with only where derivatives jump.

    Attributes
    ----------
    pieces
        Face after face; of each face by top and left.
    """

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._samples = [FaceSamples(face, surface.size) for face in surface.faces]
        self._extents: dict[Piece, FloatArray] = {}  # the same pieces are asked for again and again
        roots: list[Piece] = []
        for index, (face, samples) in enumerate(zip(surface.faces, self._samples, strict=True)):
            lines = [
                [step * line for line in (0, *breaks, count)]
                for step, breaks, count in zip(
                    samples.steps, face.breaks, (face.rows, face.columns), strict=True
                )
            ]
            for (top, bottom), (left, right) in product(pairwise(lines[0]), pairwise(lines[1])):
                roots.append(Piece(index, len(roots), top, bottom, left, right))
        self._roots = roots
        self._pieces = set(roots)
        self.whole = np.array([self.extents(root) for root in roots])

    @property
    def pieces(self) -> list[Piece]:
        """All pieces, sorted."""
        return sorted(self._pieces, key=lambda one: (one.face, one.top, one.left))

    @cached_property
    def total_area(self) -> float:
        """The surface's area, in squared model units."""
        return float(sum(samples.area.sum() for samples in self._samples))

    def extents(self, piece: Piece) -> FloatArray:
        """Return the typical height and width (2,) of a piece, in model units.

        They are area-weighted geometric means of the derivatives' lengths, corrected for the angle between
        them, so that their product is the typical area.
        """
        found = self._extents.get(piece)
        if found is None:
            samples = self._samples[piece.face]
            down, right, element = samples.means(piece)
            sine = 0.5 * (element - down - right)
            spans = [
                (last - first) / step
                for (first, last), step in zip(map(piece.ends, (0, 1)), samples.steps, strict=True)
            ]
            found = self._extents[piece] = frozen_array(np.exp([down + sine, right + sine]) * spans)
        return found

    def parameters(self, piece: Piece) -> tuple[float, float, float, float]:
        """Return s0, s1, t0, t1 of a piece."""
        (s0, s1), (t0, t1) = (
            [end / self._samples[piece.face].steps[axis] for end in piece.ends(axis)] for axis in (0, 1)
        )
        return s0, s1, t0, t1

    def even_out(self, density: float, smallest: int, thinnest: int, ring: float) -> int:
        """Cut until texels are about equally large, as far as charts may not become too small.

        Greedy: the cuts that take most of the area-weighted fourth power of log texel area over the chart's
        typical one; then cuts that turned out needless are taken back. If charts of `smallest` texels do not
        reach it, smaller ones are tried.

        Parameters
        ----------
        density
            Texels per model unit.
        smallest, thinnest, ring
            Least height and width of a chart in texels, and least way round of one that meets itself, as for
            `density_layout`.

        Returns
        -------
        int
            The least height and width that it took: `thinnest` to `smallest`.
        """
        self._part_closed(ring / density)
        begin, tried = frozenset(self._pieces), []
        for least in sorted({smallest, (smallest + thinnest) // 2, thinnest}, reverse=True):
            self._pieces = set(begin)
            spread = self._greedy(np.clip(self.whole * density, thinnest, least) / density)
            tried.append((spread, least, self._pieces))
            if spread <= WANTED:
                return least
        # Many more charts are not worth a little evenness.
        costs = [round(spread + 0.5 * np.log(len(pieces)), 6) for spread, _, pieces in tried]
        _, least, self._pieces = tried[int(np.argmin(costs))]
        return least

    def keep_busy(self, density: float) -> None:
        """Cut further where charts would leave a thread idle: charts that touch are never laid at once.

        Parameters
        ----------
        density
            Texels per model unit.
        """
        for seam in self._closed_faces():
            face = self._surface.faces[seam.face]
            axis = seam.edge % 2
            most = (face.columns if axis else face.rows) * self._samples[seam.face].steps[axis] // ROUND
            waiting = self.pieces
            while waiting:
                piece = waiting.pop()
                first, last = piece.ends(axis)
                if piece.face == seam.face and last - first > most:
                    cuts = self._cuts(piece, axis, ROOMY / density)
                    if cuts:
                        self._make(cuts[0])
                        waiting += cuts[0].halves
        # A little above: what is one sixth or sixteenth but for rounding is that.
        large, enough = 1.01 * self.total_area / LARGE, 1.01 * self.total_area / ENOUGH
        for piece in self.pieces:
            if self._samples[piece.face].moments(piece)[0] > large:
                parts = self._parts(piece, enough, LONG / density)
                if parts:
                    self._pieces.remove(piece)
                    self._pieces.update(parts)

    def _parts(self, piece: Piece, most: float, least: float) -> list[Piece]:
        """Return a piece cut into such of at most an area; nothing if one were shorter than `least`."""
        if self._samples[piece.face].moments(piece)[0] <= most:
            return [piece]
        cuts = self._cuts(piece, int(np.argmax(self.extents(piece))), least)
        parts = [self._parts(half, most, least) for cut in cuts[:1] for half in cut.halves]
        return [one for part in parts for one in part] if all(parts) else []

    def _closed_faces(self) -> list[FaceSeam]:
        """Return the seams along which opposite edges of one face meet."""
        return [
            seam
            for seam in self._surface.face_shared
            if seam.face == seam.other_face and (seam.edge - seam.other_edge) % 4 == 2
        ]

    def cut_longest(self, most: float) -> bool:
        """Cut each piece longer than `most` model units, once; return whether all of them could be."""
        for piece in self.pieces:
            extents = self.extents(piece)
            if extents.max() > most:
                cuts = self._cuts(piece, int(np.argmax(extents)), 0.0)
                if not cuts:
                    return False
                self._make(cuts[0])
        return True

    def _part_closed(self, shortest: float) -> None:
        """Cut what meets itself, but for rings that are at least `shortest` model units round.

        A chart may meet itself along two opposite edges; blocks must fit in between.
        """
        for seam in self._surface.face_shared:
            if seam.face != seam.other_face:
                continue
            # Edges 0 and 2 run along t: where one is folded, it is cut there; a ring is cut between the two.
            axis = seam.edge % 2 if seam.edge != seam.other_edge else 1 - seam.edge % 2
            waiting = self.pieces
            while waiting:
                piece = waiting.pop()
                if not self._meets_itself(piece, seam):
                    continue
                ring = (seam.edge - seam.other_edge) % 4 == 2
                if ring and self.extents(piece)[axis] >= shortest:
                    continue
                cuts = self._cuts(piece, axis, 0.0)
                if cuts:
                    self._make(cuts[0])
                    waiting += cuts[0].halves

    def _meets_itself(self, piece: Piece, seam: FaceSeam) -> bool:
        """Return whether both sides of a face's seam with itself lie on one piece."""
        if piece.face != seam.face:
            return False
        s0, s1, t0, t1 = self.parameters(piece)
        lines, sides = (s0, t1, s1, t0), ((t0, t1), (s0, s1))
        face = self._surface.faces[piece.face]
        if any(lines[edge] != face.line(edge) for edge in (seam.edge, seam.other_edge)):
            return False
        low, high = sides[seam.edge % 2]
        low, high = max(low, seam.start), min(high, seam.stop)
        slope = (seam.other_stop - seam.other_start) / (seam.stop - seam.start)
        ends = sorted(seam.other_start + slope * (u - seam.start) for u in (low, high))
        other_low, other_high = sides[seam.other_edge % 2]
        return high > low and min(ends[1], other_high) - max(ends[0], other_low) > EPS

    def _greedy(self, least: FloatArray) -> float:
        """Cut, and return the logarithm of the spread that is reached.

        `least` holds the least height and width of a chart for each root, (roots, 2), in model units.
        """
        made: list[_Cut] = []
        histogram = self._histogram(self.pieces, least)
        best = {piece: self._best(piece, least[piece.root]) for piece in self.pieces}
        while _spread(histogram) > WANTED:
            cuts = sorted((cut for cut in best.values() if cut is not None), key=_Cut.order)
            if not cuts:
                break
            for cut in cuts:
                if cut.gain < AT_ONCE * cuts[0].gain:
                    break
                self._make(cut)
                made.append(cut)
                histogram += self._histogram(cut.halves, least) - self._histogram([cut.piece], least)
                del best[cut.piece]
                best |= {half: self._best(half, least[half.root]) for half in cut.halves}
        limit = max(WANTED, _spread(histogram) + 0.01)
        for cut in reversed(made):
            if self._pieces.issuperset(cut.halves):
                without = histogram + self._histogram([cut.piece], least) - self._histogram(cut.halves, least)
                if _spread(without) <= limit:
                    histogram = without
                    self._pieces.difference_update(cut.halves)
                    self._pieces.add(cut.piece)
        return _spread(histogram)

    def _best(self, piece: Piece, least: FloatArray) -> _Cut | None:
        """Return the cut that makes a piece most even, None if none helps."""
        cuts = []
        for axis, shortest in enumerate((SHORT * least).tolist()):
            for cut in self._cuts(piece, axis, shortest):
                # What is alike on both sides of its middle gains from cutting the halves only.
                further = [
                    max((one.gain for one in self._cuts(half, axis, shortest)), default=0.0)
                    for half in cut.halves
                ]
                cuts.append(replace(cut, gain=max(cut.gain, (cut.gain + sum(further)) / 3)))
        found = min(cuts, key=_Cut.order, default=None)
        return found if found is not None and found.gain > 1e-9 * self.total_area else None

    def _cuts(self, piece: Piece, axis: int, least: float) -> list[_Cut]:
        """Return the cuts across an axis, at most two: none whose halves are shorter than `least`."""
        first, last = piece.ends(axis)
        step = self._samples[piece.face].steps[axis]
        # Within a patch its middle; across several the borders nearest to the middle.
        unit = step if last - first > step else (last - first) // 2
        if unit == 0:
            return []
        middle = (first + last) / (2 * unit)
        found = []
        for at in sorted({unit * floor(middle), unit * ceil(middle)}):
            halves = piece.halves(axis, at)
            if min(float(self.extents(half)[axis]) for half in halves) >= least:
                samples = self._samples[piece.face]
                gain = samples.unevenness(piece) - sum(map(samples.unevenness, halves))
                found.append(_Cut(piece, halves, gain))
        return found

    def _make(self, cut: _Cut) -> None:
        self._pieces.remove(cut.piece)
        self._pieces.update(cut.halves)

    def _histogram(self, pieces: Iterable[Piece], least: FloatArray) -> FloatArray:
        """Return how much area has which log texel area over the wanted one."""
        total = np.zeros(BINS)
        for piece in pieces:
            samples = self._samples[piece.face]
            # Too small a chart gets more texels than asked for: what is cut too often grows uneven again.
            short = np.log(np.maximum(1.0, least[piece.root] / self.extents(piece))).sum()
            window = np.s_[piece.top : piece.bottom, piece.left : piece.right]
            x = samples.logs[AREA][window] - (samples.means(piece)[AREA] + short)
            place = np.clip((x + 4) * (BINS / 8), 0, BINS - 1).astype(np.intp)
            total += np.bincount(place.ravel(), samples.area[window].ravel(), BINS)
        return total


def _spread(histogram: FloatArray) -> float:
    """Return the logarithm of the 99th over the 1st percentile."""
    below = np.concatenate([[0.0], np.cumsum(np.maximum(histogram, 0))])
    low, high = np.interp([0.01 * below[-1], 0.99 * below[-1]], below, np.arange(BINS + 1))
    return float(high - low) * (8 / BINS)
