"""3MF: a zip package of XML with objects for printers, read as triangles of the scene that it builds.

References
----------
3MF Consortium: Core Specification 1.3, chapters 2 (packages) and 3 (builds).
ISO/IEC 29500-2: Open Packaging Conventions.
"""

import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upholster.base.display import number_of
from upholster.base.errors import FormatError, InputError
from upholster.base.types import FloatArray, IntArray
from upholster.base.zip_files import open_zip, unpacked
from upholster.geometry.gltf.accessors import MAX_ELEMENTS
from upholster.geometry.meshes.triangle_mesh import MAX_TRIANGLES
from upholster.geometry.model_files.model_file import MAX_PARTS, ModelPart, named_parts
from upholster.geometry.model_files.raw_model import RawModel, joined_corners
from upholster.geometry.model_files.three_mf_model import (
    PlacedObject,
    ThreeMfModel,
    ThreeMfObject,
    parse_model,
)
from upholster.geometry.model_files.three_mf_settings import (
    SETTINGS,
    ObjectSettings,
    SlicedPiece,
    read_settings,
)
from upholster.geometry.model_files.xml_reader import Attributes, read_xml

__all__ = ["read_3mf"]

_RELATIONS = "http://schemas.openxmlformats.org/package/2006/relationships"
_MOST_UNPACKED = 1 << 29
_MOST_DENSE = 100
"""Bytes of XML from a byte of the file: triangles that differ give far fewer."""

_DEEPEST = 32
_NOT_SOLID = ("support", "solidsupport", "other")
"""Kinds of objects that are printed with a model, or not at all."""


@dataclass(frozen=True, eq=False)
class _Solid:
    """An object with a mesh, placed in the scene."""

    model: ThreeMfModel
    object: ThreeMfObject
    matrix: FloatArray
    names: tuple[str, ...]
    volumes: Sequence[SlicedPiece]


@dataclass(frozen=True, eq=False)
class _Piece:
    """Triangles of a placed object that are a part."""

    part: ModelPart
    owner: int
    positions: FloatArray
    triangles: IntArray
    uv: FloatArray | None
    colors: NDArray[np.float32] | None


def read_3mf(data: bytes, name: str) -> RawModel:
    """Read a 3MF file. Each material of each placed object is a part, or of each volume of PrusaSlicer.

    Parameters
    ----------
    data
        The file.
    name
        The name of objects without one.

    Raises
    ------
    FormatError
        If it violates the format.
    InputError
        If it has no triangles, too many, or needs an extension that is not read.
    """
    with open_zip(data) as zip_file:
        package = _Package(zip_file, len(data))
        scene = _Scene(package)
        scene.place_items()
    pieces: list[_Piece] = []
    for owner, solid in enumerate(scene.solids):
        pieces += _pieces(solid, owner, name, scene.left_out)
        if len(pieces) > MAX_PARTS:
            raise InputError(f"it has more than {MAX_PARTS} parts; allowed: up to that")
    beams = any(part.has_beams for part in package.models.values())
    if not pieces:
        seen = "; its lattices of beams are not read" if beams else ""
        raise InputError(f"it shows no triangles; allowed: at least one{seen}")
    model = _together(pieces, scene.root.metres)
    model.notes += package.notes
    if beams:
        model.notes.append("its lattices of beams are not read: only its triangles are covered")
    if scene.left_out:
        names = ", ".join(dict.fromkeys(filter(None, scene.left_out)))[:200] or "without names"
        count = number_of(len(scene.left_out), "modifier or support", "modifiers and supports")
        model.notes.append(f"{count} for printers left out: {names}")
    return model


