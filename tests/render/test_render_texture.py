import math
from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from upholster.base.errors import InputError
from upholster.image.color import to_linear
from upholster.model.render import _lookup
from upholster.model.render.texture import MipPyramid, build_mip_pyramid, checked_texture


@numba.njit
def texture_at(pyramid: Any, u: Any, v: Any, lod: Any) -> Any:
    """Call what only kernels can call."""
    return _lookup.texture_at(pyramid, u, v, lod)


@numba.njit
def filtered(pyramid: Any, u: Any, v: Any, across: Any, down: Any) -> Any:
    """Likewise."""
    return _lookup.filtered(pyramid, u, v, across, down)


def level(pyramid: MipPyramid, index: int) -> NDArray[np.float32]:
    start, height, width = pyramid.levels[index - pyramid.first]
    return pyramid.texels[start : start + height * width].reshape(height, width, 4)


def twin(texture: NDArray[np.float32], u: float, v: float, lod: float, last: int) -> NDArray[np.float64]:
    """Look up (H, W, 4) premultiplied texels in the plainest way; sides are multiples of 2^last."""
    lod = min(max(lod, 0.0), last)
    height, width = texture.shape[:2]

    def one(index: int) -> NDArray[np.float64]:
        n = 2**index
        small = texture.reshape(height // n, n, width // n, n, 4).mean(axis=(1, 3), dtype=np.float64)
        x = np.clip(u * width / n - 0.5, 0, width // n - 1)
        y = np.clip(v * height / n - 0.5, 0, height // n - 1)
        wx = np.maximum(0, 1 - np.abs(np.arange(width // n) - x))
        wy = np.maximum(0, 1 - np.abs(np.arange(height // n) - y))
        return np.asarray(np.einsum("y,x,yxk->k", wy, wx, small))

    low = math.floor(lod)
    return one(low) + (lod - low) * (one(min(low + 1, last)) - one(low))


@pytest.mark.slow(reason="compares with plain Python")
def test_look_up_equals_its_twin() -> None:
    rng = np.random.default_rng(3)
    texture = rng.random((32, 48, 4), np.float32)
    premultiplied = texture.copy()
    premultiplied[..., :3] *= texture[..., 3:]
    pyramid = build_mip_pyramid(texture, last=3)
    for u, v, lod in rng.uniform((-0.1, -0.1, -1), (1.1, 1.1, 4), (300, 3)):
        np.testing.assert_allclose(
            texture_at(pyramid, u, v, lod),
            twin(premultiplied, u, v, lod, 3),
            atol=2e-6,
            err_msg=f"{u} {v} {lod}",
        )


@pytest.mark.parametrize("shape", [(1, 1), (7, 5), (33, 64), (300, 1000)])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_levels_are_box_averages(shape: tuple[int, int], channels: int) -> None:
    texture = np.random.default_rng(4).random((*shape, channels), np.float32)
    pyramid = build_mip_pyramid(texture, last=3)
    alpha = texture[..., -1:] if channels in (2, 4) else np.ones((*shape, 1), np.float32)
    color = texture[..., : channels - 1 + channels % 2] * alpha
    expected = np.concatenate([np.broadcast_to(color, (*shape, 3)), alpha], axis=2)
    for index in range(len(pyramid.levels)):
        np.testing.assert_allclose(level(pyramid, index), expected, rtol=1e-5)
        padded = np.pad(expected, [(0, s % 2) for s in expected.shape[:2]] + [(0, 0)], mode="edge")
        expected = (padded[::2, ::2] + padded[1::2, ::2] + padded[::2, 1::2] + padded[1::2, 1::2]) / 4
    assert pyramid.see_through == (channels in (2, 4))


def test_fine_levels_can_be_left_out() -> None:
    texture = np.random.default_rng(5).integers(0, 256, (64, 48, 3), np.uint8)
    whole, part = build_mip_pyramid(texture, last=4), build_mip_pyramid(texture, first=2, last=4)
    assert part.first == 2
    for index in (2, 3, 4):
        np.testing.assert_array_equal(level(part, index), level(whole, index))
    assert texture_at(part, 0.3, 0.6, 0.0) == texture_at(whole, 0.3, 0.6, 2.0)
    assert texture_at(part, 0.3, 0.6, 2.75) == texture_at(whole, 0.3, 0.6, 2.75)


def test_integers_are_averaged_in_linear_light() -> None:
    texture = np.zeros((2, 2, 3), np.uint8)
    texture[0] = 255
    pyramid = build_mip_pyramid(texture, last=1)
    np.testing.assert_allclose(level(pyramid, 1)[0, 0], [0.5, 0.5, 0.5, 1], rtol=1e-6)
    coded = np.random.default_rng(6).integers(0, 65536, (4, 4, 3)).astype(np.uint16)
    np.testing.assert_allclose(level(build_mip_pyramid(coded, last=0), 0)[..., :3], to_linear(coded))


def test_see_through_texels_do_not_colour_their_neighbours() -> None:
    texture = np.zeros((2, 2, 4), np.uint8)
    texture[..., 0] = 255  # invisible red
    texture[0, 0] = (0, 255, 0, 255)
    r, g, _, a = texture_at(build_mip_pyramid(texture, last=1), 0.5, 0.5, 1.0)
    assert (r / a, g / a, a) == pytest.approx((0, 1, 0.25))


def test_footprint_average() -> None:
    """Stripes average out along a footprint that crosses them, and stay along one that follows them."""
    texture = np.zeros((64, 64, 1), np.float32)
    texture[:, ::2] = 1.0
    pyramid = build_mip_pyramid(texture)
    across = filtered(pyramid, 32.5 / 64, 0.5, (4.0, 0.0), (0.0, 1.0))[0]
    along = filtered(pyramid, 32.5 / 64, 0.5, (0.0, 4.0), (1.0, 0.0))[0]
    assert across == pytest.approx(0.5)
    assert along == pytest.approx(1.0)
    # The steps' names do not matter, nor does a turn of both.
    assert filtered(pyramid, 32.5 / 64, 0.5, (0.0, 1.0), (4.0, 0.0))[0] == pytest.approx(across)
    assert filtered(pyramid, 32.5 / 64, 0.5, (0.6, 3.2), (0.8, -2.4))[0] == pytest.approx(along, abs=1e-6)


def test_magnified_texture_is_one_bilinear_look_up() -> None:
    pyramid = build_mip_pyramid(np.random.default_rng(7).random((16, 16, 3), np.float32))
    assert filtered(pyramid, 0.4, 0.7, (0.9, 0.0), (0.0, 0.01)) == texture_at(pyramid, 0.4, 0.7, 0.0)


@pytest.mark.parametrize(
    ("texture", "message"),
    [
        (np.zeros((4, 4), np.uint8), "shape"),
        (np.zeros((4, 4, 5), np.uint8), "1 to 4"),
        (np.zeros((0, 4, 3), np.uint8), "1 to 1048576"),
        (np.zeros((4, 4, 3), np.float64), "float64"),
        (np.zeros((4, 4, 3), np.int16), "int16"),
    ],
)
def test_bad_textures_are_refused(texture: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        checked_texture(texture)


def test_values_that_are_not_finite_are_refused() -> None:
    texture = np.zeros((4, 4, 3), np.float32)
    texture[2, 1, 0] = np.nan
    with pytest.raises(InputError, match="not finite"):
        build_mip_pyramid(texture)
