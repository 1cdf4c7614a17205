"""The surface to cover: patches, or a model's mesh, flattened."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeGuard, cast

import numpy as np

from upholster.base.errors import InputError
from upholster.base.examples import model_path
from upholster.base.formats import input_kind, is_model_name
from upholster.base.options.model_options import ModelOptions
from upholster.base.options.option_fields import differing
from upholster.charts.far_vertices import far_vertices
from upholster.charts.unwrap.flat_islands import unwrap
from upholster.geometry.any_surface import AnySurface
from upholster.geometry.built_in.catalog import SurfaceLike, as_surface, surface_file
from upholster.geometry.meshes.patch_mesh import can_be_mesh, patch_mesh
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.geometry.model_files.model_file import ModelFile
from upholster.geometry.model_files.model_reader import read_model
from upholster.geometry.patches.surface import Surface
from upholster.runtime.disk_cache import kept_on_disk
from upholster.runtime.stages import file_stage, stage

__all__ = ["Covered", "CoveredLike", "as_covered", "covered_files", "covered_parts"]

_LISTED = 8
"""Number of part names that a note lists."""

CoveredLike = SurfaceLike | TriangleMesh | MeshSurface
"""A surface or a mesh, the text form of a surface, or a file that contains one."""


@dataclass(frozen=True, eq=False, slots=True)
class Covered:
    """A surface to be covered.

    Attributes
    ----------
    surface
        Of patches, or a mesh's islands.
    model
        The file that a mesh was read from; otherwise None.
    notes
        What the user should know, one line each.
    """

    surface: AnySurface
    model: ModelFile | None = None
    notes: tuple[str, ...] = ()


def covered_files(on: CoveredLike) -> list[str]:
    """Return the file that a surface is read from, in a list; empty if there is none."""
    on = model_path(on)
    if _is_model(on):
        return [os.fspath(on)]
    file = None if isinstance(on, TriangleMesh | MeshSurface) else surface_file(on)
    return [file] if file else []


def as_covered(
    on: CoveredLike,
    options: ModelOptions | None = None,
    *,
    biquadratic: bool = False,
    patches: bool = False,
) -> Covered:
    """Return the surface that `on` stands for, meshes flattened.

    Progress has the stages "faces" and "mesh" while a CAD model is read, and "unwrap" while a mesh is
    flattened.

    A patch list (``.bpt``) with poles becomes a mesh: charts over its patches' own parameters would have
    texels of very uneven size.

    Parameters
    ----------
    on
        A surface, a mesh or its islands; a surface's text form; a file of a surface or a model; or the name
        of an included model, ``sample:chair``.
    options
        How to read a model.
    biquadratic
        As for `as_surface`.
    patches
        Whether patch lists stay patches in any case.

    Raises
    ------
    InputError, FormatError
        If `on` is none of these; as `as_surface`, `read_model` and `unwrap`; if options of models are given
        for a surface of patches.
    """
    on, options = model_path(on), options or ModelOptions()
    if _is_model(on):
        return _covered_model(os.fspath(on), options)
    if isinstance(on, TriangleMesh):
        return _covered_mesh(on, options.uv == "keep")
    if options != ModelOptions():
        given = ", ".join(differing(options))
        raise InputError(
            f"{given}: for models, and this is a surface; allowed: a model's file, such as chair.glb"
        )
    if isinstance(on, MeshSurface):
        return Covered(on)
    of_patches, file = _of_patches(on, biquadratic), surface_file(on)
    kind = None if file is None else input_kind(file)
    listed = kind is not None and kind.name == "patch list"
    if patches or not listed or not of_patches.degenerate or not can_be_mesh(of_patches):
        return Covered(of_patches, None, tuple(_far_notes(of_patches)))
    return _without_poles(of_patches)


def _surface_inputs(_: Surface, on: SurfaceLike, *__: object) -> list[str]:
    return [file for file in [surface_file(on)] if file]


@file_stage(_surface_inputs)
def _of_patches(on: SurfaceLike, biquadratic: bool) -> Surface:
    return as_surface(on, biquadratic=biquadratic)


@stage
def _without_poles(surface: Surface) -> Covered:
    mesh = patch_mesh(surface)
    flat, report = unwrap(mesh)
    note = f"its patches have poles: covered as a mesh of {len(mesh.triangles):,} triangles on them"
    return Covered(flat, None, (note, *_far_notes(surface), *report.notes))


def _far_notes(surface: Surface) -> list[str]:
    far = far_vertices(surface)
    return [] if far is None else [far.words]


def _parts_inputs(found: dict[str, Covered], on: CoveredLike, *_: object, **__: object) -> list[str]:
    return [file for each in found.values() for file in _inputs(each, os.fspath(cast(str, on)))]


@file_stage(_parts_inputs)
def covered_parts(
    on: CoveredLike,
    patterns: Sequence[str],
    options: ModelOptions | None = None,
    *,
    rest: bool = False,
) -> dict[str, Covered]:
    """Return what each of several patterns covers on one model, each flattened separately.

    Parameters
    ----------
    on
        A model's file.
    patterns
        As for `ModelFile.fitting`. A part belongs to the first pattern that fits it. Parts that no pattern
        fits are left out of the mesh.
    options
        How to read the model; `part` names the rest, by default all parts that no pattern fits.
    rest
        Whether to cover the rest as well.

    Returns
    -------
    dict
        By pattern, with the rest under "". All share one mesh, and no triangle is on islands of two patterns.
        A pattern with nothing left to cover is missing; a note reports it.

    Raises
    ------
    InputError, FormatError
        If `on` is not a model's file, a pattern fits no part, or parts are chosen without a rest; as
        `read_model` and `unwrap`.
    """
    on, options = model_path(on), options or ModelOptions()
    if not _is_model(on):
        raise InputError("several materials are for models; allowed: a model's file, such as chair.glb")
    if options.part is not None and not rest:
        raise InputError("part says what the sample covers, and there is none; allowed: with a sample")
    wanted = (*options.part, *patterns) if options.part else None if rest else patterns
    model = _model(on, options, wanted)
    owner = np.full(len(model.parts), -1)
    for number, pattern in reversed(list(enumerate(patterns))):
        owner[model.fitting([pattern])] = number
    out: dict[str, Covered] = {}
    notes = list(model.notes)
    if model.left:
        names = ", ".join(model.left[:_LISTED]) + (" …" if len(model.left) > _LISTED else "")
        notes.append(f"no material is given for {names}: left as in the file")
    for number, pattern in [*enumerate(patterns), *([(-1, "")] if rest else [])]:
        chosen = (owner == number)[model.mesh.part]
        if not chosen.any():
            others = "other materials cover all parts that it fits" if pattern else "they cover all parts"
            notes.append(f"{pattern or 'the sample'!r} covers nothing: {others}")
            continue
        try:
            surface, report = unwrap(model.mesh, keep_uv=options.uv == "keep", chosen=chosen)
        except InputError as error:
            raise InputError(f"parts of {pattern or 'the sample'!r}: {error}") from None
        notes += report.notes
        out[pattern] = Covered(surface, model, tuple(notes))
        notes = []
    last = next(reversed(out))
    out[last] = replace(out[last], notes=(*out[last].notes, *notes))
    return out


def _model(on: str | os.PathLike[str], options: ModelOptions, parts: Sequence[str] | None) -> ModelFile:
    return read_model(
        on,
        parts=parts,
        unit=options.unit,
        up=options.up,
        deviation=options.deviation,
        unique=options.unique,
    )


def _inputs(found: Covered, on: str, *_: object, **__: object) -> list[str]:
    return [on, *(os.fspath(file) for file in (found.model.inputs if found.model else ()))]


@file_stage(_inputs)
def _covered_model(on: str, options: ModelOptions) -> Covered:
    # Flattening a large mesh takes seconds, and so does reading a CAD model.
    def read() -> Covered:
        model = _model(on, options, options.part)
        surface, report = unwrap(model.mesh, keep_uv=options.uv == "keep")
        return Covered(surface, model, (*model.notes, *report.notes))

    return kept_on_disk(("covered", on, options), read, file=on, files=lambda found: _inputs(found, on))


@stage
def _covered_mesh(mesh: TriangleMesh, keep_uv: bool) -> Covered:
    surface, report = unwrap(mesh, keep_uv=keep_uv)
    return Covered(surface, None, tuple(report.notes))


def _is_model(on: object) -> TypeGuard[str | os.PathLike[str]]:
    return isinstance(on, str | os.PathLike) and is_model_name(os.fspath(on))
