"""Run all benchmarks, or those named: ``python -m benchmarks [flagship] [growth] [stream] …``.

``codec``, ``profiles``, ``claims``, ``fidelity``, ``seams``, ``lattices``, ``photos`` and ``fill`` take
a folder of exemplars instead of the project's own, the last seven the options of their modules:
``codec``, ``profiles``, ``claims``, ``fidelity``, ``seams``, ``lattices``, ``photos`` and ``guides`` take
a folder of exemplars instead of the project's own, the last six the options of their modules:
``python -m benchmarks fidelity FOLDER -o OUT``. ``unwrap`` and ``meshstream`` take a folder of meshes.
``sheet REV`` compares with a revision of git, and runs only by name.
"""

import sys
from pathlib import Path

from benchmarks import claims as claims_module
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
PROGRAMS = {
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
    """Run, print, write; status 2 for an unknown name."""
    wanted = sys.argv[1:] or list(BENCHMARKS)
    if wanted[0] == "sheet":
        return sheet_module.main(wanted[1:])
    results = Results()
    if len(wanted) > 1 and wanted[1] not in BENCHMARKS:
        if wanted[0] in PROGRAMS:
            return PROGRAMS[wanted[0]](wanted[1:])
        if wanted[0] in WITH_FOLDER and len(wanted) == 2 and Path(wanted[1]).is_dir():
            WITH_FOLDER[wanted[0]](results, folder=Path(wanted[1]))
            results.show()
            return 0
    unknown = [name for name in wanted if name not in BENCHMARKS]
    if unknown:
        print(f"unknown benchmark {unknown[0]!r}; allowed: {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    for name in wanted:
        BENCHMARKS[name](results)
    results.show()
    if not sys.argv[1:]:
        results.write(Path(__file__).parent / "results.csv")
    return 0


sys.exit(main())
