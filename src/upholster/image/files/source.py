"""What users pass as the exemplar: an image, or a material in one of several forms."""

import os
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from upholster.base.display import on_a_line
from upholster.base.errors import InputError
from upholster.base.examples import sample_path
from upholster.base.lengths import read_length
from upholster.base.options.choices import chosen
from upholster.base.options.sample_options import SampleOptions
from upholster.base.types import PixelArray
from upholster.image.files.material import Material
from upholster.image.files.material_files import FilesByRole, material_of_files
from upholster.image.files.packages import is_zip
from upholster.image.files.read import check_exemplar, read_photo
from upholster.image.files.write import IMAGE_SUFFIXES
from upholster.image.masks import Used
from upholster.image.profiles import Notes, tell
from upholster.runtime.stages import file_stage

__all__ = [
    "Sample",
    "Source",
    "as_exemplar",
    "read_source",
    "source_files",
    "source_names",
    "source_parts",
    "used_pixels",
]

Source = (
    PixelArray
    | str
    | os.PathLike[str]
    | Sequence[str | os.PathLike[str]]
    | Mapping[str, str | os.PathLike[str]]
    | Material
)
"""An image or its file; or a material, its folder or zip file, its files, or its files by role.

A file may be a sample included in the program, `sample:bricks`."""


@dataclass(frozen=True, slots=True)
class Sample:
    """A sample or material, how it is read, and its size: accepted wherever a source is.

    Attributes
    ----------
    source
        The image or material to read; for a sample included in the program, its file.
    size
        Its width on the model, in the form of option `sample_size`; None: not given.
    options
        How it is read: `upholster.SampleOptions`, or some of them by name.
    """

    source: "Source"
    size: str | float | None = None
    options: SampleOptions = field(default_factory=SampleOptions)

    def __post_init__(self) -> None:
        object.__setattr__(self, "source", _located(self.source))
        object.__setattr__(self, "options", chosen(SampleOptions, self.options))
        if self.size is not None:
            read_length(self.size, name="sample size")

    @classmethod
    def of(cls, source: "Source | Sample") -> "Sample":
        """Return a source as a `Sample`."""
        return source if isinstance(source, Sample) else cls(source)

    @property
    def files(self) -> list[str]:
        """The files to read, see `source_files`; a mask's is the last."""
        mask = self.options.mask
        return [*source_files(self.source, self.options.maps), *([] if mask is None else [mask])]

    @property
    def folders(self) -> list[str]:
        """The folder of a material, as a list, empty if there is none."""
        return _folders(self.source)


def read_source(source: "Source | Sample", *, notes: Notes | None = None) -> PixelArray | Material:
    """Read an exemplar.

    Parameters
    ----------
    source
        One image is a sample by itself, whatever its name, or the albedo if maps are given; with a mask it is
        a material of one map. Anything else is a material, see `read_material`. A `Sample` also says how to
        read it.
    notes
        As for `read_exemplar`.

    Raises
    ------
    InputError
        As `read_exemplar` and `read_material`; if one of several files is no image; for `normal` if there is
        no material; for options with an array or a material, which are not read.
    """
    sample = Sample.of(source)
    if isinstance(sample.source, (Material, np.ndarray)) or not _names(sample.source):
        return _read(sample, notes)
    found, remarks = _read_files(sample)
    for words in remarks:
        tell(notes, words)
    return found


def _inputs(_: object, sample: Sample) -> list[str]:
    return [*sample.folders, *sample.files]


@file_stage(_inputs)
def _read_files(sample: Sample) -> tuple[PixelArray | Material, list[str]]:
    notes: list[str] = []
    return _read(sample, notes), notes


def _read(sample: Sample, notes: Notes | None) -> PixelArray | Material:
    source, options = sample.source, sample.options
    if isinstance(source, (Material, np.ndarray)):
        given = {entry.name: getattr(options, entry.name) for entry in fields(options)}
        if names := ", ".join(name.removesuffix("s") for name, value in given.items() if value):
            raise InputError(f"{names} is for files; an array or a Material is used as it is")
        return source if isinstance(source, Material) else check_exemplar(source)
    if not _names(source):
        raise InputError(
            f"sample is a {type(source).__name__}; allowed: an image's path, a material's folder, a list of "
            "files or files by role, an array, a Material, a Sample"
        )
    if isinstance(source, Sequence) and not isinstance(source, str):
        if len(source) == 1:
            return _read(replace(sample, source=source[0]), notes)
        for file in source:
            # In a folder such files are skipped; a file that is named is wanted.
            if Path(file).suffix.lower() not in IMAGE_SUFFIXES:
                raise InputError(
                    f"map {os.fspath(file)!r} is not an image; allowed: {', '.join(IMAGE_SUFFIXES)}"
                )
    if not isinstance(source, (str, os.PathLike)):
        return material_of_files(source, options, notes)
    if not (os.path.isdir(source) or is_zip(source)):
        if options.maps:
            return material_of_files({"albedo": source}, options, notes)
        if options.normal is not None:
            raise InputError(
                f"normal is {options.normal!r}, but {os.fspath(source)!r} is not a material; see --map"
            )
        pixels, used = read_photo(source, options, notes=notes)
        return pixels if used is None or used.all() else Material({"albedo": pixels}, used=used)
    try:
        return material_of_files(source, options, notes)
    except InputError as error:
        path = str(Path(source))
        if str(error).startswith(repr(path)[:-1]):  # it names the file, or one in it
            raise
        kind = "zip file" if is_zip(source) else "folder"
        raise InputError(f"{kind} {path!r}: {error}") from None


