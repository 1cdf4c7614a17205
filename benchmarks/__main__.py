"""Run all benchmarks, or those named: ``python -m benchmarks [flagship] [growth] [stream] …``."""

import sys
from pathlib import Path

from benchmarks.codec import codec
from benchmarks.command import command
from benchmarks.fidelity import fidelity
from benchmarks.flagship import flagship, growth
from benchmarks.measure import Results
from benchmarks.parts import parts
from benchmarks.stream import stream

BENCHMARKS = {
    "flagship": flagship,
    "growth": growth,
    "command": command,
    "parts": parts,
    "codec": codec,
    "stream": stream,
    "fidelity": fidelity,
}


def main() -> int:
    """Run, print, write; status 2 for an unknown name."""
    wanted = sys.argv[1:] or list(BENCHMARKS)
    unknown = [name for name in wanted if name not in BENCHMARKS]
    if unknown:
        print(f"unknown benchmark {unknown[0]!r}; allowed: {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    results = Results()
    for name in wanted:
        BENCHMARKS[name](results)
    results.show()
    if not sys.argv[1:]:
        results.write(Path(__file__).parent / "results.csv")
    return 0


sys.exit(main())
