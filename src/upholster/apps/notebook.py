"""How objects show themselves in a notebook: as a picture, and in the viewer.

Modules for that are loaded when something is shown.
"""

import base64
import html
import math
import os
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from upholster.base.display import show_with
from upholster.base.errors import InputError, check_whole
from upholster.base.files import path_text, read_bytes

if TYPE_CHECKING:
    from upholster.apps.project.preview import Look
    from upholster.apps.project.project import Project
    from upholster.codec.stream.reader import StreamDecoder
    from upholster.geometry.patches.surface import Surface
    from upholster.model.textured_model import TexturedModel
    from upholster.output.refinement import RefineReport
    from upholster.output.reports import CoverReport
    from upholster.quilt.model import Quilt, Texels

__all__ = ["MOST_BYTES", "LiveView", "Viewer", "view"]

MOST_BYTES = 4_000_000
"""Largest part of a stream in a notebook, in bytes: any first part of one is a model."""

_WIDEST = 1024
_QUADS = 4000
_SIZE = (480, 360)

_FRAME = """<iframe title="{title}" sandbox="allow-scripts" srcdoc="{page}"
style="width: 100%; height: {height}px; border: 0"></iframe>"""


class Viewer:
    """The viewer of a stream, which a notebook shows in a frame: it needs no other files and no network.

    The frame may run scripts and nothing else; its page allows only its own scripts.

    Attributes
    ----------
    stream
        The bytes of the stream that it shows, at most `MOST_BYTES`.
    total
        Length of the complete stream in bytes.
    height
        Height of the frame in pixels; it is as wide as the notebook.
    poster
        A picture, WebP, shown until the stream is complete; empty: the stream is shown while it loads.
    """

    def __init__(self, stream: bytes, *, height: int = 480, poster: bytes = b"") -> None:
        self.height = check_whole("height", height, 100, 10_000)
        self.poster = poster
        self.total = len(stream)
        self.stream = stream[:MOST_BYTES]

    def __repr__(self) -> str:
        cut = f" of {self.total:,}" if self.total > len(self.stream) else ""
        return f"<viewer of {len(self.stream):,}{cut} bytes; a notebook shows it>"

    def _repr_html_(self) -> str:
        from upholster.output.export.html import viewer_page

        page = viewer_page(self.stream, title="upholster", poster=self.poster).decode()
        return _FRAME.format(title="textured model", page=html.escape(page), height=self.height)


def view(model: Any, *, height: int = 480) -> Viewer:
    """Return the viewer of a model, to be turned and zoomed in a notebook.

    Parameters
    ----------
    model
        A stream: its bytes, the path of its file, or a `StreamDecoder`; texels from `upholster.paint` or
        `upholster.paint_material`; or a report of `upholster.cover` or `upholster.refine`.
    height
        Height of the viewer in pixels, 100 to 10,000.

    Returns
    -------
    Viewer
        An object that a notebook shows as a frame, which takes 0.1 MB of the notebook and at most 4 MB of
        the stream.

    Raises
    ------
    InputError, FormatError
        If it is none of these, a stream that is too short, or texels without the quilt that they were painted
        from.
    """
    return Viewer(_stream_of(model), height=height)


class LiveView:
    """A project in a notebook, which follows changes: a picture soon, then the viewer.

    If ipywidgets is installed there are sliders for seed, direction and the sample's width, and the view
    follows `change`; otherwise it shows the project at the time of display.

    Attributes
    ----------
    project
        The present project.
    """

    def __init__(self, project: "Project", *, height: int = 480) -> None:
        self.project = project
        self.height = check_whole("height", height, 100, 10_000)
        self._box: Any = None
        self._shown: Any = None
        self._thread: threading.Thread | None = None
        with suppress(ImportError):
            self._make_widgets()

    def __repr__(self) -> str:
        return f"<view of {self.project!r}; a notebook shows it>"

    def _repr_mimebundle_(self, **which: Any) -> Any:
        if self._box is not None:
            return self._box._repr_mimebundle_(**which)
        *_, last = self.project.preview()
        return {"text/plain": repr(self), "text/html": self._viewer(last)._repr_html_()}

    def _viewer(self, look: "Look") -> Viewer:
        with self.project.previews.stages.active():  # its sample is coded once
            return Viewer(look.model.stream, height=self.height, poster=look.model.poster())

    def change(self, **choices: Any) -> None:
        """Change the project as `Project.change` does; the view follows."""
        self.project = self.project.change(**choices)
        if self._box is not None:
            self._follow()

    def wait(self) -> None:
        """Wait until the view shows the present project."""
        if self._thread is not None:
            self._thread.join()

    def _make_widgets(self) -> None:
        from ipywidgets import HTML, FloatLogSlider, FloatSlider, HBox, IntSlider, VBox

        scale = self.project.request().read()[0].scene.scale
        sliders = [IntSlider(self.project.seed, 0, max(99, self.project.seed), description="seed")]
        names = ["seed"]
        if scale is not None:
            width = scale.sample_size
            least, most = math.log10(width / 4), math.log10(width * 4)
            sliders += [
                FloatSlider(0.0, min=0.0, max=360.0, step=5.0, description="direction"),
                FloatLogSlider(width, min=least, max=most, step=0.02, description="width"),
            ]
            names += ["direction", "sample_size"]
        for slider, name in zip(sliders, names, strict=True):
            slider.observe(partial(self._moved, name), names="value")
        self._shown = HTML()
        self._box = VBox([HBox(sliders), self._shown])
        self._follow()

    def _moved(self, name: str, moved: Any) -> None:
        more = {"element_size": None} if name == "sample_size" else {}
        self.change(**{name: moved["new"]}, **more)

    def _follow(self) -> None:
        looks = self.project.preview()

        def follow() -> None:
            for look in looks:
                if look.is_final:
                    shown = self._viewer(look)._repr_html_()
                else:
                    picture = base64.b64encode(_model_picture(look.model) or b"").decode()
                    shown = f'<img alt="" src="data:image/png;base64,{picture}">'
                if not looks.is_cancelled:
                    self._shown.value = shown

        self._thread = threading.Thread(target=follow, daemon=True, name="view")
        self._thread.start()


