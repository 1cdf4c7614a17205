"""3MF: triangles with a unit of length, for slicers."""

import os
import zipfile
from collections.abc import Iterator
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from upholster._version import __version__
from upholster.base.files import writing
from upholster.base.types import FloatArray, IntArray

__all__ = ["write_3mf"]

_TYPES = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"""
_RELATIONS = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0"
Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/> </Relationships>
"""
_ROWS = 1 << 15


def write_3mf(
    path: str | os.PathLike[str], positions: FloatArray, triangles: IntArray, *, name: str = "model"
) -> None:
    """Write triangles as a 3MF package with one object, in millimetres; z is up.

    Parameters
    ----------
    path
        The file.
    positions
        (V, 3) in millimetres; nine digits of each number are written.
    triangles
        (T, 3): counter-clockwise seen from outside, of three vertices each.
    name
        The object's name.

    References
    ----------
    3MF Consortium: 3D Manufacturing Format, Core Specification and Reference Guide, version 1.3.
    """
    with (
        writing(path) as opened,
        zipfile.ZipFile(opened, "w", zipfile.ZIP_DEFLATED, compresslevel=5) as package,
    ):
        for part, text in (("[Content_Types].xml", _TYPES), ("_rels/.rels", _RELATIONS)):
            package.writestr(_entry(part), text)
        with package.open(_entry("3D/3dmodel.model"), "w", force_zip64=True) as file:
            for text in _model(positions, triangles, name):
                file.write(text.encode("utf-8"))


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name)  # with a fixed date: the same model gives the same file
    entry.compress_type = zipfile.ZIP_DEFLATED
    return entry


def _model(positions: FloatArray, triangles: IntArray, name: str) -> Iterator[str]:
    """Yield the XML of the model, in pieces."""
    title = escape("".join(c for c in name if c.isprintable()), {'"': "&quot;"})
    yield (
        '<?xml version="1.0" encoding="UTF-8"?>\n<model unit="millimeter" xml:lang="en-US" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">\n'
        f'<metadata name="Application">upholster {__version__}</metadata>\n'
        f'<resources>\n<object id="1" type="model" name="{title}">\n<mesh>\n<vertices>\n'
    )
    yield from _rows('<vertex x="%.9g" y="%.9g" z="%.9g"/>\n', positions + 0.0)
    yield "</vertices>\n<triangles>\n"
    yield from _rows('<triangle v1="%d" v2="%d" v3="%d"/>\n', triangles)
    yield "</triangles>\n</mesh>\n</object>\n</resources>\n"
    yield '<build>\n<item objectid="1"/>\n</build>\n</model>\n'


def _rows(form: str, values: NDArray[np.generic]) -> Iterator[str]:
    for start in range(0, len(values), _ROWS):
        part = values[start : start + _ROWS]
        yield form * len(part) % tuple(part.ravel().tolist())
