"""`Surface`: patches and how their edges meet."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from upholster.errors import InputError
from upholster.geometry.adjacency import Adjacency, BorderInterval, SharedEdge, find_adjacency
from upholster.geometry.patch import RationalPatch
from upholster.shown import Shown
from upholster.types import FloatArray

__all__ = ["MAX_PATCHES", "Surface"]

MAX_PATCHES = 65_536


@dataclass(frozen=True, eq=False)
class Surface(Shown):
    """Patches and how their edges meet; what meets is found when first asked for, and kept.

    Attributes
    ----------
    patches
        1 to 65,536 patches; normals should all point outward.
    name
        What to call it in reports and files.
    tolerance
        How far apart edges may lie and still meet, relative to `size`: 0 to 0.01, by default 1e-9.
    spec
        The text that builds it again (`surface_from_spec`), if a builder of the catalog made it.

    Raises
    ------
    InputError
        If there are no patches or too many, one is no patch, or the tolerance is outside its range.
    """

    patches: Sequence[RationalPatch]
    name: str = ""
    tolerance: float = 1e-9
    spec: str = ""

    def __post_init__(self) -> None:
        """Check the patches and keep them as a tuple."""
        patches = tuple(self.patches)
        if not 1 <= len(patches) <= MAX_PATCHES:
            raise InputError(f"a surface has {len(patches)} patches; allowed: 1 to {MAX_PATCHES}")
        for k, patch in enumerate(patches):
            if not isinstance(patch, RationalPatch):
                raise InputError(f"patch {k} is a {type(patch).__name__}; allowed: RationalPatch")
        if not 0.0 <= self.tolerance <= 0.01:
            raise InputError(
                f"tolerance is {self.tolerance}; allowed: 0 to 0.01, relative to the surface's size"
            )
        object.__setattr__(self, "patches", patches)

    @cached_property
    def box(self) -> FloatArray:
        """Bounding box of the control points: [[x, y, z] least, [x, y, z] greatest], in the model's units."""
        corners = [(p.min(axis=(0, 1)), p.max(axis=(0, 1))) for p in (q.control_points for q in self.patches)]
        return np.array([np.min([c[0] for c in corners], axis=0), np.max([c[1] for c in corners], axis=0)])

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box of the control points, in the model's units."""
        return float(np.linalg.norm(self.box[1] - self.box[0]))

    @property
    def shared(self) -> tuple[SharedEdge, ...]:
        """Each interval in which two edges meet, once, sorted: (patch, edge) ≤ (other_patch, other_edge).

        Raises
        ------
        InputError
            If more than two edges claim one interval: names them.
        """
        return self._adjacency.shared

    @property
    def border(self) -> tuple[BorderInterval, ...]:
        """Intervals of edges that nothing meets, sorted; empty on a closed surface.

        Raises
        ------
        InputError
            As for `shared`.
        """
        return self._adjacency.border

    @property
    def degenerate(self) -> frozenset[tuple[int, int]]:
        """(patch, edge) of the edges that are a point; they have no neighbours and are no border.

        Raises
        ------
        InputError
            As for `shared`.
        """
        return self._adjacency.degenerate

    def neighbours(self, patch: int, edge: int) -> tuple[SharedEdge, ...]:
        """Return what meets an edge, seen from it (`patch` and `edge` are those asked for), sorted along it.

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
        """Return the surface with all its normals turned round: its columns run the other way."""
        return Surface([patch.reverse(1) for patch in self.patches], self.name, self.tolerance)

    @cached_property
    def _adjacency(self) -> Adjacency:
        """What meets what."""
        return find_adjacency(self.patches, self.tolerance * self.size)

    @cached_property
    def _by_edge(self) -> dict[tuple[int, int], tuple[SharedEdge, ...]]:
        """Both views of every shared interval, by the edge they are seen from."""
        views: dict[tuple[int, int], list[SharedEdge]] = defaultdict(list)
        for meeting in self.shared:
            for view in (meeting, meeting.flipped()):
                views[view.patch, view.edge].append(view)
        return {key: tuple(sorted(found, key=lambda m: m.start)) for key, found in views.items()}
