"""Control nets written as JSON files, as users write them."""

import json
from pathlib import Path
from typing import Any

from upholster.geometry import Surface

__all__ = ["write_nets"]


def write_nets(path: Path, surface: Surface) -> None:
    """Write control nets; `read_nets` restores faces, weights, and points up to rounding."""
    patches = []
    for patch in surface.patches:
        net: dict[str, Any] = {"points": patch.control_points.tolist()}
        if (patch.weights != 1.0).any():
            net["weights"] = patch.weights.tolist()
        patches.append(net)
    grids = [
        [[first + row * face.columns + column for column in range(face.columns)] for row in range(face.rows)]
        for first, face in zip(surface.first_patches, surface.faces, strict=True)
    ]
    head = {"name": surface.name, "tolerance": surface.tolerance, "faces": grids}
    path.write_text(json.dumps({**head, "patches": patches}), encoding="utf-8")
