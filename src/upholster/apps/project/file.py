"""Projects as files: `chair.upholster.json`, JSON with names of files relative to its folder.

A file may come from an untrusted source. It can name only files in its own folder, and in folders that the
caller allows.
"""

import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar

from upholster.apps.project.project import KINDS, Project
from upholster.base.errors import FormatError, InputError, nearest
from upholster.base.files import outputs, path_inside, path_text, read_bytes, write_bytes
from upholster.base.formats import PROJECT_SUFFIX
from upholster.base.json_text import read_json
from upholster.base.options.choices import seed_number
from upholster.base.options.option_fields import differing
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.directions.strokes import stroke_texts
from upholster.charts.maps.map_text import parse_map
from upholster.charts.surface_to_cover import CoveredLike, covered_files
from upholster.covering.pins import MOST_PINNED, Pinned
from upholster.image.files.source import Sample, Source
from upholster.synthesis.guidance_reader import with_names

__all__ = ["project_data", "project_of", "read_project", "save_project"]

_VERSION = 1

_KEYS = ("upholster", "model", "sample", "materials", *KINDS, "seed", "pinned", "files")

Kind = TypeVar("Kind")


def read_project(path: str | os.PathLike[str], *, allow: Sequence[str | os.PathLike[str]] = ()) -> Project:
    """Read a project from its file.

    Parameters
    ----------
    path
        The file, as `save_project` writes it.
    allow
        Further folders from which the project may name files.

    Returns
    -------
    Project
        Its notes list the files that have changed since it was saved.

    Raises
    ------
    InputError, FormatError
        If it cannot be read or is not a project; for an unknown key, a value out of range, or a file outside
        the folders.
    """
    name = path_text(path, "project")
    if not name.lower().endswith(PROJECT_SUFFIX):
        raise InputError(f"project {name!r} has another suffix; allowed: {PROJECT_SUFFIX}")
    reader = _Reader(name, [Path(name).parent, *map(Path, allow)])
    data = read_bytes(name)
    try:
        return reader.project(read_json(data))
    except (InputError, FormatError) as error:
        raise type(error)(f"{name}: {error}") from None


def project_of(data: Any, folder: str | os.PathLike[str]) -> Project:
    """Return the project in a file's JSON data; all files that it names must be in a folder.

    Raises
    ------
    InputError, FormatError
        As for `read_project`.
    """
    return _Reader("project", [Path(folder)]).project(data)


def project_data(project: Project, folder: str | os.PathLike[str]) -> dict[str, Any]:
    """Return a project as a file's JSON data; its files must be in a folder, and names are relative to it.

    Raises
    ------
    InputError
        As for `save_project`; if a file is outside the folder.
    """
    keeper = _Keeper(Path(folder))
    written = keeper.project(project)
    for source in keeper.copies:
        raise InputError(f"{os.fspath(source)!r} is outside; allowed: files in {os.fspath(folder)!r}")
    return written


