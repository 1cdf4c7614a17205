"""The lattice of a sample: its waves and phases."""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.lattice_samples import PATTERNS, lattice_sample

from upholster.image.elements.lattice import Lattice, find_lattice
from upholster.image.files.read import read_exemplar
from upholster.image.resize import resize_image

EXAMPLES = Path(__file__).parents[2] / "examples"


def change_of_basis(lattice, sample):
    """Whole numbers: how the waves that were found are made of the pattern's own."""
    change = lattice.waves @ np.linalg.inv(sample.waves)
    assert np.abs(change - np.rint(change)).max() < 0.15
    return np.rint(change)


@pytest.mark.slow(reason="finds lattices at many sizes")
@pytest.mark.parametrize(
    ("pattern", "seed"),
    [
        *((name, 2) for name in sorted(PATTERNS)),
        ("herringbone", 1),  # whose highest peaks are those of a cell five times as large
    ],
)
def test_generated_lattices_are_found(pattern, seed):
    sample = lattice_sample(pattern, side=256, seed=seed)
    lattice = find_lattice(sample.image)
    assert lattice is not None
    assert lattice.waves.shape == (2, 2)
    assert lattice.phases.shape == (2, 256, 256)
    assert lattice.phases.dtype == np.int16
    assert (lattice.certainty >= 0.5).all()
    # A basis of the same waves, none left out.
    assert abs(round(np.linalg.det(change_of_basis(lattice, sample)))) == 1


@pytest.mark.parametrize("angle", [8.0, 45.0])
def test_lattices_may_be_slanted(angle):
    sample = lattice_sample("running_bond", side=256, angle=angle)
    lattice = find_lattice(sample.image)
    assert lattice is not None
    assert abs(round(np.linalg.det(change_of_basis(lattice, sample)))) == 1


@pytest.mark.slow(reason="finds lattices at many sizes")
@pytest.mark.parametrize(("pattern", "unit"), [("herringbone", 32), ("running_bond", 40)])
def test_the_same_picture_has_the_same_lattice_at_every_size(pattern, unit):
    # Strong grain makes the correlation low at all shifts.
    sample = lattice_sample(pattern, side=512, unit=unit)
    grain = 60 * np.random.default_rng(1).normal(size=(512, 512, 1))
    image = np.rint((sample.image + grain).clip(0, 255)).astype(np.uint8)
    for side in (96, 128, 192, 256, 300, 384, 512):
        lattice = find_lattice(resize_image(image, height=side, width=side))
        assert lattice is not None, side
        change = lattice.waves * (side / 512) @ np.linalg.inv(sample.waves)
        assert np.abs(change - np.rint(change)).max() < 0.15, side
        assert abs(round(np.linalg.det(np.rint(change)))) == 1, side


@pytest.mark.parametrize(
    ("pattern", "unit", "grain"), [("gingham", 24, 90), ("stack_bond", 32, 90), ("hexagons", 32, 90)]
)
def test_few_periods_under_strong_grain_are_found(pattern, unit, grain):
    sample = lattice_sample(pattern, side=128, unit=unit, seed=3)
    noise = grain * np.random.default_rng(1).normal(size=(128, 128, 1))
    lattice = find_lattice(np.rint((sample.image + noise).clip(0, 255)).astype(np.uint8))
    assert lattice is not None
    assert abs(round(np.linalg.det(change_of_basis(lattice, sample)))) == 1


def test_a_large_sample_is_reduced_and_has_phases_at_every_pixel():
    small = find_lattice(lattice_sample("stack_bond", side=192, unit=18).image)
    image = lattice_sample("stack_bond", side=192, unit=18).image
    large = find_lattice(np.repeat(np.repeat(image, 2, axis=0), 2, axis=1))
    assert small is not None
    assert large is not None
    assert large.phases.shape == (2, 384, 384)
    assert np.allclose(2 * large.waves, small.waves, atol=1e-4)
    # The middle between two of the larger pixels is the middle of the smaller one.
    middle = large.phases[:, ::2, ::2].astype(np.int64) + (large.waves.sum(axis=1) * 32768)[:, None, None]
    away = (middle - small.phases + 32768) % 65536 - 32768
    assert np.abs(away[:, 8:-8, 8:-8].mean(axis=(1, 2))).max() < 150
    assert np.abs(away[:, 8:-8, 8:-8]).max() < 2000


def tiles(side, period, seed=1):
    """Square tiles with an ornament, `period` pixels wide, and a little noise."""
    rows, columns = (at % period - period / 2 + 0.5 for at in np.mgrid[:side, :side])
    radius, frame = np.hypot(rows, columns), np.maximum(abs(rows), abs(columns))
    petals = (radius < 0.2 * period) & (np.cos(8 * np.arctan2(rows, columns)) > 0.2)
    drawn = 200 - 120 * ((frame > 0.32 * period) & (frame < 0.38 * period)) - 90 * petals
    noise = np.random.default_rng(seed).normal(size=(side, side))
    return np.rint(drawn + 8 * noise).clip(0, 255).astype(np.uint8)[..., None]


