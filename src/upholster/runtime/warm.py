"""Compiling kernels ahead of time, several side by side in processes of their own.

A table (``kernels.json``, written by ``python -m benchmarks.kernel_table``) lists every kernel with the types
of its arguments in commands, its compilation time in seconds, the kernels that it is made of, and the
commands that need it. A command starts `compiling` when it begins: helpers compile kernels that are not on
disk yet, while the command runs. When it needs a kernel, it waits for it and loads it.
"""

import gc
import importlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from upholster.runtime.parallel import thread_count

__all__ = [
    "Compiler",
    "KernelJob",
    "compile_apart",
    "compiling",
    "compiling_apart",
    "jobs_for",
    "missing",
    "work",
]

TABLE = Path(__file__).with_name("kernels.json")


@dataclass(eq=False, slots=True)
class KernelJob:
    """A kernel to be compiled for one list of types.

    Attributes
    ----------
    kernel
        Its name below the package, ``codec._coder_kernels.code_planes``.
    arguments
        The types as JSON, see `upholster.runtime.signatures`.
    seconds
        Its compilation time on the machine that made the table.
    needs
        Jobs of kernels that it is made of.
    started, done, failed
        Its state.
    """

    kernel: str
    arguments: list[Any]
    seconds: float
    needs: "list[KernelJob]" = field(default_factory=list)
    started: bool = False
    done: bool = False
    failed: bool = False

    def dispatcher(self) -> Any:
        """Return the kernel."""
        module, _, name = self.kernel.rpartition(".")
        return getattr(importlib.import_module(f"upholster.{module}"), name)

    def types(self) -> tuple[Any, ...]:
        """Return the types of its arguments."""
        from upholster.runtime.signatures import read_type

        return tuple(read_type(written) for written in self.arguments)


def jobs_for(uses: Iterable[str] | None = None) -> list[KernelJob]:
    """Return the jobs for some uses, each after the jobs that it needs; by default the complete table."""
    table = json.loads(TABLE.read_text(encoding="utf-8"))
    jobs = [KernelJob(row["kernel"], row["arguments"], row["seconds"]) for row in table["kernels"]]
    for job, row in zip(jobs, table["kernels"], strict=True):
        job.needs = [jobs[n] for n in row["needs"]]
    if uses is None:
        return jobs
    wanted = {n for use in uses for n in table["uses"].get(use, ())}
    for n in reversed(range(len(jobs))):  # a job's needs come before it
        if n in wanted:
            wanted.update(table["kernels"][n]["needs"])
    return [jobs[n] for n in sorted(wanted)]


def missing(jobs: Sequence[KernelJob]) -> list[KernelJob]:
    """Return the jobs whose code is not on disk, but could be."""
    from upholster.runtime.kernel_cache import KernelCache

    found = []
    for job in jobs:
        with suppress(ImportError, AttributeError):  # a table of another version: compiled at the first call
            dispatcher = job.dispatcher()
            cache = getattr(dispatcher, "_cache", None)
            if isinstance(cache, KernelCache) and not cache.has(job.types(), dispatcher.targetctx):
                found.append(job)
    return found


