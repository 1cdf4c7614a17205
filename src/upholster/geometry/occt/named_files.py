"""The other files that a STEP assembly names for its parts, checked before Open CASCADE opens them."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from OCP.IFSelect import IFSelect_RetDone
from OCP.StepAP214 import StepAP214_AppliedExternalIdentificationAssignment
from OCP.StepBasic import StepBasic_Document, StepBasic_ExternalSource
from OCP.STEPConstruct import STEPConstruct_ExternRefs
from OCP.STEPControl import STEPControl_Reader
from OCP.StepData import StepData_SelectMember
from OCP.TCollection import TCollection_HAsciiString

from upholster.base.errors import InputError
from upholster.base.files import path_inside

__all__ = ["NamedFiles", "named_files"]

_FORMATS = ("", "STEP AP203", "STEP AP214")
"""Formats of the files that Open CASCADE opens, as the assembly states them."""


@dataclass(eq=False)
class NamedFiles:
    """The files that an assembly names, and those that they name.

    Attributes
    ----------
    places
        Files in the assembly's folder by their names in the assembly; there may be none at a place.
    missing
        Names of files that are not STEP files in the assembly's folder, each with the name of its product.
        That may be a drawing of a product whose shape is known.
    """

    places: dict[str, Path] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)


def named_files(session: Any, path: Path) -> NamedFiles:
    """Return the files that an assembly names, directly or not.

    Parameters
    ----------
    session
        The work session that has read the assembly. It forgets names of files that are elsewhere.
    path
        The assembly's absolute path. The files must be in its folder, at any depth.

    Raises
    ------
    InputError
        If a named file names one that is elsewhere; if a file names itself by way of others, or has the same
        name as another one: Open CASCADE would mistake one for the other.
    """
    known = NamedFiles()
    _add(session, (path,), known)
    return known


def _add(session: Any, chain: tuple[Path, ...], known: NamedFiles) -> None:
    """Add the files named in the last file of a chain; each file of the chain names the next one."""
    for name, (product, is_step) in _names(session).items():
        try:
            place = _place(name, chain)
        except InputError:
            if len(chain) > 1:
                raise
            _forget(session, name)
            known.missing[name] = product
            continue
        if place == chain[-1] or known.places.get(name) == place:
            continue
        if place in chain:
            raise InputError(f"it names itself by way of {name[:80]!r}; allowed: files that do not")
        if name in known.places:
            raise InputError(f"it names two files {name[:80]!r} in two folders; allowed: one of each name")
        known.places[name] = place
        reader = STEPControl_Reader()
        if is_step and place.is_file() and reader.ReadFile(str(place)) == IFSelect_RetDone:
            _add(reader.WS(), (*chain, place), known)
        else:
            known.missing[name] = product


def _place(name: str, chain: tuple[Path, ...]) -> Path:
    """Return the path of a file named in the last file of a chain; `InputError` if it is elsewhere."""
    folder = chain[0].parent
    if name[1:2] == ":":  # for Open CASCADE this is absolute, on every system
        raise InputError(f"it refers to {name[:80]!r}; allowed: files in the folder {str(folder)!r}")
    return path_inside(list(dict.fromkeys([chain[-1].parent, folder])), name.replace("\\", "/"))


def _names(session: Any) -> dict[str, tuple[str, bool]]:
    """Return names of files in an assembly, with their products' names, and whether they may be opened."""
    listed = STEPConstruct_ExternRefs(session)
    listed.LoadExternRefs()
    out: dict[str, tuple[str, bool]] = {}
    for k in range(1, listed.NbExternRefs() + 1):
        stated, definition, name = listed.Format(k), listed.ProdDef(k), listed.FileName(k)
        if definition is not None and name:
            product = definition.Formation().OfProduct()
            texts = [text.ToCString() for text in (product.Name(), product.Id()) if text is not None]
            is_step = stated is None or stated.ToCString().upper() in _FORMATS
            out[name] = next(filter(None, texts), ""), is_step or out.get(name, ("", False))[1]
    return out


def _forget(session: Any, name: str) -> None:
    """Remove a file's name from an assembly that was read, so that it is not opened."""
    none, model = TCollection_HAsciiString(""), session.Model()
    for k in range(1, model.NbEntities() + 1):
        one = model.Value(k)
        if isinstance(one, StepBasic_Document):
            if _is(one.Id(), name):
                one.SetId(none)
            if _is(one.Name(), name):
                one.SetName(none)
        elif isinstance(one, StepAP214_AppliedExternalIdentificationAssignment):
            if _is(one.AssignedId(), name):
                one.SetAssignedId(none)
        elif isinstance(one, StepBasic_ExternalSource):
            stated = one.SourceId().Value()
            if isinstance(stated, StepData_SelectMember) and stated.String() == name:
                stated.SetString("")
    if name in _names(session):
        raise InputError(f"it refers to {name[:80]!r}; allowed: files in its folder")


def _is(text: Any, name: str) -> bool:
    return text is not None and text.ToCString() == name
