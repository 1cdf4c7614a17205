"""A displaced solid in a slicer: layers and volume that it finds, beside what the file holds.

``python -m benchmarks.slicing SOLID.stl … --python PYTHON [--layer 0.2]``. PYTHON is that of an environment
with mandoline-py (``pip install mandoline-py``), which checks the solid, slices it to G-code as its command
does, and tells the outlines of its layers. STL is in millimetres.
"""

import argparse
import json
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import trimesh

__all__ = ["main"]

_SLICE = """
import json, sys
from mandoline.slicer import Slicer
from mandoline.stl_data import StlData
solid = StlData()
solid.read_file(sys.argv[1])
closed = solid.check_manifold(verbose=False)
slicer = Slicer([solid], layer_height=float(sys.argv[3]), infill_density=0.0, support_type="None",
                bed_size_x=500.0, bed_size_y=500.0)
slicer.slice_to_file(sys.argv[2])
def area(path):
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(path, path[1:] + path[:1])) / 2
areas = [abs(sum(area(path) for path in paths)) for paths in slicer.layer_paths]
dead = sum(len(paths) for paths in slicer.dead_paths)
print("\\n" + json.dumps([bool(closed), areas, dead]))
"""


def extruded_heights(code: str) -> set[float]:
    """Return the heights at which G-code moves and extrudes."""
    found, height = set(), 0.0
    for line in code.splitlines():
        words = {word[0]: word[1:] for word in line.split(";")[0].split()}
        if words.get("G") in ("0", "1"):
            height = float(words.get("Z", height))
            if "E" in words and ("X" in words or "Y" in words):
                found.add(height)
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.slicing", description=__doc__)
    parser.add_argument("solids", nargs="+", type=Path)
    parser.add_argument("--python", required=True)
    parser.add_argument("--layer", type=float, default=0.2)
    asked = parser.parse_args(arguments)
    for solid in asked.solids:
        with tempfile.TemporaryDirectory() as folder:
            code = Path(folder, "out.gcode")
            command = [asked.python, "-c", _SLICE, str(solid), str(code), str(asked.layer)]
            said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            closed, areas, dead = json.loads(said.splitlines()[-1])
            heights = extruded_heights(code.read_text())
        mesh = trimesh.load(solid)
        height, volume = float(mesh.extents[2]), abs(float(mesh.volume))
        found = sum(areas) * asked.layer
        print(
            f"{solid.name}: {len(mesh.faces):,} triangles, closed: {closed}, open outlines: {dead}; "
            f"{len(areas)} layers of {asked.layer} mm ({height / asked.layer:.1f} fit), "
            f"{len(heights)} heights at which the G-code extrudes; "
            f"{found / 1000:.3f} cm³ in outlines, {volume / 1000:.3f} in the file ({found / volume - 1:+.2%})"
        )


if __name__ == "__main__":
    main()
