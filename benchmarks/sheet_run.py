"""Two versions of the program, each run by its command: a revision of git, and this checkout."""

import hashlib
import io
import json
import os
import resource
import subprocess
import sys
import tarfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import upholster
from benchmarks.sheet_cases import Case

__all__ = ["ROOT", "Made", "Side", "commit_of", "revision", "unpack", "working_tree"]

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Made:
    """Files, bytes of the stream (0 without), seconds; or the last line of what went wrong."""

    folder: Path
    stream: int = 0
    seconds: float = 0.0
    processor: float = 0.0
    failed: str = ""

    def result(self, case: Case) -> Path:
        """Return the file that is looked at."""
        return self.folder / ("flat.png" if case.is_flat else "model.glb")


@dataclass(frozen=True)
class Side:
    """A version of the program, and where its results are; those of a revision are kept.

    Attributes
    ----------
    name
        As tables and pictures have it.
    source
        The folder that has the package.
    results
        A folder for each case goes in here.
    keeps
        Whether results that are there are taken as they are.
    """

    name: str
    source: Path
    results: Path
    keeps: bool

    def check(self) -> None:
        """Raise RuntimeError unless the command is this version's own."""
        script = "import upholster; print(upholster.__file__)"
        done = subprocess.run(
            [sys.executable, "-c", script],
            env=self._environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        if done.stdout.strip() != str(self.source / "upholster" / "__init__.py"):
            raise RuntimeError(
                f"{self.name} runs {done.stdout.strip() or done.stderr[-200:]}, not {self.source}"
            )

    def run(self, case: Case, where: Mapping[str, Path], seed: int) -> Made:
        """Run a case, a second time if kernels were compiled; or return what is kept of it."""
        folder = self.results / f"{case.name}-{_digest(case, where, seed)}"
        kept = folder / "made.json"
        if self.keeps and kept.exists():
            return Made(folder, **json.loads(kept.read_text(encoding="utf-8")))
        folder.mkdir(parents=True, exist_ok=True)
        model = ("-o", "flat.png") if case.is_flat else ("--texture", "png", "-o", "model.glb")
        words = [*case.words(where), "--seed", str(seed), *model]
        words += ["-o", "stream.uph"] if case.has_stream else []
        made, said = self._timed(folder, words)
        if "compiling" in said and not made.failed:
            made, said = self._timed(folder, words)
        found = {name: value for name, value in asdict(made).items() if name != "folder"}
        kept.write_text(json.dumps(found), encoding="utf-8")
        return made

    def _timed(self, folder: Path, words: list[str]) -> tuple[Made, str]:
        before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "upholster", *words],
            cwd=folder, env=self._environment(), capture_output=True, text=True, check=False,
        )  # fmt: skip
        seconds, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode:
            return Made(folder, failed=(done.stderr.strip().splitlines() or ["no message"])[-1]), done.stderr
        processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        stream = folder / "stream.uph"
        return Made(folder, stream.stat().st_size if stream.exists() else 0, seconds, processor), done.stderr

    def _environment(self) -> dict[str, str]:
        return {**os.environ, "PYTHONPATH": str(self.source), "PYTHONSAFEPATH": "1"}


def revision(text: str, cache: Path) -> Side:
    """Return a revision of git, its sources laid out below `cache`, under its commit.

    Raises
    ------
    ValueError
        If there is no such revision.
    """
    commit = commit_of(text)
    folder = cache / commit
    unpack(commit, folder / "source", "src")
    return Side(
        commit[:10], (folder / "source" / "src").resolve(), (folder / "results").resolve(), keeps=True
    )


def commit_of(text: str) -> str:
    """Return the commit that a revision of git names.

    Raises
    ------
    ValueError
        If there is no such revision.
    """
    found = _git("rev-parse", "--verify", "--quiet", f"{text}^{{commit}}")
    if found.returncode:
        raise ValueError(f"revision is {text!r}; allowed: what git knows, as HEAD~3 or main")
    return found.stdout.decode().strip()


def unpack(commit: str, folder: Path, *paths: str) -> None:
    """Lay out a commit's files, or those below some paths, in a folder that is not there yet."""
    if folder.exists():
        return
    folder.parent.mkdir(parents=True, exist_ok=True)
    packed = _git("archive", "--format=tar", commit, *paths).stdout
    with TemporaryDirectory(dir=folder.parent) as name, tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(name, filter="data")
        Path(name).rename(folder)
        Path(name).mkdir()  # what ends the context removes


def working_tree(out: Path) -> Side:
    """Return this checkout, whose results go to `out`.

    Raises
    ------
    ValueError
        If the package that measures is another one than the checkout's.
    """
    source = ROOT / "src"
    if Path(upholster.__file__).resolve() != source / "upholster" / "__init__.py":
        raise ValueError(f"upholster is {upholster.__file__}; allowed: that of {source}, by PYTHONPATH=src")
    return Side("tree", source, out.resolve() / "tree", keeps=False)


def _git(*words: str) -> "subprocess.CompletedProcess[bytes]":
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, check=False)


def _digest(case: Case, where: Mapping[str, Path], seed: int) -> str:
    """Return what changes with the command and with what it reads, wherever that lies."""
    found = hashlib.blake2b(" ".join([*case.words({}), str(seed)]).encode(), digest_size=6)
    for name in case.files:
        path = where[name]
        for file in sorted(path.iterdir()) if path.is_dir() else [path]:
            found.update(file.read_bytes())
    return found.hexdigest()
