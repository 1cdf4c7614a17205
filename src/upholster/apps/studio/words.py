"""The command line, and the Python code, that are equivalent to a project."""

import os
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from upholster.apps.project.project import KINDS, Project
from upholster.apps.studio.folder import INCLUDED, MADE
from upholster.base.examples import INCLUDED_PREFIX
from upholster.base.formats import PROJECT_SUFFIX
from upholster.base.options.choices import Options
from upholster.base.options.option_fields import differing
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.base.options.write_options import RELIEF
from upholster.image.files.source import Sample
from upholster.synthesis.guidance_reader import with_names

__all__ = ["command", "file_names", "flat", "python", "stem"]


def command(project: Project, folder: Path) -> str:
    """Return the shell command that writes a project's model to a file, and with a relief another to print.

    It names files as the user has them: without folders, and included ones as ``sample:NAME``. If the user
    does not have one of the files, or a part's own sample is more than a file and a size, it names the
    project's file, which the studio saves with all files.
    """
    found = [_command(flat(project), f"{stem(project)}.glb", folder)]
    if project.writing.displace is not None:
        found.append(_command(project, f"{stem(project)}.3mf", folder))
    return "\n".join(found)


def _command(project: Project, output: str, folder: Path) -> str:
    words = ["upholster", "cover"]
    # In a command a part's own sample is one file and a size.
    own = project.materials.values()
    is_short = all(one.options == SampleOptions() and len(file_names(one)) == 1 for one in own)
    if not (is_short and _has_all(project, folder)):
        return shlex.join([*words, "--project", f"{stem(project)}{PROJECT_SUFFIX}", "-o", output])
    options: Options | SampleOptions = SampleOptions()
    if project.sample is not None:
        words += file_names(project.sample)
        options = project.sample.options
    words += ["--on", _name(project.model)]
    if project.sample is not None and project.sample.size is not None:
        words += ["--sample-size", str(project.sample.size)]
    for part, sample in project.materials.items():
        size = "" if sample.size is None else f"@{sample.size}"
        words += ["--material", f"{part}={_name(file_names(sample)[0])}{size}"]
    for each in (options, *(getattr(project, kind) for kind in KINDS)):
        words += _flags(each)
    if project.seed:
        words += ["--seed", str(project.seed)]
    return shlex.join([*words, "-o", output])


def python(project: Project, folder: Path) -> str:
    """Return the Python code that does the same."""
    lines = ["import upholster", ""]
    output, relief = f"{stem(project)}.glb", project.writing.displace
    written = [f"project.cover([{output!r}])"]
    if relief is not None:
        written = [f"project.change({_no_relief(project)}).cover([{output!r}])"]
        written.append(f"project.cover([{stem(project) + '.3mf'!r}])")
    if not _has_all(project, folder):
        lines.append(f"project = upholster.read_project({stem(project) + PROJECT_SUFFIX!r})")
        return "\n".join([*lines, *written, ""])
    named: dict[str, str] = {"sample": "None" if project.sample is None else _spelled(project.sample)}
    if project.materials:
        inner = ", ".join(f"{part!r}: {_spelled(one)}" for part, one in project.materials.items())
        named["materials"] = f"{{{inner}}}"
    for kind in KINDS:
        if changed := differing(_renamed(getattr(project, kind))):
            named[kind] = repr(changed)
    if project.seed:
        named["seed"] = str(project.seed)
    lines.append("project = upholster.Project(")
    lines.append(f"    {_name(project.model)!r},")
    lines += [f"    {name}={text}," for name, text in named.items()]
    return "\n".join([*lines, ")", *written, ""])


def flat(project: Project) -> Project:
    """Return a project without a relief in the mesh: only some kinds of files can have one."""
    return project.change(**dict.fromkeys(RELIEF))


def _no_relief(project: Project) -> str:
    return ", ".join(f"{name}=None" for name in differing(project.writing) if name in RELIEF)


def _has_all(project: Project, folder: Path) -> bool:
    """Return whether the user has all files of a project under these names."""
    files = (Path(os.path.abspath(file)) for file in project.files())
    groups = (file.relative_to(folder).parts[0] for file in files if file.is_relative_to(folder))
    return not any((folder / group / MADE).exists() for group in groups)


def stem(project: Project) -> str:
    """Return the base name of a project's files: from its model and sample, unlike the model's own file."""
    names = [_name(project.model).removeprefix(INCLUDED_PREFIX).split(":")[0]]
    names.append(file_names(project.sample)[0] if project.sample is not None else "parts")
    names[1] = names[1].removeprefix(INCLUDED_PREFIX)
    return "_".join(re.sub(r"[^\w-]+", "-", os.path.splitext(one)[0]).strip("-") or "x" for one in names)


def _name(file: Any) -> str:
    text = str(os.fspath(file))
    base = os.path.basename(text)
    if os.path.isabs(text) and os.path.basename(os.path.dirname(text)) == INCLUDED:
        return f"{INCLUDED_PREFIX}{os.path.splitext(base)[0]}"
    return os.path.basename(text.rstrip("/")) if os.path.isabs(text) else text


def file_names(sample: Sample) -> list[str]:
    """Return a sample's files as the user has them: without folders, included ones as ``sample:NAME``."""
    source: Any = sample.source
    if isinstance(source, Mapping):
        source = list(source.values())
    return [_name(one) for one in ([source] if isinstance(source, (str, os.PathLike)) else source)]


def _spelled(sample: Sample) -> str:
    names = file_names(sample)
    words = [repr(names[0] if len(names) == 1 else names)]
    if sample.size is not None:
        words.append(repr(sample.size))
    if changed := differing(_renamed(sample.options)):
        words.append(f"options={changed!r}")
    return f"upholster.Sample({', '.join(words)})"


def _renamed(options: Options) -> Options:
    """Return options with the names of files as the user has them."""
    if isinstance(options, SampleOptions):
        return options.renamed(_name)
    return with_names(options, _name) if isinstance(options, SynthesisOptions) else options


def _flags(options: Options) -> Iterator[str]:
    """Yield options that are not defaults, in the form of the command line."""
    about = {entry.name: entry.metadata for entry in fields(options)}
    for name, value in differing(_renamed(options)).items():
        flag = about[name]["flag"] or "--" + name.replace("_", "-")
        if isinstance(value, bool):
            yield flag if value else f"--no-{flag.removeprefix('--')}"
            continue
        for text in _texts(value, "x" if "WxH" in (about[name]["metavar"] or "") else ","):
            yield from (flag, text)


def _texts(value: Any, between: str) -> list[str]:
    if isinstance(value, Mapping):
        return [f"{key}={one}" for key, one in value.items()]
    if isinstance(value, (tuple, list)):
        if value and all(isinstance(one, str) for one in value):
            return list(value)  # each is an option of its own
        if value and isinstance(value[0], tuple):
            return [" ".join(_joined(corner, ",") for corner in value)]
        return [_joined(value, between)]
    return [_number(value)]


def _joined(value: Sequence[Any], between: str) -> str:
    return between.join(_number(one) for one in value)


def _number(value: Any) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)
