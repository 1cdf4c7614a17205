"""The photographs that textures are judged on, from the files that eye_samples.csv names.

``python -m benchmarks eye_samples SOURCES OUT [--set work]``. SOURCES has a folder for each: owner+name
for a repository of GitHub, at the commit in the table, and name-version for an unpacked package of PyPI.
OUT gets SET/NAME.png; the sets are work, kept, fresh, last, later, drawn, unseen and recent. The hash
in the table is that of the pixels, because encoders of PNG differ. All sources are public domain or under a
permissive licence, as they state.
"""

import argparse
import bz2
import csv
import hashlib
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

__all__ = ["main"]

TABLE = Path(__file__).with_name("eye_samples.csv")
FACE = (1024, 768)
"""Width and height of the one photograph that is stored as packed bytes."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run as a program; status 1 if a file is missing, or has other pixels than the table says."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks eye_samples", description=__doc__)
    parser.add_argument("sources", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument(
        "--set", choices=("work", "kept", "fresh", "last", "later", "drawn", "unseen", "recent")
    )
    asked = parser.parse_args(arguments)
    wrong = 0
    with TABLE.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if asked.set in (None, row["set"]):
                said = _make(row, asked.sources, asked.out / row["set"] / f"{row['name']}.png")
                wrong += bool(said)
                print(f"{row['name']}: {said or 'made'}")
    return int(bool(wrong))


def _make(row: dict[str, str], sources: Path, out: Path) -> str:
    """Write a sample; return what is wrong, if anything."""
    source = row["source"].removeprefix("pypi:").replace("==", "-").replace("/", "+")
    path = sources / source / row["path"]
    if not path.exists():
        return f"{path} is not there"
    left, top, side = (int(row[name]) for name in ("left", "top", "square"))
    part = _read(path).crop((left, top, left + side, top + side))
    made = part.resize((int(row["side"]),) * 2, Image.Resampling.LANCZOS)
    out.parent.mkdir(parents=True, exist_ok=True)
    made.save(out)
    same = hashlib.sha256(np.asarray(made).tobytes()).hexdigest() == row["sha256"]
    return "" if same else f"{path} has other pixels than {TABLE.name} says"


def _read(path: Path) -> Image.Image:
    if path.suffix == ".dat":
        return Image.frombytes("RGB", FACE, bz2.decompress(path.read_bytes()))
    return Image.open(path).convert("RGB")


if __name__ == "__main__":
    sys.exit(main())
