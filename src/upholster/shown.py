"""Pictures of objects in notebooks: a base class whose objects show themselves without knowing the renderer.

A class derives from `Shown`; a higher layer (`upholster.notebook`) says with `show_with` how it is pictured.
"""

from collections.abc import Callable
from typing import Any, ClassVar

__all__ = ["Shown", "show_with"]


class Shown:
    """Base of what a notebook shows as a picture (Jupyter's display protocol)."""

    __slots__ = ()
    _pictures: ClassVar[dict[str, Callable[[Any], bytes]]] = {}

    def _repr_png_(self) -> bytes | None:
        picture = self._pictures.get(type(self).__name__)
        return None if picture is None else picture(self)


def show_with(name: str, picture: Callable[[Any], bytes]) -> None:
    """Let objects of the class called `name` be shown by `picture`, which returns a PNG file's bytes.

    The class is named rather than given, so that nothing has to be loaded before something is shown.
    """
    Shown._pictures[name] = picture
