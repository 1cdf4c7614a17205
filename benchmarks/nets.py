"""Control nets: a surface that no builder makes, and nets written as JSON files, as users write them."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.geometry.patches.face import Face
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface

__all__ = ["bent_vase", "write_nets"]


def bent_vase() -> Surface:
    """Return a vase, bent and flattened."""
    faces = []
    for face in surface_from_spec("vase").faces:
        rows = []
        for i in range(face.rows):
            row = []
            for j in range(face.columns):
                net = face.patches[i][j].net
                x, y, z = np.moveaxis(net[..., :3] / net[..., 3:], -1, 0)
                moved = np.stack([1.2 * x + 0.25 * z * z, 0.8 * y + 0.1 * z, z], axis=-1)
                row.append(RationalPatch(np.concatenate([moved * net[..., 3:], net[..., 3:]], axis=-1)))
            rows.append(tuple(row))
        faces.append(Face(tuple(rows)))
    return Surface(faces, "bent vase")


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
