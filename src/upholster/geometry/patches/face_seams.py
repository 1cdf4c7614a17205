"""Where edges of faces meet: intervals at which edges of patches meet, joined along the faces' edges."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from upholster.geometry.patches.adjacency import SharedEdge

__all__ = ["FaceSeam", "join_seams"]

EPS = 1e-6
"""Places on an edge closer than this, in its parameter, count as one."""


@dataclass(frozen=True, slots=True)
class FaceSeam:
    """An interval of a face's edge, and the interval of another face's edge (or its own) that meets it.

    The map between the two is linear. Edge numbers and parameters: `Face`.

    Attributes
    ----------
    face, edge
        The face and edge that the interval is on.
    start, stop
        The interval, start < stop, in the edge's own parameter: 0 to the face's rows or columns.
    other_face, other_edge
        The face and edge on the other side.
    other_start, other_stop
        Parameters on the other edge that meet `start` and `stop`: other_start > other_stop where the two
        edges run in opposite directions.
    """

    face: int
    edge: int
    start: float
    stop: float
    other_face: int
    other_edge: int
    other_start: float
    other_stop: float

    @property
    def opposed(self) -> bool:
        """Whether the two edges run in opposite directions."""
        return self.other_start > self.other_stop

    def flipped(self) -> "FaceSeam":
        """Return the same seam seen from the other side."""
        ends = [(self.other_start, self.start), (self.other_stop, self.stop)]
        (start, other_start), (stop, other_stop) = sorted(ends)
        return FaceSeam(
            self.other_face, self.other_edge, start, stop, self.face, self.edge, other_start, other_stop
        )


def join_seams(
    shared: Sequence[SharedEdge], place: Callable[[int], tuple[int, int, int]]
) -> tuple[FaceSeam, ...]:
    """Join the shared intervals of patches along the edges of their faces, where one linear map covers both.

    Parameters
    ----------
    shared
        As in `Surface.outer_shared`: on edges of faces.
    place
        Patch number to (face, row, column).

    Returns
    -------
    tuple of FaceSeam
        Each once, with (face, edge) ≤ (other_face, other_edge), sorted.
    """
    found = []
    for one in shared:
        (face, *here), (other, *there) = place(one.patch), place(one.other_patch)
        # Edges 0 and 2 run along columns, 1 and 3 along rows.
        first, other_first = here[1 - one.edge % 2], there[1 - one.other_edge % 2]
        seam = FaceSeam(
            face,
            one.edge,
            first + one.start,
            first + one.stop,
            other,
            one.other_edge,
            other_first + one.other_start,
            other_first + one.other_stop,
        )
        found.append(min(seam, seam.flipped(), key=_order))
    joined: list[FaceSeam] = []
    for seam in sorted(found, key=_order):
        longer = _joined(joined[-1], seam) if joined else None
        if longer is None:
            joined.append(seam)
        else:
            joined[-1] = longer
    return tuple(joined)


def _order(seam: FaceSeam) -> tuple[int, int, float]:
    return seam.face, seam.edge, seam.start


def _joined(a: FaceSeam, b: FaceSeam) -> FaceSeam | None:
    """Return two seams as one if the second continues where the first ends, by the same linear map."""
    same = (a.face, a.edge, a.other_face, a.other_edge) == (b.face, b.edge, b.other_face, b.other_edge)
    if not same or abs(a.stop - b.start) > EPS or abs(a.other_stop - b.other_start) > EPS:
        return None
    slopes = [(one.other_stop - one.other_start) / (one.stop - one.start) for one in (a, b)]
    if abs(slopes[0] - slopes[1]) > EPS * abs(slopes[0]):
        return None
    return FaceSeam(a.face, a.edge, a.start, b.stop, a.other_face, a.other_edge, a.other_start, b.other_stop)