class _Package:
    """A package's files, by their paths without regard to case, with what is read of them."""

    def __init__(self, file: zipfile.ZipFile, size: int) -> None:
        self.models: dict[str, ThreeMfModel] = {}
        self.notes: list[str] = []
        self._file = file
        self._left = min(_MOST_UNPACKED, max(_MOST_DENSE * size, 1 << 20))
        self._entries = {_plain(entry.filename): entry for entry in file.infolist()}

    def root(self) -> ThreeMfModel:
        """Return the model part at which a reader starts."""
        targets: list[str] = []

        def relation(attributes: Attributes) -> None:
            if attributes.get("Type", "").endswith("/3dmodel"):
                targets.append(attributes["Target"])

        if "_rels/.rels" in self._entries:
            read_xml(self._bytes("_rels/.rels"), {f"{_RELATIONS} Relationship": relation})
        return self.model((targets or ["3D/3dmodel.model"])[0])

    def model(self, path: str) -> ThreeMfModel:
        """Return a model part."""
        place = _plain(path)
        if place not in self.models:
            try:
                self.models[place] = parse_model(self._bytes(place))
            except (FormatError, InputError) as error:
                raise type(error)(f"{path[:100]}: {error}") from None
        return self.models[place]

    def settings(self) -> dict[int, ObjectSettings]:
        """Return what a slicer's settings say about objects of the root's model part."""
        for place in self._entries:
            if place.startswith("metadata/") and place.endswith(SETTINGS):
                try:
                    return read_settings(self._bytes(place))
                except FormatError as error:
                    self.notes.append(f"names in {place} are not read: {error}")
        return {}

    def _bytes(self, place: str) -> Iterator[bytes]:
        if place not in self._entries:
            raise FormatError("the package has no such file")
        entry, left = self._entries[place], self._left
        self._left = max(0, left - entry.file_size)
        return unpacked(self._file, entry, left)


def _plain(path: str) -> str:
    return path.replace("\\", "/").lstrip("/").lower()


class _Scene:
    """The objects that a package builds, each placed."""

    def __init__(self, package: _Package) -> None:
        self.solids: list[_Solid] = []
        self.left_out: list[str] = []
        self.root = package.root()
        self._package = package
        self._settings = package.settings()
        self._placements = self._vertices = self._triangles = 0

    def place_items(self) -> None:
        """Place everything that the build lists."""
        for item in self.root.items:
            self._place(self.root, item, np.eye(4), (), None, 0)

    def _place(
        self,
        model: ThreeMfModel,
        placed: PlacedObject,
        above: FloatArray,
        names: tuple[str, ...],
        piece: SlicedPiece | None,
        depth: int,
    ) -> None:
        """Place an object, and all objects in it; `names` are those of the objects around it, inner first."""
        self._placements += 1
        if self._placements > MAX_PARTS or depth > _DEEPEST:
            raise InputError(
                f"objects are placed more than {MAX_PARTS} times, or more than {_DEEPEST} deep; "
                "allowed: up to that, and not in a circle"
            )
        at_root = model is self.root and not placed.path
        model = self._package.model(placed.path) if placed.path else model
        one = model.objects.get(placed.number)
        if one is None:
            raise FormatError(f"object {placed.number} is placed but does not exist")
        settings = self._settings.get(placed.number) if at_root else None
        name = (settings.name if settings else "") or (piece.name if piece else "") or one.name or placed.name
        names = (name, *names) if name else names
        if one.kind in _NOT_SOLID or (piece is not None and not piece.solid):
            self.left_out.append(name)
            return
        matrix = placed.matrix @ above
        if one.corners:
            self._count(one)
            self.solids.append(_Solid(model, one, matrix, names, settings.volumes if settings else ()))
        for each in one.placed:
            inner = settings.components.get(each.number) if settings else None
            self._place(model, each, matrix, names, inner, depth + 1)

    def _count(self, one: ThreeMfObject) -> None:
        self._vertices += len(one.coordinates) // 3
        self._triangles += len(one.corners) // 3
        if self._triangles > MAX_TRIANGLES or self._vertices > MAX_ELEMENTS:
            raise InputError(
                f"it has more than {MAX_TRIANGLES} triangles or {MAX_ELEMENTS} vertices; allowed: up to that"
            )


