"""Meshopt-compressed buffer views.

References
----------
Khronos: EXT_meshopt_compression; appendix B: filters.
"""

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.geometry.gltf._meshopt_kernels import decode_attributes, decode_indices, decode_triangles
from upholster.geometry.gltf.gltf import MAX_BUFFER, Gltf, Json, whole

__all__ = ["MESHOPT", "decoded_view", "meshopt_of"]

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")

_HEADS = {"ATTRIBUTES": 0xA0, "TRIANGLES": 0xE1, "INDICES": 0xD1}
_STRIDES = {
    "NONE": range(4, 257, 4),
    "OCTAHEDRAL": (4, 8),
    "QUATERNION": (8,),
    "EXPONENTIAL": range(4, 257, 4),
}


def meshopt_of(entry: Json) -> Json | None:
    """Return a buffer view's compression extension; None if it is not compressed."""
    extensions = entry.get("extensions")
    if not isinstance(extensions, dict):
        return None
    return next((extensions[name] for name in MESHOPT if isinstance(extensions.get(name), dict)), None)


def decoded_view(gltf: Gltf, entry: Json, extension: Json) -> NDArray[np.uint8]:
    """Decompress a buffer view.

    Parameters
    ----------
    gltf
        The file.
    entry, extension
        The view, and its compression extension.

    Raises
    ------
    FormatError
        If the data are damaged.
    InputError
        If their version, mode or filter is not known.
    """
    mode, filter_name = extension.get("mode"), extension.get("filter", "NONE")
    if not isinstance(mode, str) or mode not in _HEADS:
        raise InputError(f"meshopt mode is {str(mode)[:20]!r}; allowed: {', '.join(_HEADS)}")
    if not isinstance(filter_name, str) or filter_name not in _STRIDES:
        raise InputError(f"meshopt filter is {str(filter_name)[:20]!r}; allowed: {', '.join(_STRIDES)}")
    stride = whole(extension, "byteStride", 1, 256)
    count = whole(extension, "count", 1, MAX_BUFFER // stride)
    allowed = _STRIDES[filter_name] if mode == "ATTRIBUTES" else (2, 4)
    if stride not in allowed or (mode == "TRIANGLES" and count % 3):
        raise FormatError(f"meshopt data have {count} elements of {stride} bytes, which {mode} cannot have")
    if whole(entry, "byteLength", 1, MAX_BUFFER) != count * stride:
        raise FormatError(
            f"a view of {entry['byteLength']} bytes has {count} elements of {stride} compressed"
        )
    data = np.frombuffer(gltf.view_of(extension), np.uint8)
    if data[0] != _HEADS[mode]:
        raise InputError(f"meshopt data begin with byte {data[0]}; allowed: {_HEADS[mode]}, version 0")
    # Zeros take at least an eighth of a bit per byte, and a triangle at least a byte: this bounds the memory.
    if count * stride > 128 * len(data):
        raise FormatError(f"{len(data)} bytes of meshopt data cannot hold {count} elements of {stride}")
    if mode == "ATTRIBUTES":
        out = np.empty(count * stride, np.uint8)
        fits = decode_attributes(data, stride, out)
        if fits:
            return _filtered(out, filter_name, stride)
    else:
        indices = np.empty(count, np.uint32)
        if mode == "INDICES":
            fits = decode_indices(data, indices)
        else:
            fits = decode_triangles(data, np.zeros((16, 2), np.int64), np.zeros(16, np.int64), indices)
        out = indices.astype("<u2" if stride == 2 else "<u4").view(np.uint8)
    if not fits:
        raise FormatError("meshopt data are damaged")
    return out


def _filtered(data: NDArray[np.uint8], name: str, stride: int) -> NDArray[np.uint8]:
    """Apply a filter to decoded attributes."""
    match name:
        case "OCTAHEDRAL":
            return _octahedral(data.view("<i1" if stride == 4 else "<i2").reshape(-1, 4))
        case "QUATERNION":
            return _quaternions(data.view("<i2").reshape(-1, 4))
        case "EXPONENTIAL":
            packed = data.view("<i4")
            mantissa = (packed << 8) >> 8
            data = np.ldexp(mantissa.astype("<f4"), packed >> 24).astype("<f4").view(np.uint8)
    return data


def _octahedral(packed: NDArray[np.signedinteger]) -> NDArray[np.uint8]:
    """Decode octahedral coordinates (n, 4) to unit vectors: x, y, and the unit; the last stays as it is."""
    one = packed[:, 2].astype(np.float32)
    x, y = packed[:, 0] / one, packed[:, 1] / one
    z = 1 - np.abs(x) - np.abs(y)
    fold = np.minimum(z, 0)
    x, y = x - np.copysign(fold, x), y - np.copysign(fold, y)
    vectors = np.stack([x, y, z], axis=1)
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    out = packed.copy()
    out[:, :3] = _rounded(vectors * np.iinfo(packed.dtype).max)
    return out.view(np.uint8).reshape(-1)


def _quaternions(packed: NDArray[np.signedinteger]) -> NDArray[np.uint8]:
    """Decode quaternions of three components (n, 4): the last stores the unit, and which one is left out."""
    largest = packed[:, 3] & 3
    one = (packed[:, 3] | 3).astype(np.float32)
    three = packed[:, :3] / one[:, None] * np.float32(0.5**0.5)
    fourth = np.sqrt(np.maximum(0, 1 - (three**2).sum(axis=1)))
    out = np.empty_like(packed)
    rows = np.arange(len(packed))
    for k, values in enumerate((fourth, *three.T)):
        out[rows, (largest + k) % 4] = _rounded(values * 32767)
    return out.view(np.uint8).reshape(-1)


def _rounded(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Round halves away from 0, as C does; NaN becomes 0."""
    rounded: NDArray[np.floating] = np.nan_to_num(
        np.trunc(values + np.copysign(0.5, values)), posinf=0, neginf=0
    )
    return rounded
