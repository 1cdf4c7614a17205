"""Additions to a glTF document, which is written as GLB with all its other content.

References
----------
Khronos: glTF 2.0 specification, chapters 3.6 and 4.
"""

import copy
import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.base.files import writing
from upholster.geometry.gltf.accessors import COMPONENTS
from upholster.geometry.gltf.gltf import Gltf, Json
from upholster.geometry.gltf.meshopt import MESHOPT, meshopt_of
from upholster.output.export.gltf_references import prune

__all__ = ["GltfEdit", "mime_type", "write_parts"]

_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_CODES = {dtype.str: code for code, dtype in COMPONENTS.items()}
_VERTICES, _INDICES = 34962, 34963
_MAGIC = {
    b"\x89PNG": "image/png",
    b"\xff\xd8\xff": "image/jpeg",
    b"RIFF": "image/webp",
    b"\xabKTX 20\xbb": "image/ktx2",
    b"DDS ": "image/vnd-ms.dds",
}
_ALIGNED = 8


def mime_type(data: bytes) -> str | None:
    """Return the media type of an image's data; None if glTF does not allow it."""
    return next((kind for magic, kind in _MAGIC.items() if data.startswith(magic)), None)


class GltfEdit:
    """A copy of a document to which objects are appended; none is renumbered until it is written.

    Attributes
    ----------
    json
        The copy, which callers may change.
    notes
        Parts that could not be kept.
    """

    def __init__(self, gltf: Gltf) -> None:
        self.gltf = gltf
        self.json: Json = copy.deepcopy(gltf.json)
        self.notes: list[str] = []
        self._added: list[bytes] = []
        self._length = 0
        self._buffer = len(gltf.items("buffers"))

    def append(self, kind: str, item: Json) -> int:
        """Add an object to one of the document's lists, and return its number."""
        found: list[Json] = self.json.setdefault(kind, [])
        found.append(item)
        return len(found) - 1

    def add_view(self, data: bytes, **more: Any) -> int:
        """Add a buffer view of new bytes."""
        entry = {"buffer": self._buffer, "byteOffset": self._length, "byteLength": len(data), **more}
        padded = data + b"\0" * (-len(data) % _ALIGNED)
        self._added.append(padded)
        self._length += len(padded)
        return self.append("bufferViews", entry)

    def add_attribute(self, values: NDArray[Any], *, normalized: bool = False, bounds: bool = False) -> int:
        """Add an accessor of vertices' attributes (V, 1 to 4), in their own type.

        Parameters
        ----------
        values
            The attributes.
        normalized
            Whether integers stand for numbers up to 1.
        bounds
            Whether minimum and maximum are stored, as positions need them.
        """
        size = values.itemsize * values.shape[1]
        stride = size + -size % 4
        if stride > size:
            padded = np.zeros((len(values), stride // values.itemsize), values.dtype)
            padded[:, : values.shape[1]] = values
        else:
            padded = np.ascontiguousarray(values)
        view = self.add_view(padded.tobytes(), byteStride=stride, target=_VERTICES)
        entry = self._entry(view, values, _TYPES[values.shape[1]])
        if normalized:
            entry["normalized"] = True
        if bounds:
            entry |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return self.append("accessors", entry)

    def add_indices(self, triangles: NDArray[Any], vertices: int) -> int:
        """Add an accessor of the vertices of triangles."""
        values = triangles.astype("<u2" if vertices < 65536 else "<u4").reshape(-1)
        view = self.add_view(values.tobytes(), target=_INDICES)
        return self.append("accessors", self._entry(view, values, "SCALAR"))

    def add_image(self, data: bytes, name: str) -> int:
        """Add an image."""
        return self.append(
            "images", {"name": name, "bufferView": self.add_view(data), "mimeType": mime_type(data)}
        )

    def use_extension(self, name: str) -> None:
        """Declare that the document uses an extension."""
        for key in ("extensionsUsed", "extensionsRequired"):
            names = self.json.setdefault(key, [])
            if name not in names:
                names.append(name)

    def glb(self) -> list[bytes]:
        """Return the document as GLB, in parts, without objects that its changes made unused.

        Raises
        ------
        InputError
            If it would exceed 4 GiB.
        """
        prune(self.json, self.gltf.json)
        self._embed_images()
        self._drop_extensions()
        binary = self._packed()
        text = json.dumps(self.json, separators=(",", ":"), ensure_ascii=False).encode()
        text += b" " * (-len(text) % 4)
        size = sum(map(len, binary))
        total = 12 + 8 + len(text) + (8 + size if binary else 0)
        if total >= 1 << 32:
            raise InputError(f"GLB file would take {total} bytes; allowed: less than 4 GiB")
        head = [struct.pack("<4sII", b"glTF", 2, total), struct.pack("<I4s", len(text), b"JSON"), text]
        return [*head, struct.pack("<I4s", size, b"BIN\0"), *binary] if binary else head

    @staticmethod
    def _entry(view: int, values: NDArray[Any], kind: str) -> Json:
        code = _CODES[values.dtype.newbyteorder("<").str]
        return {"bufferView": view, "componentType": code, "count": len(values), "type": kind}

    def _drop_extensions(self) -> None:
        """Remove extensions that are no longer used from the document's lists."""
        before, now = (
            {name for each in _extensions(d) for name in each} for d in (self.gltf.json, self.json)
        )
        for key in ("extensionsUsed", "extensionsRequired"):
            names = self.json.pop(key, [])
            if kept := [name for name in names if name not in before - now]:
                self.json[key] = kept

    def _embed_images(self) -> None:
        """Embed images in files next to the document, because the new one may be elsewhere."""
        for image in self.json.get("images", []):
            uri = image.get("uri")
            if not isinstance(uri, str) or uri.startswith("data:"):
                continue
            try:
                data = self.gltf.resource(uri)
                mime = mime_type(data)
                if mime is None:
                    raise InputError("it is not an image; allowed: PNG, JPEG, WebP, KTX2, DDS")
            except InputError as error:
                self.notes.append(f"image {uri[:80]!r} is not embedded: {error}")
                continue
            del image["uri"]
            image["bufferView"] = self.add_view(data)
            image["mimeType"] = mime

    def _packed(self) -> list[bytes]:
        """Put the bytes of all views in one buffer, without unused bytes, and return them in parts."""
        places = list(_byte_ranges(self.json))
        spans: dict[int, list[tuple[int, int]]] = {}
        for entry in places:
            start = int(entry.get("byteOffset", 0))
            spans.setdefault(entry["buffer"], []).append((start, start + int(entry["byteLength"])))
        parts: list[bytes] = []
        at = 0
        moved: dict[int, list[tuple[int, int, int]]] = {}
        for buffer, ranges in sorted(spans.items()):
            data = b"".join(self._added) if buffer == self._buffer else self._bytes(buffer)
            if data is None:
                continue
            for start, end in _merged(ranges):
                moved.setdefault(buffer, []).append((start, end, at))
                part = data[start:end]
                parts.append(part + b"\0" * (-len(part) % _ALIGNED))
                at += len(parts[-1])
        empty = [n for n in range(self._buffer) if n in spans and n not in moved]
        for entry in places:
            buffer, start = entry["buffer"], int(entry.get("byteOffset", 0))
            if buffer in moved:
                first, _, to = next(span for span in moved[buffer] if span[0] <= start < span[1])
                entry["buffer"], entry["byteOffset"] = 0, to + start - first
            else:
                entry["buffer"] = 1 + empty.index(buffer)
        buffers: list[Json] = [{"byteLength": at}] if at else []
        buffers += [self.json["buffers"][n] for n in empty]
        self.json.pop("buffers", None)
        if buffers:
            self.json["buffers"] = buffers
        return parts

    def _bytes(self, buffer: int) -> bytes | None:
        """Return a buffer's bytes; None for a placeholder of decompressed bytes."""
        extensions = self.gltf.item("buffers", buffer).get("extensions", {})
        if any(extensions.get(name, {}).get("fallback") for name in MESHOPT):
            return None
        if not self.gltf.has_bytes(buffer) and all(
            meshopt_of(view) for view in self.json["bufferViews"] if view.get("buffer") == buffer
        ):
            return None
        return self.gltf.buffer(buffer)


def _byte_ranges(document: Json) -> Iterator[Json]:
    """Yield all objects that describe bytes of a buffer."""
    for view in document.get("bufferViews", []):
        yield view
        extensions = view.get("extensions", {})
        for name in MESHOPT:
            if name in extensions:
                yield extensions[name]


def _merged(ranges: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Join ranges of bytes that overlap, and begin each at a multiple of the alignment."""
    out: list[tuple[int, int]] = []
    for start, end in sorted(ranges):
        start -= start % _ALIGNED
        if out and start < out[-1][1]:
            out[-1] = (out[-1][0], max(out[-1][1], end))
        else:
            out.append((start, end))
    return out


def _extensions(item: Any) -> Iterator[Json]:
    """Yield every "extensions" object anywhere in a document."""
    waiting = [item]
    while waiting:
        item = waiting.pop()
        if isinstance(item, dict):
            if isinstance(item.get("extensions"), dict):
                yield item["extensions"]
            waiting += item.values()
        elif isinstance(item, list):
            waiting += item


def write_parts(path: Path, parts: list[bytes]) -> None:
    """Write parts of a file one after the other."""
    with writing(path) as file:
        for part in parts:
            file.write(part)