def _pieces(solid: _Solid, owner: int, file: str, left_out: list[str]) -> Iterator[_Piece]:
    """Yield the parts of a placed object: by volume, and by material."""
    triangles = np.array(solid.object.corners, np.int32).reshape(-1, 3)
    positions = np.array(solid.object.coordinates).reshape(-1, 3) @ solid.matrix[:3, :3] + solid.matrix[3, :3]
    table, spans = solid.model.table()
    rows = _property_rows(solid.object, spans, len(triangles))
    if np.linalg.det(solid.matrix[:3, :3]) < 0:
        triangles, rows = triangles[:, [0, 2, 1]], rows[:, [0, 2, 1]]
    volume = _volumes(solid.volumes, len(triangles))
    keys = volume.astype(np.int64) << 32 | table.material[rows[:, 0]]
    for key in np.unique(keys).tolist():
        mine = np.flatnonzero(keys == key)
        number, material = key >> 32, solid.model.properties.materials[key & 0xFFFFFFFF]
        piece = solid.volumes[number] if number < len(solid.volumes) else SlicedPiece()
        if not piece.solid:
            left_out.append(piece.name)
            continue
        names = tuple(dict.fromkeys(filter(None, (piece.name, *solid.names)))) or (file,)
        yield _Piece(
            ModelPart(names[0], material, names),
            owner,
            positions,
            triangles[mine],
            _known(table.uv, rows[mine]),
            _known(table.colors, rows[mine]),
        )


def _volumes(volumes: Sequence[SlicedPiece], count: int) -> IntArray:
    """Return the volume of each triangle; the number of volumes for triangles of none."""
    if not volumes:
        return np.zeros(count, np.int32)
    first, last = np.array([(volume.first, volume.last) for volume in volumes]).T
    order = np.argsort(first, kind="stable")
    triangles = np.arange(count)
    found = order[np.searchsorted(first[order], triangles, side="right") - 1]
    inside = (first[found] <= triangles) & (triangles <= last[found])
    return np.where(inside, found, len(volumes)).astype(np.int32)


def _property_rows(one: ThreeMfObject, spans: Mapping[int, tuple[int, int]], count: int) -> NDArray[np.int64]:
    """Return the row of properties at each corner, (T, 3); 0 where the file has none."""
    group = np.full((count, 1), one.group)
    index = np.full((count, 3), one.index)
    own = np.array(one.own, np.int32).reshape(-1, 5)
    group[own[:, 0], 0], index[own[:, 0]] = own[:, 1], own[:, 2:]
    out = np.zeros((count, 3), np.int64)
    for number in np.unique(group).tolist():
        first, rows = spans.get(number, (0, 0))
        out = np.where((group == number) & (index >= 0) & (index < rows), first + index, out)
    return out


def _known(values: NDArray[Any], rows: NDArray[np.int64]) -> NDArray[Any] | None:
    """Return values at corners; None if none of them is known."""
    found = values[rows]
    return None if np.isnan(found).all() else found


def _together(pieces: Sequence[_Piece], metres: float) -> RawModel:
    names = named_parts([(piece.part.name, piece.part.material) for piece in pieces])
    first: dict[int, int] = {}
    positions: list[FloatArray] = []
    total = 0
    for piece in pieces:
        if piece.owner not in first:
            first[piece.owner] = total
            positions.append(piece.positions)
            total += len(piece.positions)
    counts = [len(piece.triangles) for piece in pieces]
    return RawModel(
        np.concatenate(positions),
        np.concatenate([piece.triangles + first[piece.owner] for piece in pieces]),
        np.repeat(np.arange(len(pieces), dtype=np.int32), counts),
        [replace(piece.part, name=name) for piece, name in zip(pieces, names, strict=True)],
        owner=np.repeat(np.arange(len(positions), dtype=np.int32), [len(each) for each in positions]),
        uv=joined_corners([piece.uv for piece in pieces], counts, 2),
        metres=metres,
        colors=joined_corners([piece.colors for piece in pieces], counts, 3, np.float32),
    )
