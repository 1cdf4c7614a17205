"""Make ``src/upholster/runtime/kernels.json``: what kernels the commands need, their types and their seconds.

``python -m benchmarks.kernel_table`` runs every use of the program once, on little, with an empty cache. It
is to be run when a kernel is added or takes other arguments; a test says so.
"""

import gc
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from numba.core import event

import upholster.runtime.warm
from upholster.runtime.kernel_cache import KernelCache, kernel_name
from upholster.runtime.signatures import type_as_json
from upholster.runtime.warm import TABLE

__all__ = ["USES", "begin_record", "main"]

EXAMPLES = Path(__file__).parent.parent / "examples"
BRICKS, MATERIAL = EXAMPLES / "bricks.png", EXAMPLES / "bricks_material"
CHAIR = EXAMPLES / "chair.glb"
CURVED, FLAT = "--on cyclide --texels 100k", "--on plane --texels 256x256"
PICTURE = "-o p.png --size 160x120"

USES = {
    f"{method} {kind}": f"cover {sample} {where} {options} {name}"
    for method, sample, where, options in (
        ("quilt", BRICKS, CURVED, ""),
        ("quilt material", MATERIAL, CURVED, ""),
        ("quilt flat", BRICKS, FLAT, ""),
        ("quilt mesh", BRICKS, f"--on {CHAIR} --texels 100k", ""),
        ("quilt mesh material", MATERIAL, f"--on {CHAIR} --texels 100k", ""),
        ("paper", BRICKS, "--on cyclide", "--method paper --chart 128"),
        ("paper material", MATERIAL, "--on cyclide", "--method paper --chart 128"),
        ("pixel", BRICKS, "--on cyclide", "--method pixel --chart 32"),
        ("pixel material", MATERIAL, "--on cyclide", "--method pixel --chart 32"),
    )
    for kind, name in (
        ("model", "-o m.glb"),
        ("texels", "-o t.npz"),
        ("stream", f"-o {method.replace(' ', '-')}.uph"),
        ("picture", PICTURE),
    )
    if (method.split()[0], kind) != ("pixel", "stream")  # it has none
} | {
    "guides": f"cover {BRICKS} --on {CHAIR} --texels 100k --guide luminance=curvature "
    "--guide luminance=noise --put 20,20,64,64=0,0,0.5 --again height>0.7 -o m.glb",
    "displaced": f"cover {MATERIAL} {CURVED} --displace 0.1 -o m.stl",
    "refine model": "refine quilt.uph -o m.glb",
    "refine picture": f"refine quilt.uph {PICTURE}",
    "refine paper": f"refine paper.uph -o m.glb {PICTURE}",
    "refine material": f"refine quilt-material.uph -o m.glb {PICTURE}",
    "levels": "levels quilt.uph --size 80x64 -o levels.png",
    "info": "info quilt.uph",
    "info model": "info m.glb",
    "picture": f"picture m.glb {PICTURE}",
    "measure": "measure quilt.uph",
    "hints": f"prepare {BRICKS} -o sample.png",
    "prepare": f"prepare {BRICKS} -o sample.png --rectify 9,12 240,20 250,251 5,240",
    "encode": f"encode {BRICKS} -o photo.ezw --bytes 20k",
    "encode lossless": f"encode {BRICKS} -o lossless.ezw --sample-quality lossless",
    "decode": "decode photo.ezw -o back.png",
}
"""Name and arguments of each use, in an order in which files are written before they are read."""


