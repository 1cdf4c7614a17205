"""Colour transforms: YCoCg-R loses nothing, the fitted one is orthonormal and finds the strongest axis."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from upholster.codec.color_transforms import MATRIX_UNIT, fit_klt, from_ycocg, to_ycocg, unmix


def test_ycocg_is_reversible():
    steps = np.array([*range(0, 256, 17), 1, 254, 65535, 65534, 32768])
    pixels = np.stack(np.meshgrid(steps, steps, steps), axis=-1).astype(np.int32)
    values = to_ycocg(pixels)
    np.testing.assert_array_equal(from_ycocg(values), pixels)
    assert values[..., 0].min() >= 0
    assert np.abs(values[..., 1:]).max() <= 65535


def test_grey_has_no_chroma():
    grey = np.repeat(np.arange(256, dtype=np.int32)[:, None], 3, axis=1)
    np.testing.assert_array_equal(to_ycocg(grey), grey * [1, 0, 0])


@given(st.integers(0, 2**32 - 1), st.sampled_from(["mixed", "flat", "grey", "one axis"]))
def test_the_klt_is_orthonormal_and_ordered(seed, kind):
    rng = np.random.default_rng(seed)
    pixels = rng.normal(size=(20, 30, 3)) @ rng.normal(size=(3, 3)) * 40
    if kind == "flat":
        pixels[:] = 0
    elif kind == "grey":
        pixels[:] = pixels[..., :1]
    elif kind == "one axis":
        pixels[..., 1:] = 0
    pixels -= pixels.mean(axis=(0, 1))
    matrix = fit_klt(pixels)
    assert matrix.dtype == np.int16
    scaled = matrix / MATRIX_UNIT
    np.testing.assert_allclose(scaled.T @ scaled, np.eye(3), atol=3e-4)
    assert (np.abs(matrix).max(axis=0) == matrix.max(axis=0)).all()
    components = np.linalg.solve(scaled, pixels.reshape(-1, 3).T).T
    energy = (components**2).sum(axis=0)
    assert energy[0] >= energy[1] * 0.999 - 1e-6
    assert energy[1] >= energy[2] * 0.999 - 1e-6
    np.testing.assert_allclose(unmix(components, matrix), pixels.reshape(-1, 3), atol=1e-9)


def test_unmix_adds_in_its_documented_order():
    rng = np.random.default_rng(4)
    components, matrix = rng.normal(size=(50, 3)) * 100, rng.integers(-16384, 16385, (3, 3)).astype(np.int16)
    for pixel, got in zip(components.tolist(), unmix(components, matrix).tolist(), strict=True):
        for row, value in zip(matrix.tolist(), got, strict=True):
            m = [entry / 16384 for entry in row]
            assert value == (pixel[0] * m[0] + pixel[1] * m[1]) + pixel[2] * m[2]
