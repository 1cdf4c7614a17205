"""Samples without noise: nothing divides by their zeros, whatever it looks for."""

from pathlib import Path

import numpy as np
import pytest
from clean_pictures import DEPTHS, PICTURES, picture
from command_line import run_cli

import upholster
from upholster.covering.measure import measure_image
from upholster.covering.notes import sample_notes
from upholster.image.elements.joints import find_joints
from upholster.image.elements.lattice import Lattice, find_lattice
from upholster.image.files.material import Material
from upholster.image.files.material_files import read_material
from upholster.image.files.write import write_image
from upholster.image.photo.even_light import even_light
from upholster.image.photo.perspective import proposed_corners

pytestmark = pytest.mark.filterwarnings("error")

SLOW = pytest.mark.slow(reason="looks at every picture at every depth; the others do at one each")
every_depth = pytest.mark.parametrize("dtype", DEPTHS)
every_picture = pytest.mark.parametrize(
    ("name", "dtype"),
    [
        pytest.param(name, dtype, marks=() if (row + column) % 3 == 0 else SLOW)
        for row, name in enumerate(PICTURES)
        for column, dtype in enumerate(DEPTHS)
    ],
)


@every_picture
def test_lattices_joints_and_blocks(name: str, dtype: type) -> None:
    sample = picture(name, dtype, side=64)
    lattice, joints = find_lattice(sample), find_joints(sample)
    if lattice is not None:
        assert np.isfinite(lattice.waves).all()
        assert np.hypot(*lattice.waves.T).min() > 0
        assert ((lattice.certainty >= 0) & (lattice.certainty <= 1)).all()
        assert min(lattice.element) > 0
    assert joints is None or np.isfinite([joints.certainty, joints.across]).all()


@every_depth
@pytest.mark.parametrize("name", ["black", "white", "dot", "corner", "line"])
def test_what_does_not_repeat_has_no_lattice(name: str, dtype: type) -> None:
    assert find_lattice(picture(name, dtype)) is None


@every_depth
@pytest.mark.parametrize(("name", "period"), [("knurl", 32), ("checkerboard", 16), ("stripes", 16)])
def test_what_repeats_has_its_own_lattice(name: str, period: int, dtype: type) -> None:
    lattice = find_lattice(picture(name, dtype))
    assert isinstance(lattice, Lattice)
    # Each wave is made of whole multiples of the pattern's own, which are both slanted, or upright.
    own = np.array([[1, 1], [-1, 1]] if name != "stripes" else [[1, 0], [0, 1]]) / period
    multiples = lattice.waves @ np.linalg.inv(own)
    assert np.abs(multiples - np.rint(multiples)).max() < 0.05
    assert len(lattice.waves) == (1 if name == "stripes" else 2)


@every_picture
def test_light(name: str, dtype: type) -> None:
    sample = picture(name, dtype, side=64)
    lit = even_light(sample)
    assert lit.dtype == dtype
    assert np.isfinite(lit).all()
    assert all(isinstance(note, str) for note in sample_notes(sample))


@pytest.mark.parametrize("name", [pytest.param(name, marks=SLOW) for name in PICTURES] + ["dot"])
def test_perspective(name: str) -> None:
    corners = proposed_corners(picture(name, DEPTHS[len(name) % 3], side=100))
    assert corners is None or np.isfinite(corners).all()


@pytest.mark.parametrize("name", ["black", "two colours", "dot", "mirrored", "knurl"])
def test_covering_measuring_and_filling(name: str) -> None:
    sample = picture(name, DEPTHS[len(name) % 3], side=64)
    quilt = upholster.synthesize(sample, "plane", texels=(48, 48))
    (texels,) = upholster.paint(quilt, sample).arrays
    # Tones may leave the sample's range by a little.
    few = 0.05 * (float(sample.max()) - float(sample.min()))
    assert sample.min() - few <= texels.min() <= texels.max() <= sample.max() + few
    found = measure_image(texels, sample)
    assert np.isfinite(found.wasserstein).all()
    hole = np.zeros(sample.shape[:2], bool)
    hole[24:32, 24:32] = True
    filled = upholster.fill(sample, hole)
    assert isinstance(filled, np.ndarray)
    np.testing.assert_array_equal(filled[~hole], sample[~hole])


@every_depth
def test_a_material_of_flat_maps(tmp_path: Path, dtype: type) -> None:
    suffix = "exr" if dtype is np.float32 else "png"
    for role, name, channels in (("color", "white", 3), ("height", "two colours", 1), ("nor", "white", 3)):
        write_image(tmp_path / f"wall_{role}.{suffix}", picture(name, dtype, side=32, channels=channels))
    material = read_material(tmp_path)
    assert isinstance(material, Material)
    assert find_lattice(material.matched()) is None


@pytest.mark.slow(reason="covers a plane, as the command does")
def test_a_designers_first_picture(tmp_path: Path) -> None:
    write_image(tmp_path / "knurl.png", picture("knurl", np.uint8, side=256))
    asked = ("--draft", "--element-size", "0.1")
    done = run_cli("cover", "knurl.png", "--on", "plane", *asked, "-o", "k.png", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