def _stream_of(model: Any) -> bytes:
    """Return a model's stream."""
    from upholster.codec.stream.reader import StreamDecoder
    from upholster.model.textured_model import TexturedModel, textured_model
    from upholster.output.refinement import RefineReport, decoded_model
    from upholster.output.reports import CoverReport
    from upholster.quilt.model import Texels

    if isinstance(model, (str, os.PathLike)):
        model = read_bytes(path_text(model, "stream"))
    if isinstance(model, (bytes, bytearray, memoryview)):
        return _checked(bytes(model))
    if isinstance(model, (CoverReport, RefineReport)):
        model = model.model
    elif isinstance(model, StreamDecoder):
        model = decoded_model(model)
    elif isinstance(model, (Texels, Mapping)):
        model = textured_model(model)
    if not isinstance(model, TexturedModel):
        raise InputError(
            f"model is a {type(model).__name__}; allowed: a stream (bytes, its path, StreamDecoder), texels, "
            "a report of `upholster.cover`"
        )
    return model.stream


def _checked(stream: bytes) -> bytes:
    """Return a stream's bytes, if they suffice to show something."""
    from upholster.codec.stream.prefix import Limit, feed_until
    from upholster.codec.stream.reader import StreamDecoder

    decoder = StreamDecoder()
    feed_until(decoder, stream, Limit(most_bytes=1))
    if decoder.needed:
        raise InputError(f"stream is cut; needs {decoder.needed} more bytes")
    return stream


def _surface_picture(surface: "Surface") -> bytes:
    from upholster.charts.tessellation.mesh import tessellate
    from upholster.image.color import from_linear
    from upholster.image.files.write import encode_image
    from upholster.model.render.picture import render

    mesh = tessellate(surface, quads=_QUADS)
    picture = render(
        mesh.positions,
        mesh.normals,
        mesh.places,
        mesh.all_triangles(),
        None,
        size=_SIZE,
    )
    return encode_image(from_linear(picture, "uint8"), "png")


def _model_picture(model: "TexturedModel | None") -> bytes | None:
    from upholster.base.options.write_options import WriteOptions
    from upholster.image.color import from_linear
    from upholster.image.files.write import encode_image

    if model is None:
        return None
    picture = replace(model, options=WriteOptions(size=_SIZE, quads=_QUADS)).picture()
    return encode_image(from_linear(picture, "uint8"), "png")


def _report_picture(report: "CoverReport | RefineReport") -> bytes | None:
    return _model_picture(report.model)


def _project_picture(project: "Project") -> bytes | None:
    *_, last = project.preview()
    return _model_picture(last.model)


def _stream_picture(decoder: "StreamDecoder") -> bytes | None:
    from upholster.output.refinement import decoded_model

    return None if decoder.needed else _model_picture(decoded_model(decoder))


def _quilt_picture(quilt: "Quilt") -> bytes:
    import numpy as np

    from upholster.image.files.write import encode_image

    # Red and green are the place in the exemplar; blue separates painted from unpainted.
    scale = np.array(quilt.exemplar_shape) * 16
    places = [
        np.concatenate([np.clip(source * 255 / scale, 0, 255), (source[:, :, :1] >= 0) * 128], axis=2)
        for source in quilt.sources()
    ]
    return encode_image(_sheet([place.astype(np.uint8) for place in places]), "png")


def _texels_picture(texels: "Texels") -> bytes | None:
    from upholster.image.files.write import encode_image
    from upholster.model.textured_model import textured_model

    if texels.surface is not None:
        return _model_picture(textured_model(texels))
    return encode_image(_sheet(list(texels.arrays)), "png", bits=8)


def _sheet(arrays: list[Any]) -> Any:
    """Lay charts side by side, in a near square, thinned out to the resolution of a screen."""
    import numpy as np

    columns = int(np.ceil(np.sqrt(len(arrays))))
    rows = -(-len(arrays) // columns)
    height = max(array.shape[0] for array in arrays)
    width = max(array.shape[1] for array in arrays)
    step = max(1, -(-max(rows * height, columns * width) // _WIDEST))
    height, width = -(-height // step), -(-width // step)
    sheet = np.zeros((rows * height, columns * width, arrays[0].shape[2]), arrays[0].dtype)
    for index, array in enumerate(arrays):
        part = array[::step, ::step]
        row, column = index // columns * height, index % columns * width
        sheet[row : row + part.shape[0], column : column + part.shape[1]] = part
    return sheet


_SHOWN: dict[str, Callable[[Any], bytes | None]] = {
    "Texels": _texels_picture,
    "TexturedModel": _model_picture,
    "CoverReport": _report_picture,
    "RefineReport": _report_picture,
    "StreamDecoder": _stream_picture,
}
show_with("Surface", _surface_picture)
show_with("Project", _project_picture, LiveView)
show_with("Quilt", _quilt_picture)
for _name, _picture in _SHOWN.items():
    show_with(_name, _picture, view)
