"""`Surface`: faces and the adjacency of their edges."""

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from numbers import Real

import numpy as np

from upholster.base.display import Shown, on_a_line
from upholster.base.errors import InputError
from upholster.base.types import FloatArray
from upholster.geometry.patches.adjacency import (
    Adjacency,
    BorderInterval,
    FaceEdges,
    SharedEdge,
    find_adjacency,
    nearly_meeting,
)
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.face_seams import FaceSeam, join_seams
from upholster.geometry.patches.patch import RationalPatch

__all__ = ["MAX_PATCHES", "BuiltIn", "Surface"]

MAX_PATCHES = 65_536

Value = float | int | str | tuple[int, int]


@dataclass(frozen=True, slots=True)
class BuiltIn:
    """The origin of a built-in surface.

    Attributes
    ----------
    name
        The builder, as in `upholster.geometry.built_in.catalog.SURFACES`.
    values
        All its parameters as (name, value), in the builder's order.
    """

    name: str
    values: tuple[tuple[str, Value], ...]


@dataclass(frozen=True, eq=False, init=False)
class Surface(Shown):
    """Faces and the adjacency of their edges, which is computed on first use and cached.

    Attributes
    ----------
    faces
        Grids of patches, 1 to 65,536 patches in all; a single patch stands for a face of one. Normals should
        all point outward.
    name
        Name in reports and files.
    tolerance
        Greatest distance at which edges still meet, relative to `size`: 0 to 0.01, by default 1e-9.
    source
        For a built-in surface, the builder and its values, which a stream stores instead of control nets.

    Raises
    ------
    InputError
        If there are no patches or too many, an entry is not a face, or the tolerance is out of range.
    """

    faces: tuple[Face, ...]
    name: str = ""
    tolerance: float = 1e-9
    source: BuiltIn | None = field(default=None, init=False)

    def __init__(
        self,
        faces: Sequence[Face | RationalPatch],
        name: str = "",
        tolerance: float = 1e-9,
    ) -> None:
        """Check the faces and keep them as a tuple."""
        if not isinstance(faces, Sequence):
            raise InputError(f"faces are a {type(faces).__name__}; allowed: a list of Face or RationalPatch")
        if not isinstance(name, str):
            raise InputError(f"name is a {type(name).__name__}; allowed: a text")
        kept = []
        for k, face in enumerate(faces):
            if not isinstance(face, Face | RationalPatch):
                raise InputError(f"face {k} is a {type(face).__name__}; allowed: Face or RationalPatch")
            kept.append(face if isinstance(face, Face) else Face(((face,),)))
        count = sum(face.rows * face.columns for face in kept)
        if not 1 <= count <= MAX_PATCHES:
            raise InputError(f"a surface has {count} patches; allowed: 1 to {MAX_PATCHES}")
        if not (isinstance(tolerance, Real) and 0.0 <= tolerance <= 0.01):
            raise InputError(
                f"tolerance is {tolerance!r}; allowed: 0 to 0.01, relative to the surface's size"
            )
        values = {"faces": tuple(kept), "name": name, "tolerance": tolerance, "source": None}
        for key, value in values.items():
            object.__setattr__(self, key, value)

    def __repr__(self) -> str:
        count = len(self.patches)
        if self.source is not None:
            written = (
                f"{name}={'x'.join(map(str, value)) if isinstance(value, tuple) else value}"
                for name, value in self.source.values
            )
            return on_a_line(self, {"spec": f"{self.source.name}:{','.join(written)}", "patches": count})
        return on_a_line(self, {"name": self.name, "faces": len(self.faces), "patches": count})

    def is_like(self, other: object) -> bool:
        """Whether another surface has the same faces, point by point within 1e-6 of its size."""
        if self is other:
            return True
        if not isinstance(other, Surface):
            return False
        if len(self.faces) != len(other.faces) or len(self.patches) != len(other.patches):
            return False
        room = 1e-6 * self.size
        return all(
            a.net.shape == b.net.shape
            and bool(np.allclose(a.control_points, b.control_points, rtol=0, atol=room))
            and bool(np.allclose(a.weights * b.weights[0, 0], b.weights * a.weights[0, 0], rtol=1e-6))
            for a, b in zip(self.patches, other.patches, strict=True)
        )

    @classmethod
    def built_in(cls, name: str, faces: Sequence[Face | RationalPatch], **values: Value) -> "Surface":
        """Return a built-in surface: its name, its faces, and all the values that its builder took.

        Raises
        ------
        InputError
            As for the class.
        """
        surface = cls(faces, name)
        object.__setattr__(surface, "source", BuiltIn(name, tuple(values.items())))
        return surface

    @cached_property
    def patches(self) -> tuple[RationalPatch, ...]:
        """All patches, face by face, each face's row by row."""
        return tuple(patch for face in self.faces for row in face.patches for patch in row)

    @cached_property
    def first_patches(self) -> tuple[int, ...]:
        """Number of each face's first patch."""
        sizes = [face.rows * face.columns for face in self.faces]
        return tuple(accumulate(sizes[:-1], initial=0))

    def place(self, patch: int) -> tuple[int, int, int]:
        """Return (face, row, column) of the patch with a number.

        Raises
        ------
        InputError
            If there is no such patch.
        """
        if not 0 <= patch < len(self.patches):
            raise InputError(f"patch {patch}; allowed: 0 to {len(self.patches) - 1}")
        face = bisect_right(self.first_patches, patch) - 1
        return face, *divmod(patch - self.first_patches[face], self.faces[face].columns)

    def whole_patch(self, face: int, s0: float, s1: float, t0: float, t1: float) -> int | None:
        """Return the number of the patch that covers exactly a rectangle of a face's parameters, or None."""
        row, column = int(s0), int(t0)
        if (s0, s1, t0, t1) != (row, row + 1, column, column + 1):
            return None
        return self.patch_number(face, row, column)

    def patch_number(self, face: int, row: int, column: int) -> int:
        """Return the number of a patch: the inverse of `place`.

        Raises
        ------
        InputError
            If there is no such patch.
        """
        if not (
            0 <= face < len(self.faces)
            and 0 <= row < self.faces[face].rows
            and 0 <= column < self.faces[face].columns
        ):
            raise InputError(f"face {face} has no patch [{row}, {column}]")
        return self.first_patches[face] + row * self.faces[face].columns + column

    @cached_property
    def box(self) -> FloatArray:
        """Least and greatest (x, y, z) of the control points, (2, 3), in the model's units."""
        corners = [(p.min(axis=(0, 1)), p.max(axis=(0, 1))) for p in (q.control_points for q in self.patches)]
        return np.array([np.min([c[0] for c in corners], axis=0), np.max([c[1] for c in corners], axis=0)])

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box of the control points, in the model's units."""
        return float(np.linalg.norm(self.box[1] - self.box[0]))

    @property
    def shared(self) -> tuple[SharedEdge, ...]:
        """Each interval in which two edges meet, once, sorted; (patch, edge) ≤ (other_patch, other_edge).

        Raises
        ------
        InputError
            If more than two edges claim one interval: names them.
        """
        return self._adjacency.shared

    @cached_property
    def face_shared(self) -> tuple[FaceSeam, ...]:
        """The seams between faces, each once, sorted; `outer_shared` joined along the faces' edges.

        A face may have a seam with itself: a closed ring does.

        Raises
        ------
        InputError
            As for `shared`.
        """
        return join_seams(self.outer_shared, self.place)

    def sharing(self, seams: tuple[FaceSeam, ...]) -> "Surface":
        """Return the surface with `face_shared` from a file; it is not computed again."""
        vars(self)["face_shared"] = seams
        return self

    @cached_property
    def outer_shared(self) -> tuple[SharedEdge, ...]:
        """The intervals in `shared` that are on the edges of faces, not inside one.

        Raises
        ------
        InputError
            As for `shared`.
        """
        rim = self._edges.rim
        return tuple(one for one in self.shared if rim[4 * one.patch + one.edge])

    @property
    def border(self) -> tuple[BorderInterval, ...]:
        """Intervals of edges without a neighbour, sorted; empty on a closed surface.

        Raises
        ------
        InputError
            As for `shared`.
        """
        return self._adjacency.border

    @property
    def degenerate(self) -> frozenset[tuple[int, int]]:
        """(patch, edge) of the edges that are points; they have no neighbours and are not borders.

        Raises
        ------
        InputError
            As for `shared`.
        """
        return self._adjacency.degenerate

    @cached_property
    def nearly_meeting(self) -> tuple[int, float]:
        """The number of edges that would also meet with a larger tolerance, and that tolerance.

        The tolerance is a power of ten, at most 0.001; it is the surface's own if no edges would join.

        Raises
        ------
        InputError
            As for `shared`.
        """
        return nearly_meeting(self._edges, self._adjacency, self.tolerance, self.size)

    def neighbours(self, patch: int, edge: int) -> tuple[SharedEdge, ...]:
        """Return the neighbours of an edge, seen from it (with `patch` and `edge` as given), sorted along it.

        A border or degenerate edge has none; an edge at a T-junction has several.

        Raises
        ------
        InputError
            If there is no such patch or edge; and as for `shared`.
        """
        if not (0 <= patch < len(self.patches) and 0 <= edge <= 3):
            raise InputError(
                f"patch {patch} edge {edge}; allowed: patch 0 to {len(self.patches) - 1}, edge 0 to 3"
            )
        return self._by_edge.get((patch, edge), ())

    def turned(self) -> "Surface":
        """Return the surface with all its normals flipped: its columns run the other way."""
        return Surface([face.reverse(1) for face in self.faces], self.name, self.tolerance)

    @cached_property
    def _edges(self) -> FaceEdges:
        """All edges of all patches."""
        return FaceEdges.of(self.faces)

    @cached_property
    def _adjacency(self) -> Adjacency:
        """The adjacency of all edges."""
        return find_adjacency(self._edges, self.tolerance * self.size)

    @cached_property
    def _by_edge(self) -> dict[tuple[int, int], tuple[SharedEdge, ...]]:
        """Both views of every shared interval, grouped by the edge from which it is seen."""
        views: dict[tuple[int, int], list[SharedEdge]] = defaultdict(list)
        for meeting in self.shared:
            for view in (meeting, meeting.flipped()):
                views[view.patch, view.edge].append(view)
        return {key: tuple(sorted(found, key=lambda m: m.start)) for key, found in views.items()}
