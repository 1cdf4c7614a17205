"""OBJ, PLY, STL and OFF: the same box from each; and what each of them can hold besides."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from gltf_models import BOX, BOX_FACES, BOX_TRIANGLES
from hypothesis import given
from hypothesis import strategies as st
from three_mf_packages import mesh, model, package

from upholster.base.errors import FormatError, InputError
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.geometry.model_files.model_reader import read_model
from upholster.geometry.model_files.polygons import cut_polygons

POINTS = "\n".join(" ".join(map(str, row)) for row in BOX.tolist())
QUADS = "\n".join("4 " + " ".join(map(str, row)) for row in BOX_FACES.tolist())


def obj() -> bytes:
    corners = "\n".join("f " + " ".join(str(k + 1) for k in row) for row in BOX_FACES.tolist())
    return ("v " + POINTS.replace("\n", "\nv ") + "\n" + corners + "\n").encode()


def off() -> bytes:
    return f"OFF # a box\n8 6 0\n\n{POINTS}\n{QUADS} 255 0 0\n".encode()


def off_broken() -> bytes:
    """Each face over four lines, as some programs write them, and its edges' lines after all."""
    lines = "\n".join("4 " + "\n".join(map(str, row)) for row in BOX_FACES.tolist())
    return f"OFF\n8 6 2\n{POINTS}\n{lines}\n0 1\n1 2\n".encode()


def stl() -> bytes:
    rows = [struct.pack("<12fH", 0, 0, 0, *BOX[t].ravel().tolist(), 0) for t in BOX_TRIANGLES]
    return b"solid".ljust(80) + struct.pack("<I", 12) + b"".join(rows)


def stl_text() -> bytes:
    lines = ["solid box"]
    for triangle in BOX_TRIANGLES:
        points = "\n".join("vertex " + " ".join(map(str, row)) for row in BOX[triangle].tolist())
        lines += ["facet normal 0 0 0", "outer loop", points, "endloop", "endfacet"]
    return "\n".join([*lines, "endsolid box"]).encode()


def ply_text() -> bytes:
    head = "ply\nformat ascii 1.0\nelement vertex 8\n" + "".join(f"property float {c}\n" for c in "xyz")
    head += "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
    return f"{head}{POINTS}\n{QUADS}\n".encode()


def ply(order: str = "<", word: str = "little") -> bytes:
    """Quadrilaterals and triangles, with a list between; and another element before."""
    head = (
        f"ply\nformat binary_{word}_endian 1.0\nelement more 2\nproperty list uchar short words\n"
        "element vertex 8\nproperty double x\nproperty float y\nproperty float z\n"
        "element face 7\nproperty uchar red\nproperty list ushort uint vertex_index\nend_header\n"
    )
    body = struct.pack(order + "BhhB", 2, 1, 2, 0)
    body += b"".join(struct.pack(order + "dff", *row) for row in BOX.tolist())
    for row in [*BOX_FACES[:5].tolist(), *BOX_TRIANGLES[10:].tolist()]:
        body += struct.pack(f"{order}BH{len(row)}I", 9, len(row), *row)
    return head.encode() + body


def three_mf() -> bytes:
    return package(model(mesh(), 'objectid="1"'))


WAYS: list[tuple[str, Callable[[], bytes]]] = [
    ("box.obj", obj),
    ("box.off", off),
    ("box.3mf", three_mf),
    ("broken.off", off_broken),
    ("box.stl", stl),
    ("text.stl", stl_text),
    ("text.ply", ply_text),
    ("box.ply", ply),
    ("big.ply", lambda: ply(">", "big")),
]


@pytest.mark.parametrize(("name", "data"), WAYS, ids=[name for name, _ in WAYS])
def test_a_box_is_a_box(tmp_path: Path, name: str, data: Callable[[], bytes]) -> None:
    (tmp_path / name).write_bytes(data())
    mesh = read_model(tmp_path / name, up="z", unit="cm").mesh
    assert mesh.metres == 0.01
    assert len(mesh.positions) == 8
    assert len(mesh.triangles) == 12
    assert (mesh.neighbours >= 0).all()
    a, b, c = mesh.corners.transpose(1, 0, 2)
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(1)
    np.testing.assert_array_equal(mesh.box, [(0, 0, 0), (1, 1, 1)])


