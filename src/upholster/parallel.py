"""Run independent tasks on several threads, with progress; stop quickly, by Ctrl-C or by another thread.

`run_tasks` runs a given list of tasks; a `TaskPool` accepts further ones while others run.
"""

import ctypes
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from itertools import count
from queue import Empty, PriorityQueue, SimpleQueue
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from upholster.errors import CancelledError, InputError, check_whole
from upholster.types import Progress

__all__ = [
    "Key",
    "Stop",
    "TaskPool",
    "cancelled_by",
    "check_cancelled",
    "check_running",
    "give_back_memory",
    "run_tasks",
    "stop_flag",
    "thread_count",
    "thread_pool",
]

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


_cancelled: "ContextVar[Stop | None]" = ContextVar("cancelled", default=None)


@contextmanager
def cancelled_by(stop: Stop) -> Iterator[None]:
    """Make work in this thread end soon after `stop` is set: at the next task or stage, or in a kernel."""
    token = _cancelled.set(stop)
    try:
        yield
    finally:
        _cancelled.reset(token)


def check_cancelled() -> None:
    """Raise CancelledError if the work in this thread is to stop."""
    if stop_flag()[0]:
        raise CancelledError("the work was cancelled")


def stop_flag() -> NDArray[np.uint8]:
    """Return the flag that ends the work in this thread, see `Stop`; its tasks can pass it to kernels.

    A kernel that is ended by it leaves its results unfinished: `run_tasks` raises then.
    """
    stop = _cancelled.get()
    return _NEVER if stop is None else stop.flag


_NEVER: NDArray[np.uint8] = np.zeros(1, np.uint8)


def thread_count(threads: int | None) -> int:
    """Return how many threads to use: `threads` if given (1 to 256), else one per usable core."""
    if threads is None:
        return max(
            1, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        )
    return check_whole("threads", threads, 1, 256)


def check_running(
    threads: int | None, progress: Progress | None, tell: Callable[[str], None] | None = None
) -> None:
    """Raise InputError, before work begins, for a wrong number of threads, `progress` or `tell`."""
    thread_count(threads)
    if progress is not None and not callable(progress):
        raise InputError(
            f"progress is a {type(progress).__name__}; allowed: a function of stage, done and total"
        )
    if tell is not None and not callable(tell):
        raise InputError(f"tell is a {type(tell).__name__}; allowed: a function of a note")


def give_back_memory() -> None:
    """Return free memory to the system, if its library can: arrays of many threads leave gaps."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)  # in glibc


def run_tasks(
    tasks: Sequence[Callable[[], object]],
    *,
    threads: int | None = None,
    progress: Progress | None = None,
    stage: str = "",
) -> None:
    """Call every task once; the first error stops the rest and is raised. No task may depend on another.

    Parameters
    ----------
    tasks
        Functions without arguments; fast ones release the interpreter lock (see `upholster.jit`).
    threads
        How many run at a time; by default one per core.
    progress, stage
        ``progress(stage, done, total)`` is called in the calling thread as tasks finish.
    """
    check_cancelled()
    total = len(tasks)
    workers = min(thread_count(threads), total)
    if workers <= 1:
        for done, task in enumerate(tasks, 1):
            check_cancelled()
            task()
            if progress is not None:
                progress(stage, done, total)
        check_cancelled()
        return
    executor = ThreadPoolExecutor(workers)
    finished: SimpleQueue[Future[object]] = SimpleQueue()
    try:
        for task in tasks:
            executor.submit(task).add_done_callback(finished.put)
        for done in range(1, total + 1):
            _next(finished).result()
            if progress is not None:
                progress(stage, done, total)
        check_cancelled()
    finally:
        executor.shutdown(wait=False, cancel_futures=True)


def _next(finished: "SimpleQueue[Future[Any]]") -> "Future[Any]":
    while True:
        check_cancelled()
        # A short wait keeps Ctrl-C prompt: the main thread runs Python code between two waits.
        with suppress(Empty):
            return finished.get(timeout=0.2 if _cancelled.get() is None else 0.01)


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
def thread_pool(threads: int | None = None) -> Iterator[TaskPool]:
    """Yield a pool on threads of this process; at the end, tasks that have not begun are dropped.

    Parameters
    ----------
    threads
        1 to 256; by default one per core.
    """
    width = thread_count(threads)
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
        self._queue.put((-priority, next(self._turn), key, lambda: task(*arguments)))
        self._executor.submit(self._run_first).add_done_callback(self._ended.put)

    def next(self) -> Key:
        return cast(Key, _next(self._ended).result())

    def counts(self) -> dict[str, int]:
        return {}

    def _run_first(self) -> Key:
        *_, key, call = self._queue.get_nowait()
        call()
        return key