def as_exemplar(exemplar: object) -> PixelArray | Material:
    """Return an exemplar, given as such or as its files.

    Parameters
    ----------
    exemplar
        A material, an array that `upholster.image.files.read.check_exemplar` takes, an image's or material's
        files, or a `Sample`.

    Raises
    ------
    InputError
        If it is none of these, or cannot be read.
    """
    if isinstance(exemplar, Material):
        return exemplar
    if isinstance(exemplar, Sample) or _names(exemplar):
        return read_source(cast(Source, exemplar))
    return check_exemplar(exemplar)


def _names(source: object) -> bool:
    """Whether that is a path, or paths alone."""
    if isinstance(source, (str, os.PathLike)):
        return True
    named: object = source.values() if isinstance(source, Mapping) else source
    if not isinstance(named, Collection) or isinstance(named, np.ndarray):
        return False
    return len(named) > 0 and all(isinstance(path, (str, os.PathLike)) for path in named)


def _located(source: Source) -> Source:
    """Return a source with names of included samples replaced by their files."""
    if isinstance(source, (Material, np.ndarray)) or not _names(source):
        return source
    if isinstance(source, (str, os.PathLike)):
        return sample_path(source)
    if isinstance(source, Mapping):
        return {role: sample_path(file) for role, file in source.items()}
    files = [sample_path(file) for file in source]
    return tuple(files) if isinstance(source, tuple) else files


def source_files(source: Source, maps: FilesByRole | None = None) -> list[str]:
    """Return the files of an exemplar; for a folder all its images: any may be one of its maps.

    Files that do not exist are left out; `read_source` reports them.
    """
    if isinstance(source, (Material, np.ndarray)) or not _names(source):
        return []
    given_maps = maps.values() if isinstance(maps, Mapping) else ()
    more = [os.fspath(file) for file in given_maps if isinstance(file, (str, os.PathLike))]
    if isinstance(source, Mapping):
        return [*(os.fspath(file) for file in source.values()), *more]
    given = [source] if isinstance(source, (str, os.PathLike)) else list(source)
    files = [os.fspath(file) for file in given]
    if len(files) == 1 and os.path.isdir(files[0]):
        folder, files = Path(files[0]), []
        with suppress(OSError):
            files = [str(file) for file in folder.iterdir() if file.suffix.lower() in IMAGE_SUFFIXES]
    return files + more


def _folders(source: Source) -> list[str]:
    """Return the folder of a material, as a list, empty if there is none."""
    given = [source] if isinstance(source, (str, os.PathLike)) else source if isinstance(source, list) else []
    return [os.fspath(name) for name in given if os.path.isdir(name)]


def source_parts(source: PixelArray | Material) -> dict[str, PixelArray]:
    """Return the painted maps by role: the base colour first, as "albedo", with the opacity as its alpha."""
    if not isinstance(source, Material):
        return {"albedo": source}
    others = {role: pixels for role, pixels in source.maps.items() if role not in ("albedo", "opacity")}
    return {"albedo": source.color(), **others}


def used_pixels(source: PixelArray | Material) -> Used | None:
    """Return which pixels of an exemplar are used, (H, W); None: all."""
    return source.used if isinstance(source, Material) else None


def source_names(source: "Source | Sample") -> Any:
    """Return an exemplar's files in a form for JSON, followed by @ and its size, if it has one."""
    if isinstance(source, Sample):
        names = source_names(source.source)
        return names if source.size is None else f"{names}@{source.size}"
    if isinstance(source, (Material, np.ndarray)):
        return on_a_line(source) if isinstance(source, Material) else f"an array of shape {source.shape}"
    if isinstance(source, Mapping):
        return {role: os.fspath(file) for role, file in source.items()}
    return os.fspath(source) if isinstance(source, (str, os.PathLike)) else [os.fspath(f) for f in source]
