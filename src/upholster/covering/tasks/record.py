"""The result of each job, kept in a file, so that a job with unchanged inputs is not repeated."""

import hashlib
import json
import os
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from upholster._version import __version__
from upholster.base.errors import FormatError, InputError
from upholster.base.files import outputs, read_bytes, write_bytes
from upholster.covering.tasks.jobs import Job

__all__ = ["Record", "state_of"]

_EVERY = 1.0
"""Seconds between two writes of the record while jobs end."""


class Record:
    """The results of jobs so far, as stored in a file ``batch.json``.

    Parameters
    ----------
    path
        The file; it is read if it exists.
    jobs
        The file of the jobs; records of other jobs are not overwritten.

    Raises
    ------
    InputError, FormatError
        If the file exists, and is not a record, or belongs to another file of jobs.
    """

    def __init__(self, path: Path, jobs: Path) -> None:
        self.path, self.folder = path, jobs.parent
        self._jobs = jobs.name
        self.entries: dict[tuple[str, ...], dict[str, Any]] = {}
        self._written = 0.0
        if path.exists():
            self._read()

    def is_done(self, job: Job) -> bool:
        """Return whether this version did a job, and its inputs and outputs are unchanged."""
        entry = self.entries.get(job.words)
        if entry is None or entry["state"] != "done" or entry["version"] != __version__:
            return False
        return _as_before(entry["inputs"], self.folder) and _as_before(entry["outputs"], self.folder)

    def files_of(self, job: Job) -> list[str]:
        """Return the files that a job has written."""
        entry = self.entries.get(job.words, {})
        return [os.fspath(self.folder / name) for name in entry.get("outputs", {})]

    def add(self, job: Job, entry: Mapping[str, Any]) -> None:
        """Record the result of a job; the file is written at most once a second."""
        self.entries[job.words] = {"name": job.name, "words": list(job.words), **entry}
        if time.monotonic() - self._written > _EVERY:
            self.write()

    def write(self, jobs: Iterable[Job] | None = None) -> None:
        """Write the file, completely or not at all.

        Parameters
        ----------
        jobs
            The jobs to keep, in this order; default: all.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        wanted = self.entries if jobs is None else [job.words for job in jobs]
        found = [self.entries[words] for words in wanted if words in self.entries]
        content = {"upholster": __version__, "jobs": self._jobs, "results": found}
        with outputs([self.path]) as files:
            write_bytes(files.path(self.path), (json.dumps(content, indent=1) + "\n").encode())
        self._written = time.monotonic()

    def _read(self) -> None:
        name = os.fspath(self.path)
        try:
            found = json.loads(read_bytes(name))
            jobs, results = found["jobs"], found["results"]
            self.entries = {tuple(entry["words"]): dict(entry) for entry in results}
            for entry in self.entries.values():
                if entry["state"] == "done":
                    _ = entry["version"], dict(entry["inputs"]), dict(entry["outputs"])
        except (ValueError, KeyError, TypeError):
            raise FormatError(f"{name}: it is not a record of a batch; allowed: another --output") from None
        if jobs != self._jobs:
            raise InputError(f"record {name!r} belongs to {jobs!r}; allowed: another --output")


def state_of(files: Iterable[str], folder: Path) -> dict[str, dict[str, Any]]:
    """Return size, time and hash of files, and of files in folders; names as given.

    Raises
    ------
    OSError
        If a file cannot be read.
    """
    found: dict[str, dict[str, Any]] = {}
    for name in files:
        place = folder / name
        if place.is_dir():
            inside = sorted(entry.name for entry in place.iterdir())
            # Another file in the folder may be a map of the material.
            found[name] = {"files": inside}
            found |= state_of(
                [os.path.join(name, file) for file in inside if (place / file).is_file()], folder
            )
        else:
            found[name] = _file_state(place)
    return found


def _file_state(place: Path) -> dict[str, Any]:
    known = place.stat()
    with place.open("rb") as file:
        return {
            "bytes": known.st_size,
            "changed": known.st_mtime_ns,
            "sha256": hashlib.file_digest(file, "sha256").hexdigest(),
        }


def _as_before(states: Mapping[str, Mapping[str, Any]], folder: Path) -> bool:
    for name, state in states.items():
        place = folder / name
        try:
            if "files" in state:
                if sorted(entry.name for entry in place.iterdir()) != state["files"]:
                    return False
                continue
            known = place.stat()
            if known.st_size != state["bytes"]:
                return False
            if known.st_mtime_ns != state["changed"] and _file_state(place)["sha256"] != state["sha256"]:
                return False
        except (OSError, KeyError):
            return False
    return True
