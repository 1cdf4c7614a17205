"""Run all benchmarks, or those named: ``python -m benchmarks [quilt] [stream] … [--publish]``.

With ``--publish`` the results become tables of docs/benchmarks.md (`benchmarks.tables`), where it has one.
``codec``, ``profiles``, ``unwrap`` and ``meshstream`` take a folder; ``claims``, ``fidelity``, ``seams``,
``lattices``, ``photos``, ``fill``, ``guides``, ``live`` and ``first_hours`` take a folder and the options of
their modules: ``python -m benchmarks fidelity FOLDER -o OUT``. ``sheet REV`` compares with a revision of git,
and ``eye FOLDER`` with textbook quilting; both run only by name.
"""

import sys
from pathlib import Path

from benchmarks import claims as claims_module
from benchmarks import eye as eye_module
from benchmarks import eye_samples as eye_samples_module
from benchmarks import fidelity as fidelity_module
from benchmarks import fill as fill_module
from benchmarks import first_hours as first_hours_module
from benchmarks import guides as guides_module
from benchmarks import lattices as lattices_module
from benchmarks import live as live_module
from benchmarks import photos as photos_module
from benchmarks import seams as seams_module
from benchmarks import sheet as sheet_module
from benchmarks.codec import codec
from benchmarks.command import command
from benchmarks.compile import compile_time
from benchmarks.crowd import crowd
from benchmarks.fidelity_methods import versions
from benchmarks.flagship import flagship, growth
from benchmarks.measure import Results
from benchmarks.meshstream import meshstream
from benchmarks.parts import parts
from benchmarks.pixel import pixel
from benchmarks.profiles import profiles
from benchmarks.quilt import quilt
from benchmarks.stream import stream
from benchmarks.studio import studio
from benchmarks.unwrap import unwrapping
from benchmarks.web import frames, web
from benchmarks.web_decoder import web_decoder

BENCHMARKS = {
    "flagship": flagship,
    "growth": growth,
    "quilt": quilt,
    "pixel": pixel,
    "command": command,
    "compile": compile_time,
    "parts": parts,
    "codec": codec,
    "profiles": profiles,
    "stream": stream,
    "unwrap": unwrapping,
    "meshstream": meshstream,
    "web": web,
    "frames": frames,
    "decoder": web_decoder,
    "crowd": crowd,
    "claims": claims_module.claims,
    "fidelity": fidelity_module.fidelity,
    "seams": seams_module.seams,
    "lattices": lattices_module.lattices,
    "photos": photos_module.photos,
    "fill": fill_module.fill,
    "guides": guides_module.guides,
    "live": live_module.live,
    "studio": studio,
    "first_hours": first_hours_module.first_hours,
}
WITH_FOLDER = {"codec": codec, "profiles": profiles, "unwrap": unwrapping, "meshstream": meshstream}
PUBLISHED = {"quilt": "time", "stream": "streams"}
"""Benchmarks whose rows are a table of docs/benchmarks.md as they are, and the table's name."""

PROGRAMS = {
    "eye": eye_module.main,
    "eye_samples": eye_samples_module.main,
    "sheet": sheet_module.main,
    "claims": claims_module.main,
    "fidelity": fidelity_module.main,
    "seams": seams_module.main,
    "lattices": lattices_module.main,
    "photos": photos_module.main,
    "fill": fill_module.main,
    "guides": guides_module.main,
    "live": live_module.main,
    "first_hours": first_hours_module.main,
}


def main() -> int:
    """Run, print, publish; status 2 for an unknown name."""
    asked = sys.argv[1:]
    own_options = len(asked) > 1 and asked[1] not in BENCHMARKS
    if asked and asked[0] in PROGRAMS and (own_options or asked[0] not in BENCHMARKS):
        return PROGRAMS[asked[0]](asked[1:])
    names = [name for name in asked if name != "--publish"]
    folder = (
        Path(names.pop()) if len(names) == 2 and names[0] in WITH_FOLDER and Path(names[1]).is_dir() else None
    )
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        print(f"unknown benchmark {unknown[0]!r}; allowed: {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    found = {name: Results() for name in names or BENCHMARKS}
    for name, results in found.items():
        if folder is None:
            BENCHMARKS[name](results)
        else:
            WITH_FOLDER[name](results, folder=folder)
    Results([row for results in found.values() for row in results.rows]).show()
    if "--publish" in asked:
        _publish(found)
    return 0


def _publish(found: dict[str, Results]) -> None:
    for name, table in PUBLISHED.items():
        if name in found:
            command = f"python -m benchmarks {name} --publish"
            found[name].publish(table, command=command, peers=versions("G'MIC") if name == "quilt" else "")


sys.exit(main())
