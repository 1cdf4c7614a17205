"""What a first run compiles: README's commands, each in a process of its own, with an empty kernel cache.

First as users meet it, with helpers side by side: seconds until the first command is done, and until
``upholster warm`` has compiled everything. Then one kernel after another, without helpers, to see what each
function costs: processor time, which hardly changes with what else the machine does.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.measure import Results

__all__ = ["COMMANDS", "compile_time"]

EXAMPLES = Path(__file__).parent.parent / "examples"
BRICKS, MATERIAL = str(EXAMPLES / "bricks.png"), str(EXAMPLES / "bricks_material")

COMMANDS = {
    "ring, GLB and picture": (
        f"cover {BRICKS} --on cyclide --texels 4M --sample-size 5 --direction around:z --seed 3 "
        "--view 150,32 -o ring.glb -o ring.png"
    ),
    "vase, GLB and picture": f"cover {BRICKS} --on vase -o vase.glb -o vase.png",
    "torus, direction": (
        f"cover {BRICKS} --on torus:R=2,r=0.7 --sample-size 0.5 --direction around:z -o torus.glb"
    ),
    "material": f"cover {MATERIAL} --on torus:R=2,r=0.9 --sample-size 2.5 -o torus.glb",
    "material, stream": f"cover {MATERIAL} --on vase -o vase.glb -o vase.uph",
    "flat": f"cover {BRICKS} --on plane --texels 512x512 -o larger.png",
    "tile": f"cover {BRICKS} --on plane --texels 512x512 --tileable -o tile.png",
    "stream": f"cover {BRICKS} --on cyclide -o ring.uph",
    "refine": "refine ring.uph -o cut.glb -o cut.png",
    "info": "info ring.uph",
    "levels": "levels ring.uph -o levels.png",
    "encode": f"encode {BRICKS} -o photo.ezw --bytes 20k",
    "encode, lossless": f"encode {BRICKS} -o lossless.ezw --sample-quality lossless",
    "decode": "decode photo.ezw -o back.png",
    "paper": f"cover {BRICKS} --on cyclide --method paper -o paper.glb -o paper.uph",
    "measure": "measure ring.uph",
}
"""Name and arguments, in an order in which files are written before they are read."""


def compile_time(results: Results) -> None:
    """Time the first run, and table what all commands compile one after another with one cache."""
    for name, arguments, aim in (
        ("the README's first command, first run ever", COMMANDS["ring, GLB and picture"], "at most 20"),
        ("upholster warm", "warm", "at most 40"),
    ):
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            _run(["-m", "upholster", *arguments.split()], folder)
            results.add(f"compile: {name}", time.perf_counter() - start, "s", aim=aim)
    lines: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        trace = Path(folder, "trace.jsonl")
        for name, arguments in COMMANDS.items():
            _run(["-m", "benchmarks.compile_trace", str(trace), *arguments.split()], folder)
            compiled = [json.loads(line) for line in trace.read_text().splitlines()]
            trace.unlink()
            cpu = sum(line["cpu"] for line in compiled if line["kernel"])
            results.add(f"compile: {name}", cpu, "s of CPU", remark=f"{len(compiled)} functions")
            lines += compiled
    total = sum(line["cpu"] for line in lines if line["kernel"])
    results.add("compile: all commands of the README", total, "s of CPU")
    _show(lines)


def _run(arguments: list[str], folder: str) -> None:
    path = os.pathsep.join([str(EXAMPLES.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    subprocess.run(
        [sys.executable, *arguments],
        check=True,
        capture_output=True,
        cwd=folder,
        env={**os.environ, "NUMBA_CACHE_DIR": f"{folder}/kernels", "PYTHONPATH": path},
    )


def _show(lines: list[dict[str, Any]]) -> None:
    # By what each function costs by itself, without what it calls; with what it calls beside that.
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for line in lines:
        groups[line["function"]].append(line)
    table = Table("function", "times", "signatures", "own s", "with callees, s")
    ranked = sorted(groups.items(), key=lambda item: -sum(line["own_cpu"] for line in item[1]))
    for name, found in ranked:
        own = sum(line["own_cpu"] for line in found)
        if own >= 0.1:
            table.add_row(
                ("[bold]" if any(line["kernel"] for line in found) else "") + name,
                str(len(found)),
                str(len({line["arguments"] for line in found})),
                f"{own:.2f}",
                f"{sum(line['cpu'] for line in found):.2f}",
            )
    Console(width=110).print(table)
