"""Surface and layout chunks: what is written comes back, and stays joined."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster.base.errors import FormatError, InputError
from upholster.codec.stream.byte_reader import ByteReader
from upholster.codec.stream.layout_chunk import pack_layout, parse_layout
from upholster.codec.stream.surface_chunk import pack_surface, parse_surface
from upholster.geometry.built_in.catalog import SURFACES, surface_from_spec
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.built_in.surface_files import read_nets
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart

SPECS = (
    "cyclide",
    "cyclide:a=7.3,c=1,mu=2.1,spans=6x4",
    "torus:R=3,r=0.1",
    "sphere",
    "sphere:r=2,tiling=octants",
    "plane:width=3,spans=2x5",
    "ellipsoid:rz=0.2",
    "cylinder:spans=7",
    "cone:r2=0",
    "vase:height=1.1",
)


SPEC = (Path(__file__).parents[2] / "SPEC.md").read_text(encoding="utf-8")


def back(surface: Any) -> Any:
    return parse_surface(ByteReader(pack_surface(surface)))


@pytest.mark.parametrize("spec", SPECS)
def test_a_built_in_surface_is_rebuilt_exactly(spec: Any) -> None:
    surface = surface_from_spec(spec)
    assert len(pack_surface(surface)) <= 40
    again = back(surface)
    assert (again.name, again.source, again.tolerance) == (surface.name, surface.source, surface.tolerance)
    assert all((a.net == b.net).all() for a, b in zip(surface.patches, again.patches, strict=True))


def test_every_surface_has_its_number_of_the_format_for_good() -> None:
    (reported,) = re.findall(r"`kind` u8: (.*), 9 a mesh\.", SPEC)
    numbers = {name: kind.number for name, kind in SURFACES.items() if kind.number is not None}
    assert ", ".join(f"{number} {name}" for name, number in numbers.items()) == reported
    assert sorted([*numbers.values(), 9]) == list(range(1, len(numbers) + 2))
    for name, number in numbers.items():
        assert pack_surface(surface_from_spec(name))[0] == number


def test_a_surface_without_a_number_is_sent_as_control_nets(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SURFACES, "torus", replace(SURFACES["torus"], number=None))
    data = pack_surface(surface_from_spec("torus"))
    again = parse_surface(ByteReader(data))
    assert data[0] == 0
    assert again.source is None
    assert len(again.patches) == 16


@pytest.mark.parametrize("spec", SPECS)
def test_nets_stay_joined_and_close(spec: Any) -> None:
    built = surface_from_spec(spec)
    surface = Surface(built.patches, "mine")
    again = back(surface)
    assert again.name == "mine"
    assert again.shared == surface.shared
    assert again.degenerate == surface.degenerate
    for a, b in zip(surface.patches, again.patches, strict=True):
        np.testing.assert_allclose(a.control_points, b.control_points, atol=1e-6 * surface.size)


def test_shared_points_are_stored_once_and_equal_to_the_bit() -> None:
    surface = Surface(ring_cyclide().patches, "mine")
    data = pack_surface(surface)
    # 64 points of the 8 × 8 grid, as float32, 32 seams of three or four bytes, and little else.
    assert len(data) < 64 * 16 + 130 + 32 * 4
    again = back(surface)
    for edge in again.shared:
        here = again.patches[edge.patch].edge(edge.edge)
        there = again.patches[edge.other_patch].edge(edge.other_edge)
        assert (here == (there[::-1] if edge.opposed else there)).all()


def test_edges_that_meet_but_for_rounding_are_joined_and_stay_so() -> None:
    # The shared edge lies where float32 rounds one way on the left patch and the other way on the right.
    middle = 1 + 2.0**-24
    left, right = middle - 1e-12, middle + 1e-12
    surface = Surface(
        [
            RationalPatch.from_points(np.array([[[0, 0, 0], [left, 0, 0]], [[0, 1, 0], [left, 1, 0]]])),
            RationalPatch.from_points(np.array([[[right, 0, 0], [2, 0, 0]], [[right, 1, 0], [2, 1, 0]]])),
        ],
        "nearly",
    )
    data = pack_surface(surface)
    assert data[1] & 1 == 0  # float32
    again = parse_surface(ByteReader(data))
    assert again.shared == surface.shared
    assert (again.patches[0].edge(1) == again.patches[1].edge(3)).all()


def test_nets_that_float32_would_tear_are_kept_exactly() -> None:
    left = RationalPatch.from_points([[[0.0, 0, 0], [0.1, 0, 0]], [[0, 0.3, 0], [0.1, 0.3, 0]]])
    upper, lower = RationalPatch.from_points(
        [[[0.1, 0, 0], [0.2, 0, 0]], [[0.1, 0.3, 0], [0.2, 0.3, 0]]]
    ).split(s=0.4)
    surface = Surface([left, upper, lower], "T-junction")
    assert not all(edge.whole for edge in surface.shared)
    again = back(surface)
    assert again.shared == surface.shared


@pytest.mark.parametrize("spec", [*SPECS, "cyclide:a=6,c=2,mu=6", "torus"])
def test_what_edges_of_faces_share_is_passed_on_and_not_found_again(spec: Any) -> None:
    surface = surface_from_spec(spec)
    again = back(surface)
    assert "face_shared" in vars(again)
    assert again.face_shared == surface.face_shared
    nets = Surface(surface.patches, "mine")
    assert back(nets).face_shared == nets.face_shared


def test_parts_of_edges_that_meet_are_found_to_a_billionth() -> None:
    ring = surface_from_spec("torus").patches
    surface = Surface([*ring[1:5], *ring[0].split(s=0.5), *ring[5].split(t=0.3), *ring[6:]], "cut", 1e-8)
    reported = back(surface).face_shared
    assert len(reported) == len(surface.face_shared)
    partial = 0
    for here, there in zip(surface.face_shared, reported, strict=True):
        assert (here.face, here.edge, here.other_face, here.other_edge) == (
            there.face,
            there.edge,
            there.other_face,
            there.other_edge,
        )
        ends = [(one.start, one.stop, one.other_start, one.other_stop) for one in (here, there)]
        np.testing.assert_allclose(ends[0], ends[1], atol=2.0**-30)
        partial += {*ends[0]} != {0.0, 1.0}
    assert partial > 4


def test_intervals_that_overlap_by_the_tolerance_are_trimmed() -> None:
    def sheet(x: float, width: float, y: float) -> Any:
        return RationalPatch.from_points(
            [[[x, y + 1, 0], [x + width, y + 1, 0]], [[x, y, 0], [x + width, y, 0]]]
        )

    # Two narrow sheets below a wide one overlap by less than the tolerance.
    surface = Surface([sheet(0, 2, 0), sheet(0, 1.004, -1), sheet(0.998, 1.002, -1)], "loose", 0.005)
    reported = [one for one in back(surface).face_shared if one.face == 0]
    assert [one.other_face for one in reported] == [1, 2]
    assert reported[0].stop == reported[1].start


def test_a_changed_surface_is_not_taken_for_the_built_in_one() -> None:
    cyclide = ring_cyclide()
    moved = [RationalPatch(patch.net * [1, 1, 2, 1]) for patch in cyclide.patches]
    again = back(replace(cyclide, faces=moved))
    np.testing.assert_allclose(again.patches[3].net, moved[3].net, rtol=1e-6, atol=1e-6)
    for changed in (cyclide.turned(), replace(cyclide, tolerance=1e-6), replace(cyclide, name="mine")):
        assert changed.source is None
        assert back(changed).tolerance == changed.tolerance


def test_different_degrees(tmp_path: Any) -> None:
    path = tmp_path / "nets.json"
    points = "[[[0,0,0],[1,0,0],[2,0,1]],[[0,1,0],[1,1,0],[2,1,0]]]"
    path.write_text(
        f'{{"patches": [{{"points": {points}}}, {{"points": [[[0,1,0],[2,1,0]],[[0,2,0],[2,2,0]]]}}]}}'
    )
    surface = read_nets(path)
    again = back(surface)
    assert [patch.degree for patch in again.patches] == [patch.degree for patch in surface.patches]
    assert all((a.net == b.net).all() for a, b in zip(surface.patches, again.patches, strict=True))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\x0a", "byte 0: kind of surface is 10; allowed: 0 to 9"),
        (b"\x01\x01" + b"\0" * 6 + b"\xf8\x7f", "byte 2: a is nan; allowed: finite"),
        (b"\x01\x01" + b"\0" * 8, "byte 1: a is 0.0"),
        (b"\x01\x08\x80\x02\x80\x02", "byte 6: spans make 65536 patches"),
        (b"\x04\0\1\2\0!", "byte 5: 1 bytes too many in surface"),
        (b"\x04\0\0", "byte 2: number of seams is 0; allowed: 1 to 1"),
        (b"\x04\0\1\6\0", "byte 3: kind of a seam is 6; allowed: 0 to 5"),
        (b"\x04\0\1\0\0\4", "byte 5: edge of a face is 4; allowed: 0 to 3"),
        (b"\x04\0\2\0\0\2\2\0", "byte 8: seams overlap"),
        (b"\x04\0\1\5\0\1\x80\x80\x80\x80\4", "byte 6: extent of a seam is 1073741824"),
        (b"\0\6\0" + b"\0" * 8 + b"\1\1\1\x0f" + b"\0\0\xc0\x7f" * 16, "byte 1: patch 0: weight"),
        (b"\0\6\0" + b"\0" * 8 + b"\1\1\1\x0f" + b"\0" * 64, "byte 1: patch 0: weight"),
        (b"\0\4\0" + b"\0" * 8 + b"\1\1\1\x07\x08" + b"\0" * 36, "byte 16: reference is to point"),
        (b"\0\4\0" + b"\0" * 8 + b"\x80\x80\x04\x20\x20", "byte 16: nets have 71368704 control points"),
    ],
)
def test_malformed_surfaces_are_refused(data: Any, message: Any) -> None:
    with pytest.raises(FormatError) as error:
        parse_surface(ByteReader(data))
    assert str(error.value).startswith(message)


def by_patch(height: Any, width: int) -> Any:
    return [Chart(0, height(n), width, n // 4, n // 4 + 1, n % 4, n % 4 + 1) for n in range(16)]


LAYOUTS = (
    by_patch(lambda _: 512, 512),
    by_patch(lambda n: 40 + n, 64),
    [Chart(0, 7, 9), Chart(0, 8, 9, 1, 4, 0, 4)],
    [Chart(0, 8, 8, 0.0, 0.5, 0.25, 4.0), Chart(0, 8, 8, 0.5, 3.75)],
    [Chart(0, 8, 8, 0.0, 1 / 3, 0.25, 1.0), Chart(0, 8, 8, 1 / 3)],
)


@pytest.mark.parametrize("charts", LAYOUTS)
def test_a_layout_comes_back(charts: Any) -> None:
    surface = ring_cyclide()
    assert parse_layout(ByteReader(pack_layout(charts, surface)), surface) == tuple(charts)


def test_a_layout_of_several_faces_comes_back() -> None:
    surface = Surface([*ring_cyclide().faces, *sphere().faces])
    charts = (Chart(0, 9, 8, 1.5, 4, 0, 2), Chart(3, 8, 8, 0.25), Chart(6, 8, 8))
    assert parse_layout(ByteReader(pack_layout(charts, surface)), surface) == charts


def test_faces_of_nets_come_back() -> None:
    surface = Surface([*ring_cyclide().faces, *sphere().faces], "two")
    again = back(surface)
    assert [(f.rows, f.columns) for f in again.faces] == [(4, 4)] + 6 * [(1, 1)]
    assert again.shared == surface.shared
    assert again.face_shared == surface.face_shared


def test_the_paper_s_layout_takes_three_bytes() -> None:
    assert len(pack_layout(LAYOUTS[0], ring_cyclide())) == 3


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\x0f\x80\x80\x02", "byte 1: height of a chart is 32768; allowed: 1 to 16384"),
        (b"\x0f\x80\x80\x01", "byte 4: layout has 4294967296 texels"),
        (b"\x0e\x00", "byte 1: number of charts is 0"),
        (b"\x0c\x01\x10\x08", "byte 2: face of a chart is 16; allowed: 0 to 0"),
        (b"\x0f", "byte 1: height of a chart takes 1 bytes; 0 are left"),
        (b"\x0c\x01\x00\x08" + b"\0" * 32, "byte 36: a chart covers parameters outside"),
    ],
)
def test_malformed_layouts_are_refused(data: Any, message: Any) -> None:
    with pytest.raises(FormatError) as error:
        parse_layout(ByteReader(data), ring_cyclide())
    assert str(error.value).startswith(message)


@pytest.mark.parametrize(
    "charts",
    [
        [],
        [Chart(1, 8, 8)],
        [Chart(0, 8, 8, 0, 5)],
        [Chart(0, 0, 8)],
        [Chart(0, 8, 8, 0.5, 0.5)],
        [Chart(0, 16384, 16384)] * 9,
    ],
)
def test_layouts_that_the_format_does_not_hold_are_refused(charts: Any) -> None:
    with pytest.raises(InputError, match=r"allowed|outside"):
        pack_layout(charts, ring_cyclide())
