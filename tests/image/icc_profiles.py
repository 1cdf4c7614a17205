"""ICC profiles made by hand, so that what they mean is known without a library."""

import struct
from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np

D50 = np.array([0.9642, 1.0, 0.8249])

# Chromaticities of red, green, blue and white: IEC 61966-2-1, Adobe RGB (1998), SMPTE EG 432-1.
SRGB = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290))
ADOBE = ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06), (0.3127, 0.3290))
P3 = ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06), (0.3127, 0.3290))


def to_xyz(primaries: Any) -> np.ndarray:
    """Linear RGB to XYZ under the primaries' own white (SMPTE RP 177)."""
    columns = np.array([(x / y, 1.0, (1 - x - y) / y) for x, y in primaries]).T
    return columns[:, :3] * np.linalg.solve(columns[:, :3], columns[:, 3])


def bradford(white: np.ndarray) -> np.ndarray:
    """From XYZ under `white` to XYZ under D50."""
    cone = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
    return np.linalg.inv(cone) @ np.diag((cone @ D50) / (cone @ white)) @ cone


def profile(space: bytes, pcs: bytes, tags: Mapping[bytes, bytes]) -> bytes:
    """Return a display profile of version 2 with the given tags."""
    tags = {b"desc": described("made by hand"), **tags}
    table, data = struct.pack(">I", len(tags)), b""
    for name, tag in tags.items():
        table += struct.pack(">4sII", name, 132 + 12 * len(tags) + len(data), len(tag))
        data += tag + bytes(-len(tag) % 4)
    head = bytearray(128)
    head[8:24] = b"\x02\x40\x00\x00mntr" + space + pcs
    head[36:40] = b"acsp"
    head[68:80] = xyz(D50)[8:]
    head[0:4] = struct.pack(">I", 128 + len(table) + len(data))
    return bytes(head) + table + data


def matrix_profile(primaries: Any, curve: bytes) -> bytes:
    matrix = bradford(to_xyz(primaries) @ np.ones(3)) @ to_xyz(primaries)
    colorants = {name: xyz(matrix[:, k]) for k, name in enumerate((b"rXYZ", b"gXYZ", b"bXYZ"))}
    return profile(b"RGB ", b"XYZ ", {**colorants, **dict.fromkeys((b"rTRC", b"gTRC", b"bTRC"), curve)})


def table_profile(space: bytes, colors: Any, channels: int) -> bytes:
    """Return a profile with a table of two points an axis (lut16Type): `colors(corner)` is Lab at each."""
    head = b"mft2" + bytes(4) + bytes([channels, 3, 2, 0])
    head += struct.pack(">9i", *(65536 * np.eye(3, dtype=int)).ravel()) + struct.pack(">HH", 2, 2)
    lab = [colors(corner) for corner in product((0, 1), repeat=channels)]
    # Lab of version 2: L from 0 to 0xFF00, a and b round 0x8000.
    words = [(L * 652.8, a * 256 + 32768, b * 256 + 32768) for L, a, b in lab]
    table = np.rint(np.clip(words, 0, 65535)).astype(">u2").tobytes()
    straight = struct.pack(">HH", 0, 65535)
    white = {b"wtpt": xyz(D50)}
    return profile(space, b"Lab ", {b"A2B0": head + straight * channels + table + straight * 3, **white})


def xyz(values: Any) -> bytes:
    return b"XYZ " + bytes(4) + struct.pack(">3i", *(round(float(v) * 65536) for v in values))


def gamma(exponent: float) -> bytes:
    return b"curv" + bytes(4) + struct.pack(">IH", 1, round(exponent * 256))


def parametric(kind: int, *values: float) -> bytes:
    fixed = (round(value * 65536) for value in values)
    return b"para" + bytes(4) + struct.pack(">HH", kind, 0) + struct.pack(f">{len(values)}i", *fixed)


def sampled(values: Any) -> bytes:
    words = np.rint(np.asarray(values) * 65535).astype(">u2")
    return b"curv" + bytes(4) + struct.pack(">I", len(words)) + words.tobytes()


def described(words: str) -> bytes:
    return b"desc" + bytes(4) + struct.pack(">I", len(words) + 1) + words.encode() + bytes(79)