def diamonds(side, period, seed=1):
    """Thin oblique lines, a pixel or two wide."""
    rows, columns = np.mgrid[:side, :side]
    away = [np.minimum(at % period, -at % period) for at in (rows + columns, rows - columns)]
    lines = sum(np.exp(-((distance / 1.1) ** 2)) for distance in away)
    noise = np.random.default_rng(seed).normal(size=(side, side))
    return np.rint(50 + 90 * lines + 5 * noise).clip(0, 255).astype(np.uint8)[..., None]


def shifts(lattice):
    """The shortest translations, as whole pixels without signs, sorted."""
    return sorted(np.abs(np.rint(np.linalg.inv(lattice.waves).T)).tolist())


@pytest.mark.parametrize("period", [84, 64, 43])
def test_one_and_a_half_periods_are_enough(period):
    lattice = find_lattice(tiles(128, period))
    assert lattice is not None
    assert shifts(lattice) == [[0.0, period], [period, 0.0]]
    # The phases are those of an even lattice.
    rows, columns = np.mgrid[:128, :128]
    for wave, phases in zip(lattice.waves, lattice.phases, strict=True):
        turns = np.exp(2j * np.pi * (phases / 65536 - wave[0] * rows - wave[1] * columns))
        assert np.abs(np.angle(turns / turns.mean())).max() < 2 * np.pi * 0.05