@pytest.mark.parametrize(("name", "data"), WAYS, ids=[name for name, _ in WAYS])
def test_damaged_files_end_in_one_line(tmp_path: Path, name: str, data: Callable[[], bytes]) -> None:
    rng = np.random.default_rng(1)
    whole = data()
    refused = []
    for k in range(60):
        wrong = bytearray(whole)
        for at in rng.integers(0, len(whole), rng.integers(1, 4)):
            wrong[at] = rng.integers(256) if k % 2 else ord(rng.choice(list("019-. n")))
        (tmp_path / name).write_bytes(wrong[: rng.integers(1, len(wrong))] if k % 5 == 0 else wrong)
        try:
            read_model(tmp_path / name)
        except (FormatError, InputError) as error:
            refused.append(str(error))
    assert refused
    assert not [text for text in refused if "\n" in text]


OBJ = """# two objects
mtllib none.mtl
v 0 0 0
v 1 0 0
v 1 1 0 # a comment
v 0 1 0 0.5 0.5 0.5
vt 0 0
vt 1 0 0
vt 1 1
vn 0 0 2
o Seat
g Cushion
usemtl Leather
f 1/1/1 2/2/1 3/3/1
usemtl Oak
f -4 -2 -1
o Leg
v 0 0 5
v 1 0 5
v 1 1 5
s off
f 5//1 6//1 \\
 7//1
f -1// -2 -3/1
f 1 2
"""


def test_obj_has_parts_coordinates_and_normals(tmp_path: Path) -> None:
    (tmp_path / "chair.obj").write_text(OBJ)
    model = read_model(tmp_path / "chair.obj", up="z")
    assert model.mesh.parts == ("Seat/Cushion/Leather", "Seat/Cushion/Oak", "Leg")
    assert [part.material for part in model.parts] == ["Leather", "Oak", "Oak"]
    assert model.mesh.part.tolist() == [0, 1, 2, 2]
    assert model.mesh.uv is None  # not all have some
    assert model.uv is not None
    np.testing.assert_array_equal(model.uv[0], [(0, 1), (1, 1), (1, 0)])  # v downward
    np.testing.assert_array_equal(model.uv[3, 2], (0, 1))
    assert np.isnan(model.uv[1]).all()
    assert model.mesh.normals is not None
    np.testing.assert_array_equal(model.mesh.normals[0], [(0, 0, 1)] * 3)
    assert read_model(tmp_path / "chair.obj", parts=["cushion"]).mesh.parts == model.mesh.parts[:2]
    assert read_model(tmp_path / "chair.obj", parts=["oak"]).mesh.parts == model.mesh.parts[1:]
    np.testing.assert_array_equal(model.mesh.corners[1], [(0, 0, 0), (1, 1, 0), (0, 1, 0)])  # by -4 -2 -1
    (seat,) = read_model(tmp_path / "chair.obj", parts=["*Leather"]).mesh.triangles.tolist()
    assert seat == [0, 1, 2]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("v 0 0 0\n", "no faces"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "names v 4; there are 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "vertex 0"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "names v -4"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n", "names vt 1; there are 0"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 zero\nf 1 2 3\n", "not numbers: 'zero'"),
        ("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "not all finite"),
        ("v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "v has 2 numbers"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1.5 2 3\n", "not whole numbers"),
        ("v 0 0 1e30\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "beyond"),
        ("v 0 0 0\n" + "f" + " 1" * 5000 + "\n", "5000 corners"),
    ],
)
def test_wrong_obj_files_are_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "wrong.obj").write_text(text)
    with pytest.raises((FormatError, InputError), match=said):
        read_model(tmp_path / "wrong.obj")


