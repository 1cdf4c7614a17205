"""How work runs: on how many threads, with progress, until it is cancelled; and tasks that run in parallel.

`running` and `cancelled_by` say it for a block, and everything called there follows. `run_tasks` runs a given
list of tasks; a `TaskPool` accepts further ones while others run. A task runs on one thread and without
progress, and it is cancelled with the work that it belongs to.
"""

import ctypes
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from queue import Empty, PriorityQueue, SimpleQueue
from typing import Any, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from upholster.base.errors import CancelledError, InputError, check_whole
from upholster.base.types import Progress

__all__ = [
    "Key",
    "Stop",
    "TaskPool",
    "cancelled_by",
    "check_cancelled",
    "give_back_memory",
    "given_threads",
    "handed_on",
    "quietly",
    "report_note",
    "report_progress",
    "reporting",
    "run_alone",
    "run_tasks",
    "running",
    "stop_flag",
    "thread_count",
    "thread_pool",
]

Value = TypeVar("Value")

Key = tuple[str, int]
"""The name of a task: its kind and a number."""


class Stop:
    """A signal from one thread that ends work in others.

    Attributes
    ----------
    flag
        (1,) uint8, not 0 once it is set: kernels that run long check it.
    """

    def __init__(self) -> None:
        self.flag: NDArray[np.uint8] = np.zeros(1, np.uint8)

    def set(self) -> None:
        """End the work."""
        self.flag[0] = 1

    def is_set(self) -> bool:
        """Whether the work is to end."""
        return bool(self.flag[0])


_NEVER = Stop()


@dataclass(frozen=True, slots=True)
class _Running:
    """How work runs: see `running` and `cancelled_by`."""

    threads: int | None = None
    progress: Progress | None = None
    tell: Callable[[str], None] | None = None
    stop: Stop = _NEVER


_DEFAULT = _Running()

_running: ContextVar[_Running] = ContextVar("running", default=_DEFAULT)


@contextmanager
def _set(how: _Running) -> Iterator[None]:
    token = _running.set(how)
    try:
        yield
    finally:
        _running.reset(token)


@contextmanager
def running(
    threads: int | None = None,
    progress: Progress | None = None,
    tell: Callable[[str], None] | None = None,
) -> Iterator[None]:
    """Say how the work in a block runs; None: as around the block.

    Parameters
    ----------
    threads
        1 to 256; by default one per core.
    progress
        Called as ``progress(stage, done, total)``.
    tell
        Called with notes.

    Raises
    ------
    InputError
        For a wrong number of threads, `progress` or `tell`.
    """
    if threads is not None:
        check_whole("threads", threads, 1, 256)
    if progress is not None and not callable(progress):
        raise InputError(
            f"progress is a {type(progress).__name__}; allowed: a function of stage, done and total"
        )
    if tell is not None and not callable(tell):
        raise InputError(f"tell is a {type(tell).__name__}; allowed: a function of a note")
    how = _running.get()
    with _set(_Running(threads or how.threads, progress or how.progress, tell or how.tell, how.stop)):
        yield


@contextmanager
def reporting(part: Callable[[str, int, int], tuple[str, int, int]]) -> Iterator[None]:
    """Report the progress of a block as part of that around it: `part` returns its stage, done and total."""
    how = _running.get()
    progress = how.progress
    with _set(how if progress is None else replace(how, progress=lambda *own: progress(*part(*own)))):
        yield


@contextmanager
def quietly() -> Iterator[None]:
    """Report no progress of a block."""
    with _set(replace(_running.get(), progress=None)):
        yield


@contextmanager
def cancelled_by(stop: Stop) -> Iterator[None]:
    """Make work in this thread end soon after `stop` is set: at the next task or stage, or in a kernel."""
    with _set(replace(_running.get(), stop=stop)):
        yield


def report_progress(stage: str, done: int, total: int) -> None:
    """Report the progress of the work in this thread, see `running`."""
    progress = _running.get().progress
    if progress is not None:
        progress(stage, done, total)


def report_note(note: str) -> None:
    """Report a note about the work in this thread, see `running`."""
    tell = _running.get().tell
    if tell is not None:
        tell(note)


def check_cancelled() -> None:
    """Raise CancelledError if the work in this thread is to stop."""
    if _running.get().stop.is_set():
        raise CancelledError("the work was cancelled")


def stop_flag() -> NDArray[np.uint8]:
    """Return the flag that ends the work in this thread, see `Stop`; its tasks can pass it to kernels.

    A kernel that is ended by it leaves its results unfinished: `run_tasks` raises then.
    """
    return _running.get().stop.flag


def given_threads() -> int | None:
    """Return the number of threads that a caller has set, see `running`; None: none has."""
    return _running.get().threads


def thread_count() -> int:
    """Return how many threads the work in this thread may use, see `running`."""
    if (threads := _running.get().threads) is not None:
        return threads
    return max(1, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1)


