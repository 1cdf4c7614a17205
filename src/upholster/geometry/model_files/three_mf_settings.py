"""Names in the settings that slicers add to a 3MF file, and their objects that are not part of the model.

PrusaSlicer cuts a mesh into volumes, ranges of its triangles, in ``Metadata/Slic3r_PE_model.config``. Bambu
Studio and its relatives name objects and their components in ``Metadata/model_settings.config``.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

from upholster.base.errors import FormatError
from upholster.geometry.model_files.xml_reader import Attributes, read_xml, whole_number

__all__ = ["SETTINGS", "ObjectSettings", "SlicedPiece", "read_settings"]

SETTINGS = ("model_settings.config", "_model.config")
"""Endings of such files' names, in lower case."""

_MOST_VOLUMES = 4096

_SOLID = ("normal_part", "ModelPart", "")
"""Kinds of pieces that are the model; others change its print: modifiers, blockers, negative volumes."""


@dataclass(eq=False)
class SlicedPiece:
    """A piece of an object.

    Attributes
    ----------
    name
        Empty without.
    kind
        As the file says.
    first, last
        The range of its triangles.
    """

    name: str = ""
    kind: str = ""
    first: int = 0
    last: int = -1

    @property
    def solid(self) -> bool:
        """Whether it is part of the model."""
        return self.kind in _SOLID


@dataclass(eq=False)
class ObjectSettings:
    """An object's name, its components by their objects' numbers, and the volumes of its mesh."""

    name: str = ""
    components: dict[int, SlicedPiece] = field(default_factory=dict)
    volumes: list[SlicedPiece] = field(default_factory=list)


def read_settings(pieces: Iterable[bytes]) -> dict[int, ObjectSettings]:
    """Return the settings of objects by their numbers.

    Raises
    ------
    FormatError
        If they are damaged.
    """
    reader = _Reader()
    starts = {
        "object": reader.start_object,
        "part": reader.start_component,
        "volume": reader.start_volume,
        "metadata": reader.metadata,
    }
    read_xml(pieces, starts, dict.fromkeys(("part", "volume", "object"), reader.end_piece))
    return reader.found


class _Reader:
    def __init__(self) -> None:
        self.found: dict[int, ObjectSettings] = {}
        self._object = ObjectSettings()
        self._piece: SlicedPiece | None = None
        self._inside = False

    def start_object(self, attributes: Attributes) -> None:
        self._object = self.found[whole_number(attributes, "id")] = ObjectSettings()
        self._inside = True

    def start_component(self, attributes: Attributes) -> None:
        self._piece = SlicedPiece(kind=attributes.get("subtype", ""))
        self._object.components[whole_number(attributes, "id")] = self._piece

    def start_volume(self, attributes: Attributes) -> None:
        self._piece = SlicedPiece(
            first=whole_number(attributes, "firstid"), last=whole_number(attributes, "lastid")
        )
        self._object.volumes.append(self._piece)
        if len(self._object.volumes) > _MOST_VOLUMES:
            raise FormatError(f"an object has more than {_MOST_VOLUMES} volumes; allowed: up to that")

    def metadata(self, attributes: Attributes) -> None:
        value = " ".join(attributes.get("value", "").split())[:200]
        match attributes.get("key"), self._piece:
            case "name", None if self._inside:
                self._object.name = value
            case "name", SlicedPiece() as piece:
                piece.name = value
            case "volume_type", SlicedPiece() as piece:
                piece.kind = value
            case "modifier", SlicedPiece() as piece if value == "1":
                piece.kind = "modifier"

    def end_piece(self) -> None:
        if self._piece is None:
            self._inside = False
        self._piece = None
