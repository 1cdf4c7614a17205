"""``upholster batch``: many covers, side by side on the cores of this machine or on a Dask cluster."""

import json
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upholster.apps.cli.command_options import spelled_out
from upholster.apps.cli.console import Quiet, check_suffix, compiled, say
from upholster.apps.cli.cover import cover, requested_project, uses_of
from upholster.base.display import number_of
from upholster.base.errors import InputError, StoppedError, UpholsterError, check_whole
from upholster.base.formats import LDR_PICTURES, split_name

if TYPE_CHECKING:
    from upholster.covering.tasks.job_runs import Run
    from upholster.covering.tasks.jobs import Job
    from upholster.covering.tasks.record import Record
    from upholster.runtime.stages import Stages

__all__ = ["batch"]


def batch(
    jobs: Annotated[
        str, typer.Argument(metavar="JOBS", help="The jobs: a .toml or .csv file, see docs/scaling.md.")
    ],
    output: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="The record: a JSON file of each job's result; jobs that it lists as done are skipped. "
            "Default: batch.json in the folder of JOBS.",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes on this machine, 1 to 256; default: one per core.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Address of a running Dask cluster: tcp://host:8786."),
    ] = None,
    threads: Annotated[
        int | None, typer.Option(help="Threads per job, 1 to 256; default: its share of the cores.")
    ] = None,
    retries: Annotated[int, typer.Option(help="Retries of a job whose worker died, 0 to 20.")] = 2,
    again: Annotated[bool, typer.Option("--again", help="Do all jobs, also those that are done.")] = False,
    sheet: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write an image with the first picture of each job.")
    ] = None,
    allow: Annotated[
        list[str] | None,
        typer.Option(metavar="DIR", help="Another folder in which jobs may read and write; repeatable."),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Run many covers side by side, skipping those that are done.

    Exit status 1: some jobs failed; 2: no job was started.
    """
    from upholster.base.files import outputs
    from upholster.covering.tasks.job_runs import run_jobs
    from upholster.covering.tasks.jobs import check_apart, check_within, read_jobs
    from upholster.covering.tasks.record import Record
    from upholster.covering.tasks.sheet import write_sheet

    check_whole("retries", retries, 0, 20)
    if sheet is not None:
        check_suffix("sheet", sheet, LDR_PICTURES)
    count = _workers(workers, scheduler)
    each = check_whole("threads", threads, 1, 256) if threads else max(1, (os.cpu_count() or 1) // count)
    found = read_jobs(jobs)
    folder = Path(jobs).resolve().parent
    place = folder / "batch.json" if output is None else Path(output).resolve()
    allowed = [Path(name).resolve() for name in allow or ()]
    inputs, uses = _checked(found, folder, allowed)
    read = list(dict.fromkeys(name for names in inputs for name in names))
    check_within(found, read, [folder, *allowed])
    check_apart(found, read, folder)
    record = Record(place, Path(jobs).resolve())
    own = [place, *([Path(sheet).resolve()] if sheet else [])]
    with outputs(own, inputs=[jobs, *(folder / name for name in read)]):
        pass  # checks before the work that they can be written
    todo = [number for number, job in enumerate(found) if again or not record.is_done(job)]
    _make_folders([found[number] for number in todo], folder)
    if not quiet and len(todo) < len(found):
        say(f"{len(found) - len(todo):,} of {len(found):,} jobs are done already")
    # Jobs of one surface follow each other: a worker reads it and lays it out once.
    todo.sort(key=lambda number: found[number].words[0])
    start, failed = time.perf_counter(), 0
    if todo:
        own_words = ("--quiet", f"--threads={each}")
        tasks = [(os.fspath(folder), (*own_words, *_words(found[n], allowed)), inputs[n]) for n in todo]
        compiled(uses if scheduler is None else (), quiet)
        try:
            with run_jobs(covered_job, tasks, workers=count, scheduler=scheduler, retries=retries) as run:
                failed = _follow(run, [found[number] for number in todo], record, quiet)
        except KeyboardInterrupt:
            done = sum(record.is_done(job) for job in found)
            raise StoppedError(f"stopped; {done:,} of {len(found):,} jobs are done, and stay done") from None
        finally:
            record.write(found)
    if sheet:
        write_sheet(own[1], [(job.name, record.files_of(job)) for job in found])
    if not quiet:
        jobs_done, seconds = number_of(len(todo) - failed, "job"), time.perf_counter() - start
        ended = f"{jobs_done} done, {failed:,} failed, in {seconds:.1f} s"
        say(f"{ended}; wrote {os.path.relpath(place)}" + (f", {sheet}" if sheet else ""))
    if failed:
        raise typer.Exit(1)


def _workers(workers: int | None, scheduler: str | None) -> int:
    if workers is not None and scheduler is not None:
        raise InputError("workers and scheduler are both given; allowed: one of them")
    return check_whole("workers", workers, 1, 256) if workers is not None else os.cpu_count() or 1


def _words(job: "Job", allowed: Sequence[Path]) -> tuple[str, ...]:
    """Return a job's words, with options for the folders that its project may read."""
    of_project = any(word.startswith("--project=") for word in job.words)
    return (*(f"--allow={folder}" for folder in allowed if of_project), *job.words)


def _checked(
    jobs: "Sequence[Job]", folder: Path, allowed: Sequence[Path]
) -> tuple[list[tuple[str, ...]], set[str]]:
    """Read the options of all jobs, as `cover` will; return the files of each job, and its kernels."""
    inputs: list[tuple[str, ...]] = []
    uses: set[str] = set()
    for job in jobs:
        try:
            asked = _parsed(_words(job, allowed))
            with _inside(folder):
                own = requested_project(asked)
                inputs.append((*([asked["project"]] if asked["project"] else []), *own.files()))
                uses |= set(uses_of(own, asked["output"]))
        except Exception as error:
            # Typer's usage errors are recognized by their attributes, see `upholster.apps.cli.main`.
            if not (isinstance(error, UpholsterError) or hasattr(error, "format_message")):
                raise
            message = error.format_message() if hasattr(error, "format_message") else str(error)
            raise InputError(f"job {job.name!r}: {message}") from None
    return inputs, uses


def _follow(run: "Run", jobs: "Sequence[Job]", record: "Record", quiet: bool) -> int:
    """Put each job's result into the record, and show it; return the number of failures."""
    from upholster.apps.cli.batch_table import shown

    failed = 0
    with shown(len(jobs), run.dashboard, quiet) as show:
        for outcome in run.outcomes:
            entry = outcome.result or {"state": "failed", "error": outcome.error}
            record.add(jobs[outcome.number], entry)
            failed += entry["state"] != "done"
            show(jobs[outcome.number].name, entry)
    return failed


@cache
def _kept() -> "Stages":
    """Return a worker's results that its next job may use: jobs in turn share surfaces and samples."""
    from upholster.runtime.stages import Stages

    return Stages()


@cache
def _parser() -> tuple[Any, list[dict[str, Any]]]:
    """Return a command that reads options as `cover` does, and the list to which it appends the result."""
    import functools

    from upholster.apps.cli.command import Command

    seen: list[dict[str, Any]] = []
    original = cover.__wrapped__  # type: ignore[attr-defined]  # of functools.wraps

    @functools.wraps(original)
    def read(**values: Any) -> None:
        seen.append(values)

    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command(cls=Command)(spelled_out()(read))
    return typer.main.get_command(app), seen


def _parsed(words: Sequence[str]) -> dict[str, Any]:
    command, seen = _parser()
    command(list(words), standalone_mode=False)
    return seen.pop()


@contextmanager
def _inside(folder: Path) -> Iterator[None]:
    """Run a block with a folder as working directory, because names in a jobs' file are relative to it."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _make_folders(jobs: "Sequence[Job]", folder: Path) -> None:
    for job in jobs:
        for name in job.outputs:
            place = (folder / split_name(name)[1]).parent
            try:
                place.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise InputError(f"folder {os.fspath(place)!r} cannot be made: {error.strerror}") from None


def covered_job(folder: str, words: tuple[str, ...], inputs: tuple[str, ...]) -> dict[str, Any]:
    """Do one job in a worker. Bad input becomes an entry of the record, not an error of the worker.

    Returns
    -------
    dict
        The job's entry in the record: state, error, hashes of inputs and outputs, texels, seconds.
    """
    from upholster.apps.cli import run_words
    from upholster.covering.tasks.record import state_of

    started, began = time.time_ns(), time.perf_counter()
    with _kept().active(), _inside(Path(folder)), tempfile.TemporaryDirectory(prefix="upholster-") as own:
        asked = next((word for word in words if word.startswith("--report=")), "")
        report = Path(asked.partition("=")[2] or Path(own) / "report.json")
        entry: dict[str, Any] = {"state": "failed", "error": ""}
        try:
            run_words(["cover", *([] if asked else [f"--report={report}"]), *words])
            made = json.loads(report.read_text(encoding="utf-8"))
            files = (file for file in dict.fromkeys([*inputs, *made["read"]]) if os.path.exists(file))
            entry["inputs"] = state_of(files, Path())
            if any(state.get("changed", 0) > started for state in entry["inputs"].values()):
                raise InputError("an input was changed while it was read; allowed: to run this job again")
            entry |= {"state": "done", "version": made["version"], "texels": made["counts"]["texels"]}
            entry |= {"outputs": state_of(made["written"], Path()), "notes": made["notes"]}
        except UpholsterError as error:
            entry["error"] = str(error)
    return entry | {
        "seconds": round(time.perf_counter() - began, 3),
        "finished": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }
