"""Bricks on a surface of revolution: each course closes, and blocks end with their course."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from upholster import read_exemplar, synthesize
from upholster.covering.measure import broken_elements
from upholster.geometry.built_in.cyclide import torus
from upholster.image.elements.courses import find_courses
from upholster.image.elements.joints import find_joints
from upholster.image.elements.lattice import find_lattice
from upholster.image.files.write import write_image
from upholster.quilt.painting import paint
from upholster.synthesis import setup

BRICKS = read_exemplar(Path(__file__).parent.parent.parent / "examples" / "bricks.png", resize=128)

ROUND: dict[str, Any] = {"texels": 1_000_000, "sample_size": 1.0, "direction": "around:z", "seed": 1}


def broken(**options: object) -> tuple[float, ...]:
    """Return the shares of cuts that break bricks on a torus, between courses and along them."""
    surface, lattice = torus(), find_lattice(BRICKS)
    assert lattice is not None
    quilt = synthesize(BRICKS, surface, **ROUND, **options)
    courses = find_courses(lattice, find_joints(BRICKS))
    assert courses is not None
    return broken_elements(quilt, lattice, surface, courses=courses).share


def test_bricks_round_a_torus_are_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    assert max(broken()) < 0.005
    monkeypatch.setattr(setup, "course_field", lambda *_: None)
    assert min(broken()) > 0.01


def test_a_picture_is_put_over_courses(tmp_path: Path) -> None:
    """The picture is whole, and the image in which it is next to the sample has no courses of its own."""
    write_image(tmp_path / "sign.png", np.full((40, 40, 3), (255, 255, 0), np.uint8))
    place = f"{tmp_path}/sign.png@0.6=2.7,0,0"
    quilt = synthesize(BRICKS, torus(), **ROUND, put=(place,))
    assert quilt.exemplar_shape[1] > BRICKS.shape[1]
    shown = np.zeros(quilt.exemplar_shape, np.float32)
    shown[:, BRICKS.shape[1] :] = 1
    texels = paint(quilt, shown[..., None])
    area = sum(float(array.sum()) for array in texels.arrays)
    wanted = 0.6**2 * sum(array.size for array in texels.arrays) / (4 * np.pi**2 * 2 * 0.7)
    assert area == pytest.approx(wanted, rel=0.15)


def test_mirrored_blocks_end_with_their_course_too() -> None:
    assert max(broken(mirror=True)) < 0.005