class Compiler:
    """Helpers that compile kernels; each has a thread here that hands out work and waits for the answer."""

    def __init__(self, jobs: Sequence[KernelJob], processes: int) -> None:
        self._jobs = list(jobs)
        here = set(self._jobs)
        for job in self._jobs:
            job.needs = [other for other in job.needs if other in here]
        self._queue = sorted(self._jobs, key=self._urgency, reverse=True)
        self._changed = threading.Condition()
        self._helpers: list[subprocess.Popen[str]] = []
        for _ in range(min(processes, len(jobs))):
            with suppress(OSError):  # no room for another process: kernels are compiled at their first call
                self._helpers.append(_process(work, stderr=subprocess.DEVNULL))
        self._alive = len(self._helpers)
        self._threads = [
            threading.Thread(target=self._serve, args=(helper,), daemon=True) for helper in self._helpers
        ]
        for thread in self._threads:
            thread.start()

    @property
    def total(self) -> int:
        """Number of kernels to compile."""
        return len(self._jobs)

    @property
    def done(self) -> int:
        """Number of compiled kernels."""
        return sum(job.done for job in self._jobs)

    @property
    def running(self) -> bool:
        """Whether compilation is still running."""
        return self._alive > 0 and self.done < self.total

    def wait(self, kernel: str | None = None) -> None:
        """Return when a kernel, or all of them, is compiled, or will not be."""
        with self._changed:
            wanted = [job for job in self._jobs if kernel in (None, job.kernel)]
            self._hasten(wanted)
            while self._alive and not all(job.done for job in wanted):
                self._changed.wait(0.2)  # short, so that Ctrl-C is noticed

    def close(self) -> None:
        """End all helpers, finished or not."""
        with self._changed:
            self._queue.clear()
            self._alive = 0
            self._changed.notify_all()
        for helper in self._helpers:
            helper.kill()
        for thread in self._threads:
            thread.join()

    def _hasten(self, wanted: list[KernelJob]) -> None:
        # Kernels that a caller waits for come first, after the kernels that they need.
        needed = set(wanted)
        for job in reversed(self._jobs):
            if job in needed:
                needed.update(job.needs)
        self._queue.sort(key=lambda job: job not in needed)

    def _urgency(self, job: KernelJob) -> float:
        # Seconds from its start to the end of the kernels that wait for it.
        after = [self._urgency(other) for other in self._jobs if job in other.needs]
        return job.seconds + max(after, default=0.0)

    def _serve(self, helper: "subprocess.Popen[str]") -> None:
        # An error means that the helper died: its kernel is compiled at the first call.
        job: KernelJob | None = None
        with suppress(OSError, ValueError), helper:
            assert helper.stdin is not None
            assert helper.stdout is not None
            while (job := self._next()) is not None:
                helper.stdin.write(json.dumps([job.kernel, job.arguments]) + "\n")
                helper.stdin.flush()
                if not helper.stdout.readline():
                    break
                with self._changed:
                    job.done = True
                    self._changed.notify_all()
        with self._changed:
            if job is not None:
                job.failed = not job.done
            self._alive = max(0, self._alive - 1)
            self._changed.notify_all()

    def _next(self) -> KernelJob | None:
        with self._changed:
            while self._queue:
                for job in self._queue:
                    if all(other.done for other in job.needs):
                        self._queue.remove(job)
                        job.started = True
                        return job
                self._changed.wait(0.5)
                if not any(job.started and not (job.done or job.failed) for job in self._jobs):
                    return None  # the remaining kernels need one that will not come
            return None


@contextmanager
def compiling(uses: Iterable[str] | None = None) -> Iterator[Compiler | None]:
    """Compile the kernels of some uses that are not on disk, in the background; None if all are there."""
    from upholster.runtime.kernel_cache import KernelCache

    jobs = missing(jobs_for(uses))
    if not jobs:
        yield None
        return
    compiler = Compiler(jobs, thread_count())
    KernelCache.waiting = compiler.wait
    try:
        yield compiler
    finally:
        KernelCache.waiting = None
        compiler.close()


@contextmanager
def compiling_apart(uses: Sequence[str], note: str) -> Iterator[None]:
    """Compile the kernels of some uses like `compiling`, in a process of its own: this one needs no Numba.

    That process prints `note` on standard error, with the number of kernels in it, if any are missing.
    """
    with _process(compile_apart) as process:
        assert process.stdin is not None
        with suppress(OSError):  # it has died: kernels are compiled at their first call
            process.stdin.write(json.dumps([list(uses), note]) + "\n")
            process.stdin.flush()
        try:
            yield
        finally:
            process.kill()


def compile_apart() -> None:
    """Do the work of `compiling_apart`: what to compile is a line of standard input, which ends with it."""
    lines = _commands()
    uses, note = json.loads(lines.get())
    with compiling(uses) as compiler:
        if compiler is not None:
            print(note.format(compiler.total), file=sys.stderr, flush=True)
            compiler.wait()


def _process(call: Callable[[], None], stderr: int | None = None) -> "subprocess.Popen[str]":
    # The package may be anywhere on this process's path; the working directory is not searched.
    path = os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, sys.path)])
    name = call.__name__
    return subprocess.Popen(
        [sys.executable, "-P", "-c", f"from upholster.runtime.warm import {name}; {name}()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=stderr,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
    )


def _commands() -> "SimpleQueue[str]":
    """Return lines of standard input as they come; the process ends with them, and not by Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the command, which ends this process
    lines: SimpleQueue[str] = SimpleQueue()

    def listen() -> None:
        for line in sys.stdin:
            lines.put(line)
        os._exit(0)  # even in the middle of a kernel: it is no longer needed

    threading.Thread(target=listen, daemon=True).start()
    return lines


def work() -> None:
    """Compile kernels named on standard input, one per line, and answer with the seconds, until it ends."""
    lines = _commands()
    # Compiling makes millions of objects that stay: the garbage collector would take a fifth of the time to
    # scan them again and again.
    gc.disable()
    while True:
        kernel, arguments = json.loads(lines.get())
        job = KernelJob(kernel, arguments, 0.0)
        job.dispatcher().compile(job.types())
        print(flush=True)
