"""Pieces that are put by hand, and regions that are laid once more, on every kind of surface."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laying import texture
from laying_kernels import lay_numbers

from upholster import Quilt, encode_stream, paint, synthesize
from upholster.charts.maps.map_ground import MapGround
from upholster.charts.maps.map_text import parse_map
from upholster.charts.maps.surface_map import region
from upholster.codec.stream.reader import read_stream
from upholster.covering.measure.trace import charted_of
from upholster.image.files.write import write_image
from upholster.quilt.chart import Chart
from upholster.synthesis.quilt.puts import PutPiece, piece_frame

CHAIR = str(Path(__file__).parents[2] / "examples" / "chair.glb")
SAMPLE = texture(128, 128, seed=4, passes=3)
FLAT: dict[str, Any] = {"texels": (200, 200), "seed": 1}


def read_at(quilt: Quilt) -> np.ndarray:
    """Return where each step of the only chart reads, (height, width, 2) in pixels."""
    return quilt.sources()[0] / 16


@pytest.mark.parametrize(
    ("size", "degrees"), [(1.0, 0.0), (1.5, 0.0), (1.0, 90.0), (0.75, 30.0), (2.0, -60.0)]
)
def test_a_piece_lies_as_it_was_put(size: float, degrees: float) -> None:
    """Turned clockwise, and so many times as large: a step reads as that says, about the piece's middle."""
    quilt = synthesize(SAMPLE, "plane", put=(f"20,40,48,32=100,90*{size}@{degrees}",), **FLAT)
    rows, columns = np.mgrid[:200, :200]
    down, right = rows - 90, columns - 100
    angle = np.radians(degrees)
    y = (np.cos(angle) * down - np.sin(angle) * right) / size
    x = (np.sin(angle) * down + np.cos(angle) * right) / size
    inside = (abs(y) < 13) & (abs(x) < 21)
    off = read_at(quilt) - np.stack([40 + 16 + y, 20 + 24 + x], axis=2)
    assert (np.abs(off[inside]).max(axis=1) < 0.7).mean() > 0.97
    assert np.abs(np.median(off[inside], axis=0)).max() < 0.4
    plain = synthesize(SAMPLE, "plane", **FLAT)
    assert np.abs((read_at(plain) - np.stack([56 + y, 44 + x], axis=2))[inside]).max() > 10


def test_all_else_is_laid_round_a_piece() -> None:
    quilt = synthesize(SAMPLE, "plane", put=("20,40,48,32=100,90",), **FLAT)
    read = read_at(quilt)
    assert (read[..., 0] >= 0).all()
    beyond = np.ones((200, 200), bool)
    beyond[60:122, 60:142] = False
    same = np.abs(read - np.stack(np.mgrid[:200, :200] + 0.0, axis=2) - (56 - 90, 44 - 100)).max(axis=2) < 1
    assert same[beyond].mean() < 0.1


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
@pytest.mark.parametrize("on", ["torus", "sphere", CHAIR])
def test_a_picture_shows_where_it_was_put(on: str, tmp_path: Path) -> None:
    sign = np.zeros((48, 64, 4), np.uint8)
    sign[4:-4, 4:-4] = 255, 0, 0, 255
    write_image(tmp_path / "sign.png", sign)
    places = {"torus": (1.9, 1.8, 0.4), "sphere": (0.6, 0.6, 0.5), CHAIR: (0.0, 0.2, 0.45)}
    x, y, z = places[on]
    options: dict[str, Any] = {"texels": 40_000, "seed": 1, "sample_size": 0.5 if on == CHAIR else 2.0}
    quilt = synthesize(SAMPLE, on, put=(f"{tmp_path}/sign.png={x},{y},{z}",), **options)
    second = np.zeros(quilt.exemplar_shape)
    second[4:44, 132:188] = 1
    shown = paint(quilt, second.astype(np.float32)[..., None], density=1).arrays
    charted = charted_of(quilt)
    assert charted is not None
    assert quilt.surface is not None
    ground = MapGround(charted, None, quilt.surface, False)
    width = options["sample_size"] / 2
    near = region(parse_map(f"{x},{y},{z}:{3 * width}"), ground)
    inside = sum(float(own[..., 0][at].sum()) for own, at in zip(shown, near, strict=True))
    lies = [charted.lies_on(n, (0, 0), own.shape) for n, own in enumerate(near)]
    beyond = sum(float(own[..., 0][on & ~at].sum()) for own, at, on in zip(shown, near, lies, strict=True))
    steps = float(np.mean([chart.height * chart.width for chart in quilt.charts]))
    assert inside > 0.02 * min(steps, 4000)
    assert beyond < 0.02 * inside  # no other block shows it


