"""Whether two surfaces consist of the same patches that meet in the same way, regardless of shape."""

from collections.abc import Iterable

from upholster.base.errors import InputError
from upholster.geometry.patches.adjacency import SharedEdge
from upholster.geometry.patches.surface import Surface

__all__ = ["check_same_edges"]

EPS = 1e-6
"""Parameters of an edge closer than this count as equal."""


def check_same_edges(surface: Surface, model: Surface) -> None:
    """Check that a quilt on one surface also fits another: the same faces, whose edges meet alike.

    Texels that match across an edge on one surface then do so on the other.

    Parameters
    ----------
    surface
        The other surface. An edge that is a point counts as an edge without neighbours.
    model
        The surface to compare with.

    Raises
    ------
    InputError
        If the number of faces or a face's patches differ, or an edge meets another edge, or along another
        interval, or in the other direction. The message names the first difference.
    """
    if len(surface.faces) != len(model.faces):
        raise InputError(f"it has {len(surface.faces)} faces; allowed: {len(model.faces)}, as before")
    for number, (face, before) in enumerate(zip(surface.faces, model.faces, strict=True)):
        if (face.rows, face.columns) != (before.rows, before.columns):
            raise InputError(
                f"face {number} has {face.rows}x{face.columns} patches; "
                f"allowed: {before.rows}x{before.columns}, as before"
            )
    for patch in range(len(surface.patches)):
        for edge in range(4):
            now, then = surface.neighbours(patch, edge), model.neighbours(patch, edge)
            if not _alike(now, then):
                raise InputError(
                    f"edge {edge} of patch {patch} {_described(now)}; allowed: {_described(then)}, as before"
                )


def _alike(now: tuple[SharedEdge, ...], then: tuple[SharedEdge, ...]) -> bool:
    return len(now) == len(then) and all(
        (a.other_patch, a.other_edge) == (b.other_patch, b.other_edge)
        and max(
            abs(a.start - b.start),
            abs(a.stop - b.stop),
            abs(a.other_start - b.other_start),
            abs(a.other_stop - b.other_stop),
        )
        < EPS
        for a, b in zip(now, then, strict=True)
    )


def _described(neighbours: Iterable[SharedEdge]) -> str:
    parts = []
    for one in neighbours:
        along = "" if one.whole else f" from {one.start:.3g} to {one.stop:.3g}"
        way = ", in the opposite direction" if one.opposed else ""
        parts.append(f"meets edge {one.other_edge} of patch {one.other_patch}{along}{way}")
    return " and ".join(parts) or "meets nothing"