class Recorder(event.Listener):  # type: ignore[misc]  # numba is untyped
    """What a process loads and compiles: a line of JSON for each kernel, when it is there."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("a", encoding="utf-8")
        self._open: list[dict[str, Any]] = []  # kernels and what is inlined into them, as they nest

    def on_start(self, _event: Any) -> None:
        """Begin a kernel or an inlined function."""
        self._open.append({"start": time.thread_time(), "apart": 0.0, "needs": []})

    def on_end(self, found: Any) -> None:
        """Write a kernel's line; what is inlined belongs to the kernel round it."""
        this = self._open.pop()
        dispatcher, arguments = found.data["dispatcher"], found.data["args"]
        cached = isinstance(dispatcher._cache, KernelCache)
        seconds = time.thread_time() - this["start"]
        if cached:
            self._write(dispatcher.py_func, arguments, seconds - this["apart"], this["needs"])
        if self._open:
            self._open[-1]["apart"] += seconds if cached else this["apart"]
            self._open[-1]["needs"] += [] if cached else this["needs"]

    def asked(self, cache: KernelCache, arguments: Any) -> None:
        """Note that a kernel is needed: by the command, or by the kernel that is being compiled."""
        if self._open:
            self._open[-1]["needs"].append(_key(cache._py_func, arguments))
        else:
            self._file.write(json.dumps({"used": _key(cache._py_func, arguments)}) + "\n")
            self._file.flush()

    def _write(self, function: Any, arguments: Any, seconds: float, needs: list[Any]) -> None:
        line = {"kernel": _key(function, arguments), "seconds": round(seconds, 2), "needs": needs}
        self._file.write(json.dumps(line) + "\n")
        self._file.flush()


def _key(function: Any, arguments: Any) -> list[Any]:
    return [kernel_name(function), [type_as_json(kind) for kind in arguments]]


def begin_record(path: Path) -> None:
    """Write to a file, from now on, the kernels that this process needs."""
    gc.disable()  # as in the helpers that will compile
    upholster.runtime.warm.jobs_for = lambda *_: []  # which have nothing to do here
    recorder = Recorder(path)
    event.register("numba:compile", recorder)
    load = KernelCache.load_overload

    def asked(cache: KernelCache, kinds: Any, target: Any) -> Any:
        recorder.asked(cache, kinds)
        return load(cache, kinds, target)

    KernelCache.load_overload = asked  # type: ignore[assignment, method-assign]  # heard


def _record(path: Path, arguments: list[str]) -> None:
    begin_record(path)
    from upholster.apps.cli import main as command

    sys.argv = ["upholster", *arguments]
    command()


def _table() -> dict[str, Any]:
    kernels: dict[str, dict[str, Any]] = {}
    uses: dict[str, list[str]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for use, arguments in USES.items():
            print(use, file=sys.stderr)
            record = Path(folder, "record.jsonl")
            record.unlink(missing_ok=True)
            subprocess.run(
                [sys.executable, "-m", "benchmarks.kernel_table", str(record), *arguments.split()],
                check=True,
                capture_output=True,
                cwd=folder,
                env={
                    **os.environ,
                    "NUMBA_CACHE_DIR": f"{folder}/kernels",
                    # Its own, or a model that another use has laid out would need no kernels.
                    "UPHOLSTER_CACHE": f"{folder}/cache-{len(uses)}",
                    "PYTHONPATH": os.pathsep.join(filter(None, sys.path)) + f":{EXAMPLES.parent}",
                },
            )
            uses[use] = []
            for line in map(json.loads, record.read_text().splitlines()):
                if "used" in line:
                    uses[use].append(json.dumps(line["used"]))
                else:
                    kernels.setdefault(json.dumps(line["kernel"]), line)
    order = {key: n for n, key in enumerate(kernels)}  # as they were ready: needs come first
    return {
        "kernels": [
            {
                "kernel": line["kernel"][0],
                "seconds": line["seconds"],
                "needs": sorted({order[json.dumps(need)] for need in line["needs"]}),
                "arguments": line["kernel"][1],
            }
            for line in kernels.values()
        ],
        "uses": {use: sorted({order[key] for key in found}) for use, found in uses.items()},
    }


def _written(table: dict[str, Any]) -> str:
    # One kernel and one use a line.
    kernels = ",\n".join("  " + json.dumps(row) for row in table["kernels"])
    uses = ",\n".join(f"  {json.dumps(use)}: {found}" for use, found in table["uses"].items())
    return f'{{"kernels": [\n{kernels}\n],\n"uses": {{\n{uses}\n}}}}\n'


def main() -> None:
    """Write the table; or, given a file and a command, what the command needs."""
    if len(sys.argv) > 1:
        _record(Path(sys.argv[1]), sys.argv[2:])
    TABLE.write_text(_written(_table()), encoding="utf-8")


if __name__ == "__main__":
    main()
