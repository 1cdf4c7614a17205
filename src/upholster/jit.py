"""Compilation of hot loops: decorators, so that every kernel follows the same rules.

Kernels release the interpreter lock (threads run them side by side, see `upholster.parallel`), are cached on
disk (see `upholster.kernel_cache`), never use fast-math, and get no automatic parallelism: the same call
gives the same bits on any machine.

Python calls only kernels. A `shared` or `inline` function has no entry point for Python: use its `py_func`.
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

# No C code calls kernels: without the C entry point they compile faster.
_RULES: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def kernel(function: Function) -> Function:
    """Compile `function` with Numba at its first call and keep the machine code on disk; it makes no arrays.

    The caller of a kernel holds its arrays, so kernels count no references: counting takes time in every
    function called, and a third of the compilation time.
    """
    return cast(Function, _cached(_compiled(function, _nrt=False)))


def allocating_kernel(function: Function) -> Function:
    """Like `kernel`, for kernels that make arrays; the functions that they call make none."""
    return cast(Function, _cached(_compiled(function)))


def shared(function: Function) -> Function:
    """Like `kernel`, for functions that only kernels call: kept on disk, so that each kernel loads them."""
    return cast(Function, _cached(_compiled(function, _nrt=False, no_cpython_wrapper=True)))


def inline(function: Function) -> Function:
    """Like `shared`, for small functions: compiled together with each kernel that calls them."""
    return cast(Function, _compiled(function, _nrt=False, no_cpython_wrapper=True))


def spliced(function: Function) -> Function:
    """Like `inline`, but copied into its caller: for a function with many arrays and a single call."""
    return cast(Function, _compiled(function, inline="always"))


def _compiled(function: Callable[..., Any], **more: Any) -> Any:
    compiled: Any = numba.njit(**_RULES, **more)(function)
    if isinstance(compiled, Dispatcher):  # with NUMBA_DISABLE_JIT it is the plain function
        compiler = vars(compiled)["_compiler"]
        compiler.fold_argument_types = partial(_folded, compiler.pysig)
    return compiled


def _folded(signature: Any, arguments: Any, keywords: Any) -> tuple[Any, tuple[Any, ...]]:
    # Numba compiles a function again for each constant argument. Here a constant is treated like any other
    # number.
    bound = signature.bind(*arguments, **keywords)
    return signature, tuple(unliteral(kind) for kind in bound.args)


def _cached(compiled: Any) -> Any:
    if isinstance(compiled, Dispatcher):
        KernelCache.attach(compiled)
    return compiled
