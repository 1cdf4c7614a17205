"""Properties in 3MF: groups of materials, colours and texture coordinates; triangles name rows of groups."""

from array import array
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import FormatError
from upholster.base.types import FloatArray
from upholster.geometry.gltf.accessors import MAX_ELEMENTS
from upholster.geometry.model_files.model_file import MAX_PARTS
from upholster.geometry.model_files.xml_reader import Attributes, whole_number

__all__ = ["Properties", "PropertyTable"]

_LAYERS = ("materials", "colors", "uv", "mixed")

_NAN = float("nan")


@dataclass(eq=False)
class _Group:
    """A group: `width` numbers for each row.

    These are the colours of materials and of colour groups, coordinates with v upward, the shares of mixed
    materials, or rows of other groups.
    """

    kind: Literal["materials", "colors", "uv", "mixed", "joined"]
    width: int
    numbers: "array[float]" = field(default_factory=lambda: array("d"))
    names: list[str] = field(default_factory=list)
    others: tuple[int, ...] = ()
    chosen: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class PropertyTable:
    """Rows of one group, or of all groups of a model part.

    Attributes
    ----------
    material
        (n,) index in `Properties.materials`.
    colors
        (n, 3) from 0 to 1, NaN without.
    uv
        (n, 2), v downward, NaN without.
    """

    material: NDArray[np.int32]
    colors: NDArray[np.float32]
    uv: FloatArray

    @staticmethod
    def empty(count: int) -> "PropertyTable":
        """Return rows without properties."""
        colors = np.full((count, 3), np.nan, np.float32)
        return PropertyTable(np.zeros(count, np.int32), colors, np.full((count, 2), np.nan))

    @staticmethod
    def joined(tables: Sequence["PropertyTable"]) -> "PropertyTable":
        """Return the rows of several tables."""
        return PropertyTable(
            np.concatenate([table.material for table in tables]),
            np.concatenate([table.colors for table in tables]),
            np.concatenate([table.uv for table in tables]),
        )

    def at(self, rows: NDArray[np.integer]) -> "PropertyTable":
        """Return some rows; without properties for rows that do not exist."""
        padded = PropertyTable.joined([self, self.empty(1)])
        count = len(self.material)
        rows = np.where((rows >= 0) & (rows < count), rows, count)
        return PropertyTable(padded.material[rows], padded.colors[rows], padded.uv[rows])


