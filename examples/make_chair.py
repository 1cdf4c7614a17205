"""Makes chair.glb, an armchair of seven parts in metres: ``python examples/make_chair.py``.

Cushions are rounded boxes that bulge a little; legs are tapered.
"""

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

# Of each part: middle (right, up, front), half sizes, radius of the rounding, bulge, all in metres.
PARTS = {
    "Seat": ((0.0, 0.38, 0.02), (0.30, 0.09, 0.30), 0.07, 0.03),
    "Back": ((0.0, 0.68, -0.27), (0.30, 0.26, 0.08), 0.07, 0.03),
    "Arm left": ((-0.36, 0.44, 0.0), (0.07, 0.17, 0.32), 0.06, 0.015),
    "Arm right": ((0.36, 0.44, 0.0), (0.07, 0.17, 0.32), 0.06, 0.015),
    "Leg 1": ((-0.33, 0.14, 0.27), (0.03, 0.14, 0.03), 0.012, 0.0),
    "Leg 2": ((0.33, 0.14, 0.27), (0.03, 0.14, 0.03), 0.012, 0.0),
    "Leg 3": ((-0.33, 0.14, -0.27), (0.03, 0.14, 0.03), 0.012, 0.0),
    "Leg 4": ((0.33, 0.14, -0.27), (0.03, 0.14, 0.03), 0.012, 0.0),
}


def rounded_box(half: np.ndarray, radius: float, bulge: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (V, 3) and triangles (T, 3) of a box with round edges, about the origin."""
    line = np.sin(np.linspace(-np.pi / 2, np.pi / 2, count + 1))  # denser towards the edges
    u, v = (x.ravel() for x in np.meshgrid(line, line))
    i, j = (x.ravel() for x in np.mgrid[:count, :count])
    at = [(i + a) * (count + 1) + j + b for a, b in ((0, 0), (0, 1), (1, 1), (1, 0))]
    square = np.concatenate([np.stack(at[:3], axis=1), np.stack([at[0], at[2], at[3]], axis=1)])
    sides: list[np.ndarray] = []
    swollen: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    for axis in range(3):
        for sign in (1, -1):
            side = np.empty((len(u), 3))
            side[:, axis], side[:, (axis + 1) % 3], side[:, (axis + 2) % 3] = sign, u, v
            triangles.append((square if sign > 0 else square[:, ::-1]) + len(u) * len(sides))
            sides.append(side)
            swollen.append(np.eye(3)[axis] * (sign * (1 - u**2) * (1 - v**2))[:, None])
    cube = np.concatenate(sides)
    inner = np.clip(cube * half, -(half - radius), half - radius)
    outward = cube * half - inner
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    points = np.round(inner + radius * outward + bulge * np.concatenate(swollen), 6)
    _, first, vertex = np.unique(points, axis=0, return_index=True, return_inverse=True)
    return points[first], vertex.reshape(-1)[np.concatenate(triangles)]


def write_glb(path: Path, parts: Mapping[str, tuple[np.ndarray, np.ndarray, tuple[float, ...]]]) -> None:
    """Write parts, each positions, triangles and place, as a GLB with a node and a mesh for each."""
    data = b""
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    nodes: list[dict[str, Any]] = []
    for name, (points, triangles, place) in parts.items():
        arrays = (
            (points.astype("<f4"), 34962, 5126, "VEC3"),
            (triangles.astype("<u2"), 34963, 5123, "SCALAR"),
        )
        for array, target, kind, shape in arrays:
            flat = array.reshape(-1) if shape == "SCALAR" else array
            accessor = {"bufferView": len(views), "componentType": kind, "count": len(flat), "type": shape}
            if shape == "VEC3":
                accessor |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes, "target": target})
            accessors.append(accessor)
            data += array.tobytes() + b"\0" * (-array.nbytes % 4)
        attributes = {"POSITION": len(accessors) - 2}
        material = 1 if name.startswith("Leg") else 0
        primitive = {"attributes": attributes, "indices": len(accessors) - 1, "material": material}
        nodes.append({"name": name, "mesh": len(meshes), "translation": list(place)})
        meshes.append({"name": name, "primitives": [primitive]})
    document = {
        "asset": {"version": "2.0", "generator": "upholster's examples/make_chair.py"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{"name": "cover"}, {"name": "wood"}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 + len(data)
    head = struct.pack("<4sII", b"glTF", 2, length) + struct.pack("<I4s", len(text), b"JSON")
    path.write_bytes(head + text + struct.pack("<I4s", len(data), b"BIN\0") + data)


def main() -> None:
    """Write chair.glb beside this script."""
    parts = {}
    for name, (place, half, radius, bulge) in PARTS.items():
        points, triangles = rounded_box(np.array(half), radius, bulge, 6 if name.startswith("Leg") else 16)
        if name.startswith("Leg"):
            points[:, [0, 2]] *= (0.75 + 0.25 * (points[:, 1:2] / half[1] + 1) / 2) ** 1.5
        parts[name] = points, triangles, place
    write_glb(Path(__file__).parent / "chair.glb", parts)


if __name__ == "__main__":
    main()
