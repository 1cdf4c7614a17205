"""Courses: found in running bond, with their joints; in no grid, weave or herringbone."""

import numpy as np
import pytest

import upholster
from upholster.image.elements.courses import Courses, find_courses
from upholster.image.elements.joints import find_joints
from upholster.image.elements.lattice import find_lattice


def bricks(high=24, long=48, offset=0.5, side=240, turned=False, down=0):
    """Bricks of different shades with dark joints; each course begins `offset` bricks after the one above."""
    rng = np.random.default_rng(3)
    rows, columns = np.mgrid[:side, :side]
    rows = rows + down
    course = rows // high
    along = columns + course * offset * long
    shades = rng.uniform(110, 190, (side // high + 2, side // long + side // high + 2))
    image = shades[course, (along // long).astype(int)] + rng.normal(0, 4, (side, side))
    joint = np.minimum(np.minimum(rows % high, -rows % high), np.minimum(along % long, -along % long)) < 2
    image = np.where(joint, 50, image)
    return np.clip(image.T if turned else image, 0, 255).astype(np.uint8)[..., None].repeat(3, axis=2)


def found_in(image) -> Courses | None:
    return find_courses(find_lattice(image), find_joints(image))


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("down", [0, 7])
def test_running_bond_has_courses_and_joints_between_them(turned, down):
    image = bricks(turned=turned, down=down)
    lattice, courses = find_lattice(image), found_in(image)
    wave = courses.wave(lattice.waves)
    np.testing.assert_allclose(np.abs(wave), (0, 1 / 24) if turned else (1 / 24, 0), atol=1e-3)
    phases = np.array(courses.multiples) @ lattice.phases.reshape(2, -1).astype(np.int64)
    away = (phases / 65536 - courses.joint).reshape(240, 240)
    away = np.abs(away - np.rint(away)).T if turned else np.abs(away - np.rint(away))
    in_joint = (np.arange(240) + down) % 24 == 0
    assert np.median(away[in_joint]) < 0.06
    assert np.median(away[np.roll(in_joint, 12)]) > 0.44


@pytest.mark.parametrize("long", [36, 72, 96])
def test_elements_may_be_short_or_long(long):
    image = bricks(long=long, side=288)
    wave = found_in(image).wave(find_lattice(image).waves)
    np.testing.assert_allclose(np.abs(wave), (1 / 24, 0), atol=1e-3)


def test_a_grid_has_none():
    assert found_in(bricks(offset=0.0)) is None
    assert found_in(bricks(24, 24, 0.0)) is None


@pytest.mark.parametrize("name", ["weave", "granite", "pebbles"])
def test_weaves_and_stones_have_none(name):
    assert found_in(upholster.read_exemplar(f"examples/{name}.png")) is None


def test_without_lattice_or_joints_there_are_none():
    image = bricks()
    assert find_courses(None, find_joints(image)) is None
    assert find_courses(find_lattice(image), None) is None
