"""Bricks on a surface of revolution: each course closes, and blocks end with their course."""

from pathlib import Path

import pytest

from upholster import read_exemplar, synthesize
from upholster.covering.measure import broken_elements
from upholster.geometry.built_in.cyclide import torus
from upholster.image.elements.courses import find_courses
from upholster.image.elements.joints import find_joints
from upholster.image.elements.lattice import find_lattice
from upholster.synthesis import setup

BRICKS = read_exemplar(Path(__file__).parent.parent.parent / "examples" / "bricks.png", resize=128)


def broken(**options: object) -> tuple[float, ...]:
    """Return the shares of cuts that break bricks on a torus, between courses and along them."""
    surface, lattice = torus(), find_lattice(BRICKS)
    assert lattice is not None
    quilt = synthesize(
        BRICKS, surface, texels=1_000_000, sample_size=1.0, direction="around:z", seed=1, **options
    )
    courses = find_courses(lattice, find_joints(BRICKS))
    assert courses is not None
    return broken_elements(quilt, lattice, surface, courses=courses).share


def test_bricks_round_a_torus_are_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    assert max(broken()) < 0.005
    monkeypatch.setattr(setup, "course_field", lambda *_: None)
    assert min(broken()) > 0.01


def test_mirrored_blocks_end_with_their_course_too() -> None:
    assert max(broken(mirror=True)) < 0.005