class _Reader:
    """Reads a project's parts; names of files are relative to the first of the folders."""

    def __init__(self, name: str, folders: Sequence[Path]) -> None:
        self.name, self.folders = name, folders

    def project(self, data: Any) -> Project:
        known = _object(data, "the project", _KEYS)
        version = known.get("upholster")
        if version != _VERSION:
            raise FormatError(f"upholster is {version!r}; allowed: {_VERSION}, the version of the format")
        options = {key: self.options(kind, known.get(key, {}), key) for key, kind in KINDS.items()}
        options["synthesis"] = with_names(options["synthesis"], self.file_or_folder)
        materials = known.get("materials", {})
        if not isinstance(materials, dict):
            raise FormatError("materials is not an object; allowed: samples by the names of parts")
        found = Project(
            self.model(known.get("model")),
            self.sample(known["sample"], "sample") if known.get("sample") is not None else None,
            {part: self.sample(one, f"material {part!r}") for part, one in materials.items()},
            seed=known.get("seed", 0),
            pinned=self.pinned(known["pinned"]) if known.get("pinned") is not None else None,
            **options,
        )
        return replace(found, notes=tuple(self.changed(known.get("files", {}))))

    def pinned(self, data: Any, depth: int = 1) -> Pinned:
        known = _object(data, "pinned", ("regions", "synthesis", "seed", "before"))
        regions = known.get("regions")
        if not isinstance(regions, list) or not regions or not all(isinstance(one, str) for one in regions):
            raise FormatError('regions of pinned is not a list of texts; allowed: maps, as ["0,0,1:0.3"]')
        if depth > MOST_PINNED:
            raise FormatError(f"pinned holds more than {MOST_PINNED} states; allowed: {MOST_PINNED}")
        before = known.get("before")
        return Pinned(
            tuple(parse_map(one).named(self.file) for one in regions),
            with_names(
                self.options(SynthesisOptions, known.get("synthesis", {}), "pinned"), self.file_or_folder
            ),
            seed_number(known.get("seed", 0)),
            None if before is None else self.pinned(before, depth + 1),
        )

    def model(self, data: Any) -> str:
        if not isinstance(data, str):
            raise FormatError(f"model is {data!r}; allowed: a file's name, or a surface as `torus:R=2,r=0.7`")
        # The name of an included model stands for a file elsewhere, and stays as it is.
        return self.file(data) if covered_files(data) == [data] else data

    def sample(self, data: Any, what: str) -> Sample:
        names = [entry.name for entry in fields(SampleOptions)]
        known = dict(_object(data, what, ("source", "size", *names)))
        source, size = known.pop("source", None), known.pop("size", None)
        options = self.options(SampleOptions, known, what)
        found = Sample(self.source(source, what), size, options.renamed(self.file))
        for file in found.files:  # those of a folder, too: they may be links that lead elsewhere
            self.file(os.path.relpath(file, self.folders[0]))
        return found

    def source(self, data: Any, what: str) -> Source:
        if isinstance(data, str):
            return self.file(data)
        if isinstance(data, list) and data:
            return [self.file(file) for file in data]
        if isinstance(data, dict) and data:
            return {role: self.file(file) for role, file in data.items()}
        raise FormatError(f"source of {what} is {data!r}; allowed: a file's name, a list, or files by role")

    def file(self, data: Any) -> str:
        if not isinstance(data, str) or not data:
            raise FormatError(f"a file's name is {data!r}; allowed: a text")
        try:
            path_inside(self.folders, data)
        except InputError as error:
            raise InputError(f"{error}, and in those of --allow DIR") from None
        return os.path.normpath(os.path.join(self.folders[0], data))

    def file_or_folder(self, data: str) -> str:
        found = self.file(data)
        for file in Sample(found).files:  # those of a folder, too: they may be links that lead elsewhere
            self.file(os.path.relpath(file, self.folders[0]))
        return found

    def options(self, kind: type[Kind], data: Any, what: str) -> Kind:
        known = _object(data, what, [entry.name for entry in fields(kind)])  # type: ignore[arg-type]
        return kind(**{key: _tuples(value) for key, value in known.items()})

    def changed(self, data: Any) -> Iterable[str]:
        for file, digest in _object(data, "files").items():
            try:
                found = file_digest(self.file(file))
            except InputError:
                continue  # reading it will report the error
            if found != digest:
                yield f"{file} has changed since the project was saved"


def _object(data: Any, what: str, allowed: Iterable[str] | None = None) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise FormatError(f"{what} is {str(data)[:40]!r}; allowed: an object")
    if allowed is not None:
        names = list(allowed)
        for key in data:
            if key not in names:
                raise FormatError(f"{what} has an unknown key {key!r}; {nearest(key, names)}")
    return data


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def save_project(project: Project, path: str | os.PathLike[str]) -> list[str]:
    """Write a project's file, and copy the files that it needs into its folder unless they are there.

    Parameters
    ----------
    project
        The project to write.
    path
        The file, ``chair.upholster.json``; its folder is made if it is missing.

    Returns
    -------
    list of str
        The paths of the copies.

    Raises
    ------
    InputError
        If a value is neither a file nor text, such as an array or a function; if files cannot be written.
    """
    name = path_text(path, "project")
    if not name.lower().endswith(PROJECT_SUFFIX):
        raise InputError(f"project {name!r} has another suffix; allowed: {PROJECT_SUFFIX}")
    keeper = _Keeper(Path(name).parent)
    written = keeper.project(project)
    for source, target in keeper.copies.items():
        target.parent.mkdir(parents=True, exist_ok=True)
        if not target.exists():
            with outputs([target], inputs=[source]) as files:
                shutil.copyfile(source, files.path(target))
    written["files"] = {file: file_digest(str(keeper.root / file)) for file in keeper.files}
    with outputs([name]) as files:
        write_bytes(files.path(name), (json.dumps(written, indent=2) + "\n").encode())
    return [str(target) for target in keeper.copies.values()]


