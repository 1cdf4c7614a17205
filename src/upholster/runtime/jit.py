"""Compilation of hot loops: decorators, so that every kernel follows the same rules.

Kernels release the interpreter lock (threads run them side by side, see `upholster.runtime.parallel`), are
cached on disk (see `upholster.runtime.kernel_cache`), never use fast-math, and get no automatic parallelism:
the same call gives the same bits on any machine. So all newer x86 processors run the same code.

Python calls only kernels. A `shared` or `inline` function has no entry point for Python: use its `py_func`.

Numba is imported when a kernel is first called: many commands need none, and would wait for it.
"""

from collections.abc import Callable
from functools import partial, update_wrapper
from threading import RLock
from typing import Any, TypeVar, cast

__all__ = ["Kernel", "allocating_kernel", "by_type", "inline", "is_float", "kernel", "shared", "spliced"]

Function = TypeVar("Function", bound=Callable[..., Any])

# No C code calls kernels: without the C entry point they compile faster.
_RULES: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}

_PROCESSOR = "x86-64-v3"
_FEATURES = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
"""What kernels are compiled for, where the processor has these features.

With AVX-512, LLVM 22 makes wrong code of a cut's last loop, which compares 32-bit and 8-bit numbers.
"""

_LOCK = RLock()
_choices: list[tuple[Callable[..., Any], Callable[..., Any]]] = []


def kernel(function: Function) -> Function:
    """Compile `function` with Numba at its first call and keep the machine code on disk; it makes no arrays.

    The caller of a kernel holds its arrays, so kernels count no references: counting takes time in every
    function called, and a third of the compilation time.
    """
    return cast(Function, Kernel(function, on_disk=True, _nrt=False))


def allocating_kernel(function: Function) -> Function:
    """Like `kernel`, for kernels that make arrays; the functions that they call make none."""
    return cast(Function, Kernel(function, on_disk=True))


def shared(function: Function) -> Function:
    """Like `kernel`, for functions that only kernels call: kept on disk, so that each kernel loads them."""
    return cast(Function, Kernel(function, on_disk=True, _nrt=False, no_cpython_wrapper=True))


def inline(function: Function) -> Function:
    """Like `shared`, for small functions: compiled together with each kernel that calls them."""
    return cast(Function, Kernel(function, on_disk=False, _nrt=False, no_cpython_wrapper=True))


def spliced(function: Function) -> Function:
    """Like `inline`, but copied into its caller: for a function with many arrays and a single call."""
    return cast(Function, Kernel(function, on_disk=False, inline="always"))


def by_type(function: Callable[..., Any]) -> Callable[[Function], Function]:
    """Let kernels that call `function` compile what the decorated one returns for the types of arguments."""

    def chosen_by(choose: Function) -> Function:
        _choices.append((function, choose))
        return choose

    return chosen_by


def is_float(kind: Any) -> bool:
    """Return whether a type that a function `by_type` gets is that of floats."""
    from numba import types

    return isinstance(kind, types.Float)


class Kernel:
    """A function that becomes Numba's `dispatcher` when it is first called, or compiled into another one.

    Numba compiles it into others as if it were its dispatcher, since it has the attributes of that.
    """

    def __init__(self, function: Callable[..., Any], *, on_disk: bool, **rules: Any) -> None:
        update_wrapper(self, function)
        self.py_func, self._on_disk, self._rules = function, on_disk, rules
        self._dispatcher: Any = None

    def __call__(self, *arguments: Any) -> Any:
        """Run it."""
        return (self._dispatcher or self.dispatcher)(*arguments)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # Python asks for some of any object, even of one that is not made yet
            raise AttributeError(name)
        return getattr(self.dispatcher, name)

    @property
    def dispatcher(self) -> Any:
        """Numba's function; with NUMBA_DISABLE_JIT the plain one."""
        with _LOCK:
            if self._dispatcher is None:
                self._dispatcher = _dispatcher(self.py_func, self._on_disk, self._rules)
        return self._dispatcher


def _dispatcher(function: Callable[..., Any], on_disk: bool, rules: dict[str, Any]) -> Any:
    import numba
    from numba.core.dispatcher import Dispatcher
    from numba.extending import overload

    from upholster.runtime.inlined_code import InlinedCompiler
    from upholster.runtime.kernel_cache import KernelCache

    _choose_processor(numba.core.config)
    while _choices:
        name, choose = _choices.pop()
        overload(name, strict=False)(choose)
    if not on_disk:
        rules = {"pipeline_class": InlinedCompiler, **rules}
    compiled: Any = numba.njit(**_RULES, **rules)(function)
    if isinstance(compiled, Dispatcher):
        compiler = vars(compiled)["_compiler"]
        compiler.fold_argument_types = partial(_folded, compiler.pysig)
        if on_disk:
            KernelCache.attach(compiled)
    return compiled


def _choose_processor(config: Any) -> None:
    # Without effect if another program in this process has compiled with Numba before.
    from llvmlite.binding import get_host_cpu_features

    if config.CPU_NAME is None and config.CPU_FEATURES is None:
        features = get_host_cpu_features()
        if all(features.get(name) for name in _FEATURES):
            config.CPU_NAME, config.CPU_FEATURES = _PROCESSOR, ""


def _folded(signature: Any, arguments: Any, keywords: Any) -> tuple[Any, tuple[Any, ...]]:
    # Numba compiles a function again for each constant argument. Here a constant is treated like any other
    # number.
    from numba.core.types.misc import unliteral

    bound = signature.bind(*arguments, **keywords)
    return signature, tuple(unliteral(kind) for kind in bound.args)
