"""Fuzzing: ``python tests/fuzz --streams 100000 --files 20000 --pairs 10000``; without options a short run.

Damaged streams with right checksums, limit cases, and every kind of file that is read: nothing but the two
promised errors may come of them. Prints, of each kind, the slowest, the most memory, the most time a byte.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "stream"))

from fuzz import fuzz_files, fuzz_pairs, fuzz_streams


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--streams", type=int, default=1500, help="damaged streams")
    parser.add_argument("--files", type=int, default=1500, help="damaged files of all other kinds together")
    parser.add_argument("--pairs", type=int, default=0, help="damaged streams, Python against JavaScript")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cad", type=int, default=2, help="damaged files of each kind of CAD file")
    asked = parser.parse_args()
    start = time.perf_counter()
    streams, files, pairs = np.random.default_rng(asked.seed).spawn(3)
    costs = [fuzz_streams(streams, asked.streams)] if asked.streams else []
    with tempfile.TemporaryDirectory() as folder:
        if asked.files or asked.cad:
            costs += fuzz_files(files, asked.files, asked.cad, Path(folder))
        for one in costs:
            print(one)
        differ = fuzz_pairs(pairs, asked.pairs, Path(folder)) if asked.pairs else 0
    print(f"{time.perf_counter() - start:.0f} s")
    if differ:
        sys.exit(f"{differ} pairs differ")


if __name__ == "__main__":
    main()