class _Keeper:
    """Finds names in a project's folder for its files; `copies` lists the copies to make."""

    def __init__(self, folder: Path) -> None:
        self.root = Path(os.path.realpath(folder))
        self.copies: dict[Path, Path] = {}
        self.folders: dict[Path, Path] = {}
        self.files: list[str] = []

    def project(self, project: Project) -> dict[str, Any]:
        written: dict[str, Any] = {"upholster": _VERSION, "model": self.model(project)}
        if project.sample is not None:
            written["sample"] = self.sample(project.sample)
        if project.materials:
            written["materials"] = {part: self.sample(one) for part, one in project.materials.items()}
        for key in KINDS:
            if options := _written(getattr(project, key)):
                written[key] = options
        if synthesis := self.synthesis(project.synthesis):
            written["synthesis"] = synthesis
        if project.pinned is not None:
            written["pinned"] = self.pinned(project.pinned)
        return written | {"seed": project.seed}

    def synthesis(self, asked: SynthesisOptions) -> dict[str, Any]:
        """Return options as a file stores them, with the names of their files."""
        if asked.stroke:
            asked = replace(asked, stroke=stroke_texts(asked.stroke))
        return _written(with_names(asked, lambda file: str(self.source(Sample(file)))))

    def pinned(self, pinned: Pinned) -> dict[str, Any]:
        written: dict[str, Any] = {
            "regions": [parse_map(one).named(self.kept) for one in pinned.regions],
            "synthesis": self.synthesis(pinned.synthesis),
            "seed": pinned.seed,
        }
        return written | ({} if pinned.before is None else {"before": self.pinned(pinned.before)})

    def model(self, project: Project) -> str:
        on: CoveredLike = project.model
        if not isinstance(on, (str, os.PathLike)):
            raise InputError(f"model is a {type(on).__name__}; allowed in a project's file: a file or a text")
        if not covered_files(on):
            return os.fspath(on)
        (first,), inputs = covered_files(on), project.inputs()
        if len(inputs) == 1:
            return self.kept(first)
        folder = self.kept_together(inputs, os.path.dirname(first) or ".", Path(first).stem)
        return f"{folder}/{Path(first).name}"

    def sample(self, sample: Sample) -> dict[str, Any]:
        written = _written(sample.options.renamed(self.kept))
        size = {} if sample.size is None else {"size": sample.size}
        return {"source": self.source(sample), **size, **written}

    def source(self, sample: Sample) -> Any:
        source = sample.source
        if isinstance(source, Mapping):
            return {role: self.kept(file) for role, file in source.items()}
        if isinstance(source, (str, os.PathLike)):
            if not os.path.isdir(source):
                return self.kept(source)
            base = os.path.realpath(source)
            return self.kept_together(Sample(source).files, base, os.path.basename(base))
        if isinstance(source, Sequence) and all(isinstance(one, (str, os.PathLike)) for one in source):
            return [self.kept(file) for file in source]
        raise InputError(f"sample is a {type(source).__name__}; allowed in a project's file: files")

    def kept(self, file: str | os.PathLike[str]) -> str:
        """Return a file's name in the folder; a file that is elsewhere will be copied there."""
        place = _place(file)
        if place.is_relative_to(self.root):
            return self._listed(place)
        target = next(one for one in _names(self.root / place.name) if self._is_free(one, place))
        self.copies[place] = target
        return self._listed(target)

    def kept_together(self, files: Sequence[str], base: str, name: str) -> str:
        """Return a folder within the project's that has these files of the folder `base`, and no others."""
        if not files:
            raise InputError(f"folder {base!r} holds no images; allowed: a folder with some")
        places = {_place(file): os.path.relpath(file, base) for file in files}
        folder = Path(os.path.realpath(base))
        if not all(place.is_relative_to(self.root) for place in places):
            own = (one for one in _names(self.root / name) if self._is_free_for(one, folder, places))
            folder = self.folders.setdefault(folder, next(own))
            self.copies |= {place: folder / inner for place, inner in places.items()}
        for inner in places.values():
            self._listed(folder / inner)
        return folder.relative_to(self.root).as_posix()

    def _listed(self, place: Path) -> str:
        found = place.relative_to(self.root).as_posix()
        if found not in self.files:
            self.files.append(found)
        return found

    def _is_free(self, target: Path, place: Path) -> bool:
        taken = {other for source, other in self.copies.items() if source != place}
        if target in taken:
            return False
        return not target.exists() or (
            target.is_file() and file_digest(str(target)) == file_digest(str(place))
        )

    def _is_free_for(self, target: Path, folder: Path, places: Mapping[Path, str]) -> bool:
        # Whether the folder does not exist, or has the same files and no others.
        if any(target == own and folder != other for other, own in self.folders.items()):
            return False
        if not target.exists():
            return True
        there = {one.relative_to(target).as_posix() for one in target.rglob("*") if not one.is_dir()}
        return there == {Path(inner).as_posix() for inner in places.values()} and all(
            file_digest(str(target / inner)) == file_digest(str(place)) for place, inner in places.items()
        )


def _place(file: str | os.PathLike[str]) -> Path:
    place = Path(os.path.realpath(file))
    if not place.is_file():
        raise InputError(f"file {os.fspath(file)!r} does not exist")
    return place


def _names(target: Path) -> Iterable[Path]:
    yield target
    for number in range(2, 1000):
        yield target.with_stem(f"{target.stem}-{number}")
    raise InputError(f"{str(target)!r} and 998 names like it are taken; allowed: another folder")


def _written(options: Any) -> dict[str, Any]:
    """Return options that differ from the defaults, in a form for JSON."""
    found = differing(options)
    for name, value in found.items():
        try:
            json.dumps(value, allow_nan=False)
        except (TypeError, ValueError):
            kind = type(value).__name__
            raise InputError(
                f"{name} is a {kind}; allowed in a project's file: texts, numbers, lists of them"
            ) from None
    return found


def file_digest(file: str) -> str:
    """Return the digest of a file's content that a project's file stores."""
    return hashlib.blake2b(read_bytes(file), digest_size=16).hexdigest()
