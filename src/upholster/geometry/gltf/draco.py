"""Draco-compressed primitives (KHR_draco_mesh_compression), by DracoPy."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError
from upholster.base.types import IntArray

__all__ = ["decoded_primitive"]


def decoded_primitive(
    data: bytes, attributes: dict[str, int], vertices: int, indices: int
) -> tuple[IntArray, dict[str, NDArray[Any]]]:
    """Decode a primitive.

    Parameters
    ----------
    data
        The compressed bytes.
    attributes
        Draco's number of each attribute by its name in glTF.
    vertices, indices
        Numbers that the file announces.

    Returns
    -------
    triangles
        (T, 3) int32.
    attributes
        (V, components) by name.

    Raises
    ------
    FormatError
        If the data are damaged, or differ from what the file announces.
    """
    import DracoPy

    try:
        found = DracoPy.decode(data)
        triangles = np.ascontiguousarray(found.faces, np.int32).reshape(-1, 3)
        arrays = {int(each["unique_id"]): np.asarray(each["data"]) for each in found.attributes}
    except Exception as error:  # of the library's own kinds
        words = (str(error).splitlines() or ["no reason given"])[0]
        raise FormatError(f"Draco data are damaged: {words}") from None
    chosen = {name: arrays[number] for name, number in attributes.items() if number in arrays}
    if len(chosen) < len(attributes):
        raise FormatError(f"Draco data lack {min(attributes.keys() - chosen.keys())}")
    if 3 * len(triangles) != indices or any(len(array) != vertices for array in chosen.values()):
        raise FormatError(f"Draco data hold {len(triangles)} triangles; announced: {indices // 3}")
    if not len(triangles) or triangles.min() < 0 or triangles.max() >= vertices:
        raise FormatError("Draco data name vertices that do not exist")
    return triangles, {name: array.reshape(vertices, -1) for name, array in chosen.items()}
