"""glTF 2.0 as a document: its JSON, checked where it is read, and its buffers.

References
----------
Khronos: glTF 2.0 specification, chapters 3.6 (buffers) and 4 (GLB).
"""

import base64
import binascii
import json
import math
import os
import struct
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from upholster.base.errors import FormatError, InputError
from upholster.base.files import path_inside, read_bytes

__all__ = ["MAX_BUFFER", "Gltf", "Json", "number_list", "parse_gltf", "whole"]

Json = dict[str, Any]

MAX_BUFFER = 1 << 30
"""Greatest number of bytes of a buffer, and of all decompressed data."""

_MAX_ITEMS = 1 << 20
_MAX_OF_KIND = {"nodes": 1 << 16, "meshes": 1 << 16}
"""Each item takes work in Python, even if nothing is drawn."""

_READABLE = {
    "KHR_draco_mesh_compression",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_mesh_quantization",
}
_GEOMETRY = ("meshopt", "draco", "mesh", "compression", "quantization", "skinning", "instancing", "lod")


class Gltf:
    """A glTF file: its JSON and its bytes.

    Attributes
    ----------
    json
        The document. It has only been checked to be an object; the methods check what they return.
    folder
        The folder of the files that it refers to.
    inputs
        Those of these files that have been read.
    """

    def __init__(self, document: Json, binary: bytes | None, folder: Path) -> None:
        self.json = document
        self.folder = folder
        self.inputs: list[Path] = []
        self._binary = binary
        self._buffers: dict[int, bytes] = {}
        self._checked: dict[str, list[Json]] = {}

    def items(self, kind: str) -> list[Json]:
        """Return one of the document's lists of objects, [] where it has none.

        Raises
        ------
        FormatError
            If it is not a list of objects, or has more than a million; for nodes and meshes, more than
            65,536.
        """
        found = self.json.get(kind, [])
        known = self._checked.get(kind)
        if known is not None and known is found:
            return known
        if not isinstance(found, list):
            raise FormatError(f"{kind} is not a list of objects")
        most = _MAX_OF_KIND.get(kind, _MAX_ITEMS)
        if len(found) > most:
            raise FormatError(f"{kind} has {len(found)} items; allowed: {most}")
        if not all(isinstance(item, dict) for item in found):
            raise FormatError(f"{kind} is not a list of objects")
        self._checked[kind] = found
        return found

    def item(self, kind: str, index: object) -> Json:
        """Return an object of one of the lists.

        Raises
        ------
        FormatError
            If there is none of this number.
        """
        found = self.items(kind)
        if type(index) is not int or not 0 <= index < len(found):
            raise FormatError(f"{kind[:-1]} {str(index)[:20]} does not exist; there are {len(found)}")
        return found[index]

    def buffer(self, index: object) -> bytes:
        """Return a buffer's bytes: from the GLB, from a separate file, or from a data URI.

        Raises
        ------
        FormatError, InputError
            If they are missing, or fewer than the document says.
        """
        entry = self.item("buffers", index)
        assert isinstance(index, int)
        if index not in self._buffers:
            length = whole(entry, "byteLength", 1, MAX_BUFFER)
            if not self.has_bytes(index):
                raise FormatError(f"buffer {index} has no bytes")
            data = self.resource(entry["uri"]) if "uri" in entry else self._binary or b""
            if len(data) < length:
                raise FormatError(f"buffer {index} has {len(data)} bytes; its byteLength is {length}")
            self._buffers[index] = data[:length]
        return self._buffers[index]

    def has_bytes(self, index: object) -> bool:
        """Return whether a buffer's bytes are in the GLB or at a URI; others stand for decompressed bytes."""
        return "uri" in self.item("buffers", index) or (index == 0 and self._binary is not None)

    def resource(self, uri: object) -> bytes:
        """Return the data of a URI: those in the URI, or a file in the document's folder.

        Raises
        ------
        FormatError, InputError
            For any other URI, data that are not base64, or a file that cannot be read or is elsewhere.
        """
        if not isinstance(uri, str):
            raise FormatError(f"uri is a {type(uri).__name__}; allowed: text")
        if uri.startswith("data:"):
            head, comma, data = uri.partition(",")
            if not comma or not head.endswith(";base64"):
                raise FormatError("a data URI is not base64")
            try:
                return base64.b64decode(data, validate=True)
            except (binascii.Error, ValueError):
                raise FormatError("a data URI is no base64") from None
        file = self._file_of(uri)
        data_read = read_bytes(file)
        if file not in self.inputs:
            self.inputs.append(file)
        return data_read

    def _file_of(self, uri: str) -> Path:
        try:
            scheme = urlsplit(uri).scheme
        except ValueError:
            scheme = "?"
        if scheme:
            raise InputError(f"it refers to {uri[:80]!r}; allowed: files in its folder, by relative names")
        return path_inside([self.folder], unquote(uri))

    def images_beside(self) -> list[Path]:
        """Return the image files that are in the document's folder."""
        uris = [image.get("uri") for image in self.items("images")]
        names = dict.fromkeys(uri for uri in uris if isinstance(uri, str) and not uri.startswith("data:"))
        found = []
        for name in names:
            with suppress(InputError):
                found.append(self._file_of(name))
        return found

    def view_of(self, entry: Mapping[str, Any]) -> memoryview:
        """Return the bytes described by an object with buffer, byteOffset and byteLength.

        Raises
        ------
        FormatError
            If they are not in the buffer.
        """
        data = self.buffer(entry.get("buffer"))
        offset = whole(entry, "byteOffset", 0, MAX_BUFFER, 0)
        length = whole(entry, "byteLength", 1, MAX_BUFFER)
        if offset + length > len(data):
            raise FormatError(f"a view of bytes {offset} to {offset + length}; its buffer has {len(data)}")
        return memoryview(data)[offset : offset + length]


