"""How hot loops are compiled: one decorator, so that every kernel obeys the same rules.

Kernels release the interpreter lock (threads run them side by side, see `upholster.parallel`), are cached on
disk (see `upholster.kernel_cache`), never use fast-math, and get no automatic parallelism: the same call
gives the same bits on any machine.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core.dispatcher import Dispatcher

from upholster.kernel_cache import KernelCache

__all__ = ["inline", "kernel", "shared", "spliced"]

Function = TypeVar("Function", bound=Callable[..., Any])

# Nobody calls kernels from C: without that entry they compile faster.
_RULES: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def kernel(function: Function) -> Function:
    """Compile `function` with Numba at its first call and keep the machine code on disk."""
    return cast(Function, _with_cache(numba.njit(**_RULES)(function)))


def shared(function: Function) -> Function:
    """Like `kernel`, for what only other kernels call: kept on disk, so that each of them loads it."""
    return cast(Function, _with_cache(numba.njit(**_RULES, no_cpython_wrapper=True)(function)))


def inline(function: Function) -> Function:
    """Like `shared`, for small functions: compiled together with each kernel that calls them."""
    return cast(Function, numba.njit(**_RULES, no_cpython_wrapper=True)(function))


def spliced(function: Function) -> Function:
    """Like `inline`, but copied into its caller: for what is called at one place with many arrays."""
    return cast(Function, numba.njit(**_RULES, inline="always")(function))


def _with_cache(compiled: Any) -> Any:
    if isinstance(compiled, Dispatcher):  # with NUMBA_DISABLE_JIT it is the function itself
        KernelCache.attach(compiled)
    return compiled
