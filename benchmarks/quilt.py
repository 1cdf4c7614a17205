"""Method "quilt": flat textures, the paper's cyclide from 1 to 16 Mtexels, and README's first command.

All figures are processor seconds of all threads and processes: other programs on the machine disturb them
less than the clock.
"""

import os
import subprocess
import sys
import tempfile
from typing import Any

import upholster
from benchmarks.measure import EXEMPLAR, Request, median_processor_seconds, one_pixel_a_texel, row
from benchmarks.peers import gmic_seconds, versions
from benchmarks.tables import Table

__all__ = ["measured"]


def measured(_request: Request) -> Table:
    """Time synthesis and painting together, G'MIC in the same run."""
    ours, peer = _flat(128, runs=15), gmic_seconds()
    remark = "" if peer is None else f"G'MIC: {peer:.2g} s, {peer / ours:.0f} times as long"
    rows = [
        row("flat, 128² → 512²", ours, "s", remark),
        row("flat, 1024² → 512²", _flat(1024, runs=7), "s"),
        *_cyclide(),
    ]
    seconds, peak = _first_command()
    remark = f"{peak / 1e9:.1f} GB of memory at most; GLB and picture written"
    rows.append(row("README's first command, 7.7 Mtexels, kernels compiled before", seconds, "s", remark))
    return Table(("what", "figure", "compared with"), rows, {"peers": versions("G'MIC")})


def _flat(side: int, *, runs: int) -> float:
    # Seconds for a flat texture of 512² from a sample of that side.
    exemplar, plane = upholster.read_exemplar(EXEMPLAR, resize=side), upholster.plane()

    def flat() -> None:
        made = upholster.synthesize(exemplar, plane, texels=(512, 512), seed=7)
        upholster.paint(made, exemplar)

    return median_processor_seconds(flat, runs=runs)


def _cyclide() -> list[list[str]]:
    rows = []
    exemplar, ring = upholster.read_exemplar(EXEMPLAR, resize=128), upholster.ring_cyclide(6, 2, 3)
    for texels in (2**20, 2**22, 2**24):
        options = one_pixel_a_texel(ring, exemplar, texels)

        def cover(options: dict[str, Any] = options) -> None:
            upholster.paint(upholster.synthesize(exemplar, ring, seed=7, **options), exemplar)

        seconds = median_processor_seconds(cover, runs=3 if texels <= 2**22 else 1)
        each = f"{1e9 * seconds / texels:.0f} ns a texel"
        rows.append(row(f"cyclide, 128² → {texels / 2**20:g} Mtexels", seconds, "s", each))
    return rows


def _first_command() -> tuple[float, float]:
    """Return processor seconds and the most bytes of memory of README's first command, at its second call."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable, "-m", "upholster", "cover", str(EXEMPLAR), "--on", "cyclide",
            "--sample-size", "2.5", "--direction", "around:z", "--seed", "3", "--view", "150,32",
            "-o", f"{folder}/ring.glb", "-o", f"{folder}/ring.png",
        ]  # fmt: skip
        for _ in range(2):
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            if process.returncode:
                raise subprocess.CalledProcessError(process.returncode, command)
    return used.ru_utime + used.ru_stime, 1024.0 * used.ru_maxrss
