"""Run independent tasks on several threads, with progress, and stop quickly when asked to."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from queue import Empty, SimpleQueue

from upholster.errors import InputError, check_whole
from upholster.types import Progress

__all__ = ["check_running", "run_tasks", "thread_count"]


def thread_count(threads: int | None) -> int:
    """Return how many threads to use: `threads` if given (1 to 256), else one per usable core."""
    if threads is None:
        return max(
            1, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        )
    return check_whole("threads", threads, 1, 256)


def check_running(threads: int | None, progress: Progress | None) -> None:
    """Raise InputError before work begins unless it can run on so many threads and tell its progress so."""
    thread_count(threads)
    if progress is not None and not callable(progress):
        raise InputError(
            f"progress is a {type(progress).__name__}; allowed: a function of stage, done and total"
        )


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
    total = len(tasks)
    workers = min(thread_count(threads), total)
    if workers <= 1:
        for done, task in enumerate(tasks, 1):
            task()
            if progress is not None:
                progress(stage, done, total)
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
    finally:
        executor.shutdown(wait=False, cancel_futures=True)


def _next(finished: "SimpleQueue[Future[object]]") -> "Future[object]":
    while True:
        # A short wait keeps Ctrl-C prompt: the main thread runs Python code between two waits.
        with suppress(Empty):
            return finished.get(timeout=0.2)
