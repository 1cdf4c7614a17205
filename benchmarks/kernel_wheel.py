"""Make and test a wheel for this platform that holds the machine code of all kernels.

``python -m benchmarks.kernel_wheel DIST``. From the wheel, the first command compiles nothing. The code fits
one minor version of Python, one release of Numba, and x86 processors with AVX2; anything else compiles, as
from the wheel for all platforms. Needs `wheel`.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path
from sysconfig import get_platform

__all__ = ["main"]

ROOT = Path(__file__).parent.parent
COMMAND = ("cover", "sample:bricks", "--on", "cyclide", "--texels", "200k", "-o", "ring.glb")
PLATFORMS = {"linux-x86_64": "manylinux_2_28_x86_64", "win-amd64": "win_amd64"}
"""Tags by platform. Machine code calls no C library by version: the tag is that of Numba's own wheels."""


def main() -> int:
    """Run as a program; status 1 if the wheel's first command compiles."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.kernel_wheel", description=__doc__)
    parser.add_argument("dist", type=Path, help="the folder that gets the wheel")
    dist = parser.parse_args().dist.resolve()
    if get_platform() not in PLATFORMS:
        parser.error(f"platform is {get_platform()}; allowed: {', '.join(PLATFORMS)}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wheel = _with_kernels(_plain_wheel(folder), folder)
        dist.mkdir(parents=True, exist_ok=True)
        shutil.copy(wheel, dist)
        seconds, compiled = _first_command(wheel, folder / "fresh")
        size = wheel.stat().st_size / 1e6
    print(f"{dist / wheel.name}: {size:.1f} MB; first command {seconds:.1f} s, {compiled} kernels compiled")
    return int(compiled > 0)


def _plain_wheel(folder: Path) -> Path:
    _run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder / "plain", ROOT)
    return next((folder / "plain").glob("*.whl"))


def _with_kernels(plain: Path, folder: Path) -> Path:
    """Return the wheel with the files that ``upholster warm`` leaves when it is installed."""
    program, kernels = _installed(plain, folder / "plain-venv"), folder / "kernels"
    kernels.mkdir()
    _run(program, "warm", NUMBA_CACHE_DIR=kernels)
    _wheel("unpack", plain, "-d", folder / "unpacked")
    (unpacked,) = (folder / "unpacked").iterdir()
    compiled = unpacked / "upholster" / "runtime" / "compiled"
    compiled.mkdir()
    for file in kernels.rglob("*.kernel"):
        shutil.copy(file, compiled)
    _wheel("pack", unpacked, "-d", folder)
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    tags = ("--python-tag", python, "--abi-tag", python, "--platform-tag", PLATFORMS[get_platform()])
    _wheel("tags", "--remove", *tags, folder / plain.name)
    return next(folder.glob("*.whl"))


def _first_command(wheel: Path, folder: Path) -> tuple[float, int]:
    """Return how long the first command takes in a new environment, and how many kernels it compiles."""
    program, kernels = _installed(wheel, folder), folder / "kernels"
    kernels.mkdir()
    start = time.perf_counter()
    _run(program, *COMMAND, cwd=folder, NUMBA_CACHE_DIR=kernels)
    return time.perf_counter() - start, len(list(kernels.rglob("*.kernel")))


def _installed(wheel: Path, folder: Path) -> Path:
    """Install a wheel into a new virtual environment; return the program."""
    venv.create(folder, with_pip=True)
    scripts = folder / ("Scripts" if os.name == "nt" else "bin")
    _run(scripts / "python", "-m", "pip", "install", "-q", wheel)
    return scripts / "upholster"


def _wheel(*arguments: object) -> None:
    _run(sys.executable, "-m", "wheel", *arguments)


def _run(*command: object, cwd: Path | None = None, **variables: Path) -> None:
    environment = {**os.environ, **{name: str(value) for name, value in variables.items()}}
    subprocess.run([str(word) for word in command], cwd=cwd, env=environment, check=True)


if __name__ == "__main__":
    sys.exit(main())
