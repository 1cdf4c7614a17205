"""Pictures of objects in notebooks: who can show themselves, and how, without a class knowing its renderer.

A class derives from `Shown`; a higher layer (`upholster.notebook`) says with `show_with` how it is pictured.
"""

from collections.abc import Callable
from typing import Any, ClassVar

__all__ = ["Shown", "show_with"]


class Shown:
    """Base of what a notebook shows as a picture (Jupyter's display protocol)."""

    __slots__ = ()
    _pictures: ClassVar[dict[type, Callable[[Any], bytes]]] = {}

    def _repr_png_(self) -> bytes | None:
        picture = self._pictures.get(type(self))
        return None if picture is None else picture(self)


def show_with(kind: type, picture: Callable[[Any], bytes]) -> None:
    """Let objects of class `kind` be shown by `picture`, which returns a PNG file's bytes."""
    Shown._pictures[kind] = picture
