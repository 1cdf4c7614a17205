"""What is to be covered: a surface of patches, or a model's mesh, laid out flat."""

import os
from dataclasses import dataclass
from pathlib import Path

from upholster.charts.unwrap import unwrap
from upholster.errors import InputError
from upholster.geometry import AnySurface, MeshSurface, SurfaceLike, TriangleMesh, as_surface, surface_file
from upholster.geometry.mesh_files import MODEL_SUFFIXES, ModelFile, read_model
from upholster.options import ModelOptions

__all__ = ["Covered", "CoveredLike", "as_covered", "covered_files"]

CoveredLike = SurfaceLike | TriangleMesh | MeshSurface
"""A surface or a mesh, the text form of a surface, or the file that it is in."""


@dataclass(frozen=True, eq=False, slots=True)
class Covered:
    """A surface to be covered.

    Attributes
    ----------
    surface
        Of patches, or a mesh's islands.
    model
        The file that a mesh was read from; None for others.
    notes
        What the user should know, a line each.
    """

    surface: AnySurface
    model: ModelFile | None = None
    notes: tuple[str, ...] = ()


def covered_files(on: CoveredLike) -> list[str]:
    """Return the file that a surface is to be read from, in a list that is empty where there is none."""
    if _is_model(on):
        return [os.fspath(on)]  # type: ignore[arg-type]  # a path
    file = None if isinstance(on, TriangleMesh | MeshSurface) else surface_file(on)
    return [file] if file else []


def as_covered(on: CoveredLike, options: ModelOptions | None = None, *, biquadratic: bool = False) -> Covered:
    """Return what is meant, meshes laid out flat.

    Parameters
    ----------
    on
        A surface, a mesh or islands of one; a surface's text form; or a file, of a surface or a model.
    options
        How a model is read.
    biquadratic
        As for `as_surface`.

    Raises
    ------
    InputError, FormatError
        If it is none of these; as `as_surface`, `read_model` and `unwrap`; if options of models are given for
        a surface of patches.
    """
    options = options or ModelOptions()
    if _is_model(on):
        model = read_model(on, parts=options.part, unit=options.unit, up=options.up)  # type: ignore[arg-type]
        surface, report = unwrap(model.mesh, keep_uv=options.uv == "keep")
        return Covered(surface, model, (*model.notes, *report.notes))
    if isinstance(on, TriangleMesh):
        surface, report = unwrap(on, keep_uv=options.uv == "keep")
        return Covered(surface, None, tuple(report.notes))
    if options != ModelOptions():
        raise InputError("part, uv, unit and up are for models; allowed: none of them on other surfaces")
    return Covered(on if isinstance(on, MeshSurface) else as_surface(on, biquadratic=biquadratic))


def _is_model(on: object) -> bool:
    return isinstance(on, str | os.PathLike) and Path(os.fspath(on)).suffix.lower() in MODEL_SUFFIXES
