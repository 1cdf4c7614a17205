"""Pieces of images that are blended: against a dense solution, and what stays."""

import numpy as np
import pytest

from upholster.image.blend import blended

REACH = 8


def shapes(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A photo and its hole, a source, and places of two pieces of it."""
    hole = np.zeros((14, 17), np.bool_)
    hole[3:9, 0:8] = hole[6:14, 5:12] = True
    photo = rng.uniform(0.2, 0.8, (14, 17, 1)).astype(np.float32)
    source = rng.uniform(0.2, 0.8, (30, 40, 1)).astype(np.float32)
    places = np.stack(np.indices((14, 17)), axis=2) + np.array([4, 3])
    places[:, 6:] += [7, 11]
    return photo, hole, source, places


def least_squares(photo: np.ndarray, hole: np.ndarray, source: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The same by a dense system: an equation for each pixel of the hole and for each pair with one in it."""
    number = np.full(hole.shape, -1)
    number[hole] = np.arange(hole.sum())
    shown = source[places[..., 0], places[..., 1], 0].astype(float)
    rows, wanted = [], []

    def equation(entries: dict[int, float], value: float) -> None:
        row = np.zeros(hole.sum())
        for k, weight in entries.items():
            row[k] += weight
        rows.append(row)
        wanted.append(value)

    for i, j in np.argwhere(hole):
        equation({number[i, j]: 1 / REACH}, shown[i, j] / REACH)
    for step in ((1, 0), (0, 1)):
        for i, j in np.ndindex(hole.shape[0] - step[0], hole.shape[1] - step[1]):
            k, m = i + step[0], j + step[1]
            differences = []
            if hole[i, j]:
                r, c = places[i, j]
                differences.append(source[r + step[0], c + step[1], 0] - source[r, c, 0])
            if hole[k, m]:
                r, c = places[k, m]
                differences.append(source[r, c, 0] - source[r - step[0], c - step[1], 0])
            if differences:
                entries, value = {}, float(np.mean(differences))
                for (a, b), sign in (((k, m), 1.0), ((i, j), -1.0)):
                    if hole[a, b]:
                        entries[number[a, b]] = sign
                    else:
                        value -= sign * photo[a, b, 0]
                equation(entries, value)
    found = photo[..., 0].astype(float)
    found[hole] = np.linalg.lstsq(np.array(rows), np.array(wanted))[0]
    return found


def test_it_is_the_least_squares_answer() -> None:
    photo, hole, source, places = shapes(np.random.default_rng(1))
    expected = least_squares(photo, hole, source, places)
    shown = source[places[..., 0], places[..., 1], 0]
    values = np.where(hole, shown, photo[..., 0])
    found = blended(photo, hole, source, places, reach=REACH)[..., 0]
    np.testing.assert_allclose(found, np.clip(expected, values.min(), values.max()), atol=2e-3)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_what_fits_is_copied(dtype: type) -> None:
    rng = np.random.default_rng(2)
    source = rng.integers(0, 250, (30, 40, 3)).astype(dtype)
    places = np.stack(np.indices((14, 17)), axis=2) + np.array([5, 9])
    hole = np.zeros((14, 17), np.bool_)
    hole[4:9, 3:11] = True
    whole = source[5:19, 9:26]
    found = blended(np.where(hole[..., None], 0, whole).astype(dtype), hole, source, places, reach=REACH)
    np.testing.assert_allclose(found, whole, atol=1e-3 if dtype == np.float32 else 0)


def test_outside_stays_and_nothing_exceeds_its_range() -> None:
    rng = np.random.default_rng(3)
    photo = rng.integers(0, 256, (40, 40, 2)).astype(np.uint8)
    source = rng.integers(100, 140, (60, 60, 2)).astype(np.uint8)
    photo[..., 1] = source[..., 1] = 77
    hole = rng.random((40, 40)) < 0.5
    found = blended(photo, hole, source, np.stack(np.indices((40, 40)), axis=2) + 9, reach=REACH)
    np.testing.assert_array_equal(found[~hole], photo[~hole])
    assert (found[..., 1] == 77).all()


def test_a_step_at_the_border_fades() -> None:
    photo, source = np.full((41, 41, 1), 0.25, np.float32), np.full((50, 50, 1), 0.75, np.float32)
    hole = np.zeros((41, 41), np.bool_)
    hole[:, 8:] = True
    found = blended(photo, hole, source, np.stack(np.indices((41, 41)), axis=2), reach=REACH)[20, :, 0]
    assert (np.diff(found[8:]) > 0).all()
    assert found[8] < 0.25 + 0.5 * 2 / REACH
    # So many pixels on, a third is left.
    assert 0.5 * np.exp(-1.3) < 0.75 - found[7 + REACH] < 0.5 * np.exp(-0.7)


def test_what_reaches_far_is_found_as_well() -> None:
    # A smooth shade over the photo: of a source without it, a wide hole gets it back.
    rows, columns = np.indices((150, 170))
    texture = np.random.default_rng(4).uniform(-0.1, 0.1, (150, 170))
    shade = 0.4 + 0.001 * rows + 0.002 * columns
    photo, source = ((texture + level)[..., None].astype(np.float32) for level in (shade, 0.5))
    hole = (rows - 75) ** 2 + (columns - 80) ** 2 < 50**2
    found = blended(
        np.where(hole[..., None], 0.5, photo).astype(np.float32),
        hole,
        source,
        np.stack([rows, columns], 2),
        reach=1000,
    )
    np.testing.assert_allclose(found, photo, atol=0.01)
