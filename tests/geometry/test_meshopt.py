"""Meshopt's codecs, against plain encoders made from the specification alone."""

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_models import BOX, BOX_TRIANGLES, Glb
from numpy.typing import NDArray

from upholster.base.errors import FormatError, InputError
from upholster.geometry.gltf._meshopt_kernels import decode_attributes, decode_indices, decode_triangles
from upholster.geometry.gltf.meshopt import _filtered
from upholster.geometry.model_files.model_reader import read_model
from upholster.output.export.glb_copy import Cover, write_retextured_glb


def leb128(value: int) -> bytes:
    out = bytearray()
    while value > 127:
        out.append(128 | value & 127)
        value >>= 7
    return bytes([*out, value])


def zigzag(delta: int) -> int:
    return 2 * delta if delta >= 0 else -2 * delta - 1


def coded_attributes(elements: NDArray[np.uint8]) -> bytes:
    """Code (count, stride) bytes, each group in the shortest of its four modes."""
    count, stride = elements.shape
    out = bytearray([0xA0])
    base = elements[0].copy()
    most = min((8192 // stride) & ~15, 256)
    last = base.astype(int)
    for first in range(0, count, most):
        block = elements[first : first + most].astype(int)
        groups = -(-len(block) // 16)
        padded = np.concatenate([block, np.repeat(block[-1:], groups * 16 - len(block), axis=0)])
        for byte in range(stride):
            deltas = np.diff(np.concatenate([[last[byte]], padded[:, byte]]))
            codes = [zigzag(int((d + 128) % 256 - 128)) for d in deltas]
            heads, bodies = [], []
            for group in range(groups):
                mine = codes[16 * group : 16 * group + 16]
                kinds = [
                    (0, b"") if not any(mine) else None,
                    packed(mine, 2),
                    packed(mine, 4),
                    (3, bytes(mine)),
                ]
                best = min((kind for kind in kinds if kind), key=lambda kind: len(kind[1]))
                heads.append(best[0])
                bodies.append(best[1])
            heads += [0] * (-len(heads) % 4)
            out += bytes(
                sum(h << (2 * k) for k, h in enumerate(heads[n : n + 4])) for n in range(0, len(heads), 4)
            )
            out += b"".join(bodies)
        last = block[-1]
    return bytes(out) + bytes(max(0, 32 - stride)) + base.tobytes()


def packed(codes: list[int], bits: int) -> tuple[int, bytes]:
    sentinel = (1 << bits) - 1
    small = [min(code, sentinel) for code in codes]
    per = 8 // bits
    body = bytes(sum(small[n + k] << (8 - bits - k * bits) for k in range(per)) for n in range(0, 16, per))
    return bits // 2, body + bytes(code for code in codes if code >= sentinel)


def coded_indices(indices: list[int], rng: np.random.Generator) -> bytes:
    out, last = bytearray([0xD1]), [0, 0]
    for index in indices:
        which = int(rng.integers(2))
        out += leb128(zigzag(index - last[which]) << 1 | which)
        last[which] = index
    return bytes(out) + bytes(4)


class TriangleCoder:
    """Codes triangles, each in a way drawn from those that fit it."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.codes, self.data = bytearray(), bytearray()
        self.following = self.last = 0
        self.edges: list[tuple[int, int]] = []
        self.vertices: list[int] = []  # the latest first, as edges
        self.used: set[str] = set()
        self.table = bytes([0x00, 0x12, 0x10, 0x21, 0x02, 0x01]) + bytes(10)

    def add(self, a: int, b: int, c: int) -> None:
        ways = [self._explicit]
        ways += [self._shared] * 3 * any(edge in self.edges[:15] for edge in _turns(a, b, c))
        ways[int(self.rng.integers(len(ways)))](a, b, c)

    def _push(self, *edges: tuple[int, int]) -> None:
        self.edges = ([*reversed(edges), *self.edges])[:16]

    def _push_vertex(self, vertex: int) -> None:
        self.vertices = [vertex, *self.vertices][:16]

    def _free(self, vertex: int) -> None:
        self.data += leb128(zigzag(vertex - self.last))
        self.last = vertex

    def _shared(self, a: int, b: int, c: int) -> None:
        turns = ((a, b, c), (b, c, a), (c, a, b))
        a, b, c = next(turn for turn in turns if turn[:2] in self.edges[:15])
        edge = self.edges.index((a, b))
        low = 15
        if c == self.following:
            low, self.following = 0, self.following + 1
        elif c in self.vertices[1:13]:
            low = self.vertices.index(c, 1)
        elif abs(c - self.last) == 1:
            low = 14 if c > self.last else 13
            self.last = c
        else:
            self._free(c)
        self.used.add(f"edge {low if low in (0, 13, 14, 15) else 'fifo'}")
        self.codes.append(edge << 4 | low)
        self._push((c, b), (a, c))
        if low in (0, 13, 14, 15):
            self._push_vertex(c)

    def _explicit(self, a: int, b: int, c: int) -> None:
        following = self.following + (a == self.following)
        nibbles = []
        for vertex in (b, c):
            if vertex == following:
                nibbles.append(0)
                following += 1
            elif vertex in self.vertices[:14]:
                nibbles.append(self.vertices.index(vertex) + 1)
            else:
                nibbles.append(15)
        aux = nibbles[0] << 4 | nibbles[1]
        new = a == self.following
        in_table = new and aux in self.table[:6]
        if in_table:
            self.codes.append(0xF0 | self.table.index(aux))
            self.used.add("table")
        elif aux == 0:  # written out, it would begin anew
            return (
                self._explicit(b, c, a)
                if (b, c, a) != (a, b, c) and b != self.following
                else self._all_free(a, b, c)
            )
        else:
            self.codes.append(0xFE if new else 0xFF)
            self.data.append(aux)
            self.used.add("new" if new else "free")
            if not new:
                self._free(a)
            for vertex, nibble in ((b, nibbles[0]), (c, nibbles[1])):
                if nibble == 15:
                    self._free(vertex)
        self.following = following
        self._push((b, a), (c, b), (a, c))
        self._push_vertex(a)
        for vertex, nibble in ((b, nibbles[0]), (c, nibbles[1])):
            if nibble in (0, 15):
                self._push_vertex(vertex)
        return None

    def _all_free(self, a: int, b: int, c: int) -> None:
        self.codes.append(0xFF)
        self.data.append(0xFF)
        for vertex in (a, b, c):
            self._free(vertex)
        self._push((b, a), (c, b), (a, c))
        for vertex in (a, b, c):
            self._push_vertex(vertex)

    def bytes(self) -> bytes:
        return b"\xe1" + bytes(self.codes) + bytes(self.data) + self.table


def _turns(a: int, b: int, c: int) -> list[tuple[int, int]]:
    return [(a, b), (b, c), (c, a)]


def decoded_triangles(data: bytes, count: int) -> NDArray[np.uint32]:
    out = np.empty(count, np.uint32)
    room = np.zeros((16, 2), np.int64), np.zeros(16, np.int64)
    assert decode_triangles(np.frombuffer(data, np.uint8), *room, out)
    return out


@pytest.mark.parametrize("stride", [4, 12, 64, 256])
def test_attributes_come_back(stride: int) -> None:
    rng = np.random.default_rng(stride)
    steps = rng.integers(-3, 4, (700, stride)) * (rng.random((700, stride)) < 0.3)
    steps[rng.integers(0, 700, 40), rng.integers(0, stride, 40)] = 100
    steps[300:340] = rng.integers(-128, 128, (40, stride))
    elements = np.cumsum(steps, axis=0).astype(np.uint8)
    data = coded_attributes(elements)
    out = np.empty(elements.size, np.uint8)
    assert decode_attributes(np.frombuffer(data, np.uint8), stride, out)
    np.testing.assert_array_equal(out.reshape(-1, stride), elements)
    tail = max(32, stride)
    cut = data[: -tail - 10] + data[-tail:]
    assert not decode_attributes(np.frombuffer(cut, np.uint8), stride, out)


def test_the_specifications_example_is_decoded() -> None:
    deltas = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]
    group = bytes.fromhex("175ff0bc77a9210034b5")
    data = b"\xa0" + b"\x02" + group + 3 * b"\x00" + bytes(32)
    out = np.empty(64, np.uint8)
    assert decode_attributes(np.frombuffer(data, np.uint8), 4, out)
    np.testing.assert_array_equal(out.reshape(16, 4)[:, 0], np.cumsum(deltas).astype(np.uint8))


def test_indices_come_back() -> None:
    rng = np.random.default_rng(5)
    indices = rng.integers(0, 2**20, 500).tolist()
    out = np.empty(500, np.uint32)
    data = coded_indices(indices, rng)
    assert decode_indices(np.frombuffer(data, np.uint8), out)
    assert out.tolist() == indices
    assert not decode_indices(np.frombuffer(data[:-5], np.uint8), out)


def test_triangles_come_back_in_every_way_of_coding() -> None:
    used = set()
    for seed in range(20):
        rng = np.random.default_rng(seed)
        n = 8
        corner = np.arange(n * n).reshape(n, n)
        a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
        triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
        if seed % 2:
            triangles = rng.permutation(triangles)
        if seed % 4:
            _, order = np.unique(triangles, return_index=True)
            rank = np.empty(n * n, int)
            rank[triangles.reshape(-1)[np.sort(order)]] = np.arange(n * n)
            triangles = rank[triangles]
        coder = TriangleCoder(rng)
        for triangle in triangles.tolist():
            coder.add(*triangle)
        found = decoded_triangles(coder.bytes(), triangles.size).reshape(-1, 3)
        turned = [sorted([t[k:] + t[:k] for k in range(3)]) for t in found.tolist()]
        assert turned == [sorted([t[k:] + t[:k] for k in range(3)]) for t in triangles.tolist()]
        used |= coder.used
    assert used == {"edge 0", "edge fifo", "edge 13", "edge 14", "edge 15", "table", "new", "free"}


def test_filters_give_unit_vectors_and_numbers() -> None:
    rng = np.random.default_rng(2)
    vectors = rng.normal(size=(500, 3))
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    flat = vectors / np.abs(vectors).sum(axis=1, keepdims=True)
    x, y, z = flat.T
    folded = z < 0
    x, y = (
        np.where(folded, (1 - np.abs(other)) * np.where(own < 0, -1, 1), own)
        for own, other in ((x, y), (y, x))
    )
    for kind, stride, ones in (("<i1", 4, 127), ("<i2", 8, 2047)):
        coded = np.stack([np.rint(x * ones), np.rint(y * ones), 0 * x + ones, 0 * x - 7], axis=1).astype(kind)
        out = _filtered(coded.view(np.uint8).reshape(-1), "OCTAHEDRAL", stride).view(kind).reshape(-1, 4)
        assert (out[:, 3] == -7).all()
        top = np.iinfo(kind).max
        assert np.abs(out[:, :3] / top - vectors).max() < 2.5 / ones
    quaternions = rng.normal(size=(500, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    largest = np.abs(quaternions).argmax(axis=1)
    rows = np.arange(500)
    quaternions *= np.sign(quaternions[rows, largest])[:, None]
    three = np.stack([quaternions[rows, (largest + k) % 4] for k in (1, 2, 3)], axis=1)
    last = (2047 & ~3) | largest
    coded = np.column_stack([np.rint(three * 2**0.5 * 2047), last]).astype("<i2")
    out = _filtered(coded.view(np.uint8).reshape(-1), "QUATERNION", 8).view("<i2").reshape(-1, 4)
    assert np.abs(out / 32767 - quaternions).max() < 2e-3
    numbers = np.array([0.0, 1.5, -3.25, 2.0**-60, -1e20], np.float32)
    mantissa, exponent = np.frexp(numbers)
    coded = (np.rint(mantissa * 2**22).astype("<i4") & 0xFFFFFF) | ((exponent.astype("<i4") - 22) << 24)
    out = _filtered(coded.astype("<i4").view(np.uint8), "EXPONENTIAL", 4).view("<f4")
    np.testing.assert_allclose(out, numbers, rtol=3e-7)


def compressed_box() -> Glb:
    """A box whose positions and triangles are compressed; its second buffer is only announced."""
    glb = Glb()
    coder = TriangleCoder(np.random.default_rng(1))
    for triangle in BOX_TRIANGLES.tolist():
        coder.add(*triangle)
    position = BOX.view(np.uint8).reshape(8, 12)
    views = []
    for data, mode, stride, count in (
        (coded_attributes(position), "ATTRIBUTES", 12, 8),
        (coder.bytes(), "TRIANGLES", 2, 36),
    ):
        held = glb.json.setdefault("bufferViews", [])
        glb.view(data)
        place = held.pop()
        extension = place | {"byteStride": stride, "count": count, "mode": mode}
        view = {
            "buffer": 1,
            "byteLength": stride * count,
            "extensions": {"EXT_meshopt_compression": extension},
        }
        views.append(glb.add("bufferViews", view))
    glb.json["accessors"] = [
        {
            "bufferView": views[0],
            "componentType": 5126,
            "count": 8,
            "type": "VEC3",
            "min": [0] * 3,
            "max": [1] * 3,
        },
        {"bufferView": views[1], "componentType": 5123, "count": 36, "type": "SCALAR"},
    ]
    glb.node(mesh=glb.mesh("box", {"attributes": {"POSITION": 0}, "indices": 1}))
    glb.json["extensionsRequired"] = glb.json["extensionsUsed"] = ["EXT_meshopt_compression"]
    return glb


def test_a_compressed_box_is_a_box(tmp_path: Path) -> None:
    model = read_model(compressed_box().write(tmp_path / "box.glb"))
    assert model.mesh.areas.sum() == pytest.approx(6)
    assert (model.mesh.neighbours >= 0).all()
    assert model.parts[0].features == ("meshopt",)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"mode": "LINES"}, "meshopt mode is 'LINES'"),
        ({"filter": "COLOR"}, "meshopt filter is 'COLOR'"),
        ({"count": 9}, "a view of 96 bytes"),
        ({"byteStride": 6, "count": 16}, "cannot have"),
        ({"byteLength": 9}, "damaged"),
        ({"byteOffset": 4}, "begin with byte"),
    ],
)
def test_wrong_descriptions_are_refused(tmp_path: Path, change: dict, said: str) -> None:
    glb = compressed_box()
    glb.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"] |= change
    with pytest.raises((InputError, FormatError), match=said):
        read_model(glb.write(tmp_path / "box.glb"))


@pytest.mark.parametrize("placeholder", [{}, {"extensions": {"EXT_meshopt_compression": {"fallback": True}}}])
def test_a_placeholder_without_bytes_is_kept_in_a_glb(tmp_path: Path, placeholder: dict[str, Any]) -> None:
    glb = compressed_box()
    data = base64.b64encode(glb.binary).decode()
    held = {"byteLength": len(glb.binary), "uri": f"data:application/octet-stream;base64,{data}"}
    glb.json["buffers"] = [held, {"byteLength": 168, **placeholder}]
    (tmp_path / "box.gltf").write_text(json.dumps(glb.json))
    model = read_model(tmp_path / "box.gltf")
    cover = Cover(np.zeros((12, 3, 2)), np.zeros((4, 4, 3), np.uint8))
    write_retextured_glb(tmp_path / "out.glb", model, [cover])
    again = read_model(tmp_path / "out.glb")
    assert again.parts[0].features == ("meshopt",)
    np.testing.assert_array_equal(again.mesh.corners, model.mesh.corners)
