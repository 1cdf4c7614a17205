"""Flat sheets of many samples, made by one version of the program in one process.

``python eye_sheets.py JOBS.json``: a list of [sample, side, seed, .npy file to write]. Runs by the
interpreter and the sources of any version: it uses only names that all versions have.
"""

import json
import sys
from pathlib import Path

import numpy as np

import upholster


def main() -> None:
    """Make the sheets."""
    for sample, side, seed, out in json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")):
        exemplar = upholster.read_exemplar(sample)
        quilt = upholster.synthesize(exemplar, upholster.plane(), texels=(side, side), seed=seed)
        np.save(out, upholster.paint(quilt, exemplar).arrays[0])


main()
