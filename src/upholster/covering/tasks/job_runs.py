"""Jobs on Dask: on processes of this machine, or on an existing cluster."""

import importlib
import logging
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from upholster._version import __version__
from upholster.base.errors import InputError, UpholsterError
from upholster.runtime.parallel import Key, TaskPool, run_alone

__all__ = ["CALM", "Outcome", "Run", "cluster_pool", "run_jobs"]

_PATIENCE = 10
"""Seconds in which a scheduler has to answer."""

CALM = {
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "500ms",
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "2s",
    "distributed.nanny.pre-spawn-environ": dict.fromkeys(
        ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"
    ),
}
"""Settings of workers on this machine. A worker gets a task only when it is free: tasks take a second, and
more urgent ones may become ready in the meantime. Dask's self-monitoring took 3 % of a core in each process.
Dask also makes glibc return all memory at once (MALLOC_TRIM_THRESHOLD_), so that the pages of arrays are
cleared again and again: here glibc's default is kept.
"""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of one job.

    Attributes
    ----------
    number
        Index of the job in the list.
    result
        The work's return value; None if it failed.
    error
        The cause of the failure, in a line; empty if there was none.
    """

    number: int
    result: Any
    error: str = ""


@dataclass(frozen=True, slots=True)
class Run:
    """Running jobs.

    Attributes
    ----------
    dashboard
        The address of Dask's dashboard; empty if there is none.
    outcomes
        Outcomes of the jobs, in the order in which they end.
    """

    dashboard: str
    outcomes: Iterator[Outcome]


@contextmanager
def run_jobs(
    work: Callable[..., Any],
    arguments: Sequence[tuple[Any, ...]],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    retries: int = 2,
) -> Iterator[Run]:
    """Run jobs side by side, and yield outcomes in the order in which jobs end.

    Parameters
    ----------
    work
        A function of a module, called with each job's arguments in some worker's process.
    arguments
        The arguments of each job.
    workers
        Processes on this machine, each with one job at a time; default: one per core.
    scheduler
        Address of a Dask scheduler, ``tcp://host:8786``, instead of processes of this machine.
    retries
        How often a job is retried if its worker died, or a fault of the machine made it fail.

    Yields
    ------
    Run
        Dashboard and outcomes.

    Raises
    ------
    InputError
        If Dask is not installed, no scheduler answers, or its workers have another version of upholster.
    """
    with _connected(workers, scheduler, retries) as (distributed, client):
        yield Run(_dashboard(client), _outcomes(distributed, client, work, arguments, retries))


@contextmanager
def cluster_pool(
    workers: int | None = None, scheduler: str | None = None, retries: int = 2
) -> Iterator[TaskPool]:
    """Yield a pool whose tasks run on Dask's workers; parameters and errors as for `run_jobs`.

    A task whose worker dies is repeated by another. `TaskPool.next` raises `InputError` if a task could not
    be done.
    """
    with _connected(workers, scheduler, retries) as (distributed, client):
        yield _Pool(distributed, client, retries)


class _Pool:
    """Tasks on Dask's workers, as a `TaskPool`.

    A task costs the scheduler about ten messages, most of them of a fixed size. To save messages, several
    tasks are sent at a time, and no task returns a result that would have to be fetched.
    """

    def __init__(self, distributed: Any, client: Any, retries: int) -> None:
        self._client, self._retries = client, retries
        self._ended = distributed.as_completed()
        self._keys: dict[Any, Key] = {}
        self._unsent: dict[tuple[Callable[..., Any], int], list[tuple[Key, tuple[Any, ...]]]] = {}
        self._mark, self._tasks, self._before = os.urandom(3).hex(), 0, _stream_bytes(client)

    @property
    def width(self) -> int:
        cores: Mapping[str, int] = self._client.ncores()
        return max(1, sum(cores.values()))

    def submit(self, key: Key, task: Callable[..., Any], *arguments: Any, priority: int = 0) -> None:
        self._unsent.setdefault((task, priority), []).append((key, arguments))

    def next(self) -> Key:
        self._send()
        future = next(self._ended)
        key = self._keys.pop(future)
        if future.status != "finished":
            error = future.exception()
            if isinstance(error, UpholsterError):
                raise error
            raise InputError(f"{key[0]} {key[1]} could not be done: {_why(future)}")
        future.release()
        return key

    def counts(self) -> dict[str, int]:
        now = _stream_bytes(self._client)
        known = {} if now is None or self._before is None else {"scheduler bytes": now - self._before}
        return {"tasks": self._tasks, **known}

    def _send(self) -> None:
        """Send all waiting tasks: those of one function in one message."""
        for (task, priority), waiting in self._unsent.items():
            futures = self._client.map(
                partial(run_alone, task),
                *zip(*(arguments for _, arguments in waiting), strict=True),
                key=[f"{kind}-{number}-{self._mark}" for (kind, number), _ in waiting],
                priority=priority,
                retries=self._retries,
                pure=False,
            )
            self._keys.update(zip(futures, (key for key, _ in waiting), strict=True))
            self._ended.update(futures)
            self._tasks += len(futures)
        self._unsent.clear()


def _stream_bytes(client: Any) -> int | None:
    """Return the bytes that went through the scheduler in messages about tasks; None if unknown.

    Only open connections count. Heartbeats, about 2 kB per second and worker, are not included.
    """
    with suppress(Exception):  # only informative; these counts are not part of Dask's public interface
        own = int(client.scheduler_comm.byte_count)
        by_workers: Mapping[str, int] = client.run(_sent_by_worker)
        return own + int(client.run_on_scheduler(_sent_by_scheduler)) + sum(by_workers.values())
    return None


def _sent_by_scheduler(dask_scheduler: Any) -> int:
    streams = [*dask_scheduler.stream_comms.values(), *dask_scheduler.client_comms.values()]
    return sum(int(stream.byte_count) for stream in streams)


def _sent_by_worker(dask_worker: Any) -> int:
    return int(dask_worker.batched_stream.byte_count)


@contextmanager
def _connected(workers: int | None, scheduler: str | None, retries: int) -> Iterator[tuple[Any, Any]]:
    """Yield Dask's module and a client whose workers have the same version as this process."""
    try:
        distributed = importlib.import_module("distributed")
    except ImportError:
        raise InputError(
            'workers and scheduler need Dask; install it by: pip install "upholster[cluster]"'
        ) from None
    with _client(distributed, workers, scheduler, retries) as client:
        _check_versions(client)
        yield distributed, client


