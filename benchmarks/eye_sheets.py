"""Flat sheets of many samples, made by one version of the program in one process.

``python eye_sheets.py JOBS.json``: a list of [sample, side, seed, file to write]. Runs by the interpreter and
the sources of any version: it uses only names that all versions have.
"""

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import upholster


def main() -> None:
    """Make the sheets that are not there."""
    for sample, side, seed, out in json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")):
        if Path(out).exists():
            continue
        exemplar = upholster.read_exemplar(sample)
        quilt = upholster.synthesize(exemplar, upholster.plane(), texels=(side, side), seed=seed)
        sheet = upholster.paint(quilt, exemplar).arrays[0]
        Image.fromarray(np.squeeze(sheet)).save(f"{out}.png")
        Path(f"{out}.png").rename(out)  # a run that was ended leaves no half sheet


main()