def parse_gltf(data: bytes, path: str | os.PathLike[str]) -> Gltf:
    """Read a GLB or glTF document.

    Raises
    ------
    FormatError
        If it violates the format.
    InputError
        If it has another version, or needs an unknown extension for its geometry.
    """
    binary = None
    text: bytes | memoryview = data
    if data[:4] == b"glTF":
        text, binary = _chunks(data)
    try:
        document = json.loads(bytes(text).decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"its JSON is damaged: {error}") from None
    if not isinstance(document, dict) or not isinstance(document.get("asset"), dict):
        raise FormatError("it is not glTF: it has no asset")
    version = document["asset"].get("version")
    if not isinstance(version, str) or not version.startswith("2."):
        raise InputError(f"glTF version is {str(version)[:20]!r}; allowed: 2.0")
    required = document.get("extensionsRequired", [])
    if not isinstance(required, list):
        raise FormatError("extensionsRequired is not a list")
    for name in required:
        # Other extensions concern appearance, and stay as they are.
        about_geometry = isinstance(name, str) and any(word in name.lower() for word in _GEOMETRY)
        if about_geometry and name not in _READABLE:
            raise InputError(f"it needs the extension {name[:60]}; allowed: {', '.join(sorted(_READABLE))}")
    return Gltf(document, binary, Path(path).parent)


def _chunks(data: bytes) -> tuple[memoryview, bytes | None]:
    """Return the JSON and the binary part of a GLB."""
    if len(data) < 20:
        raise FormatError(f"a GLB of {len(data)} bytes is cut short")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise InputError(f"GLB version is {version}; allowed: 2")
    if length > len(data):
        raise FormatError(f"it has {len(data)} bytes of {length}")
    chunks: list[tuple[bytes, memoryview]] = []
    at = 12
    while at + 8 <= length and len(chunks) < 64:
        size, kind = struct.unpack_from("<I4s", data, at)
        if at + 8 + size > length:
            raise FormatError(f"the GLB's chunk at byte {at} has {size} bytes, beyond the file's end")
        chunks.append((kind, memoryview(data)[at + 8 : at + 8 + size]))
        at += 8 + size + -size % 4
    if not chunks or chunks[0][0] != b"JSON":
        raise FormatError("the GLB does not begin with JSON")
    binary = next((bytes(part) for kind, part in chunks[1:] if kind == b"BIN\0"), None)
    return chunks[0][1], binary


def whole(entry: Mapping[str, Any], key: str, least: int, most: int, default: int | None = None) -> int:
    """Return an integer of an object.

    Raises
    ------
    FormatError
        If it is missing and has no default, is not an integer, or is out of range.
    """
    value = entry.get(key, default)
    if isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
        value = int(value)
    if type(value) is not int or not least <= value <= most:
        raise FormatError(f"{key} is {str(value)[:20]}; allowed: {least} to {most}")
    return value


def number_list(entry: Mapping[str, Any], key: str, count: int) -> list[float] | None:
    """Return a list of `count` finite numbers of an object; None if it is missing.

    Raises
    ------
    FormatError
        If it is anything else.
    """
    value = entry.get(key)
    if value is None:
        return None
    if isinstance(value, list) and len(value) == count:
        plain = [float(v) for v in value if type(v) is float or (type(v) is int and abs(v) < 2**1000)]
        if len(plain) == count and all(map(math.isfinite, plain)):
            return plain
    raise FormatError(f"{key} is not {count} finite numbers")
