"""Where edges of faces meet: the intervals at which edges of patches meet, joined along the faces' edges."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from upholster.geometry.adjacency import SharedEdge
from upholster.geometry.face import Face

__all__ = ["FaceSeam", "join_seams"]

EPS = 1e-6
"""Places on an edge closer than this, in its parameter, are one."""


@dataclass(frozen=True, slots=True)
class FaceSeam:
    """An interval of a face's edge, and the interval of another one's (or of the same face's) that meets it.

    The map between the two is linear. Edge numbers and parameters: `Face`.

    Attributes
    ----------
    face, edge
        Whose interval it is.
    start, stop
        The interval, start < stop, in the edge's own parameter: 0 to the face's rows or columns.
    other_face, other_edge
        Who is on the other side.
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
    faces: Sequence[Face], shared: Sequence[SharedEdge], place: Callable[[int], tuple[int, int, int]]
) -> tuple[FaceSeam, ...]:
    """Join what edges of patches share along the edges of their faces, as far as one linear map goes.

    Parameters
    ----------
    faces
        All faces.
    shared
        As `Surface.shared`; what lies inside a face is left out.
    place
        Patch number to (face, row, column).

    Returns
    -------
    tuple of FaceSeam
        Each once, (face, edge) ≤ (other_face, other_edge), sorted.
    """
    found = []
    for one in shared:
        here, there = (
            _rim(faces, place(one.patch), one.edge),
            _rim(faces, place(one.other_patch), one.other_edge),
        )
        if here is None or there is None:
            continue
        (face, first), (other, other_first) = here, there
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


def _rim(faces: Sequence[Face], place: tuple[int, int, int], edge: int) -> tuple[int, int] | None:
    """Return the face of a patch's edge, and where it begins on the face's edge; None inside the face."""
    index, row, column = place
    face = faces[index]
    inside = (row > 0, column < face.columns - 1, row < face.rows - 1, column > 0)[edge]
    return None if inside else (index, row if edge & 1 else column)


def _joined(a: FaceSeam, b: FaceSeam) -> FaceSeam | None:
    """Return two seams as one, if the second goes on where the first ends, by the same linear map."""
    same = (a.face, a.edge, a.other_face, a.other_edge) == (b.face, b.edge, b.other_face, b.other_edge)
    if not same or abs(a.stop - b.start) > EPS or abs(a.other_stop - b.other_start) > EPS:
        return None
    slopes = [(one.other_stop - one.other_start) / (one.stop - one.start) for one in (a, b)]
    if abs(slopes[0] - slopes[1]) > EPS * abs(slopes[0]):
        return None
    return FaceSeam(a.face, a.edge, a.start, b.stop, a.other_face, a.other_edge, a.other_start, b.other_stop)