@pytest.mark.parametrize(("height", "found"), [(44, True), (66, False)])
def test_a_picture_that_is_there_twice_is_no_lattice(height, found):
    """Every second row of pictures is shifted by half of one: 132 pixels wide, they have 1.4 to 2 cells."""
    picture = np.random.default_rng(3).integers(0, 256, (height, 132, 3), dtype=np.uint8)
    y, x = np.mgrid[:128, :128]
    assert (find_lattice(picture[y % height, (x + 66 * (y // height)) % 132]) is not None) == found


@pytest.mark.parametrize("period", [48, 31])
def test_joints_may_be_thin_lines(period):
    lattice = find_lattice(diamonds(128, period))
    assert lattice is not None
    assert np.abs(np.abs(np.linalg.inv(lattice.waves)) - period / 2).max() < 0.15


def test_a_clean_drawn_knurl_has_its_lattice():
    rows, columns = np.mgrid[:256, :256]
    height = np.minimum(abs((rows + columns) % 32 - 16), abs((rows - columns) % 32 - 16)) / 16
    lattice = find_lattice((255 * (1 - height)).astype(np.uint8)[..., None])
    assert lattice is not None
    assert np.allclose(np.abs(np.linalg.inv(lattice.waves)), 16, atol=0.01)


def test_elements_may_differ_in_colour_alone():
    # Tiles of 20 pixels, red and green by turns, equally bright: edges alone have half the period.
    rows, columns = np.mgrid[:160, :160]
    red = (rows // 20 + columns // 20) % 2
    joints = (rows % 20 < 2) | (columns % 20 < 2)
    image = np.stack([40 + 120 * red, 160 - 120 * red, np.full_like(red, 90)], axis=2)
    image[joints] = 20
    lattice = find_lattice(image.astype(np.uint8))
    assert lattice is not None
    assert shifts(lattice) == [[20.0, 20.0], [20.0, 20.0]]


_ROWS, _COLUMNS = np.mgrid[:96, :96]

PLAIN = {
    "one colour": np.full((96, 96), 7),
    "two colours": np.where(_COLUMNS < 48, 10, 200),
    "one line": (_ROWS == 60) * 255,
    "one dot": ((_ROWS == 60) & (_COLUMNS == 31)) * 255,
    "two dots": ((_ROWS == 60) & ((_COLUMNS == 31) | (_COLUMNS == 70))) * 255,
    "a cross": ((_ROWS == 40) | (_COLUMNS == 40)) * 255,
    "a gradient": _COLUMNS * 2,
    "an oblique gradient": _ROWS + _COLUMNS,
    "a mirrored gradient": np.abs(_COLUMNS - 47.5) * 4,
    "rings": np.hypot(_ROWS - 47.5, _COLUMNS - 47.5) * 4 % 256,
    "single pixels by turns": (_ROWS + _COLUMNS) % 2 * 255,
}


@pytest.mark.parametrize("name", PLAIN)
def test_plain_pictures_have_no_lattice(name):
    for dtype, most in ((np.uint8, 1), (np.uint16, 257), (np.float32, 1 / 255)):
        picture = PLAIN[name].astype(np.uint8).astype(dtype) * dtype(most)
        assert find_lattice(picture[..., None].astype(dtype)) is None


def test_a_checkerboard_repeats_along_its_diagonals():
    lattice = find_lattice(((_ROWS // 8 + _COLUMNS // 8) % 2 * 255).astype(np.uint8)[..., None])
    assert lattice is not None
    assert np.allclose(np.abs(np.linalg.inv(lattice.waves)), 8, atol=0.01)


def meandering(side, cycles, seed):
    """Stripes that bend and fork, as a zebra's: noise of nearly one frequency in nearly one direction."""
    rng = np.random.default_rng(seed)
    down, right = np.meshgrid(*[np.fft.fftfreq(side) * side] * 2, indexing="ij")
    angle = rng.uniform(0, np.pi)
    along = np.cos(angle) * right - np.sin(angle) * down
    band = np.exp(-(((np.hypot(down, right) - cycles) / 1.6) ** 2) - (along / 5) ** 2)
    field = np.fft.ifft2(np.fft.fft2(rng.normal(size=(side, side))) * band).real
    drawn = 128 + 90 * np.tanh(6 * field / field.std()) + 10 * rng.normal(size=(side, side))
    return np.rint(drawn.clip(0, 255)).astype(np.uint8)[..., None]


def pebbles(side, count, seed):
    """Cells around random places, with light joints between them."""
    rng = np.random.default_rng(seed)
    places = rng.random((count, 2)) * side
    rows, columns = np.mgrid[:side, :side]
    away = np.hypot(rows - places[:, :1, None], columns - places[:, 1:, None])
    near = np.sort(away, axis=0)
    drawn = 60 + 80 * rng.random(count)[away.argmin(axis=0)]
    joints = np.exp(-(((near[1] - near[0]) / 4) ** 2))
    return np.rint(drawn + (230 - drawn) * joints).astype(np.uint8)[..., None]


def grain(side, size, seed):
    """Smooth noise, longer along the rows, as of wood or brushed metal."""
    fine = np.random.default_rng(seed).normal(size=(side, side))
    down, right = np.fft.fftfreq(side)[:, None], np.fft.fftfreq(side)
    low = np.exp(-2 * (np.pi * size * down) ** 2 - 2 * (4 * np.pi * size * right) ** 2)
    field = np.fft.ifft2(np.fft.fft2(fine) * low).real
    return np.rint(128 + 40 * field / field.std()).clip(0, 255).astype(np.uint8)[..., None]


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    "made",
    [
        lambda seed: meandering(192, 7, seed),
        lambda seed: pebbles(160, 40, seed),
        lambda seed: grain(160, 2, seed),
        lambda seed: grain(160, 6, seed),
        lambda seed: np.random.default_rng(seed).integers(0, 256, (128, 128, 3), dtype=np.uint8),
    ],
    ids=["stripes", "pebbles", "fine grain", "coarse grain", "noise"],
)
def test_nothing_repeats_in_random_textures(made, seed):
    assert find_lattice(made(seed)) is None


def test_rows_alone_are_one_wave():
    rows = np.sin(2 * np.pi * np.arange(160) / 20)[:, None] * np.ones(160)
    noise = np.random.default_rng(1).normal(size=(160, 160))
    lattice = find_lattice(np.rint(128 + 40 * rows + 20 * noise).clip(0, 255).astype(np.uint8)[..., None])
    assert lattice is not None
    assert np.abs(lattice.waves - [[0.05, 0.0]]).max() < 1e-3
    # The phase is the wave's own: a quarter turn from the sine's.
    expected = 65536 * (np.arange(160)[:, None] / 20 - 0.25) * np.ones(160)
    away = (lattice.phases[0] - expected + 32768) % 65536 - 32768
    assert np.abs(away).max() < 6554


def test_phases_grow_by_the_waves():
    lattice = find_lattice(lattice_sample("stack_bond", side=256).image)
    assert lattice is not None
    for wave, phases in zip(lattice.waves, lattice.phases, strict=True):
        for axis in (0, 1):
            steps = np.diff(phases, axis=axis)  # they wrap
            assert abs(steps.mean() / 65536 - wave[axis]) < 1e-3


def test_any_type_of_sample_gives_the_same_waves():
    image = lattice_sample("hexagons", side=192).image
    found = [find_lattice(image.astype(np.uint16) * 257), find_lattice((image / 255).astype(np.float32))]
    expected = find_lattice(image)
    assert expected is not None
    for lattice in found:
        assert lattice is not None
        assert np.allclose(lattice.waves, expected.waves, atol=1e-4)


@pytest.mark.parametrize(
    ("waves", "cell"),
    [
        ([[1 / 20, 0.0]], 20.0),
        ([[1 / 20, 0.0], [0.0, 1 / 30]], 30.0),
        ([[1 / 20, 0.0], [1 / 40, 1 / 30]], 40.0),  # two courses, moved by half a stone of 30
        ([[1 / 20, 1 / 30], [0.0, 1 / 30]], 30.0),
    ],
)
def test_a_cell_holds_what_repeats(waves, cell):
    phases = np.zeros((len(waves), 8, 8), np.int16)
    assert Lattice(np.array(waves), phases, np.ones(len(waves))).cell == pytest.approx(cell)


def test_a_weak_wave_is_made_of_strong_waves():
    # Of these bricks, 32 pixels high and 64 wide, joints are seen at harmonics only.
    lattice = find_lattice(read_exemplar(EXAMPLES / "bricks.png"))
    assert lattice is not None
    change = lattice.waves @ np.linalg.inv([[1 / 32, 0.0], [1 / 64, 1 / 64]])
    assert np.abs(change - np.rint(change)).max() < 0.1
    assert abs(round(np.linalg.det(np.rint(change)))) == 1
    assert np.hypot(*lattice.waves.T).max() < 1 / 30
