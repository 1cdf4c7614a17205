"""STL files, binary or text: triangles without shared vertices.

References
----------
3D Systems: StereoLithography Interface Specification, 1988.
"""

import re
from itertools import islice

import numpy as np

from upholster.base.errors import FormatError
from upholster.base.types import FloatArray
from upholster.geometry.meshes.triangle_mesh import MAX_TRIANGLES
from upholster.geometry.model_files.model_file import ModelPart
from upholster.geometry.model_files.raw_model import RawModel
from upholster.geometry.model_files.text_numbers import numbers_of

__all__ = ["read_stl"]

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"vertex\s+(\S+\s+\S+\s+\S+)", re.IGNORECASE)
_FACET = re.compile(rb"\bendfacet\b", re.IGNORECASE)


def read_stl(data: bytes, name: str) -> RawModel:
    """Read an STL file: one part, named after the file.

    Raises
    ------
    FormatError
        If it violates the format.
    """
    corners = _text_corners(data) if _is_text(data) else _binary_corners(data)
    count = len(corners)
    return RawModel(
        corners.reshape(-1, 3),
        np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        np.zeros(count, np.int32),
        [ModelPart(name)],
    )


def _is_text(data: bytes) -> bool:
    """Return whether a file is text. A binary file may also begin with "solid", but has an exact length."""
    if len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return False
    return data.lstrip()[:5].lower() == b"solid"


def _binary_corners(data: bytes) -> FloatArray:
    if len(data) < 84:
        raise FormatError(f"an STL of {len(data)} bytes is cut short")
    count = int.from_bytes(data[80:84], "little")
    if not 1 <= count <= MAX_TRIANGLES or len(data) < 84 + 50 * count:
        raise FormatError(
            f"it announces {count} triangles in {len(data)} bytes; allowed: 1 to {MAX_TRIANGLES}, of 50 bytes"
        )
    return np.frombuffer(data, _RECORD, count, 84)["corners"].astype(np.float64)


def _text_corners(data: bytes) -> FloatArray:
    rows = _VERTEX.findall(data)
    facets = len(_FACET.findall(data))
    if not rows or len(rows) != 3 * facets:
        raise FormatError(f"it has {facets} facets and {len(rows)} vertices; allowed: three for each")
    if facets > MAX_TRIANGLES:
        raise FormatError(f"it has {facets} facets; allowed: {MAX_TRIANGLES}")

    def place(row: int) -> str:
        start = next(islice(_VERTEX.finditer(data), row, None)).start()
        number = data.count(b"\n", 0, start) + 1
        return f"line {number}"

    one_line = b"\n".join(b" ".join(row.split()) for row in rows)
    return numbers_of(one_line, "coordinates", place).reshape(-1, 3, 3)
