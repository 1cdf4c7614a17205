"""``upholster warm``: compile all kernels ahead of time."""

import os
import time

from upholster.apps.cli.console import Quiet, Threads, bars, say
from upholster.base.errors import InputError

__all__ = ["warm"]


def warm(threads: Threads = None, quiet: Quiet = False) -> None:
    """Compile all kernels for this machine now, for images and CI, instead of at their first use."""
    start = time.perf_counter()
    from upholster.runtime.kernel_cache import KernelCache
    from upholster.runtime.parallel import running
    from upholster.runtime.warm import compiling, jobs_for, missing

    jobs = jobs_for()
    caches = [getattr(job.dispatcher(), "_cache", None) for job in jobs]
    folders = {str(cache.cache_path) for cache in caches if isinstance(cache, KernelCache)}
    if not folders:
        raise InputError("no folder for kernels is writable and your own; set NUMBA_CACHE_DIR to one that is")
    with running(threads), compiling() as compiler, bars(quiet, compiler):
        if compiler is not None:
            compiler.wait()
    left = len(missing(jobs))
    if left:
        raise InputError(f"{left} of {len(jobs)} kernels could not be compiled")
    if not quiet:
        done = f"{len(jobs)} kernels are ready after {time.perf_counter() - start:.1f} s"
        say(f"{done}, kept in {os.path.commonpath(folders)}")
