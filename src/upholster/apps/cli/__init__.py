"""The command line.

Heavy imports wait until a command needs them: ``upholster --help`` answers immediately.

- One module for each command: `batch`, `cover`, `fill`, `measure`, `picture`, `prepare`, `studio`, `warm`,
  `web`; `serve` has `view` as well, `codec` has `encode` and `decode`, `stream` has `refine` and `levels`
- `upholster info`: `model_info`, `cad_info`, `project_info`, `surface_info`, and `stream`
- `command`, `command_options`: a command's checks, and its options from a dataclass
- `console`: errors, numbers and progress bars on the terminal; `batch_table`: the progress of a batch
"""

import errno
import gc
import os
import signal
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from types import FrameType
from typing import Annotated, NoReturn

import typer

from upholster._version import __version__
from upholster.apps.cli.batch import batch
from upholster.apps.cli.codec import decode, encode
from upholster.apps.cli.command import Command
from upholster.apps.cli.cover import EXAMPLE, cover, surfaces
from upholster.apps.cli.fill import fill
from upholster.apps.cli.measure import measure
from upholster.apps.cli.picture import picture
from upholster.apps.cli.prepare import prepare
from upholster.apps.cli.serve import serve, view
from upholster.apps.cli.stream import info, levels, refine
from upholster.apps.cli.studio import studio
from upholster.apps.cli.warm import warm
from upholster.apps.cli.web import web
from upholster.base.errors import StoppedError, UpholsterError, printable

__all__ = ["app", "main", "run_words"]

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of writing to standard output: no space left, or the device is gone."""

app = typer.Typer(
    name="upholster",
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def main() -> NoReturn:
    """Run the command line; bad input is one line on stderr and exit status 2, Ctrl-C is 130."""
    _open_standard_files()
    _start_quickly()
    for name in ("SIGTERM", "SIGHUP"):  # Windows has no SIGHUP; nohup ignores it
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _interrupt)
    warnings.showwarning = _note
    if os.environ.get("NO_COLOR"):  # Typer's help would still be bold and dim
        os.environ["_TYPER_FORCE_DISABLE_TERMINAL"] = "1"
    try:
        # Without any argument, print the help. Typer returns an exit code instead of ending the process: 130
        # for Ctrl-C.
        status = app(sys.argv[1:] or ["--help"], standalone_mode=False) or 0
        sys.stdout.flush()
        if status == 130:
            _stop()
    except UpholsterError as error:
        status = _fail(str(error), status=130 if isinstance(error, StoppedError) else 2)
    except KeyboardInterrupt:
        status = _stop()
    except BrokenPipeError:
        # The reader has closed the pipe: `upholster info ring.uph | head -1`.
        status = 1
    except OSError as error:
        if error.filename is not None or error.errno not in _FULL:
            status = _unforeseen(error)
        else:
            status = _fail(f"standard output cannot be written: {error.strerror}", status=1)
    except Exception as error:
        # Typer's usage errors and aborts: click's classes may be vendored, so they are recognized by their
        # attributes.
        if hasattr(error, "format_message"):
            message = error.format_message()
            if message.startswith("No such command"):
                message = f"{message.rstrip('.')}; allowed: {', '.join(_COMMANDS)}"
            status = _fail(message)
        elif type(error).__name__ == "Abort":
            status = _stop()
        elif hasattr(error, "exit_code"):
            status = error.exit_code
        elif isinstance(error, MemoryError):
            status = _fail("not enough memory; a smaller --texels, --size or sample needs less")
        else:
            status = _unforeseen(error)
    with suppress(OSError):
        sys.stderr.flush()
    # After Ctrl-C or an error, kernels may still be running on other threads: do not wait for them.
    os._exit(status)


def run_words(words: Sequence[str]) -> None:
    """Run a command in this process.

    Raises
    ------
    InputError, FormatError
        As the command raises them.
    """
    app(list(words), standalone_mode=False)


def _interrupt(_signal: int, _frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


def _start_quickly() -> None:
    # NumPy would start threads of BLAS, which take processor time while they wait. Our matrices are small.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Imports make several hundred thousand objects that stay: the garbage collector would scan them again and
    # again.
    gc.set_threshold(20_000)


def _open_standard_files() -> None:
    """Open closed standard files: otherwise a file of ours would take their number and be printed into."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
    sys.stdout = sys.stdout or open(1, "w", closefd=False)  # noqa: SIM115
    sys.stderr = sys.stderr or open(2, "w", closefd=False)  # noqa: SIM115


def _note(message: Warning | str, *_: object, **__: object) -> None:
    with suppress(OSError):
        print(printable("note: " + " ".join(str(message).split())), file=sys.stderr)


def _fail(message: str, *, status: int = 2) -> int:
    with suppress(OSError):  # if the message cannot be printed, the exit status still reports the error
        print(printable("upholster: " + " ".join(message.split())), file=sys.stderr)
    return status


def _unforeseen(error: Exception) -> int:
    """Report in one line that this is a fault of upholster, and the file with the details."""
    import platform
    import tempfile
    import traceback

    message = f"{type(error).__name__}: {error}"
    try:
        descriptor, place = tempfile.mkstemp(prefix="upholster-fault-", suffix=".txt", text=True)
        with open(descriptor, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(
                f"upholster {__version__}, Python {sys.version}, {platform.platform()}\n{sys.argv}\n\n"
            )
            file.writelines(traceback.format_exception(error))
    except OSError:
        return _fail(f"this is a fault of upholster, please report it: {message}", status=1)
    return _fail(f"this is a fault of upholster, please report it with the file {place}: {message}", status=1)


def _stop() -> int:
    return _fail("stopped, nothing written", status=130)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"upholster {__version__}")
        raise typer.Exit


@app.callback(epilog=EXAMPLE)
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    """Cover curved surfaces with texture from a small sample image."""


_COMMANDS = {
    function.__name__: function
    for function in (
        cover,
        picture,
        prepare,
        fill,
        surfaces,
        refine,
        info,
        levels,
        studio,
        view,
        serve,
        web,
        measure,
        batch,
        encode,
        decode,
        warm,
    )
}
for function in _COMMANDS.values():
    app.command(cls=Command, epilog=EXAMPLE if function is cover else None)(function)
