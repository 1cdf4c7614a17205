"""How hot loops are compiled: by decorators, so that every kernel obeys the same rules.

Kernels release the interpreter lock (threads run them side by side, see `upholster.parallel`), are cached on
disk (see `upholster.kernel_cache`), never use fast-math, and get no automatic parallelism: the same call
gives the same bits on any machine.

Python calls kernels only. What is `shared` or `inline` has no entry for Python: its function is `py_func`.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar, cast

import numba
from numba.core.dispatcher import Dispatcher
from numba.core.types.misc import unliteral

from upholster.kernel_cache import KernelCache

__all__ = ["allocating_kernel", "inline", "kernel", "shared", "spliced"]

Function = TypeVar("Function", bound=Callable[..., Any])

# Nobody calls kernels from C: without that entry they compile faster.
_RULES: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def kernel(function: Function) -> Function:
    """Compile `function` with Numba at its first call and keep the machine code on disk; it makes no arrays.

    Whoever calls a kernel holds its arrays, so nothing counts references to them: that takes time in every
    function called, and a third of compiling.
    """
    return cast(Function, _cached(_compiled(function, _nrt=False)))


def allocating_kernel(function: Function) -> Function:
    """Like `kernel`, for those that make arrays; what they call makes none."""
    return cast(Function, _cached(_compiled(function)))


def shared(function: Function) -> Function:
    """Like `kernel`, for what only other kernels call: kept on disk, so that each of them loads it."""
    return cast(Function, _cached(_compiled(function, _nrt=False, no_cpython_wrapper=True)))


def inline(function: Function) -> Function:
    """Like `shared`, for small functions: compiled together with each kernel that calls them."""
    return cast(Function, _compiled(function, _nrt=False, no_cpython_wrapper=True))


def spliced(function: Function) -> Function:
    """Like `inline`, but copied into its caller: for what is called at one place with many arrays."""
    return cast(Function, _compiled(function, inline="always"))


def _compiled(function: Callable[..., Any], **more: Any) -> Any:
    compiled: Any = numba.njit(**_RULES, **more)(function)
    if isinstance(compiled, Dispatcher):  # with NUMBA_DISABLE_JIT it is the function itself
        compiler = vars(compiled)["_compiler"]
        compiler.fold_argument_types = partial(_folded, compiler.pysig)
    return compiled


def _folded(signature: Any, arguments: Any, keywords: Any) -> tuple[Any, tuple[Any, ...]]:
    # Numba compiles a function again for each constant that it is called with. Here a constant is a number
    # like any other.
    bound = signature.bind(*arguments, **keywords)
    return signature, tuple(unliteral(kind) for kind in bound.args)


def _cached(compiled: Any) -> Any:
    if isinstance(compiled, Dispatcher):
        KernelCache.attach(compiled)
    return compiled
