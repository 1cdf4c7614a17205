"""Settings for all tests."""

import os

import pytest
from hypothesis import settings

# The first example of a test may compile kernels: how long it takes says nothing. The same few examples each
# time make the test command's answer depend on the code alone; `--hypothesis-profile random` looks further.
settings.register_profile("same", deadline=None, derandomize=True, max_examples=25)
settings.register_profile("random", deadline=None)
settings.load_profile("same")


# What a test reads, it reads anew: nothing of an earlier run.
os.environ["UPHOLSTER_CACHE"] = "off"


# Uses of the program, as `upholster/runtime/kernels.json` names them.
DECODING = ("refine paper", "refine material", "levels", "encode", "encode lossless", "decode")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile all kernels once, side by side, before several workers would each compile them."""
    several = getattr(session.config.option, "numprocesses", None)
    if not several or hasattr(session.config, "workerinput") or os.environ.get("NUMBA_DISABLE_JIT"):
        return
    from upholster.runtime.warm import compiling

    # With bounds checked only decoders run (.ci/run): kernels that lay quilts are not compiled for them.
    uses = DECODING if os.environ.get("NUMBA_BOUNDSCHECK") else None
    with compiling(uses) as compiler:
        if compiler is not None:
            compiler.wait()
