"""Private parts of Numba that the program uses; where these tests pass on a newer one, the bound may rise."""

import copy
import inspect
import os
import re
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import llvmlite.binding
import numba
import numpy as np
import pytest
from numba.core import config

from upholster.runtime.jit import Kernel, by_type, inline, is_float, kernel, shared
from upholster.runtime.kernel_cache import KernelCache

ROOT = Path(__file__).parent.parent


def _release(text: str) -> tuple[int, ...]:
    """Return a release as numbers that compare: (0, 68) of ``0.68.1``."""
    return tuple(int(part) for part in text.split(".")[:2])


def test_numba_is_one_that_was_tried() -> None:
    """It tells when the bound may rise: alone it fails on a Numba beyond it that works."""
    found = re.search(r'"numba>=([\d.]+),<([\d.]+)"', (ROOT / "pyproject.toml").read_text("utf-8"))
    assert found, "pyproject.toml has no bound on numba"
    least, most = map(_release, found.groups())
    assert least <= _release(numba.__version__)
    assert _release(numba.__version__) < most, (
        f"Numba {numba.__version__} is beyond the bound in pyproject.toml, <{found[2]}; "
        "if all other tests pass, raise it"
    )


@pytest.mark.parametrize("decorator", [shared, inline])
def test_constants_are_numbers_like_others(decorator: Callable[..., Any]) -> None:
    """Numba's own way is a copy of the machine code for each constant that a kernel is called with."""

    @decorator
    def power(x: int, n: int) -> int:
        return x**n

    @kernel
    def both(x: int) -> int:
        return power(x, 2) + power(x, 3)

    assert both(5) == 150
    assert isinstance(power, Kernel)
    assert power.signatures == [(numba.int64, numba.int64)]


def test_a_function_that_is_inlined_has_no_machine_code_of_its_own() -> None:
    @inline
    def third(x: float) -> float:
        return x / 3

    @kernel
    def sixth(x: float) -> float:
        return third(x) / 2

    assert sixth(12.0) == 2
    (result,) = cast(Any, third).overloads.values()
    engine = result.target_context.codegen()._engine
    assert not engine.is_symbol_defined(result.fndesc.mangled_name)


def _ends(first: Any, last: Any) -> Any:
    """Choose what kernels compile, by type."""
    raise NotImplementedError


@by_type(_ends)
def _ends_by_type(first: Any, last: Any) -> Any:
    if is_float(first):
        return lambda first, last: first / last
    return lambda first, last: first * last


def test_a_kernel_is_compiled_by_the_types_of_its_arguments() -> None:
    @kernel
    def ends(first: Any, last: Any) -> Any:
        return _ends(first, last)

    assert (ends(8.0, 2.0), ends(8, 2)) == (4, 16)


def test_to_look_at_a_kernel_does_not_import_numba() -> None:
    @kernel
    def twice(value: int) -> int:
        """Return twice a value."""
        return 2 * value

    assert inspect.signature(twice) == inspect.signature(cast(Kernel, twice).py_func)
    assert twice.__doc__ == "Return twice a value."
    assert not hasattr(twice, "__test__")
    assert vars(twice)["_dispatcher"] is None
    assert copy.copy(twice)(2) == 4


def test_newer_x86_processors_run_the_same_code() -> None:
    @kernel
    def twice(value: int) -> int:
        return 2 * value

    if "NUMBA_CPU_NAME" in os.environ or not llvmlite.binding.get_host_cpu_features().get("avx2"):
        pytest.skip("kernels are compiled for another processor here")
    assert twice(4) == 8
    code = cast(Any, twice).dispatcher.targetctx.codegen()
    assert code.magic_tuple()[1:] == ("x86-64-v3", "")


def test_threads_that_call_a_kernel_at_once_get_the_same_one() -> None:
    @kernel
    def twice(value: int) -> int:
        return 2 * value

    barrier, found = threading.Barrier(8), []

    def call() -> None:
        barrier.wait()
        found.append((twice(4), id(cast(Kernel, twice).dispatcher)))

    threads = [threading.Thread(target=call) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    assert len(set(found)) == 1
    assert found[0][0] == 8


def test_machine_code_is_written_and_read_by_our_cache_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))

    def total(values: np.ndarray) -> float:
        found = 0.0
        for value in values:
            found += value
        return found

    for hits in (0, 1):  # the second kernel finds what the first has compiled
        compiled: Any = kernel(total)
        assert compiled(np.arange(4.0)) == 6
        cache = vars(compiled.dispatcher)["_cache"]
        assert isinstance(cache, KernelCache)
        assert sum(compiled.stats.cache_hits.values()) == hits
        assert cache.has((numba.float64[::1],), compiled.targetctx)
        assert not cache.has((numba.float32[::1],), compiled.targetctx)
        assert [path.suffix for path in tmp_path.rglob("*") if path.is_file()] == [".kernel"]


def test_kernels_of_a_wheel_are_loaded_and_not_written_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def half(value: float) -> float:
        return value / 2

    shipped, own = tmp_path / "shipped", tmp_path / "own"
    monkeypatch.setattr(config, "CACHE_DIR", str(shipped))
    assert kernel(half)(3.0) == 1.5
    monkeypatch.setattr(config, "CACHE_DIR", str(own))
    monkeypatch.setattr("upholster.runtime.kernel_cache.SHIPPED", shipped)
    loaded: Any = kernel(half)
    assert loaded(3.0) == 1.5
    assert sum(loaded.stats.cache_hits.values()) == 1
    assert not list(own.rglob("*.kernel"))


def test_bitcode_is_parsed_where_a_kernel_from_disk_is_compiled_into_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    parsed = []

    def parse(bitcode: bytes) -> Any:
        parsed.append(len(bitcode))
        return llvmlite.binding.parse_bitcode(bitcode)

    monkeypatch.setattr("upholster.runtime.kernel_cache.parse_bitcode", parse)

    def triple(value: float) -> float:
        return 3 * value

    assert kernel(triple)(1.0) == 3  # on disk from now on
    loaded: Any = kernel(triple)
    assert loaded(2.0) == 6
    assert sum(loaded.stats.cache_hits.values()) == 1
    assert not parsed

    def more(value: float) -> Any:
        return loaded(value) + 1

    assert kernel(more)(5.0) == 16
    assert len(parsed) == 1


@pytest.mark.skipif(os.name != "posix", reason="files have owners there")
def test_machine_code_of_strangers_is_not_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder
) -> None:
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    owners: dict[Path, int] = {}

    def owned(path: Path, *others: int) -> bool:
        return owners.get(path, 0) in (1000, *others)

    monkeypatch.setattr("upholster.runtime.kernel_cache.belongs", owned)

    def twice(value: float) -> float:
        return 2 * value

    first: Any = kernel(twice)
    assert first(3.0) == 6
    (file,) = tmp_path.glob("*.kernel")
    for owner, hits in ((1000, 1), (0, 1), (2000, 0)):
        owners[file] = owner
        other: Any = kernel(twice)
        assert other(3.0) == 6
        assert sum(other.stats.cache_hits.values()) == hits, owner
    owners[tmp_path] = 2000
    alone: Any = kernel(twice)
    assert alone(3.0) == 6
    assert not isinstance(vars(alone.dispatcher)["_cache"], KernelCache)
    (warning,) = recwarn.list
    assert "the folder belongs to another user" in str(warning.message)
