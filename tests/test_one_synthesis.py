"""`synthesize` and `cover` take the same options, and lay the same quilt, bit for bit."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster import InputError, Quilt, cover, synthesize
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.image.files.write import write_image

STOOL = """o Seat
v 0 1 0
v 1 1 0
v 1 1 -1
v 0 1 -1
f 1 2 3 4
o Leg 1
v 0 0 0
v 1 0 0
f 5 6 2 1
"""
"""A model of two parts; y is up."""

FLAT: dict[str, Any] = {"on": "plane", "texels": (96, 64)}
ON_STOOL: dict[str, Any] = {"on": "stool.obj", "texels": 4000, "sample_size": 0.9}
ON_PLANE: dict[str, Any] = {"on": "plane", "texels": 4096, "sample_size": 1.0}
PAPER: dict[str, Any] = {"on": "sphere", "method": "paper", "chart": 64, "levels": 2, "block": 32}
PIXEL: dict[str, Any] = {"on": "plane", "method": "pixel", "chart": 24, "levels": 2}

REFUSED = [{**ON_STOOL, "direction": {"Nothing": "x"}}, {**ON_PLANE, "direction": {"Seat": "x"}}]

USES: dict[str, list[dict[str, Any]]] = {
    "texels": [ON_PLANE, FLAT],
    "density": [{"on": "torus", "density": 12.0}],
    "sample_size": [{"on": "stool.obj", "texels": 4000, "sample_size": 0.7}],
    "element_size": [{"on": "stool.obj", "texels": 4000, "element_size": 0.2}],
    "direction": [
        {**ON_STOOL, "direction": {"Seat": "x", "Leg*": "z"}},
        {**ON_STOOL, "direction": 30},
        {**ON_STOOL, "direction": (1, 1, 0)},
        {**ON_PLANE, "direction": "u"},
        {**ON_PLANE, "direction": lambda points: points[:, [1, 0, 2]] * (-1, 1, 0) + (1, 0, 0)},
        *REFUSED,
    ],
    "stroke": [{**ON_STOOL, "stroke": ("0.5,0.5,1:1,1,0",)}, {**ON_STOOL, "stroke": "strokes.json"}],
    "size_map": [{**ON_STOOL, "size_map": "height=0.5,2"}],
    "guide": [{**ON_STOOL, "guide": ("luminance=height",)}, {**ON_PLANE, "guide": "map.png=map.png@0.5"}],
    "labels": [{**FLAT, "labels": ("map.png=0.5,0.5,0:0.2",)}],
    "zone": [{**ON_STOOL, "zone": ("other.png=height>0.5",)}],
    "blend": [{**ON_STOOL, "zone": ("other.png@0.7=height>0.5",), "blend": 0.1}],
    "again": [{**ON_STOOL, "again": ("part:Seat@5",)}],
    "put": [
        {**ON_STOOL, "put": ("10,10,20,20=0.5,0.5,1@30",)},
        {**ON_STOOL, "put": ("other.png@0.7=0.5,0.5,1",)},
    ],
    "crease": [{**ON_STOOL, "crease": 20.0}],
    "fit": [{"on": "rod.step", "texels": 8000, "direction": "around", "fit": True}],
    "tileable": [{**FLAT, "tileable": True}],
    "method": [PAPER, PIXEL],
    "block": [{**ON_PLANE, "block": 16}],
    "overlap": [{**ON_PLANE, "block": 16, "overlap": 5}],
    "phase": [{**ON_PLANE, "phase": 0.0}],
    "variety": [{**ON_PLANE, "variety": 1.5}],
    "shortlist": [{**ON_PLANE, "shortlist": 3}],
    "mirror": [{**ON_PLANE, "mirror": True}],
    "rotate": [{**ON_PLANE, "rotate": True}],
    "chart": [{**PIXEL, "chart": 32}],
    "edge_block": [{**PAPER, "overlap": 8, "edge_block": 28}],
    "levels": [{**PAPER, "levels": 1}],
    "threshold": [{**PAPER, "threshold": 9.0}],
    "coefficients": [{**PAPER, "coefficients": 0.1}],
    "seams": [{**PAPER, "seams": False}],
    "search": [{**PIXEL, "search": "full"}],
}
"""Small uses of every option."""


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Write files that options name into the current folder."""
    monkeypatch.chdir(tmp_path)
    row, column = np.indices((48, 48))
    bricks = np.where((row % 8 < 1) | ((column + 6 * (row // 8 % 2)) % 12 < 1), 60, 200)
    noise = np.random.default_rng(1).integers(0, 40, (48, 48, 3))
    write_image("sample.png", (bricks[..., None] + noise).astype(np.uint8))
    write_image("other.png", (255 - bricks[..., None] - noise).clip(0).astype(np.uint8))
    write_image("map.png", np.where(column < 24, 0, 255).astype(np.uint8)[..., None])
    Path("stool.obj").write_text(STOOL)
    Path("strokes.json").write_text('[{"at": [0.5, 0.5, 1], "along": [1, 1, 0]}]')


def rod(path: str) -> None:
    """Write a cylinder as a STEP file."""
    pytest.importorskip("OCP")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    writer = STEPControl_Writer()
    writer.Transfer(BRepPrimAPI_MakeCylinder(5.0, 20.0).Shape(), STEPControl_AsIs)
    writer.Write(path)


def laid(use: Mapping[str, Any], *, by_cover: bool) -> Quilt | str:
    """Return the quilt of a use, or the message that refuses it."""
    choices = {name: value for name, value in use.items() if name != "on"}
    try:
        if not by_cover:
            return synthesize("sample.png", use["on"], seed=3, **choices)
        report = cover("sample.png", use["on"], "out.npz", synthesis=choices, seed=3)
    except InputError as error:
        return str(error)
    assert report.model is not None
    assert report.model.quilt is not None
    return report.model.quilt


def check_alike(use: Mapping[str, Any]) -> Quilt | str:
    ours, theirs = laid(use, by_cover=False), laid(use, by_cover=True)
    if isinstance(ours, str) or isinstance(theirs, str):
        assert ours == theirs
        return ours
    assert ours.charts == theirs.charts
    assert ours.density == theirs.density
    np.testing.assert_array_equal(ours.placements, theirs.placements)
    for one, other in zip(ours.labels, theirs.labels, strict=True):
        assert [layer.labels.tobytes() for layer in one] == [layer.labels.tobytes() for layer in other]
    for field, same in zip(ours.fields, theirs.fields, strict=True):
        assert field.nodes.tobytes() == same.nodes.tobytes()
    return ours


def test_a_direction_for_each_part() -> None:
    assert not isinstance(check_alike({**ON_STOOL, "direction": {"Seat": "x"}}), str)
    refused = check_alike({**ON_STOOL, "direction": {"Nothing": "x"}})
    assert isinstance(refused, str)
    assert "'Nothing'" in refused


def test_every_option_has_a_use() -> None:
    assert [entry.name for entry in fields(SynthesisOptions)] == list(USES)
    for option, uses in USES.items():
        assert all(option in use for use in uses)


@pytest.mark.slow(reason="lays 80 quilts, two for each use of an option")
@pytest.mark.parametrize("option", USES)
def test_synthesize_and_cover_lay_the_same_quilt(option: str) -> None:
    for use in USES[option]:
        if use["on"] == "rod.step":
            rod("rod.step")
        found = check_alike(use)
        assert isinstance(found, Quilt) or use in REFUSED, found