@contextmanager
def _client(distributed: Any, workers: int | None, scheduler: str | None, retries: int) -> Iterator[Any]:
    import dask

    settings = {
        "distributed.scheduler.allowed-failures": retries,
        "distributed.comm.timeouts.connect": _PATIENCE,
        "distributed.admin.large-graph-warning-threshold": "1GB",
    }
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(settings | (CALM if scheduler is None else {})))
        for name in ("distributed", "bokeh", "tornado"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
        if scheduler is not None:
            try:
                yield stack.enter_context(distributed.Client(scheduler, timeout=_PATIENCE))
            except (OSError, ValueError, TypeError) as error:
                raise InputError(
                    f"scheduler {scheduler!r} does not answer; allowed: a Dask scheduler, such as "
                    f"tcp://127.0.0.1:8786 ({error})"
                ) from None
            return
        folder = stack.enter_context(
            tempfile.TemporaryDirectory(prefix="upholster-", ignore_cleanup_errors=True)
        )
        cluster = distributed.LocalCluster(
            n_workers=workers or os.cpu_count() or 1,
            threads_per_worker=1,
            processes=True,
            preload=["upholster.covering.tasks.dask_worker"],
            local_directory=folder,
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
        )
        stack.enter_context(cluster)
        yield stack.enter_context(distributed.Client(cluster))


def _has_bokeh() -> bool:
    return importlib.util.find_spec("bokeh") is not None


def _dashboard(client: Any) -> str:
    with suppress(Exception):  # only a name for people
        return str(client.dashboard_link or "") if _has_bokeh() else ""
    return ""


def _version_here() -> str:
    return __version__


def _check_versions(client: Any) -> None:
    try:
        found: Mapping[str, str] = client.run(_version_here)
    except Exception as error:
        raise InputError(
            f"workers cannot load upholster {__version__}; allowed: the same version on all ({error})"
        ) from None
    for address, version in found.items():
        if version != __version__:
            raise InputError(
                f"worker {address} has upholster {version}; allowed: {__version__}, as here, on all workers"
            )


def _outcomes(
    distributed: Any,
    client: Any,
    work: Callable[..., Any],
    arguments: Sequence[tuple[Any, ...]],
    retries: int,
) -> Iterator[Outcome]:
    futures = {
        client.submit(
            work, *own, key=f"job-{number}-{os.urandom(4).hex()}", retries=retries, pure=False
        ): number
        for number, own in enumerate(arguments)
    }
    # Finished futures are released, so that workers do not keep their results.
    pending = distributed.as_completed(list(futures))
    for future in pending:
        number = futures.pop(future)
        if future.status == "finished":
            yield Outcome(number, future.result())
        else:
            yield Outcome(number, None, _why(future))
        future.release()


def _why(future: Any) -> str:
    error = future.exception()
    if type(error).__name__ == "KilledWorker":
        return "its worker died at every attempt (out of memory?)"
    return f"{type(error).__name__}: {error}"
