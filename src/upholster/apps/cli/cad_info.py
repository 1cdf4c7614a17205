"""``upholster info`` for a CAD model."""

from collections import Counter
from typing import TYPE_CHECKING

from upholster.apps.cli.console import add_row, new_console, say
from upholster.base.display import number_of

if TYPE_CHECKING:  # NumPy, which they import, would slow down --help
    from upholster.geometry.model_files.cad_model import CadState
    from upholster.geometry.occt.records import BodyRecord

__all__ = ["show_cad"]

_LINES = 200
"""Largest number of bodies in the table."""

_NAMES = 8
"""Largest number of faces in a line."""


def show_cad(path: str, *, unit: str | None = None) -> None:
    """Print a CAD model's bodies, their faces and kinds of surface, and the faces that will be left plain."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from upholster.geometry.model_files.cad_model import cad_state

    state = cad_state(path, unit=unit)
    record = state.record
    console = new_console()
    for line in _head(path, state):
        say(line)
    table = Table("body", "", "places", "faces", "of which", "area", "colours, layers", box=SIMPLE_HEAD)
    for body in record.bodies[:_LINES]:
        kinds = Counter(face.kind for face in body.faces)
        add_row(
            table,
            body.places[0].name or body.name or "-",
            "solid" if body.solid else "sheet",
            str(len(body.places)),
            str(len(body.faces)),
            ", ".join(f"{count} {kind}" for kind, count in kinds.most_common()),
            f"{sum(face.area for face in body.faces):.4g} mm²",
            _labels(body),
        )
    console.print(table)
    lines = [f"note: {note}" for note in record.notes]
    if len(record.bodies) > _LINES:
        lines.insert(0, f"and {number_of(len(record.bodies) - _LINES, 'body', 'bodies')} more")
    for line in (*lines, *_outcome(state)):
        say(line)


def _head(path: str, state: "CadState") -> list[str]:
    record = state.record
    faces = sum(len(body.faces) for body in record.bodies)
    places = sum(len(body.places) for body in record.bodies)
    bodies = len(record.bodies)
    patches = number_of(state.patches, "rational Bézier patch", "rational Bézier patches")
    several = f" in {places} places" if places > bodies else ""
    others = number_of(len(record.files), "other file")
    named = f"; it names {others}" if record.files else ""
    size = " x ".join(f"{side:.4g}" for side in record.box[1] - record.box[0])
    unit = (
        f"the file's unit: {record.unit}" if record.unit else "the file states no unit: millimetres (--unit)"
    )
    return [
        f"{path}: {record.format}, {number_of(bodies, 'body', 'bodies')}{several}, "
        f"{number_of(faces, 'face')}, {patches}{named}",
        f"{size} mm (x, y, z); {unit}; tolerance {record.tolerance:.2g} mm",
    ]


def _labels(body: "BodyRecord") -> str:
    """Return the colours, layers and names of faces that can select parts."""
    found: dict[str, None] = {}
    found |= dict.fromkeys((body.colour, body.layer))
    for face in body.faces:
        found |= dict.fromkeys((face.colour, face.layer))
    found |= dict.fromkeys(face.name for face in body.faces)
    names = [name for name in found if name]
    return ", ".join(names[:_NAMES]) + (" …" if len(names) > _NAMES else "") or "-"


def _outcome(state: "CadState") -> list[str]:
    """Return lines about faces that will be covered, left plain, or covered only approximately."""
    lines = []
    if state.plain:
        listed = ", ".join(state.plain[:_NAMES]) + (" …" if len(state.plain) > _NAMES else "")
        lines.append(f"left plain, {number_of(len(state.plain), 'face')}: {listed}")
    else:
        lines.append("every face can be covered")
    if state.inexact:
        listed = ", ".join(state.inexact[:_NAMES]) + (" …" if len(state.inexact) > _NAMES else "")
        lines.append(f"not exact, {number_of(len(state.inexact), 'face')}: {listed}")
    return lines