@pytest.mark.parametrize("name", ["plane", "tile", "torus"])
def test_a_region_is_laid_once_more(name: str) -> None:
    on = "torus" if name == "torus" else "plane"
    options: dict[str, Any] = {"texels": 20_000, "sample_size": 4.0}
    options = {"texels": (150, 150), "tileable": name == "tile"} if on == "plane" else options
    where = "2,1,0:2" if name == "torus" else "75,-75,0:45"
    before = synthesize(SAMPLE, on, seed=1, **options)
    after, other = (synthesize(SAMPLE, on, seed=1, again=(f"{where}@{seed}",), **options) for seed in (1, 2))
    charted = charted_of(before)
    assert charted is not None
    inside = region(parse_map(where), MapGround(charted, None, before.surface, False))
    if on == "plane":  # where a step is a unit, and rows lead down
        rows, columns = np.mgrid[:150, :150] + 0.5
        inside = (np.hypot(rows - 75, columns - 75) <= 45,)
    changed, apart = [], []
    for n, own in enumerate(inside):
        one, two, three = (
            paint(replace(quilt, has_tones=False), SAMPLE, density=1).arrays[n]
            for quilt in (before, after, other)
        )
        differs = (one != two).any(axis=2)
        changed.append(differs[own])
        apart.append((two != three).any(axis=2)[own])
        lies = charted.lies_on(n, (0, 0), own.shape)
        # Where a region ends at a seam, what is blended over it changes as well.
        assert (differs & ~own & lies).sum() <= (0 if on == "plane" else 0.02 * lies.sum())
    # Along its rim, a region two blocks wide continues what is around it.
    assert np.concatenate(changed).mean() > 0.3
    assert np.concatenate(apart).mean() > 0.3


def test_regions_are_laid_one_after_another() -> None:
    rows, columns = np.mgrid[:150, :150] + 0.5
    first, second = (np.hypot(rows - at, columns - at) <= 25 for at in (40, 110))
    texts = "40,-40,0:25@3", "110,-110,0:25@4"
    none, one, two = (
        paint(replace(quilt, has_tones=False), SAMPLE, density=1).arrays[0]
        for quilt in (
            synthesize(SAMPLE, "plane", texels=(150, 150), seed=1, again=again)
            for again in (None, texts[:1], texts)
        )
    )
    differs = (two != none).any(axis=2)
    assert min(differs[first].mean(), differs[second].mean()) > 0.25
    assert not differs[~first & ~second].any()
    np.testing.assert_array_equal(two[~second], one[~second])  # what was laid first stays


@pytest.mark.parametrize("block", [10, 16])
def test_a_stream_stores_a_region_that_is_laid_once_more(block: int) -> None:
    """New blocks show where blocks that stay have their centres; with block 10, one shows only there."""
    again = ("60,-60,0:40@3",)
    quilt = synthesize(SAMPLE, "plane", texels=(120, 120), seed=1, block=block, again=again)
    assert quilt.surface is not None
    found = read_stream(encode_stream(quilt.surface, quilt, SAMPLE)).quilt()
    np.testing.assert_array_equal(found.placements, quilt.placements)
    np.testing.assert_array_equal(found.labels[0][0].labels, quilt.labels[0][0].labels)


def test_a_pieces_frame_is_its_rectangle() -> None:
    numbers = lay_numbers(100, 100, 32)
    used = np.ones((20, 30), bool)
    used[:, 20:] = False
    for piece, cells in (
        (PutPiece((0, 5, 5), (10, 40, 20, 30)), 10 * 15),
        (PutPiece((0, 5, 5), (10, 40, 20, 30), used=used), 10 * 10),
    ):
        frame = piece_frame(piece, numbers)
        assert frame.source == (20, 55)
        assert (frame.numbers.size, frame.numbers.cell) == (32, 2)
        assert frame.mask.sum() == cells
        assert frame.half > np.hypot(20, 30) / 2
    np.testing.assert_allclose(
        PutPiece((0, 0, 0), (0, 0, 8, 8), 2.0, 90.0).turn(), [0, -0.5, 0.5, 0], atol=1e-12
    )
    moved = PutPiece((1, 10, 20), (0, 0, 8, 8)).on_charts(
        [Chart(0, 64, 64), Chart(1, 64, 64)], [Chart(0, 16, 16), Chart(1, 16, 16)]
    )
    assert moved.step == (1, 2, 5)
