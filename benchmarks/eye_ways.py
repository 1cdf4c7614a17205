"""The ways to make a sheet: this checkout, a revision of git, textbook quilting, G'MIC."""

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import venv
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.pool import Pool
from pathlib import Path

import numpy as np

import upholster
from benchmarks.peers import SIDE, methods
from benchmarks.quilting import BLOCK, OVERLAP, quilting
from benchmarks.sheet_run import ROOT, commit_of, unpack
from upholster.image.files.write import write_image

__all__ = ["Way", "gmic", "revision", "textbook", "this_checkout"]

SCRIPT = Path(__file__).with_name("eye_sheets.py")


@dataclass(frozen=True)
class Way:
    """A way to make sheets of 512².

    Attributes
    ----------
    name
        As tables have it.
    folder
        Sheets that are there are taken as they are.
    python, source
        The interpreter and the folder with the package, of a version of the program; None for others.
    numbers
        Of textbook quilting: the blocks' side and overlap.
    """

    name: str
    folder: Path
    python: Path | None = None
    source: Path | None = None
    numbers: tuple[int, int] = (BLOCK, OVERLAP)

    def environment(self) -> dict[str, str]:
        """Return the environment in which the version's own package is found."""
        return {**os.environ, "PYTHONPATH": str(self.source), "PYTHONSAFEPATH": "1"}

    def sheet(self, sample: Path, seed: int, on: str = "flat") -> Path:
        """Return the file of a sheet, or of a picture of a model, named by its sample's content, too."""
        digest = hashlib.blake2b(sample.read_bytes(), digest_size=4).hexdigest()
        return self.folder / f"{sample.stem}-{digest}-{on}-{seed}.png"

    def make(self, samples: Sequence[Path], seeds: Sequence[int], pool: Pool) -> None:
        """Make the sheets that are missing."""
        self.folder.mkdir(parents=True, exist_ok=True)
        every = [(sample, seed, self.sheet(sample, seed)) for sample in samples for seed in seeds]
        jobs = [job for job in every if not job[2].exists()]
        if self.source is None:
            pool.starmap(_peer, [(self.name, *job, self.numbers) for job in jobs], chunksize=1)
        elif jobs:
            # In two processes: what is laid by one core leaves the other one free.
            pool.starmap(self._run, [(jobs[part::2],) for part in range(2)])

    def _run(self, jobs: Sequence[tuple[Path, int, Path]]) -> None:
        with tempfile.TemporaryDirectory() as name:
            file = Path(name, "jobs.json")
            made = [Path(name, f"{number}.npy") for number in range(len(jobs))]
            listed = [(str(job[0]), SIDE, job[1], str(to)) for job, to in zip(jobs, made, strict=True)]
            file.write_text(json.dumps(listed), encoding="utf-8")
            subprocess.run([str(self.python), str(SCRIPT), str(file)], env=self.environment(), check=True)
            for (_, _, out), sheet in zip(jobs, made, strict=True):
                write_image(out, np.load(sheet))


def this_checkout(out: Path) -> Way:
    """Return this checkout, whose sheets are always made again."""
    folder = out / "ours"
    for old in folder.glob("*.png"):
        old.unlink()
    return Way("ours", folder, Path(sys.executable), ROOT / "src")


def revision(text: str, cache: Path, python: Path | None) -> Way:
    """Return a revision of git, laid out below `cache` with a virtual environment, unless `python` is given.

    Raises
    ------
    ValueError
        If there is no such revision.
    """
    commit = commit_of(text)
    folder = cache / commit
    unpack(commit, folder / "all")
    if python is None:
        python = folder / "venv" / "bin" / "python"
        if not (folder / "venv" / "made").exists():
            venv.create(folder / "venv", with_pip=True, clear=True)
            subprocess.run([str(python), "-m", "pip", "install", "-q", str(folder / "all")], check=True)
            (folder / "venv" / "made").touch()
    return Way(commit[:10], folder / "sheets", python, folder / "all" / "src")


def textbook(cache: Path, block: int, overlap: int) -> Way:
    """Return textbook quilting."""
    return Way("textbook", cache / f"textbook-{block}-{overlap}", numbers=(block, overlap))


def gmic(cache: Path) -> Way | None:
    """Return G'MIC's texture synthesis, which takes no seed; None where it is not installed."""
    return Way("G'MIC", cache / "gmic") if "G'MIC" in methods() else None


def _peer(name: str, sample: Path, seed: int, out: Path, numbers: tuple[int, int]) -> None:
    exemplar = upholster.read_exemplar(sample)
    if name == "textbook":
        sheet = quilting(exemplar, SIDE, seed=seed, block=numbers[0], overlap=numbers[1])
    else:
        sheet = methods()[name](exemplar, seed)
    write_image(out, sheet)