def run_alone(task: Callable[..., Value], *arguments: Any) -> Value:
    """Call a task, whose own work runs on one thread and without progress."""
    with _set(_Running(1, stop=_running.get().stop)):
        return task(*arguments)


def handed_on(work: Callable[..., Value]) -> Callable[..., Value]:
    """Return a function that works as this thread does, on whichever thread it is called.

    A thread of our own has no context; it gets this one by hand.
    """
    how = _running.get()

    def call(*arguments: Any) -> Value:
        with _set(how):
            return work(*arguments)

    return call


def give_back_memory() -> None:
    """Return free memory to the system, if its library can: arrays of many threads leave gaps."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)  # in glibc


def run_tasks(
    tasks: Sequence[Callable[[], object]],
    *,
    threads: int | None = None,
    stage: str = "",
    share: tuple[int, int, int] | None = None,
) -> None:
    """Call every task once; the first error stops the rest and is raised. No task may depend on another.

    Parameters
    ----------
    tasks
        Functions without arguments; fast ones release the interpreter lock (see `upholster.runtime.jit`).
    threads
        How many run at a time; None: as `running` says.
    stage
        The name by which progress is reported as tasks finish, in the calling thread; empty: it is not.
    share
        Where these tasks are in a larger stage: the number done before, their number there, and the total.
    """
    check_cancelled()
    before, own, total = share or (0, len(tasks), len(tasks))
    workers = min(thread_count() if threads is None else threads, len(tasks))
    with _called(tasks, workers) as ends:
        for done, end in enumerate(ends, 1):
            end()
            if stage:
                report_progress(stage, before + own * done // len(tasks), total)
    check_cancelled()


@contextmanager
def _called(tasks: Sequence[Callable[[], object]], workers: int) -> Iterator[Iterator[Callable[[], object]]]:
    # Yields functions, each of which waits for one more task to end, or raises its error.
    if workers <= 1:
        yield (partial(_called_here, task) for task in tasks)
        return
    executor = ThreadPoolExecutor(workers)
    finished: SimpleQueue[Future[object]] = SimpleQueue()
    try:
        for task in tasks:
            executor.submit(handed_on(run_alone), task).add_done_callback(finished.put)
        yield (lambda: _next(finished).result() for _ in tasks)
    finally:
        executor.shutdown(wait=False, cancel_futures=True)


def _called_here(task: Callable[[], object]) -> None:
    check_cancelled()
    run_alone(task)


def _next(finished: "SimpleQueue[Future[Any]]") -> "Future[Any]":
    while True:
        check_cancelled()
        # A short wait keeps Ctrl-C prompt: the main thread runs Python code between two waits.
        with suppress(Empty):
            return finished.get(timeout=0.2 if _running.get().stop is _NEVER else 0.01)


class TaskPool(Protocol):
    """Runs tasks that arrive while others run: on threads of this process, or on workers elsewhere.

    A task leaves its results in files: nothing is returned.
    """

    @property
    def width(self) -> int:
        """Number of tasks that run at a time."""
        ...

    def submit(self, key: Key, task: Callable[..., Any], *arguments: Any, priority: int = 0) -> None:
        """Run a task under a name; higher priorities are first, then earlier submissions.

        A task is a function of a module, and its arguments can be pickled.
        """
        ...

    def next(self) -> Key:
        """Wait until one more task has ended; return its name, or raise its error."""
        ...

    def counts(self) -> dict[str, int]:
        """Return counts of the tasks so far for a report; empty for threads."""
        ...


@contextmanager
def thread_pool() -> Iterator[TaskPool]:
    """Yield a pool on threads of this process; at the end, tasks that have not begun are dropped."""
    width = thread_count()
    executor = ThreadPoolExecutor(width)
    try:
        yield _Threads(executor, width)
    finally:
        executor.shutdown(wait=True, cancel_futures=True)


class _Threads:
    """A pool on threads: each turn of a thread takes the task that is first in the queue at that time."""

    def __init__(self, executor: ThreadPoolExecutor, width: int) -> None:
        self._executor, self._turn, self.width = executor, count(), width
        self._queue: PriorityQueue[tuple[int, int, Key, Callable[[], Any]]] = PriorityQueue()
        self._ended: SimpleQueue[Future[Key]] = SimpleQueue()

    def submit(self, key: Key, task: Callable[..., Any], *arguments: Any, priority: int = 0) -> None:
        call = partial(handed_on(run_alone), task, *arguments)
        self._queue.put((-priority, next(self._turn), key, call))
        self._executor.submit(self._run_first).add_done_callback(self._ended.put)

    def next(self) -> Key:
        return cast(Key, _next(self._ended).result())

    def counts(self) -> dict[str, int]:
        return {}

    def _run_first(self) -> Key:
        *_, key, call = self._queue.get_nowait()
        call()
        return key
