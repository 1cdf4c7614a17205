"""Stages: functions whose results are kept under their arguments, on which alone they depend.

A function marked as a `stage` runs as usual if nothing is kept. Within `Stages.active` it runs once for the
same arguments: later calls return the same object again. So a stage whose arguments come from other stages
runs again only if one of those did. Arguments that can be compared count by value, arrays and surfaces by
identity: arguments and results of a stage are never changed afterwards.

Work that is cancelled stops at the next stage or task: see `upholster.runtime.parallel.cancelled_by`. If a
stage is running in one thread, another thread that needs it waits.
"""

import functools
import inspect
import os
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, fields, is_dataclass
from threading import Event, Lock
from typing import Any, NamedTuple, ParamSpec, TypeVar, cast

import numpy as np

from upholster.runtime.parallel import check_cancelled, give_back_memory

__all__ = ["Ran", "Stages", "file_stage", "keeping", "stage"]

Parameters = ParamSpec("Parameters")
Value = TypeVar("Value")

_TOLD = 1000
"""Number of recently run stages that are listed."""

_SMALL = (int, float, complex, bool, type(None))
_PLAIN = (str, bytes, *_SMALL)

_active: "ContextVar[Stages | None]" = ContextVar("stages", default=None)
_nested: "ContextVar[_Nested | None]" = ContextVar("nested", default=None)


def stage(function: Callable[Parameters, Value]) -> Callable[Parameters, Value]:
    """Mark a function as a stage: its result follows from its arguments.

    A stage has no arguments for output, such as a list of notes: it returns all of its results.
    """
    return _as_stage(function, None)


def file_stage(
    files: Callable[..., Iterable[str]],
) -> Callable[[Callable[Parameters, Value]], Callable[Parameters, Value]]:
    """Mark a function as a stage that reads files: it runs again if one of its files has changed.

    Parameters
    ----------
    files
        Called with a result, then with the arguments: returns the names of the files that were read.
    """

    def mark(function: Callable[Parameters, Value]) -> Callable[Parameters, Value]:
        return _as_stage(function, files)

    return mark


def _as_stage(
    function: Callable[Parameters, Value], files: Callable[..., Iterable[str]] | None
) -> Callable[Parameters, Value]:
    signature = inspect.signature(function)

    @functools.wraps(function)
    def run(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Value:
        check_cancelled()
        stages = _active.get()
        if stages is None:
            return function(*args, **kwargs)
        bound = signature.bind(*args, **kwargs)
        bound.apply_defaults()
        inputs = tuple(_compared(value) for value in bound.arguments.values())
        if files is not None:
            inputs = (*inputs, os.getcwd())  # names of files may be relative
        own = None if files is None else lambda made: files(made, *args, **kwargs)
        return stages.result(function.__name__, inputs, lambda: function(*args, **kwargs), own)

    return run


@dataclass(eq=False, slots=True)
class _Result:
    """The result of a stage; `ready` is set when it is there, or the stage has failed."""

    ready: Event = field(default_factory=Event)
    value: Any = None
    failed: bool = False
    files: tuple[tuple[str, int, int], ...] = ()
    arrays: dict[int, int] | None = None
    """Identity and bytes of its arrays, once they are measured."""
    used: int = 0
    """Number of the use of `Stages.active` that needed it last."""


class Ran(NamedTuple):
    """A stage that has run: its function's name, and its own seconds, without those of stages within it."""

    name: str
    seconds: float


@dataclass(eq=False, slots=True)
class _Nested:
    seconds: float = 0.0


class Stages:
    """Results of stages, the most recently used ones.

    Attributes
    ----------
    most_bytes
        Largest size of the arrays in all results together; beyond it the oldest are dropped. But results of
        the present use of `active`, and of the last one that succeeded, stay: otherwise a large model would
        be recomputed each time.
    ran
        The stages that ran last, in the order in which they ended: recalled results are not listed.
    """

    def __init__(self, most_bytes: int = 2**28) -> None:
        self.most_bytes = most_bytes
        self.ran: deque[Ran] = deque(maxlen=_TOLD)
        self._lock = Lock()
        self._results: OrderedDict[Hashable, _Result] = OrderedDict()
        self._holders: dict[int, int] = {}  # number of results that hold an array
        self._bytes = 0
        self._uses = self._whole = 0  # of `active`: number of uses, and number of the last that succeeded

    @contextmanager
    def active(self) -> Iterator[None]:
        """Keep results of all stages that run in a block, in this thread."""
        self._uses += 1
        own, token = self._uses, _active.set(self)
        try:
            yield
            self._whole = own
        finally:
            _active.reset(token)
            self.trim()

    def result(
        self,
        name: str,
        inputs: tuple[Hashable, ...],
        make: Callable[[], Value],
        files: Callable[..., Iterable[str]] | None = None,
    ) -> Value:
        """Return the kept result of a stage for the same inputs and files; otherwise call it."""
        key = _Key((name, *inputs))
        while True:
            with self._lock:
                found = self._results.get(key)
                if found is None or found.files != _states(name for name, *_ in found.files):
                    if found is not None:
                        self._count(found.arrays or {}, -1)
                    own = self._results[key] = _Result(used=self._uses)
                    break
                found.used = self._uses
                self._results.move_to_end(key)
            while not found.ready.wait(0.005):
                check_cancelled()
            if not found.failed:
                value: Value = found.value
                return value
        within, start = _Nested(), time.perf_counter()
        token = _nested.set(within)
        try:
            own.value = made = make()
            own.files = () if files is None else _states(files(made))
            spent = time.perf_counter() - start
            self.ran.append(Ran(name, spent - within.seconds))
            return made
        except BaseException:
            own.failed = True
            with self._lock:
                if self._results.get(key) is own:
                    del self._results[key]
            raise
        finally:
            own.ready.set()
            _nested.reset(token)
            if (outer := _nested.get()) is not None:
                outer.seconds += time.perf_counter() - start

    @property
    def bytes(self) -> int:
        """Size of the arrays in the measured results; shared arrays count once."""
        with self._lock:
            return self._bytes

    def trim(self) -> None:
        """Measure new results, and drop the oldest while all exceed `most_bytes`, see there."""
        with self._lock:
            new = [one for one in self._results.values() if one.arrays is None and one.ready.is_set()]
        found = [(one, _arrays(one.value)) for one in new]
        with self._lock:
            for one, arrays in found:
                if one.arrays is None:
                    one.arrays = arrays
                    self._count(arrays, 1)
            dropped = self._bytes > self.most_bytes and self._drop_oldest()
        if dropped:
            give_back_memory()

    def _drop_oldest(self) -> bool:
        before = len(self._results)
        for key, one in list(self._results.items()):
            if self._bytes <= self.most_bytes:
                break
            if one.ready.is_set() and one.used not in (self._uses, self._whole):
                del self._results[key]
                self._count(one.arrays or {}, -1)
        return len(self._results) < before

    def _count(self, arrays: Mapping[int, int], by: int) -> None:
        # Records that `by` more results hold these arrays.
        for place, size in arrays.items():
            now = self._holders.get(place, 0) + by
            self._bytes += size * ((now > 0) - (now > by))
            if now:
                self._holders[place] = now
            else:
                del self._holders[place]

    def __len__(self) -> int:
        return len(self._results)


def _states(files: Iterable[str]) -> tuple[tuple[str, int, int], ...]:
    """Return name, size and time of files; both are −1 for missing files."""
    found = []
    for name in files:
        try:
            state = os.stat(name)
        except OSError:
            found.append((name, -1, -1))
        else:
            found.append((name, state.st_size, state.st_mtime_ns))
    return tuple(found)


@contextmanager
def keeping() -> Iterator[None]:
    """Keep results in a block, unless they are kept already: repeated requests are computed once."""
    if _active.get() is not None:
        yield
        return
    with Stages().active():
        yield


class _Key:
    """A name and inputs; its hash is computed once, because there may be thousands of them."""

    __slots__ = ("_hash", "_inputs")

    def __init__(self, inputs: tuple[Hashable, ...]) -> None:
        self._inputs, self._hash = inputs, hash(inputs)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Key) and self._inputs == other._inputs


