"""The command line run in the test's own process: to start another takes a second, for each of many cases."""

import os
import signal
import sys
from contextlib import ExitStack, chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from unittest.mock import patch

from upholster.apps import cli


@dataclass(frozen=True)
class Done:
    """What a command leaves: its exit status and what it said."""

    returncode: int
    stdout: str
    stderr: str


def run_cli(*arguments: object, cwd: Path | None = None) -> Done:
    """Run ``upholster`` with these arguments, in folder `cwd`, as `upholster.apps.cli.main` runs it.

    An exception that `main` did not foresee fails the test that calls.
    """
    out, err = StringIO(), StringIO()
    handler = signal.getsignal(signal.SIGTERM)
    try:
        with ExitStack() as during:
            if cwd is not None:
                during.enter_context(chdir(cwd))
            during.enter_context(patch.object(sys, "argv", ["upholster", *map(str, arguments)]))
            during.enter_context(patch.object(os, "_exit", _leave))
            # Kernels are compiled before the tests begin (conftest.py), not by helpers of each command.
            during.enter_context(patch("upholster.runtime.warm.jobs_for", lambda *_: []))
            during.enter_context(redirect_stdout(out))
            during.enter_context(redirect_stderr(err))
            cli.main()
    except SystemExit as end:
        assert "fault of upholster" not in err.getvalue(), err.getvalue()
        return Done(int(str(end.code)), out.getvalue(), err.getvalue())
    finally:
        signal.signal(signal.SIGTERM, handler)
    raise AssertionError("main() came back: it ends the process")


def _leave(status: int) -> None:
    raise SystemExit(status)


def assert_one_line(done: Done, named: str = "") -> None:
    """Bad input is one line on stderr, which names what is wrong, and exit status 2."""
    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert done.stderr.startswith("upholster: ")
    assert named in done.stderr
