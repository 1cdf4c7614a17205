"""A file of jobs, TOML or CSV with a job per line: each becomes arguments of ``upholster cover``."""

import csv
import glob
import io
import itertools
import math
import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from upholster.base.errors import FormatError, InputError
from upholster.base.examples import included_models, included_samples
from upholster.base.files import path_inside, read_bytes
from upholster.base.formats import PROJECT_SUFFIX, split_name

__all__ = ["Job", "check_apart", "check_within", "read_jobs"]

MAX_JOBS = 100_000

_FIELD = re.compile(r"\{([^{}]*)\}")
_NAMED = re.compile(r"[a-z][a-z0-9-]*")
_TEMPLATES = ("output", "report")
_OWN = {
    "threads": "--threads of the batch",
    "workers": "--workers of the batch",
    "scheduler": "--scheduler of the batch",
    "quiet": "--quiet of the batch",
    "allow": "--allow of the batch",
    "save-project": "upholster cover --save-project",
    "help": "none",
}
"""Options that a job cannot have, and their replacements."""


@dataclass(frozen=True, slots=True)
class Job:
    """One run of ``upholster cover``.

    Attributes
    ----------
    name
        A readable name: sample and surface, and the values that differ between jobs.
    words
        Command-line arguments after ``cover``; files are relative to the folder of the jobs' file.
    outputs
        The files to write, as in `words`.
    """

    name: str
    words: tuple[str, ...]
    outputs: tuple[str, ...]


def read_jobs(path: str | os.PathLike[str]) -> list[Job]:
    """Read a file of jobs.

    Parameters
    ----------
    path
        TOML: options for all jobs first, then tables ``[[jobs]]``. Options are those of ``upholster cover``,
        without dashes. `sample`, `on` and `project` may be lists and patterns (``photos/*.jpg``), which are
        combined with each other; a list in the list is one material's files. With a `project` the other two
        are optional. A table ``[jobs.each]`` has lists of further options, and makes a job for each of their
        values. CSV: a column per option, a job per line; columns may recur. In `output` and `report`,
        ``{sample}``, ``{on}``, ``{project}``, ``{n}`` (the job's number) and ``{option}`` are replaced by
        the job's values.

    Raises
    ------
    InputError, FormatError
        If it cannot be read, has another suffix, no jobs or more than 100,000, a job without sample, surface
        or output, a value of the wrong type, or an unknown name in braces.
    """
    name = os.fspath(path)
    suffix = Path(name).suffix.lower()
    if suffix not in (".toml", ".csv"):
        raise InputError(f"jobs {name!r} have suffix {suffix!r}; allowed: .toml, .csv")
    try:
        text = read_bytes(name).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise FormatError(f"{name}: it is not UTF-8 text") from None
    folder = Path(name).parent
    tables = _toml_tables(name, text) if suffix == ".toml" else _csv_tables(name, text)
    found = [(where, table, *_choices(where, table, folder)) for where, table in tables]
    if sum(math.prod(len(values) for _, values in lists) for *_, lists in found) > MAX_JOBS:
        raise InputError(f"{name}: more than {MAX_JOBS:,} jobs; allowed: that many in a file")
    jobs: list[Job] = []
    for where, table, shared, lists in found:
        keys, varied = [key for key, _ in lists], tuple(table.get("each", ()))
        for values in itertools.product(*(values for _, values in lists)):
            choice = {**shared, **dict(zip(keys, values, strict=True))}
            jobs.append(_job(where, choice, len(jobs) + 1, varied))
    if not jobs:
        raise InputError(f"{name}: it has no jobs; allowed: tables [[jobs]], or lines of a CSV")
    return jobs


