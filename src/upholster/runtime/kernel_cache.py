"""Machine code of kernels on disk: one file per kernel and signature, safe for concurrent processes.

Numba's own cache keeps an index per function. Processes that compile at the same time lose or mix up entries
in it, and it does not notice when a function changes that a kernel calls. Here a file's name identifies its
content: the kernel, a digest of all its sources, and a digest of its signature and machine. So a folder may
serve several versions and copies of the program. A file begins with a checksum: a damaged file is deleted,
and its kernel compiled again. Folders and files of other users are not used: see `_Files.is_trusted`.

A wheel for one platform holds such files, too, in `SHIPPED`: from it, the first command compiles nothing.
"""

import hashlib
import os
import pickle
import re
import secrets
import warnings
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache, partial
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any

import numba
from llvmlite.binding import parse_assembly, parse_bitcode
from numba.core import config
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

from upholster._version import __version__
from upholster.runtime.ownership import belongs

__all__ = ["SHIPPED", "KernelCache", "kernel_name"]

SHIPPED = Path(__file__).with_name("compiled")
"""The kernels of a wheel for this platform, read only; absent in other installations."""

_ROOT = Path(__file__).parents[1]

_ADMINISTRATOR = 0

_KEPT = 8
"""Number of versions of a kernel that a folder keeps: the most recently used ones."""
_IMPORT = re.compile(r"^\s*from upholster([\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)


def kernel_name(function: Callable[..., Any]) -> str:
    """Return a kernel's name, ``codec._coder_kernels.code_planes``."""
    return f"{function.__module__.removeprefix('upholster.')}.{function.__name__}"


class KernelCache(FunctionCache):  # type: ignore[misc]  # numba is untyped
    """A kernel's machine code on disk.

    If another process is compiling a kernel for this one (see `upholster.runtime.warm`) and its code is not
    there yet, `waiting` is called with the kernel's name. It returns when the code is there, or will not
    come.
    """

    waiting: Callable[[str], None] | None = None

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._is_linked = False  # whether only other kernels call it
        locator = self._impl.locator
        if config.CACHE_DIR:  # a folder named by the user holds all kernels, wherever the sources are
            locator._cache_path = config.CACHE_DIR
        folder = Path(locator.get_cache_path())
        self._cache_file = _Files(folder, kernel_name(function), Path(locator._py_file))
        if not self._cache_file.is_trusted(folder):
            _report_other_user(folder)
            raise RuntimeError("the folder belongs to another user")

    @classmethod
    def attach(cls, dispatcher: Dispatcher) -> None:
        """Give a kernel its cache, unless no folder is writable, or it is another user's."""
        with suppress(RuntimeError):
            cache = vars(dispatcher)["_cache"] = cls(dispatcher.py_func)
            cache._is_linked = "no_cpython_wrapper" in dispatcher.targetoptions

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
        # Numba's own way starts by loading the whole compiler: half a second. Code that exists needs only the
        # reference counting; a process that compiles loads the rest.
        rtsys.initialize(target)
        key = self._index_key(arguments, target.codegen())
        try:
            data = self._cache_file.load(key)
            return None if data is None else self._rebuilt(data, target)
        except Exception:  # a damaged file may raise anything
            self._cache_file.damaged(key)
            return None

    def _rebuilt(self, data: Any, target: Any) -> Any:
        (name, kind, (code, bitcode)), description, *more = data
        if self._is_linked:
            return self._impl.rebuild(target, data)
        # Numba's own way parses the bitcode, just to list the functions in it: half of the time for loading.
        # Here it is parsed if the kernel is compiled into another one.
        target.codegen()._engine._defined_symbols.add(description.llvm_cpython_wrapper_name)
        result = self._impl.rebuild(target, ((name, kind, (code, _no_bitcode())), description, *more))
        result.library._get_module_for_linking = lru_cache(partial(parse_bitcode, bitcode))
        return result


class _Files:
    """The files that Numba's cache reads and writes, by keys made of signature and machine."""

    def __init__(self, folder: Path, kernel: str, source: Path) -> None:
        self._folder, self._kernel, self._source = folder, kernel, source

    def has(self, key: Any) -> bool:
        return self._existing(key) is not None

    def is_trusted(self, path: Path) -> bool:
        """Whether a path belongs to this user, the administrator, or the owner of the program's sources.

        Other users could have it run anything; these can anyway. A path that does not exist is no danger.
        """
        try:
            return belongs(path, _ADMINISTRATOR, self._source.stat().st_uid)
        except OSError:
            return not path.exists()

    def load(self, key: Any) -> Any:
        path = self._existing(key)
        if path is None:
            return None
        try:
            written = path.read_bytes()
        except OSError:
            return None
        if zlib.crc32(written[4:]) != int.from_bytes(written[:4], "little") or len(written) <= 4:
            raise ValueError("the checksum differs")
        with suppress(OSError):  # mark as used now
            os.utime(path)
        return pickle.loads(written[4:])

    def damaged(self, key: Any) -> None:
        _report_damage(self._folder)
        with suppress(OSError):
            self._path(key).unlink()

    def save(self, key: Any, data: Any) -> None:
        path = self._path(key)
        temporary = path.with_suffix(f".{secrets.token_hex(4)}")
        written = dumps(data)
        with suppress(OSError):  # a full disk only costs time
            with open(temporary, "wb") as file:
                file.write(zlib.crc32(written).to_bytes(4, "little") + written)
                file.flush()
                os.fsync(file.fileno())  # before the renaming: otherwise a crash may leave an empty file
            os.replace(temporary, path)
        self._forget_old()

    def flush(self) -> None:
        for path in self._all():
            path.unlink(missing_ok=True)

    def _all(self) -> list[Path]:
        return list(self._folder.glob(f"{self._kernel}.*.*.*"))

    def _forget_old(self) -> None:
        used: dict[str, float] = {}
        for path in self._all():
            with suppress(OSError):  # another process has deleted it
                stamp = path.name.removeprefix(self._kernel).split(".")[1]
                used[stamp] = max(used.get(stamp, 0.0), path.stat().st_mtime)
        kept = sorted(used, key=lambda stamp: used[stamp])[-_KEPT:]
        for path in self._all():
            if path.name.removeprefix(self._kernel).split(".")[1] not in kept:
                with suppress(OSError):  # as above, or it is being read
                    path.unlink()

    def _existing(self, key: Any) -> Path | None:
        name = self._path(key).name
        for path in (self._folder / name, SHIPPED / name):
            if path.exists() and self.is_trusted(path):
                return path
        return None

    def _path(self, key: Any) -> Path:
        return self._folder / f"{self._kernel}.{self._stamp()}.{_digest(str(key).encode())}.kernel"

    def _stamp(self) -> str:
        # The suffix tells Python's minor version and binary interface. Whether bounds checks are compiled in:
        # Numba's own key leaves that out.
        machine = (__version__, numba.__version__, EXTENSION_SUFFIXES[0])
        return _stamp(self._source, *machine, str(config.BOUNDSCHECK), str(config.OPT))


@lru_cache
def _report_other_user(folder: Path) -> None:
    warnings.warn(
        f"compiled kernels in {folder} are not used: the folder belongs to another user. They are compiled "
        "at each start, unless NUMBA_CACHE_DIR names your own",
        RuntimeWarning,
        2,
    )


@lru_cache
def _report_damage(folder: Path) -> None:
    warnings.warn(f"compiled kernels in {folder} were damaged; they are compiled again", RuntimeWarning, 2)


@lru_cache
def _no_bitcode() -> bytes:
    bitcode: bytes = parse_assembly("").as_bitcode()
    return bitcode


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


@lru_cache
def _stamp(path: Path, *more: str) -> str:
    # Covers all sources of the package that a module depends on, directly or not: constants and inlined
    # functions are compiled in.
    seen, waiting = {path}, [path] if path.exists() else []
    while waiting:
        fresh = _imported(waiting.pop()) - seen
        seen |= fresh
        waiting += fresh
    digest = hashlib.sha256("\n".join(more).encode())
    for source in sorted(source for source in seen if source.exists()):
        digest.update(hashlib.sha256(source.read_bytes()).digest())
    return digest.hexdigest()[:16]


@lru_cache
def _imported(path: Path) -> set[Path]:
    # Files of the package that a source imports from; for `from a import b` both a and, if it is a module, b.
    found = set()
    for parts, names in _IMPORT.findall(path.read_text(encoding="utf-8")):
        place = _ROOT.joinpath(*filter(None, parts.split(".")))
        for candidate in (place, *(place / name for name in re.findall(r"\w+", names))):
            for file in (candidate.with_suffix(".py"), candidate / "__init__.py"):
                if file.exists():
                    found.add(file)
    return found
