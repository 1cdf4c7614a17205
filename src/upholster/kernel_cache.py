"""Machine code of kernels on disk: one file per kernel and signature, safe for processes side by side.

Numba's own cache keeps an index per function, in which processes that compile at the same time lose or mix up
entries, and does not notice when a function changes that a kernel calls. Here a file's name says what it
holds: the kernel, a digest of all sources that the kernel is made of, and one of its signature and machine.
"""

import hashlib
import os
import pickle
import re
import secrets
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

from upholster._version import __version__

__all__ = ["KernelCache", "kernel_name"]

_ROOT = Path(__file__).parent
_IMPORT = re.compile(r"^\s*from upholster([\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


def kernel_name(function: Callable[..., Any]) -> str:
    """Return a kernel's name, ``codec._coder_kernels.code_planes``."""
    return f"{function.__module__.removeprefix('upholster.')}.{function.__name__}"


class KernelCache(FunctionCache):  # type: ignore[misc]  # numba is untyped
    """A kernel's machine code on disk.

    Where another process is compiling a kernel for this one (see `upholster.warm`), `waiting` is called with
    the kernel's name when its code is not there yet, and returns when it is, or will not be.
    """

    waiting: Callable[[str], None] | None = None

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._cache_file = _Files(Path(self._cache_path), self._impl.filename_base, self._impl.locator)

    @classmethod
    def attach(cls, dispatcher: Dispatcher) -> None:
        """Give a kernel its cache; it goes without where no folder can be written."""
        with suppress(RuntimeError):
            vars(dispatcher)["_cache"] = cls(dispatcher.py_func)

    def has(self, arguments: tuple[Any, ...], target: Any) -> bool:
        """Return whether the code for some types of arguments is on disk."""
        return self._cache_file.has(self._index_key(arguments, target.codegen()))

    def load_overload(self, arguments: Any, target: Any) -> Any:
        """Return the code for some types of arguments, or None."""
        found = self._loaded(arguments, target)
        if found is None and KernelCache.waiting is not None:
            KernelCache.waiting(kernel_name(self._py_func))
            found = self._loaded(arguments, target)
        return found

    def _loaded(self, arguments: Any, target: Any) -> Any:
        # Numba's own way begins by loading all that it compiles with: half a second. Code that is there needs
        # only what counts references, and whoever compiles loads the rest.
        rtsys.initialize(target)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(arguments, target)


class _Files:
    """What Numba's cache reads and writes, by keys made of signature and machine."""

    def __init__(self, folder: Path, base: str, locator: Any) -> None:
        self._folder, self._base, self._locator = folder, base, locator

    def has(self, key: Any) -> bool:
        return self._path(key).exists()

    def load(self, key: Any) -> Any:
        with suppress(OSError):
            return pickle.loads(self._path(key).read_bytes())
        return None

    def save(self, key: Any, data: Any) -> None:
        path = self._path(key)
        beside = path.with_suffix(f".{secrets.token_hex(4)}")
        with suppress(OSError):  # a full disk costs time, no more
            beside.write_bytes(dumps(data))
            os.replace(beside, path)
        current = f"{self._base}.{self._stamp()}."
        for old in self._folder.glob(f"{self._base}.*"):
            if not old.name.startswith(current):
                with suppress(OSError):  # another process was faster, or is reading it
                    old.unlink()

    def flush(self) -> None:
        for path in self._folder.glob(f"{self._base}.*"):
            path.unlink(missing_ok=True)

    def _path(self, key: Any) -> Path:
        return self._folder / f"{self._base}.{self._stamp()}.{_digest(str(key).encode())}.kernel"

    def _stamp(self) -> str:
        # Bounds checks are compiled in or not; Numba's own key does not say.
        machine = (__version__, numba.__version__, str(config.BOUNDSCHECK), str(config.OPT))
        return _stamp(Path(self._locator._py_file), *machine)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


@lru_cache
def _stamp(path: Path, *more: str) -> str:
    # Of all sources of the package that a module is made of, directly or not: constants and inlined functions
    # are compiled in.
    seen, waiting = {path}, [path] if path.exists() else []
    while waiting:
        fresh = _imported(waiting.pop()) - seen
        seen |= fresh
        waiting += fresh
    digest = hashlib.sha256("\n".join(more).encode())
    for source in sorted(filter(os.path.exists, seen)):
        digest.update(hashlib.sha256(source.read_bytes()).digest())
    return digest.hexdigest()[:16]


@lru_cache
def _imported(path: Path) -> set[Path]:
    # Files of the package that a source imports from; of `from a import b` both a and, if it is one, b.
    found = set()
    for parts, names in _IMPORT.findall(path.read_text(encoding="utf-8")):
        place = _ROOT.joinpath(*filter(None, parts.split(".")))
        for candidate in (place, *(place / name for name in re.findall(r"\w+", names))):
            for file in (candidate.with_suffix(".py"), candidate / "__init__.py"):
                if file.exists():
                    found.add(file)
    return found
