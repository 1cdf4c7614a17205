"""Arrays of a glTF file: accessors over buffer views, including sparse accessors and compressed views.

References
----------
Khronos: glTF 2.0 specification, chapter 3.6.2.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError
from upholster.base.types import FloatArray
from upholster.geometry.gltf.gltf import MAX_BUFFER, Gltf, Json, whole
from upholster.geometry.gltf.meshopt import decoded_view, meshopt_of

__all__ = ["COMPONENTS", "MAX_ELEMENTS", "Accessor", "Accessors", "as_floats"]

MAX_ELEMENTS = 12_000_000
"""Greatest number of elements of an accessor: three vertices for each triangle of the largest mesh."""

COMPONENTS: dict[int, np.dtype[Any]] = {
    5120: np.dtype("<i1"),
    5121: np.dtype("<u1"),
    5122: np.dtype("<i2"),
    5123: np.dtype("<u2"),
    5125: np.dtype("<u4"),
    5126: np.dtype("<f4"),
}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass(frozen=True, eq=False)
class Accessor:
    """An accessor's elements.

    Attributes
    ----------
    values
        (count, components), in the type of the file.
    normalized
        Whether integers represent numbers up to 1.
    """

    values: NDArray[Any]
    normalized: bool


class Accessors:
    """Reads the accessors of a file; caches decompressed views."""

    def __init__(self, gltf: Gltf) -> None:
        self.gltf = gltf
        self._views: dict[int, NDArray[np.uint8]] = {}
        self._decompressed = 0

    def read(self, index: object, *widths: int) -> Accessor:
        """Return an accessor's elements.

        Parameters
        ----------
        index
            Its number.
        widths
            Allowed numbers of components of an element.

        Raises
        ------
        FormatError
            If it violates the format, or has other elements.
        """
        entry = self.gltf.item("accessors", index)
        kind = COMPONENTS.get(entry.get("componentType", 0) if _is_plain(entry.get("componentType")) else 0)
        width = _WIDTHS.get(str(entry.get("type")))
        if kind is None or width is None or width not in widths:
            raise FormatError(
                f"accessor {index} is of componentType {str(entry.get('componentType'))[:20]}, type "
                f"{str(entry.get('type'))[:20]}; allowed there: {' or '.join(map(str, widths))} components"
            )
        count = whole(entry, "count", 1, MAX_ELEMENTS)
        if "bufferView" in entry:
            offset = whole(entry, "byteOffset", 0, MAX_BUFFER, 0)
            values = self._elements(entry["bufferView"], offset, count, kind, width)
        else:
            values = np.zeros((count, width), kind)
        if "sparse" in entry:
            values = self._patched(entry["sparse"], values.copy())
        return Accessor(values, entry.get("normalized") is True and kind.kind != "f")

    def count(self, index: object) -> int:
        """Return the number of elements that an accessor announces."""
        return whole(self.gltf.item("accessors", index), "count", 1, MAX_ELEMENTS)

    def view(self, index: object) -> NDArray[np.uint8]:
        """Return the bytes of a buffer view, decompressed."""
        entry = self.gltf.item("bufferViews", index)
        assert isinstance(index, int)
        extension = meshopt_of(entry)
        if extension is None:
            return np.frombuffer(self.gltf.view_of(entry), np.uint8)
        if index not in self._views:
            self._decompressed += whole(entry, "byteLength", 1, MAX_BUFFER)
            if self._decompressed > MAX_BUFFER:
                raise FormatError(f"more than {MAX_BUFFER} bytes when decompressed; allowed: up to that")
            self._views[index] = decoded_view(self.gltf, entry, extension)
        return self._views[index]

    def _elements(
        self, view: object, offset: int, count: int, kind: np.dtype[Any], width: int
    ) -> NDArray[Any]:
        data = self.view(view)
        size = kind.itemsize * width
        stride = whole(self.gltf.item("bufferViews", view), "byteStride", 1, 1024, size)
        if stride < size or offset + stride * (count - 1) + size > len(data):
            raise FormatError(
                f"{count} elements of {size} bytes, {stride} apart from byte {offset} on, do not fit buffer "
                f"view {view}, which has {len(data)} bytes"
            )
        return np.ndarray((count, width), kind, data, offset, (stride, kind.itemsize)).copy()

    def _patched(self, sparse: object, values: NDArray[Any]) -> NDArray[Any]:
        """Replace the elements that a sparse accessor lists."""
        if not isinstance(sparse, dict):
            raise FormatError("sparse is not an object")
        where, what = sparse.get("indices"), sparse.get("values")
        if not isinstance(where, dict) or not isinstance(what, dict):
            raise FormatError("sparse has no indices and values")
        count = whole(sparse, "count", 1, len(values))
        kind = COMPONENTS.get(where["componentType"] if _is_plain(where.get("componentType")) else 0)
        if kind is None or kind.kind != "u":
            raise FormatError("sparse indices are not whole numbers")
        at = self._listed(where, count, kind, 1)[:, 0].astype(np.int64)
        if at.max() >= len(values):
            raise FormatError(f"a sparse index is {at.max()}; there are {len(values)} elements")
        values[at] = self._listed(what, count, values.dtype, values.shape[1])
        return values

    def _listed(self, entry: Json, count: int, kind: np.dtype[Any], width: int) -> NDArray[Any]:
        offset = whole(entry, "byteOffset", 0, MAX_BUFFER, 0)
        return self._elements(entry.get("bufferView"), offset, count, kind, width)


def as_floats(accessor: Accessor) -> FloatArray:
    """Return an accessor's elements as floats: normalized integers as shares of the largest one.

    Raises
    ------
    FormatError
        If one is not finite.
    """
    values = accessor.values.astype(np.float64)
    if accessor.normalized:
        values = np.maximum(values / np.iinfo(accessor.values.dtype).max, -1.0)
    if not np.isfinite(values).all():
        raise FormatError("a number of the geometry is not finite")
    return values


def _is_plain(value: object) -> bool:
    return type(value) is int