def check_within(jobs: Sequence[Job], inputs: Iterable[str], folders: Sequence[Path]) -> None:
    """Check that no job reads or writes outside some folders, because a file of jobs may be untrusted.

    Samples and models included in the program may be read wherever it is installed.

    Raises
    ------
    InputError
        If a job does.
    """
    written = (split_name(output)[1] for job in jobs for output in job.outputs)
    included = {str(file) for file in (*included_samples().values(), *included_models().values())}
    for name in (*(name for name in inputs if name not in included), *written):
        try:
            path_inside(folders, name)
        except InputError as error:
            raise InputError(f"the file of jobs: {error}, and in those of --allow DIR") from None


def check_apart(jobs: Sequence[Job], inputs: Iterable[str], folder: Path) -> None:
    """Check that no file is written twice, or written by one job and read by another.

    Raises
    ------
    InputError
        If a file is.
    """
    read = {os.path.realpath(folder / name) for name in inputs}
    writers: dict[str, Job] = {}
    for job in jobs:
        for output in job.outputs:
            place = os.path.realpath(folder / split_name(output)[1])
            if place in writers:
                raise InputError(
                    f"{output!r} is written by {writers[place].name!r} and by {job.name!r}; allowed: names "
                    "that differ, by {sample}, {on}, {n}"
                )
            if place in read:
                raise InputError(
                    f"{output!r} is written by {job.name!r} and read by a job; allowed: other names"
                )
            writers[place] = job


def _toml_tables(name: str, text: str) -> Iterator[tuple[str, dict[str, Any]]]:
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FormatError(f"{name}: {error}") from None
    tables = found.pop("jobs", [])
    if not (isinstance(tables, list) and all(isinstance(table, dict) for table in tables)):
        raise FormatError(f"{name}: jobs are not tables; allowed: [[jobs]], and options below it")
    for number, table in enumerate(tables, 1):
        each = found.get("each", {}), table.get("each", {})
        if not all(isinstance(some, dict) for some in each):
            raise FormatError(
                f"{name}: each is not a table; allowed: [jobs.each], and lists of options below it"
            )
        yield f"{name}, job {number}", {**found, **table, "each": {**each[0], **each[1]}}


def _csv_tables(name: str, text: str) -> Iterator[tuple[str, dict[str, Any]]]:
    try:
        rows = list(csv.reader(io.StringIO(text), strict=True))
    except csv.Error as error:
        raise FormatError(f"{name}: {error}") from None
    head = [cell.strip() for cell in rows[0]] if rows else []
    for number, row in enumerate(rows[1:], 2):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) > len(head):
            raise FormatError(f"{name}, line {number}: {len(row)} values; allowed: {len(head)}, as in line 1")
        table: dict[str, Any] = {}
        for key, cell in zip(head, row, strict=False):
            if value := cell.strip():
                if key in table:
                    table[key] = [*(table[key] if isinstance(table[key], list) else [table[key]]), value]
                else:
                    table[key] = {"true": True, "false": False}.get(value.lower(), value)
        # A job per line: the files of several columns are one material.
        if isinstance(table.get("sample"), list):
            table["sample"] = [table["sample"]]
        yield f"{name}, line {number}", table


def _choices(
    where: str, table: Mapping[str, Any], folder: Path
) -> tuple[dict[str, Any], list[tuple[str, list[Any]]]]:
    """Return the values that all jobs of a table share, and the lists that are combined, by option."""
    shared = dict(table)
    each = shared.pop("each", {})
    samples = list(_files(where, "sample", shared.pop("sample", [[]]), folder))
    surfaces = list(_files(where, "on", shared.pop("on", []), folder))
    projects = list(_files(where, "project", shared.pop("project", []), folder))
    if not surfaces and not projects:
        raise InputError(f"{where}: on is missing; allowed: the surface, or a list of them")
    if [] in samples and "material" not in shared and not projects:
        raise InputError(f"{where}: sample is missing; allowed: an image or a material, or a list of them")
    for key, values in each.items():
        if not isinstance(values, list) or not values:
            raise InputError(f"{where}: each.{key} is {values!r}; allowed: a list of values")
    named = {"project": projects, "on": surfaces}
    given = [(key, values) for key, values in named.items() if values]
    return shared, [("sample", samples), *given, *each.items()]