def test_announced_counts_are_checked_before_room_is_made(tmp_path: Path) -> None:
    for name, data in (
        ("a.stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50)),
        ("a.off", b"OFF\n999999999 1 0\n0 0 0\n3 0 0 0\n"),
        ("a.ply", ply_text().replace(b"vertex 8", b"vertex 11000000")),
        ("b.ply", ply().replace(b"face 7", b"face 9000000")),
        ("c.ply", ply_text().replace(b"uchar int vertex_indices", b"uchar int none")),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises((FormatError, InputError)):
            read_model(tmp_path / name)


def star(rng: np.random.Generator, corners: int) -> np.ndarray:
    """Return a polygon that is seldom convex, (n, 2), which turns to the left."""
    angles = (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) * 2 * np.pi / corners
    return rng.uniform(0.2, 1, corners)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


@given(st.integers(0, 2**32 - 1), st.integers(4, 12))
def test_concave_polygons_are_cut_into_what_they_cover(seed: int, corners: int) -> None:
    """All triangles face the polygon's side, and their areas add up to its area."""
    rng = np.random.default_rng(seed)
    flat = star(rng, corners)
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = flat @ frame[:2]
    normal = np.cross(frame[0], frame[1])
    (cut,) = cut_polygons(points, np.arange(corners)[None])
    a, b, c = points[cut].transpose(1, 0, 2)
    areas = np.cross(b - a, c - a) @ normal / 2
    x, y = flat.T
    assert (areas >= -1e-12).all()
    assert areas.sum() == pytest.approx((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)
    assert sorted(np.unique(cut)) == list(range(corners))


@pytest.mark.parametrize("turn", range(4))
def test_a_dart_is_cut_at_its_dent(turn: int) -> None:
    points = np.roll([(0.0, 0, 0), (2, -1, 0), (1, 0, 0), (2, 1, 0)], turn, axis=0)
    (cut,) = cut_polygons(points, np.arange(4)[None])
    a, b, c = points[cut].transpose(1, 0, 2)
    np.testing.assert_allclose(np.cross(b - a, c - a)[:, 2], 1)


def test_polygons_without_area_or_that_cross_themselves_end(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    for points in (np.zeros((9, 3)), rng.normal(size=(40, 3)), np.repeat(rng.normal(size=(5, 3)), 3, axis=0)):
        (cut,) = cut_polygons(points, np.arange(len(points))[None])
        assert cut.shape == (len(points) - 2, 3)
        TriangleMesh(points, cut)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
@pytest.mark.parametrize(
    ("name", "data"), [("box.obj", obj), ("box.off", off), ("box.ply", ply_text), ("box.stl", stl_text)]
)
def test_text_may_have_a_mark_of_its_encoding(
    tmp_path: Path, name: str, data: Callable[[], bytes], encoding: str
) -> None:
    (tmp_path / name).write_bytes(data().decode().encode(encoding))
    assert len(read_model(tmp_path / name).mesh.triangles) == 12


def test_a_binary_file_that_begins_like_text_is_binary(tmp_path: Path) -> None:
    data = b"\xff\xfe\x00\xd8" + stl()[4:]
    (tmp_path / "box.stl").write_bytes(data)
    assert len(read_model(tmp_path / "box.stl").mesh.triangles) == 12


THREE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("kind", "text", "said"),
    [
        ("obj", f"# v a\n\n{THREE}v 0 1,5 0\nf 1 2 3\n", "line 6: numbers of v are not numbers: '1,5'"),
        ("obj", "v 0 0 0\nv 1 \\\n0 0\nv 0 inf 0\nf 1 2 3\n", "line 4: numbers of v are not all finite"),
        ("obj", "v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "line 2: v has 2 numbers"),
        ("obj", f"{THREE}f 1 2\nf 1 2 3\nf 1 2 x\n", "line 6: corners of a face are not numbers: 'x'"),
        ("obj", f"{THREE}f 1 2 3\nf 1 2 1.5\n", "line 5: corners of a face are not whole"),
        ("obj", f"{THREE}f 1 2 3\nf 1 2 9\n", "line 5: a face names v 9; there are 3"),
        ("obj", f"{THREE}f 1 2 3\nf 1 2 0\n", "line 5: a face names vertex 0"),
        ("off", "OFF\n3 1 0\n\n0 0 0\n1 0 x\n0 1 0\n3 0 1 2\n", "line 5: vertices are not numbers: 'x'"),
        ("off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 y\n", "face 0: its vertices are not numbers"),
        ("off", "# c\nOFF\n3 z 0\n0 0 0\n", "line 3: the counts are not numbers: 'z'"),
        ("stl", "solid\nfacet\nvertex 0 0 0\nvertex 1 0 q\nvertex 0 1 0\nendfacet\n", "line 4: coord"),
        ("ply", ply_text().decode().replace("0.0 1.0", "0.0 w", 1), "line 11: its rows are not numbers: 'w'"),
    ],
)
def test_errors_in_numbers_have_lines(tmp_path: Path, kind: str, text: str, said: str) -> None:
    (tmp_path / f"a.{kind}").write_text(text)
    with pytest.raises(FormatError, match=said):
        read_model(tmp_path / f"a.{kind}")
