"""The report of a request that was carried out."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from upholster._version import __version__
from upholster.base.errors import InputError
from upholster.base.files import path_text, write_bytes
from upholster.base.options.sample_options import SampleOptions
from upholster.covering.joint_work import automatic_values
from upholster.covering.request import Request
from upholster.image.files.source import source_names
from upholster.model.textured_model import TexturedModel
from upholster.output.output_writer import quality_words
from upholster.output.reports import CoverReport, peak_memory, totalled
from upholster.synthesis.quilt.scene import Scene

__all__ = ["check_report", "cover_report", "written_report"]


def check_report(report: str | os.PathLike[str] | None) -> None:
    """Raise InputError if the report's file has another suffix than ``.json``."""
    if report is not None and not path_text(report, "report").lower().endswith(".json"):
        raise InputError(f"report {os.fspath(report)!r} has suffix {Path(report).suffix!r}; allowed: .json")


def cover_report(
    request: Request,
    requests: Sequence[Request],
    *,
    running: Mapping[str, int | str | None],
    seconds: Mapping[str, float],
    written: dict[str, int],
    counts: dict[str, int],
    notes: list[str],
    model: TexturedModel | None,
) -> CoverReport:
    """Return the report of a request, which was read as the given `requests`; `running` says how it ran.

    `written` are the bytes of each file. `model` is None if tiles were written one by one.
    """
    file = requests[0].covered.model
    inputs = () if file is None else file.inputs
    return CoverReport(
        version=__version__,
        parameters=_parameters(request, running, requests[0]),
        settled=automatic_values(requests) | quality_words(request.outputs, model),
        counts=counts,
        seconds=totalled(dict(seconds)),
        peak_memory_bytes=peak_memory(),
        written=written,
        notes=notes,
        read=list(dict.fromkeys([*request.files(), *map(os.fspath, inputs)])),
        model=model,
    )


def written_report(report: CoverReport, path: Path) -> None:
    """Write a report as JSON."""
    write_bytes(path, (json.dumps(report.to_json(), indent=2) + "\n").encode())


def _parameters(request: Request, running: Mapping[str, int | str | None], first: Request) -> dict[str, Any]:
    """Return all parameters, including defaults."""
    sample, on, asked = request.sample, request.on, request.synthesis
    read_with = SampleOptions() if sample is None else sample.options
    found = {
        "exemplar": None if sample is None else source_names(sample),
        "materials": {pattern: source_names(each) for pattern, each in request.materials.items()},
        "on": os.fspath(on) if isinstance(on, (str, os.PathLike)) else repr(on),
        **running,
    }
    for options in (read_with, request.reading, asked, request.writing):
        found |= asdict(options)
    found["seed"] = request.seed
    if callable(asked.direction) and isinstance(first.scene, Scene):
        found["direction"] = first.scene.direction
    return found
