"""How soon a project answers a change: the first look at the whole model, and the export's own quilt.

``python -m benchmarks live [FOLDER] [-o OUT]``. On the ring and the chair of the examples, and of a folder of
models on ``spot_triangulated.obj``, ``meshes/house.glb``, a CAD part and a scan of half a million triangles,
for exports of 0.25, 1 and 4 million texels, the scan for 0.25 million. The model has been read and laid out,
and the sample is known; each figure is the median of three changes. Draws what each stage took of a change of
direction to OUT/live.png. Before that fifty changes in a row, with a person's pauses: on the chair with three
materials, and on the house. It tells what was lost, what memory they took, how soon cancelled work stops, and
whether the last look is what a fresh run gives.
"""

import argparse
import resource
import statistics
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import Results
from upholster import Project, Sample
from upholster.project.preview import Previews

__all__ = ["live", "main"]

ROOT = Path(__file__).parent.parent
EXAMPLES = ROOT / "examples"

_TEXELS = 250_000, 1_000_000, 4_000_000
_LOOK = 1_000_000
"""Texels that a look has at most."""

_CHANGES: dict[str, Sequence[dict[str, Any]]] = {
    "seed": [{"seed": n} for n in (1, 2, 3)],
    "direction": [{"direction": f"{n}"} for n in (20, 40, 60)],
    "size": [{"sample_size": n} for n in (0.9, 1.1, 1.2)],
}
"""Three changes of each kind; sizes are in parts of the first."""

_STEPS, _PAUSE = 50, 0.4
"""Changes in a row, and seconds between two."""

_FIFTY: dict[str, dict[str, str]] = {"chair": {"Leg*": "granite.png", "Back": "bricks.png"}, "house": {}}
"""On which models many changes are made, and samples of their parts."""

_CANCELLED = 30
"""Previews that are cancelled, each at another moment."""


def _cases(folder: Path | None) -> dict[str, tuple[str, str]]:
    found = {
        "ring": ("cyclide", "bricks.png"),
        "chair": (str(EXAMPLES / "chair.glb"), "weave.png"),
    }
    if folder is not None:
        found |= {
            "spot": (str(folder / "spot_triangulated.obj"), "pebbles.png"),
            "house": (str(folder / "meshes" / "house.glb"), "bricks.png"),
            "CAD part": (str(folder / "cad" / "as1-oc-214.stp"), "granite.png"),
            "scan": (str(folder / "meshes" / "nist-pmi-4-dense.ply"), "grass.png"),
        }
    return found


def _sized(project: Project) -> tuple[Project, float]:
    """Return a project whose sample's width is given, and that width."""
    scale = project.request().read()[0].scene.scale
    assert scale is not None  # method "quilt" on a surface
    return project.change(sample_size=scale.sample_size), scale.sample_size


def _timed(project: Project) -> tuple[float, float, dict[str, float]]:
    """Return the seconds to the first and the last look, and those of each stage."""
    ran = project.previews.stages.ran
    ran.clear()
    looks = [(look.seconds, look.is_final) for look in project.preview(texels=_LOOK)]
    assert looks[-1][1]
    seconds: dict[str, float] = {}
    for one in list(ran):
        seconds[one.name] = seconds.get(one.name, 0.0) + one.seconds
    return looks[0][0], looks[-1][0], seconds


def live(results: Results, folder: Path | None = None, out: Path | None = None) -> None:
    """Measure all cases."""
    # First: a process begins with the most memory that the one had which starts it.
    for name, parts in _FIFTY.items():
        if name not in _cases(folder):
            continue
        with ProcessPoolExecutor(1, get_context("spawn")) as own:  # its memory is that of these changes
            for what, figure, unit in own.submit(_fifty, *_cases(folder)[name], parts).result():
                results.add(f"{name}: {what}", figure, unit)
    stages: dict[str, dict[str, float]] = {}
    for name, (on, sample) in _cases(folder).items():
        for texels in _TEXELS:
            if name == "scan" and texels > _TEXELS[0]:
                continue
            project = Project(on, Sample(str(EXAMPLES / sample)), synthesis={"texels": texels})
            with project.previews.stages.active():
                project, width = _sized(project)
            list(project.preview(texels=_LOOK))
            for kind, changes in _CHANGES.items():
                took = []
                for change in changes:
                    if kind == "size":
                        change = {"sample_size": width * change["sample_size"]}
                    took.append(_timed(project.change(**change)))
                first = statistics.median(one[0] for one in took)
                last = statistics.median(one[1] for one in took)
                if kind == "direction" and texels == (_TEXELS[0] if name == "scan" else 1_000_000):
                    stages[name] = took[0][2]
                case = f"{name}, {texels / 1e6:g} M"
                results.add(f"{case}, {kind}: first look", first, "s")
                results.add(f"{case}, {kind}: final quilt", last, "s")
    if out is not None:
        _plot(stages, out / "live.png")