def _files(where: str, key: str, value: Any, folder: Path) -> Iterator[Any]:
    """Yield the files of a value: texts, the files that match a pattern, and lists as they are."""
    for entry in value if isinstance(value, list) else [value]:
        if key == "sample" and isinstance(entry, list) and all(isinstance(file, str) for file in entry):
            yield entry
        elif not isinstance(entry, str) or not entry:
            raise InputError(f"{where}: {key} is {entry!r}; allowed: a text, or a list of texts")
        elif any(sign in entry for sign in "*?["):
            found = sorted(glob.glob(entry, root_dir=folder))
            if not found:
                raise InputError(
                    f"{where}: {key} is {entry!r}, which no file matches; allowed: a pattern of files"
                )
            yield from ([file] for file in found) if key == "sample" else found
        else:
            yield [entry] if key == "sample" else entry


def _job(where: str, table: Mapping[str, Any], number: int, varied: Sequence[str]) -> Job:
    samples = table["sample"]
    covered = [table[key] for key in ("project", "on") if key in table]
    fields = {key: _file_word(str(value)) for key, value in table.items() if key not in _TEMPLATES}
    fields |= {key: _stem(table[key]) for key in ("project", "on") if key in table}
    fields |= {"sample": _stem(samples[0]) if samples else "", "n": str(number)}
    words: list[str] = []
    outputs: list[str] = []
    for key in ("on", "project", *(key for key in table if key not in ("sample", "on", "project"))):
        value = table.get(key, [])
        for text in _texts(where, key, value):
            if text is not None and key in _TEMPLATES:
                text = _filled(f"{where}: {key}", text, fields)
                outputs.append(text)
            words.append(f"--{key}" if text is None else f"--{key}={text}")
    if "output" not in table:
        raise InputError(f"{where}: output is missing; allowed: a file's name, as out/{{on}}_{{sample}}.glb")
    named = [
        *(os.path.basename(file.rstrip("/")) for file in samples),
        *(f"{key} {table[key]}" for key in varied),
    ]
    on = " on ".join(os.path.basename(each) for each in covered)
    name = f"{number}: {' + '.join(named) or 'materials'} on {on}"
    return Job(name, (*words, "--", *samples), tuple(outputs))


def _texts(where: str, key: str, value: Any) -> Iterator[str | None]:
    """Yield an option's values as texts; None for a switch that is on."""
    if not _NAMED.fullmatch(key):
        raise InputError(f"{where}: {key!r} is not an option; allowed: those of upholster cover")
    if key in _OWN:
        raise InputError(f"{where}: {key} is not for a job; instead: {_OWN[key]}")
    for entry in value if isinstance(value, list) else [value]:
        if isinstance(entry, bool):
            if entry:
                yield None
        elif isinstance(entry, (str, int, float)):
            yield str(entry)
        else:
            raise InputError(
                f"{where}: {key} is {entry!r}; allowed: a text, a number, true, or a list of them"
            )


def _filled(where: str, template: str, fields: Mapping[str, str]) -> str:
    def value(found: re.Match[str]) -> str:
        if found[1] not in fields:
            raise InputError(
                f"{where} is {template!r}, but there is no {found[0]}; allowed: "
                + ", ".join(f"{{{name}}}" for name in sorted(fields))
            )
        return fields[found[1]]

    return _FIELD.sub(value, template)


def _stem(text: str) -> str:
    """Return the name of a file or a surface for use in names of other files."""
    path = text.rstrip("/\\")
    base = os.path.basename(path).removesuffix(PROJECT_SUFFIX)
    return _file_word(base if ":" in base else os.path.splitext(base)[0])


def _file_word(text: str) -> str:
    return re.sub(r"[^\w.=+,-]+", "-", text).strip("-.") or "x"