class _Same:
    """Represents an object in a key, which holds it: equal only to itself."""

    __slots__ = ("value",)

    def __init__(self, value: object) -> None:
        self.value = value

    def __hash__(self) -> int:
        return id(self.value)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.value is other.value


def _compared(value: Any) -> Hashable:
    """Return a key for an argument."""
    if isinstance(value, _PLAIN):
        return type(value), value  # 1, 1.0 and True are equal
    if isinstance(value, np.generic):
        return type(value), value.item()
    if isinstance(value, os.PathLike):
        return type(value), os.fspath(value)
    if isinstance(value, (tuple, list)):
        return (type(value), *(_compared(each) for each in value))
    if isinstance(value, dict):
        return (dict, *((name, _compared(each)) for name, each in value.items()))
    if is_dataclass(value) and not isinstance(value, type) and type(value).__eq__ is not object.__eq__:
        return (type(value), *(_compared(getattr(value, entry.name)) for entry in fields(value)))
    return _Same(value)


def _arrays(value: Any) -> dict[int, int]:
    """Return identity and bytes of each array and text in something made of dataclasses, tuples and dicts."""
    found: dict[int, int] = {}
    seen: set[int] = set()
    left = [value]
    while left:
        one = left.pop()
        kind = type(one)
        if kind in _SMALL or id(one) in seen:
            continue
        seen.add(id(one))
        if isinstance(one, np.ndarray):
            if isinstance(one.base, np.ndarray):
                left.append(one.base)
            else:
                found[id(one)] = one.nbytes
        elif isinstance(one, (bytes, str)):
            found[id(one)] = len(one)
        elif isinstance(one, dict):
            left.extend(one.values())
        elif isinstance(one, (tuple, list, set, frozenset)):
            left.extend(one)
        else:
            left.extend(getattr(one, "__dict__", {}).values())  # includes values that are computed later
            left.extend(getattr(one, name, None) for name in _slots(cast(Hashable, kind)))
    return found


@functools.cache
def _slots(kind: Hashable) -> tuple[str, ...]:
    return tuple(name for each in getattr(kind, "__mro__", ()) for name in getattr(each, "__slots__", ()))
