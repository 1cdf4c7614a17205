"""``upholster info`` for a model."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from upholster.apps.cli.console import add_row, new_console, say
from upholster.base.display import number_of
from upholster.base.lengths import METRES

if TYPE_CHECKING:  # NumPy, which they import, would slow down --help
    from upholster.base.types import FloatArray
    from upholster.geometry.meshes.mesh_state import PartState, UvState
    from upholster.geometry.model_files.model_file import ModelFile, ModelPart

__all__ = ["show_model"]

_UNITS = ("km", "m", "cm", "mm")
"""Units in which sizes are printed."""

_LINES = 200
"""Largest number of parts in the table."""

_LEAST = 0.0005
"""Smaller shares are not reported: overlaps are counted on a raster."""


def show_model(path: str, *, unit: str | None = None) -> None:
    """Print a model's parts, their sizes and texture coordinates, and their defects."""
    from upholster.charts.far_vertices import far_vertices
    from upholster.geometry.meshes.mesh_state import mesh_states
    from upholster.geometry.model_files.model_reader import read_model

    model = read_model(path, unit=unit)
    states = mesh_states(model.mesh, model.uv)
    for line in _head(model):
        say(line)
    shown = list(zip(model.parts, states, strict=True))[:_LINES]
    _show_parts(shown, model.mesh.metres)
    lines = [f"{part.name}: {', '.join(odd)}" for part, state in shown if (odd := _odd(part, state))]
    if len(states) > _LINES:
        lines.append(f"and {number_of(len(states) - _LINES, 'part')} more")
    far = far_vertices(model.mesh)
    lines += [f"note: {note}" for note in (*model.notes, *([] if far is None else [far.words]))]
    for line in lines:
        say(line)


def _show_parts(shown: "Sequence[tuple[ModelPart, PartState]]", metres: float | None) -> None:
    """Print a table of parts, or some lines for each part if a table would be too wide."""
    from rich.box import SIMPLE_HEAD
    from rich.measure import Measurement
    from rich.table import Column, Table

    names = ("part", "material", "triangles", "area", "size", "UV", "holes")
    table = Table(*(Column(name, no_wrap=True) for name in names), box=SIMPLE_HEAD, collapse_padding=True)
    rows = [
        (
            part.name,
            part.material or "-",
            f"{state.triangles:,}",
            _measured([state.area], metres, 2),
            _measured(state.box[1] - state.box[0], metres),
            _uv(state.uv),
            str(state.holes or "-"),
        )
        for part, state in shown
    ]
    for row in rows:
        add_row(table, *row)
    console = new_console()
    if Measurement.get(console, console.options.update(max_width=10_000), table).maximum <= console.width:
        console.print(table)
        return
    # --part and --material take these names: print each complete, on a line of its own.
    say("")
    for part, material, triangles, area, size, uv, holes in rows:
        say(part)
        say(f"  material {material}")
        say(f"  triangles {triangles}, area {area}, size {size}, UV {uv}, holes {holes}")
    say("")


def _head(model: "ModelFile") -> list[str]:
    mesh = model.mesh
    sides = _measured(mesh.box[1] - mesh.box[0], mesh.metres)
    unit = f"a unit is {mesh.metres:g} m" if mesh.metres else "the file states no unit (--unit mm)"
    lines = [
        f"{model.path}: {number_of(len(mesh.triangles), 'triangle')}, "
        f"{number_of(len(mesh.positions), 'vertex', 'vertices')}, {number_of(len(mesh.parts), 'part')}",
        f"{sides} (width x depth x height); {unit}; {model.up} is up in the file",
    ]
    if model.contents:
        kept = (f"{count} {kind if count > 1 else kind[:-1]}" for kind, count in model.contents.items())
        lines.append(f"besides: {', '.join(kept)}")
    return lines


def _measured(values: "Sequence[float] | FloatArray", metres: float | None, power: int = 1) -> str:
    """Write lengths, or an area, in a suitable unit."""
    largest = float(max(values)) * (metres or 1.0) ** power
    name = next((name for name in _UNITS if largest >= METRES[name] ** power), _UNITS[-1])
    factor = 1.0 if metres is None else (metres / METRES[name]) ** power
    text = " x ".join(_figures(float(value) * factor) for value in values)
    return text if metres is None else f"{text} {name}{'²' if power == 2 else ''}"


def _figures(value: float) -> str:
    """Write a number with three figures, or its complete integer part."""
    return f"{value:,.0f}" if 1000 <= value < 1e9 else f"{value:.3g}"


def _uv(state: "UvState | None") -> str:
    if state is None:
        return "none"
    return "no overlap" if state.overlapping < _LEAST else f"{_percent(state.overlapping)} overlap"


def _percent(share: float) -> str:
    return f"{100 * share:.{0 if share >= 0.1 else 1}f} %"


def _odd(part: "ModelPart", state: "PartState") -> Sequence[str]:
    """Return a part's defects in words."""
    counts = (
        (state.components, 1, "piece", ""),
        (state.crowded_edges, 0, "edge", " of more than two triangles"),
        (state.turned_edges, 0, "edge", " where triangles turn against each other"),
        (state.degenerate, 0, "triangle", " without area"),
        (state.slivers, 0, "sliver", ""),
        (part.instances, 1, "instance", ""),
    )
    said = [number_of(count, word) + more for count, most, word, more in counts if count > most]
    if state.inside_out:
        said.append("inside out")
    if state.uv is not None:
        shares = (
            (state.uv.mirrored, "mirrored"),
            (state.uv.outside, "outside 0 to 1"),
            (state.uv.collapsed, "without area"),
        )
        said += [f"UV {_percent(share)} {word}" for share, word in shares if share >= _LEAST]
    return [*said, *part.features]