def _fifty(on: str, sample: str, parts: dict[str, str]) -> list[tuple[str, float, str]]:
    """Change a project fifty times, as a person does; each change cancels what is under way."""
    materials = {part: Sample(str(EXAMPLES / other)) for part, other in parts.items()}
    project = Project(on, Sample(str(EXAMPLES / sample)), materials, synthesis={"texels": 1_000_000})
    rng = np.random.default_rng(0)
    with project.previews.stages.active():
        project, width = _sized(project)
    list(project.preview(texels=_LOOK))
    seen, preview = 0, None
    for step in range(_STEPS):
        kind = ("seed", "direction", "size")[int(rng.integers(3))]
        choices: dict[str, dict[str, Any]] = {
            "seed": {"seed": step},
            "direction": {"direction": f"{int(rng.integers(360))}"},
            "size": {"sample_size": width * float(rng.uniform(0.7, 1.4))},
        }
        change = choices[kind]
        project = project.change(**change)
        preview = project.preview(texels=_LOOK)
        until, looks = time.perf_counter() + _PAUSE * float(rng.uniform(0.5, 4)), 0
        for look in preview:
            looks += 1
            if look.is_final or time.perf_counter() > until:
                break
        seen += looks > 0
        time.sleep(max(0.0, until - time.perf_counter()))
    stopped = sorted(_stopped(project, float(rng.uniform(0.02, 2.0)), step) for step in range(_CANCELLED))
    last = list(project.preview(texels=_LOOK))[-1]
    fresh = list(replace(project, previews=Previews()).preview(texels=_LOOK))[-1]
    equal = all(
        np.array_equal(one, other)
        for one, other in zip(last.model.texels.arrays, fresh.model.texels.arrays, strict=True)
    )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    return [
        (f"changes of {_STEPS} of which something was seen", seen, ""),
        ("last look equals a fresh run's", float(equal), ""),
        ("cancelled work has stopped, median", statistics.median(stopped), "s"),
        ("cancelled work has stopped, slowest", stopped[-1], "s"),
        ("most memory that the process had", peak / 2**20, "MiB"),
    ]


def _stopped(project: Project, after: float, step: int) -> float:
    """Return how long the work of a preview goes on after it is cancelled."""
    preview = project.change(seed=1000 + step, direction=f"{7 * step + 1}").preview(texels=_LOOK)
    time.sleep(after)
    began = time.perf_counter()
    preview.cancel()
    preview.wait()
    return time.perf_counter() - began


def _plot(stages: dict[str, dict[str, float]], path: Path) -> None:
    from matplotlib import pyplot as plt

    total: dict[str, float] = {}
    for each in stages.values():
        for name, seconds in each.items():
            total[name] = total.get(name, 0.0) + seconds
    names = sorted(total, key=lambda name: -total[name])[:9]
    figure, axes = plt.subplots(figsize=(9, 1 + 0.5 * len(stages)))
    left = np.zeros(len(stages))
    for name in [*names, "others"]:
        wide = np.array(
            [
                sum(s for n, s in each.items() if n not in names) if name == "others" else each.get(name, 0.0)
                for each in stages.values()
            ]
        )
        axes.barh(list(stages), wide, left=left, label=name.strip("_").replace("_", " "))
        left += wide
    axes.invert_yaxis()
    axes.set_xlabel("seconds after a change of direction, 1 million texels (scan: 0.25): all looks")
    axes.legend(ncols=4, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    figure.savefig(path, dpi=110, bbox_inches="tight")


def main(arguments: Sequence[str]) -> int:
    """Run as a program."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks live", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="of models")
    parser.add_argument("-o", "--out", type=Path, help="folder for live.png")
    given = parser.parse_args(arguments)
    results = Results()
    live(results, given.folder, given.out)
    results.show()
    return 0
