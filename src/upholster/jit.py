"""How hot loops are compiled: one decorator, so that every kernel obeys the same rules.

Kernels release the interpreter lock (threads run them side by side, see `upholster.parallel`), are cached on
disk, never use fast-math, and get no automatic parallelism: the same call gives the same bits on any machine.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core import event

__all__ = ["inline", "kernel", "on_first_compilation", "spliced"]

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile `function` with Numba at its first call and keep the machine code on disk."""
    return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def inline(function: Function) -> Function:
    """Like `kernel`, for small functions that only other kernels call: compiled into each of them."""
    return cast(Function, numba.njit(nogil=True, error_model="numpy")(function))


def spliced(function: Function) -> Function:
    """Like `inline`, but copied into its caller: for what is called at one place with many arrays."""
    return cast(Function, numba.njit(nogil=True, error_model="numpy", inline="always")(function))


def on_first_compilation(callback: Callable[[], None]) -> None:
    """Call `callback` once, when a kernel is compiled that the disk cache does not hold."""

    class Listener(event.Listener):  # type: ignore[misc]  # numba is untyped
        told = False

        def on_start(self, _event: object) -> None:
            if not self.told:
                self.told = True
                callback()

        def on_end(self, _event: object) -> None:
            pass

    event.register("numba:compile", Listener())
