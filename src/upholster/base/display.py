"""How objects show themselves: on a line, as a picture in a notebook, in the viewer.

A class derives from `Shown`; a higher layer (`upholster.apps.notebook`) registers its picture with
`show_with`, so that no class depends on the renderer.
"""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from upholster.base.errors import InputError

__all__ = ["LINE", "Shown", "in_bytes", "number_of", "on_a_line", "show_with", "texels_in_words"]

LINE = 100
"""Largest number of characters of a line of text."""


def number_of(count: int, thing: str, things: str | None = None) -> str:
    """Return a number of things in words: ``1 part``, ``1,234 parts``; `things` is an irregular plural."""
    return f"{count:,} {thing if count == 1 else things or f'{thing}s'}"


def texels_in_words(texels: int, painted: int) -> str:
    """Return the number of texels on a surface in words, and the number painted if that is larger."""
    return f"{texels:,} texels" + (f" ({painted:,} with the charts' margins)" * (texels < painted))


class Shown:
    """Base of objects that a notebook shows as a picture (Jupyter's display protocol)."""

    __slots__ = ()
    _pictures: ClassVar[dict[str, Callable[[Any], bytes | None]]] = {}
    _viewers: ClassVar[dict[str, Callable[..., Any]]] = {}

    def _repr_png_(self) -> bytes | None:
        picture = self._pictures.get(type(self).__name__)
        return None if picture is None else picture(self)

    def view(self, *, height: int = 480) -> Any:
        """Return the viewer of this model, to be turned and zoomed in the notebook.

        Parameters
        ----------
        height
            Height of the viewer in pixels, 100 to 10,000.

        Returns
        -------
        Viewer
            An object that a notebook shows; see `upholster.view`.

        Raises
        ------
        InputError
            If there is nothing to view: texels without a quilt, or a stream that is too short.
        """
        viewer = self._viewers.get(type(self).__name__)
        if viewer is None:
            raise InputError(
                f"a {type(self).__name__} has no model to view; allowed: texels, streams, reports"
            )
        return viewer(self, height=height)


def show_with(
    name: str, picture: Callable[[Any], bytes | None], viewer: Callable[..., Any] | None = None
) -> None:
    """Let objects of the class called `name` be shown by `picture`, which returns a PNG file's bytes.

    The class is named rather than given, so that nothing has to be loaded before something is shown. `viewer`
    returns the same as `Shown.view`.
    """
    Shown._pictures[name] = picture
    if viewer is not None:
        Shown._viewers[name] = viewer


def on_a_line(value: object, parts: Mapping[str, object] | None = None) -> str:
    """Return a description of an object in at most `LINE` characters.

    Parameters
    ----------
    value
        The object.
    parts
        Values to show, by name: ``Chart(width=4)``. By default its own ``repr``.
    """
    if parts is None:
        text = repr(value)
    else:
        text = f"{type(value).__name__}({', '.join(f'{name}={part!r}' for name, part in parts.items())})"
    text = " ".join(text.split())
    return text if len(text) <= LINE else text[: LINE - 2] + "…" + text[-1]


def in_bytes(count: int) -> str:
    """Return a number of bytes for users."""
    power = min(3, (len(str(count)) - 1) // 3)
    number = count / 1000**power
    return (
        f"{number:.1f} {('bytes', 'kB', 'MB', 'GB')[power]}"
        if power and number < 100
        else (f"{number:.0f} {('bytes', 'kB', 'MB', 'GB')[power]}")
    )