class Properties:
    """Collects the groups of a model part.

    Attributes
    ----------
    materials
        Names of materials and of textures, each once; the first is empty.
    """

    def __init__(self) -> None:
        self.materials = [""]
        self._places = {"": 0}
        self._groups: dict[int, _Group] = {}
        self._tables: dict[int, PropertyTable] = {}
        self._textures: dict[int, str] = {}
        self._group = _Group("colors", 3)
        self._numbers = self._names = 0

    def start_materials(self, attributes: Attributes) -> None:
        """Begin a group of materials."""
        self._start(attributes, _Group("materials", 3))

    def base(self, attributes: Attributes) -> None:
        """Add a material."""
        self._names += 1
        if self._names > MAX_PARTS:
            raise FormatError(f"it has more than {MAX_PARTS} materials; allowed: up to that")
        color = attributes.get("displaycolor")
        self._add("materials", (_NAN,) * 3 if color is None else _color(color))
        self._group.names.append(" ".join(attributes.get("name", "").split())[:200])

    def start_colors(self, attributes: Attributes) -> None:
        """Begin a group of colours."""
        self._start(attributes, _Group("colors", 3))

    def color(self, attributes: Attributes) -> None:
        """Add a colour."""
        self._add("colors", _color(attributes["color"]))

    def texture(self, attributes: Attributes) -> None:
        """Add an image."""
        path = PurePosixPath(attributes.get("path", ""))
        self._textures[whole_number(attributes, "id")] = path.stem[:200]

    def start_coordinates(self, attributes: Attributes) -> None:
        """Begin a group of texture coordinates."""
        texture = self._textures.get(whole_number(attributes, "texid"), "")
        self._start(attributes, _Group("uv", 2, names=[texture]))

    def coordinate(self, attributes: Attributes) -> None:
        """Add texture coordinates."""
        self._add("uv", (float(attributes["u"]), float(attributes["v"])))

    def start_mixed(self, attributes: Attributes) -> None:
        """Begin a group of mixed materials."""
        chosen = _wholes(attributes["matindices"])
        others = (whole_number(attributes, "matid"),)
        self._start(attributes, _Group("mixed", len(chosen), others=others, chosen=chosen))

    def mixture(self, attributes: Attributes) -> None:
        """Add a mixture."""
        self._add("mixed", tuple(float(word) for word in attributes["values"].split()))

    def start_joined(self, attributes: Attributes) -> None:
        """Begin a group that joins rows of several groups."""
        others = _wholes(attributes["pids"])
        self._start(attributes, _Group("joined", len(others), others=others))

    def joined(self, attributes: Attributes) -> None:
        """Add a row that joins rows of several groups."""
        self._add("joined", _wholes(attributes["pindices"]))

    def table(self) -> tuple[PropertyTable, dict[int, tuple[int, int]]]:
        """Return the rows of all groups, and the first row and the number of rows of each group.

        Row 0 has no property.
        """
        spans, tables, total = {}, [PropertyTable.empty(1)], 1
        for number in self._groups:
            tables.append(self._of_group(number))
            count = len(tables[-1].material)
            spans[number] = (total, count)
            total += count
        return PropertyTable.joined(tables), spans

    def _of_group(self, number: int) -> PropertyTable:
        if number not in self._tables:
            self._tables[number] = self._read(self._groups[number])
        return self._tables[number]

    def _start(self, attributes: Attributes, group: _Group) -> None:
        if not 1 <= group.width <= 64:
            raise FormatError(f"a group chooses from {group.width} others; allowed: 1 to 64")
        self._group = self._groups[whole_number(attributes, "id")] = group

    def _add(self, kind: str, numbers: tuple[float, ...]) -> None:
        group = self._group
        if group.kind != kind:
            raise FormatError(f"a group of {group.kind} has {kind}; allowed: of its own kind")
        group.numbers.extend((*numbers, *[0.0] * group.width)[: group.width])
        self._numbers += group.width
        if self._numbers > 3 * MAX_ELEMENTS:
            raise FormatError(f"its properties have more than {3 * MAX_ELEMENTS} numbers; allowed: fewer")

    def _read(self, group: _Group) -> PropertyTable:
        values = np.array(group.numbers).reshape(-1, group.width)
        out = PropertyTable.empty(len(values))
        match group.kind:
            case "materials":
                out.colors[:] = values
                out.material[:] = [self._material(name) for name in group.names]
            case "colors":
                out.colors[:] = values
            case "uv":
                out.uv[:, 0], out.uv[:, 1] = values[:, 0], 1.0 - values[:, 1]
                out.material[:] = self._material(group.names[0])
            case "mixed":
                parts = self._of_kinds(("materials",), group.others[0]).at(np.array(group.chosen))
                shares = np.clip(np.nan_to_num(values), 0.0, 1.0)
                out.material[:] = parts.material[shares.argmax(axis=1)]
                with np.errstate(invalid="ignore"):
                    out.colors[:] = shares @ parts.colors / shares.sum(axis=1, keepdims=True)
            case "joined":
                for number, rows in zip(group.others, values.T.astype(np.int64), strict=True):
                    _lay_over(out, self._of_kinds(_LAYERS, number).at(rows))
        return out

    def _of_kinds(self, kinds: Collection[str], group: int) -> PropertyTable:
        """Return the rows of a group of these kinds: so groups do not refer to each other in circles."""
        found = self._groups.get(group)
        return self._of_group(group) if found is not None and found.kind in kinds else PropertyTable.empty(0)

    def _material(self, name: str) -> int:
        if name not in self._places:
            self._places[name] = len(self.materials)
            self.materials.append(name)
        return self._places[name]


def _lay_over(out: PropertyTable, layer: PropertyTable) -> None:
    """Add a layer: its colour replaces those below, other properties are the first layer's that has them."""
    colored = ~np.isnan(layer.colors[:, 0])
    out.colors[colored] = layer.colors[colored]
    bare = np.isnan(out.uv[:, 0])
    out.uv[bare] = layer.uv[bare]
    bare = out.material == 0
    out.material[bare] = layer.material[bare]


def _color(text: str) -> tuple[float, float, float]:
    """Return the colour of ``#RRGGBB`` or ``#RRGGBBAA``."""
    digits = text.strip().removeprefix("#")
    try:
        red, green, blue, *_ = bytes.fromhex(digits) if len(digits) in (6, 8) else b""
    except ValueError:
        raise FormatError(f"a colour is {text[:20]!r}; allowed: #RRGGBB or #RRGGBBAA") from None
    return red / 255, green / 255, blue / 255


def _wholes(text: str) -> tuple[int, ...]:
    return tuple(whole_number({"": word}, "") for word in text.split())
