"""Compilation of functions that only become parts of kernels.

Numba optimizes each of them, and makes machine code that nobody runs; then it optimizes the kernel, with
these parts in it. Here only the kernel is optimized: that saves an eighth of the time for compilation.
"""

from types import SimpleNamespace
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

__all__ = ["InlinedCompiler"]


class InlinedCompiler(Compiler):  # type: ignore[misc]  # numba is untyped
    """Numba's compiler, which leaves its result to the kernels that are made of it."""

    def __init__(self, typing: Any, target: Any, library: Any, *more: Any) -> None:
        super().__init__(typing, target, library or _InlinedCode(target.codegen(), "inlined"), *more)


class _InlinedCode(JITCodeLibrary):  # type: ignore[misc]  # as above
    # There is no machine code whose environment could be set.
    codegen = SimpleNamespace(set_env=lambda *_: None)

    def finalize(self) -> None:
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = True
