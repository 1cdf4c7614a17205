"""One model part of a 3MF package: its XML as objects, properties and items, not yet put together.

References
----------
3MF Consortium: Core Specification 1.3; Materials and Properties 1.2.1; Production Extension 1.1.2.
"""

import math
from array import array
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from upholster.base.errors import FormatError, InputError
from upholster.base.types import FloatArray
from upholster.geometry.gltf.accessors import MAX_ELEMENTS
from upholster.geometry.meshes.triangle_mesh import MAX_TRIANGLES
from upholster.geometry.model_files.three_mf_properties import Properties, PropertyTable
from upholster.geometry.model_files.xml_reader import Attributes, Handlers, read_xml, whole_number

__all__ = ["CORE", "PlacedObject", "ThreeMfModel", "ThreeMfObject", "parse_model"]

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
_PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"

_READABLE = ("core", "material", "production", "slice", "beamlattice", "trianglesets", "securecontent")
"""Words in the namespaces of extensions that may be required: they are read, or change no triangle."""

_UNITS = {
    "micron": 1e-6,
    "millimeter": 0.001,
    "centimeter": 0.01,
    "inch": 0.0254,
    "foot": 0.3048,
    "meter": 1.0,
}


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object's placement: in the scene, or in another object.

    Attributes
    ----------
    number
        The object's number in its model part.
    path
        That part's path; empty for the part that says so.
    matrix
        (4, 4): a point p is placed at p @ matrix[:3, :3] + matrix[3, :3].
    name
        The item's part number.
    """

    number: int
    path: str
    matrix: FloatArray
    name: str = ""


@dataclass(eq=False)
class ThreeMfObject:
    """An object: a mesh, or placed objects.

    Attributes
    ----------
    name, kind
        As the file says; its kind is "model" if it does not.
    group, index
        The group of properties and the row in it that triangles have by default; -1: none.
    coordinates
        Three numbers for each vertex.
    corners
        Three vertices for each triangle.
    own
        Five numbers for each triangle with properties of its own: the triangle, the group, and three rows.
    placed
        PlacedObject objects.
    """

    name: str
    kind: str
    group: int
    index: int
    coordinates: "array[float]" = field(default_factory=lambda: array("d"))
    corners: "array[int]" = field(default_factory=lambda: array("i"))
    own: "array[int]" = field(default_factory=lambda: array("i"))
    placed: list[PlacedObject] = field(default_factory=list)


@dataclass(eq=False)
class ThreeMfModel:
    """A model part.

    Attributes
    ----------
    metres
        Length of its unit.
    objects
        By number.
    items
        What it places in the scene.
    properties
        Materials, colours and texture coordinates.
    has_beams
        Whether it has lattices of beams.
    """

    metres: float = 0.001
    objects: dict[int, ThreeMfObject] = field(default_factory=dict)
    items: list[PlacedObject] = field(default_factory=list)
    properties: Properties = field(default_factory=Properties)
    has_beams: bool = False
    _table: tuple[PropertyTable, dict[int, tuple[int, int]]] | None = None

    def table(self) -> tuple[PropertyTable, dict[int, tuple[int, int]]]:
        """Return all properties, as `Properties.table`."""
        if self._table is None:
            self._table = self.properties.table()
        return self._table


def parse_model(pieces: Iterable[bytes]) -> ThreeMfModel:
    """Read a model part.

    Raises
    ------
    FormatError
        If it violates the format.
    InputError
        If it needs an extension that is not read, or has too many triangles.
    """
    reader = _Reader()
    read_xml(pieces, reader.starts(), reader.ends(), reader.namespaces.__setitem__)
    if not reader.is_model:
        raise FormatError("it is not 3MF: it has no model")
    for number, one in reader.model.objects.items():
        _check_object(number, one)
    return reader.model


def _check_object(number: int, one: ThreeMfObject) -> None:
    coordinates, corners = np.array(one.coordinates), np.array(one.corners)
    if not np.isfinite(coordinates).all():
        row = int(np.flatnonzero(~np.isfinite(coordinates))[0]) // 3
        raise FormatError(f"object {number}, vertex {row} is not finite")
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(coordinates) // 3:
        wrong = corners.min() if corners.min() < 0 else corners.max()
        raise FormatError(
            f"a triangle of object {number} names vertex {wrong}; there are {len(coordinates) // 3}"
        )


class _Reader:
    """Collects what the elements of a model part say."""

    def __init__(self) -> None:
        self.model = ThreeMfModel()
        self.is_model = False
        self.namespaces: dict[str, str] = {}
        self._object = ThreeMfObject("", "model", -1, -1)
        self._vertices = self._triangles = 0

    def starts(self) -> Handlers:
        properties = self.model.properties
        core = {
            "model": self._start_model,
            "object": self._start_object,
            "vertex": self._vertex,
            "triangle": self._triangle,
            "component": self._component,
            "item": self._item,
            "basematerials": properties.start_materials,
            "base": properties.base,
            "multi": properties.joined,  # without its namespace in samples of the 3MF Consortium
        }
        material = {
            "colorgroup": properties.start_colors,
            "color": properties.color,
            "texture2d": properties.texture,
            "texture2dgroup": properties.start_coordinates,
            "tex2coord": properties.coordinate,
            "compositematerials": properties.start_mixed,
            "composite": properties.mixture,
            "multiproperties": properties.start_joined,
            "multi": properties.joined,
        }
        beams = {
            f"http://schemas.microsoft.com/3dmanufacturing/beamlattice/{year} beamlattice": self._beams
            for year in ("2017/02", "2015/02")
        }
        return (
            {f"{CORE} {name}": function for name, function in core.items()}
            | {f"{_MATERIAL} {name}": function for name, function in material.items()}
            | beams
        )

    def ends(self) -> dict[str, Callable[[], None]]:
        return {f"{CORE} object": self._end_object}

    def _start_model(self, attributes: Attributes) -> None:
        self.is_model = True
        unit = attributes.get("unit", "millimeter")
        if unit not in _UNITS:
            raise FormatError(f"unit is {unit[:20]!r}; allowed: {', '.join(_UNITS)}")
        self.model.metres = _UNITS[unit]
        for prefix in attributes.get("requiredextensions", "").split():
            needed = self.namespaces.get(prefix, prefix)
            if not any(f"/{word}/" in needed for word in _READABLE):
                raise InputError(f"it needs the extension {needed[:100]!r}; allowed: {', '.join(_READABLE)}")

    def _start_object(self, attributes: Attributes) -> None:
        number = whole_number(attributes, "id")
        if number in self.model.objects:
            raise FormatError(f"two objects have id {number}; allowed: one")
        name = attributes.get("name", "") or attributes.get("partnumber", "")
        group, index = whole_number(attributes, "pid", -1), whole_number(attributes, "pindex", -1)
        self._object = ThreeMfObject(_on_one_line(name), attributes.get("type", "model"), group, index)
        self.model.objects[number] = self._object

    def _end_object(self) -> None:
        self._object = ThreeMfObject("", "model", -1, -1)  # of stray vertices

    def _vertex(self, attributes: Attributes) -> None:
        self._object.coordinates.extend(
            (float(attributes["x"]), float(attributes["y"]), float(attributes["z"]))
        )
        self._vertices += 1
        if self._vertices > MAX_ELEMENTS:
            raise InputError(f"it has more than {MAX_ELEMENTS} vertices; allowed: up to that")

    def _triangle(self, attributes: Attributes) -> None:
        corners = self._object.corners
        corners.extend((int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])))
        self._triangles += 1
        if self._triangles > MAX_TRIANGLES:
            raise InputError(f"it has more than {MAX_TRIANGLES} triangles; allowed: up to that")
        if "p1" in attributes or "pid" in attributes:
            group = whole_number(attributes, "pid", self._object.group)
            first = whole_number(attributes, "p1", self._object.index)
            rows = (whole_number(attributes, "p2", first), whole_number(attributes, "p3", first))
            self._object.own.extend((len(corners) // 3 - 1, group, first, *rows))

    def _component(self, attributes: Attributes) -> None:
        self._object.placed.append(_placed(attributes))

    def _item(self, attributes: Attributes) -> None:
        self.model.items.append(_placed(attributes))

    def _beams(self, _: Attributes) -> None:
        self.model.has_beams = True


def _placed(attributes: Attributes) -> PlacedObject:
    number = whole_number(attributes, "objectid")
    matrix = np.eye(4)
    if "transform" in attributes:
        numbers = [float(word) for word in attributes["transform"].split()]
        if len(numbers) != 12 or not all(map(math.isfinite, numbers)):
            raise FormatError(f"transform is {attributes['transform'][:60]!r}; allowed: 12 finite numbers")
        matrix[:, :3] = np.array(numbers).reshape(4, 3)
    name = _on_one_line(attributes.get("partnumber", ""))
    return PlacedObject(number, attributes.get(f"{_PRODUCTION} path", ""), matrix, name)


def _on_one_line(name: str) -> str:
    return " ".join(name.split())[:200]
