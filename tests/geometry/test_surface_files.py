"""Reading and writing surfaces: round trips, damaged files, limits."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.nets import write_nets
from hypothesis import given
from hypothesis import strategies as st

from upholster.base.errors import FormatError, InputError, UpholsterError
from upholster.geometry.built_in import surface_files
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import vase
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.built_in.surface_files import read_bpt, read_nets, read_surface
from upholster.geometry.patches.orientation import signed_volume
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface


def box_bpt(*, indexed: bool, inward: bool = False) -> str:
    """A closed box of six flat bi-cubic patches and a lid-like seventh that ends in a point."""
    corners = {
        "front": [(0, 0, 1), (1, 0, 1), (0, 0, 0), (1, 0, 0)],
        "right": [(1, 0, 1), (1, 1, 1), (1, 0, 0), (1, 1, 0)],
        "back": [(1, 1, 1), (0, 1, 1), (1, 1, 0), (0, 1, 0)],
        "left": [(0, 1, 1), (0, 0, 1), (0, 1, 0), (0, 0, 0)],
        "bottom": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)],
        "top": [(0, 1, 1), (1, 1, 1), (0, 0, 1), (1, 0, 1)],
        "flag": [(3, 0, 1), (3, 0, 1), (3, 0, 0), (4, 0, 0)],
    }
    nets = []
    for four in corners.values():
        net = RationalPatch.from_points(np.array(four, float).reshape(2, 2, 3)).elevate(3, 3).control_points
        nets.append(net[:, ::-1] if inward else net)
    if not indexed:
        return "".join(
            [f"{len(nets)}\n"]
            + [
                "3 3\n" + "".join(f"{x:.15g} {y:.15g} {z:.15g}\n" for x, y, z in n.reshape(-1, 3))
                for n in nets
            ]
        )
    points, index = np.unique(np.round(np.concatenate(nets).reshape(-1, 3), 6), axis=0, return_inverse=True)
    rows = [",".join(str(k + 1) for k in row) for row in index.reshape(-1, 16)]
    return (
        "\n".join([str(len(nets)), *rows, str(len(points)), *(f"{x},{y},{z}" for x, y, z in points)]) + "\n"
    )


@pytest.mark.parametrize("indexed", [True, False])
@pytest.mark.parametrize("inward", [True, False])
@pytest.mark.parametrize("suffix", [".bpt", ".bpt.txt", ".BPT"])
def test_bpt(tmp_path: Path, indexed: bool, inward: bool, suffix: str) -> None:
    path = tmp_path / f"box{suffix}"
    path.write_text(box_bpt(indexed=indexed, inward=inward))
    surface = read_surface(path)
    assert surface.name == "box"
    assert [patch.degree for patch in surface.patches] == [(3, 3)] * 7
    assert len(surface.shared) == 12
    assert surface.degenerate == {(6, 0)}
    assert {b.patch for b in surface.border} == {6}
    box = Surface(surface.patches[:6])
    assert signed_volume(box) == pytest.approx(1.0, abs=1e-5)
    # rows still run down
    assert surface.patches[0].points([0.0, 1.0], [0.5, 0.5])[:, 2] == pytest.approx([1, 0])


def test_bpt_of_other_degrees_and_with_spaces_and_empty_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.bpt"
    path.write_text("\n 1 \n\n1 2\r\n0,0,0\n1 0 0\n 2\t0  0\n0 1 0\n\n1 1 1\n2 1 0\n\n")
    (patch,) = read_bpt(path).patches
    assert patch.degree == (1, 2)
    assert signed_volume(Surface([patch])) >= 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "0 bytes"),
        ("\n\n", "ends after line 2"),
        ("0\n", "line 1: 0 in the number of patches"),
        ("70000\n", "line 1: 70000"),
        ("99999999999999999999999\n", "line 1: 65537"),
        ("x\n", "line 1: 'x'"),
        ("1 2 3\n", "line 1: 3 numbers"),
        ("1\n1,2,3\n", "line 2: 3 numbers"),
        ("1\n" + "1 " * 16, "ends after line 2, where the number of points"),
        ("1\n" + "1 " * 15 + "0\n1\n0 0 0\n", "line 2: 0 in 16 point numbers"),
        ("1\n\n" + "1 " * 15 + "2\n1\n0 0 0\n", "line 3: point 2; allowed: 1 to 1"),
        ("1\n" + "1 " * 16 + "\n2\n0 0 0\n", "ends after line 4"),
        ("1\n" + "1 " * 16 + "\n1\n0 0 zero\n", "line 4: '0 0 zero'"),
        ("1\n" + "1 " * 16 + "\n1\n0 0 1_0\n", "line 4: '0 0 1_0'"),
        ("1\n" + "1 " * 16 + "\n1\n0 0 0\n0 0 0\n", "line 5: more lines"),
        ("1\n3 33\n", "line 2: 33 in two degrees"),
        ("1\n1 1\n0 0 0\n1 0 0\n", "ends after line 4"),
        ("1\n" + " " * 5000, "line 2: too long"),
    ],
)
def test_damaged_bpt(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.bpt"
    path.write_text(text)
    with pytest.raises(UpholsterError, match=re.escape(message)) as caught:
        read_bpt(path)
    assert "\n" not in str(caught.value)


def test_bpt_with_bad_coordinates_names_the_patch(tmp_path: Path) -> None:
    path = tmp_path / "a.bpt"
    path.write_text("1\n1 1\n0 0 0\n1 0 0\n0 nan 0\n1 1 1\n")
    with pytest.raises(InputError, match=re.escape("patch 0: control point [1, 0]")):
        read_bpt(path)


@given(st.data())
def test_any_cut_of_a_bpt_is_refused(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    text = box_bpt(indexed=data.draw(st.booleans()))
    cut = data.draw(st.integers(0, len(text.rstrip()) - len(text.rstrip().rsplit(None, 1)[1])))
    path = tmp_path_factory.getbasetemp() / "cut.bpt"
    path.write_text(text[:cut])
    with pytest.raises(UpholsterError):
        read_bpt(path)


@pytest.mark.parametrize("surface", [ring_cyclide(), sphere(), vase(), plane(2, 3)], ids=lambda s: s.name)
def test_nets_round_trip(tmp_path: Path, surface: Surface) -> None:
    path = tmp_path / "nets.json"
    write_nets(path, surface)
    again = read_nets(path)
    assert again.name == surface.name
    assert again.tolerance == surface.tolerance
    assert len(again.shared) == len(surface.shared)
    for one, two in zip(surface.patches, again.patches, strict=True):
        np.testing.assert_allclose(two.net, one.net, rtol=1e-15, atol=1e-15)


def test_nets_without_options(tmp_path: Path) -> None:
    path = tmp_path / "little hat.json"
    path.write_text('{"patches": [{"points": [[[0, 0, 0], [1, 0, 0]], [[0, -1, 0], [1, -1, 2e0]]]}]}')
    surface = read_surface(str(path))
    assert surface.name == "little hat"
    assert (surface.patches[0].weights == 1).all()


def test_nets_that_point_inward_are_turned(tmp_path: Path) -> None:
    path = tmp_path / "nets.json"
    write_nets(path, sphere().turned())
    assert signed_volume(sphere().turned()) < 0
    assert signed_volume(read_nets(path)) == pytest.approx(signed_volume(sphere()))


SQUARE: list[Any] = [[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 0]]]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ([], "the file is a list of 0; allowed: an object"),
        (7, "the file is 7"),
        ({}, "no 'patches'"),
        ({"patchs": []}, "did you mean 'patches'"),
        ({"patches": []}, "patches is a list of 0"),
        ({"patches": {}}, "patches is an object of 0"),
        ({"patches": [1]}, "patch 0 is 1"),
        ({"patches": [{"points": SQUARE}, {}]}, "patch 1 has no 'points'"),
        ({"patches": [{"points": SQUARE, "weigths": 1}]}, "did you mean 'weights'"),
        ({"patches": [{"points": [[1]]}]}, "patch 0: points is a list of 1"),
        ({"patches": [{"points": [[1], [2]]}]}, "points[0] is a list of 1"),
        ({"patches": [{"points": [SQUARE[0], SQUARE[1][:1]]}]}, "points[1] is a list of 1"),
        ({"patches": [{"points": [SQUARE[0], [[0, 1], [0, 1, 2]]]}]}, "points[1][0] is a list of 2"),
        ({"patches": [{"points": [SQUARE[0], [["0", 1, 1], [0, 1, 2]]]}]}, "points[1][0] is a list of 3"),
        ({"patches": [{"points": [SQUARE[0], [[True, 1, 1], [0, 1, 2]]]}]}, "points[1][0] is a list of 3"),
        ({"patches": [{"points": [SQUARE[0], [[10**400, 1, 1], [0, 1, 2]]]}]}, "points[1][0] is a list of 3"),
        ({"patches": [{"points": SQUARE, "weights": [[1, 1], [1, None]]}]}, "weights[1][1] is None"),
        ({"patches": [{"points": SQUARE, "weights": [[1, 1, 1], [1, 1, 1]]}]}, "weights are 2 x 3"),
        ({"patches": [{"points": SQUARE, "weights": [[1, 1], [0, 1]]}]}, "patch 0: weight [1, 0] is 0"),
        ({"patches": [{"points": SQUARE, "weights": [[1, 1], [float("nan"), 1]]}]}, "weight [1, 0] is nan"),
        ({"patches": [{"points": [SQUARE[0], [[0, 1e300, 0], [1, 1, 0]]]}]}, "patch 0: control point [1, 0]"),
        ({"patches": [{"points": SQUARE}], "name": 3}, "name is 3"),
        ({"patches": [{"points": SQUARE}], "tolerance": 1}, "tolerance is 1"),
        ({"patches": [{"points": SQUARE}], "tolerance": "x"}, "tolerance is 'x'"),
        ({"patches": [{"points": SQUARE}] * 65_537}, "a list of 65537; allowed: a list of 1 to 65536"),
    ],
)
def test_bad_nets(tmp_path: Path, data: object, message: str) -> None:
    path = tmp_path / "nets.json"
    path.write_text(json.dumps(data))
    with pytest.raises(UpholsterError, match=re.escape(message)) as caught:
        read_nets(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'{"patches": [\n{"points": [[', "line 2 column 14"),
        (b"[" * 100_000, "nested too deep"),
        (b"[" + b"9" * 5000 + b"]", "number too long"),
        (b'{"patches": \xff}', "byte 12"),
    ],
)
def test_what_is_no_json(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "nets.json"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=re.escape(message)):
        read_nets(path)


def test_unreadable_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_surface(tmp_path / "none.json")
    with pytest.raises(InputError, match="is not a file"):
        read_nets(tmp_path)
    with pytest.raises(InputError, match="unknown suffix"):
        read_surface(tmp_path / "model.obj")
    write_nets(tmp_path / "large.json", plane())
    monkeypatch.setattr(surface_files, "MAX_FILE_BYTES", 20)
    with pytest.raises(InputError, match="allowed: 1 to 20"):
        read_nets(tmp_path / "large.json")
