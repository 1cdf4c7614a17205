import math
from typing import Any

import numpy as np
import pytest
from render_shapes import Model, checker, joined, sheet, sphere

from upholster.base.errors import InputError
from upholster.base.types import frozen_array
from upholster.model.render._kernels import resolve, shade
from upholster.model.render.camera import Camera
from upholster.model.render.picture import render
from upholster.model.render.texture import MipPyramid, build_mip_pyramid
from upholster.runtime.parallel import running

SMALL: dict[str, Any] = {"size": (160, 120), "background": (0.9, 0.9, 0.9)}
PLAIN: dict[str, Any] = {**SMALL, "shadows": False}


def lit(model: Model, color: tuple[float, ...], **options: Any) -> np.ndarray:
    """Return a picture of a model that is one linear colour all over."""
    texture = np.broadcast_to(np.asarray(color, np.float32), (4, 4, len(color))).copy()
    return render(*model, texture, **{**PLAIN, **options})


def test_silhouette_of_a_sphere_is_where_it_projects() -> None:
    radius, center = 2.5, np.array([7.0, -3.0, 11.0])
    model = sphere(radius, (7, -3, 11))
    camera = Camera.fit(model[0], size=(160, 120), view=(40, 15))
    image = render(*model, None, camera=camera, background=None, shadows=False, supersample=4)
    alpha = image[..., 3]
    x, y, depth = camera.project(center)
    assert (x, y) == pytest.approx((80, 60), abs=1e-2)
    # A sphere straight ahead is a disc of this radius.
    disc = camera.focal * radius / math.sqrt(depth**2 - radius**2)
    assert alpha.sum() == pytest.approx(math.pi * disc**2, rel=5e-3)
    rows, columns = np.indices(alpha.shape) + 0.5
    assert (columns * alpha).sum() / alpha.sum() == pytest.approx(x, abs=0.05)
    assert (rows * alpha).sum() / alpha.sum() == pytest.approx(y, abs=0.05)


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e7])
def test_depth_of_a_sphere(scale: float) -> None:
    model = sphere(scale, (5 * scale, 0, 2 * scale), cells=200)
    camera = Camera.fit(model[0], size=(90, 70), view=(-30, 40))
    depth = np.empty((70, 90), np.float32)
    render(*model, None, camera=camera, supersample=1, depth=depth)
    rows, columns = np.indices(depth.shape) + 0.5
    d = camera.directions(columns, rows)
    to_center = camera.eye - np.array([5, 0, 2]) * scale
    a, b, c = (d**2).sum(axis=-1), d @ to_center, to_center @ to_center - scale**2
    disc = b * b - a * c
    inside = disc > 0.02 * c * a * scale**2 / c  # not at the very rim, where facets differ
    exact = (-b - np.sqrt(np.where(inside, disc, 0))) / a
    np.testing.assert_allclose(depth[inside], exact[inside], atol=2e-3 * scale)
    assert np.isinf(depth[disc < -1e-3 * scale**2 * a]).all()


def test_checker_seen_frontally_shows_its_colours() -> None:
    model = sheet()
    camera = Camera.fit(model[0], size=(128, 128), view=(0, 0))
    image = render(*model, checker(4, 64), camera=camera, shadows=False)
    plain = [lit(model, (albedo,) * 3, camera=camera) for albedo in (0.1, 0.5)]
    for row, column in np.ndindex(4, 4):
        middle = ((column + 0.5) / 4 - 0.5, 0, 0.5 - (row + 0.5) / 4)
        x, y, _ = camera.project(middle).astype(int)
        np.testing.assert_allclose(image[y, x], plain[(row + column) % 2][y, x], rtol=1e-5)


def test_columns_go_right_and_rows_down() -> None:
    texture = np.zeros((2, 2, 3), np.float32)
    texture[0, 0], texture[0, 1], texture[1, 0] = (0.5, 0, 0), (0, 0.5, 0), (0, 0, 0.5)
    image = render(*sheet(), texture, **PLAIN, view=(0, 0))
    height, width = image.shape[:2]
    quarters = [image[y, x] for y in (height // 4, 3 * height // 4) for x in (3 * width // 8, 5 * width // 8)]
    assert [int(np.argmax(color)) for color in quarters[:3]] == [0, 1, 2]
    assert quarters[3].max() < 0.1


@pytest.mark.parametrize("supersample", [1, 2])
def test_minified_texture_keeps_its_mean_in_linear_light(supersample: int) -> None:
    """A fine checker of 8-bit black and white is as bright as its linear mean, not as grey 128."""
    texture = ((np.indices((1024, 1024)).sum(axis=0) % 2) * 255).astype(np.uint8)[..., None]
    model = sheet()
    options: dict[str, Any] = {"size": (96, 96), "view": (0, 0), "supersample": supersample}
    image = render(*model, texture, shadows=False, **options)[30:66, 30:66]
    flat = lit(model, (0.5,), **options)[30:66, 30:66]
    np.testing.assert_allclose(image.mean(), flat.mean(), rtol=2e-3)
    assert image.std() - flat.std() < 0.01  # no moiré


def test_levels_beyond_max_level_are_not_used() -> None:
    """With max_level 0 a minified texture is sampled, not averaged: its variance stays."""
    texture = np.random.default_rng(8).random((512, 512, 1), np.float32)
    sharp, soft = (
        render(*sheet(), texture, size=(64, 64), view=(0, 0), shadows=False, supersample=1, max_level=n)
        for n in (0, 4)
    )
    assert sharp[20:44, 20:44].std() > 2 * soft[20:44, 20:44].std()


def test_oblique_texture_does_not_moire() -> None:
    texture = checker(256, 1024, channels=1)
    model = sheet(4, 4)
    tilted = (model[0][:, [0, 2, 1]] * (1, -1, 1), model[1][:, [0, 2, 1]] * (1, -1, 1), model[2], model[3])
    options: dict[str, Any] = {"size": (160, 120), "view": (0, 18)}
    image = render(*tilted, texture, shadows=False, **options)
    flat = lit(tilted, (0.3,), **options)
    camera = Camera.fit(tilted[0], **options)
    _, far, _ = camera.project((0, 1.2, 0)).astype(int)
    strip = (slice(far - 1, far + 2), slice(40, 120))
    assert np.abs(image[strip].mean() / flat[strip].mean() - 1) < 0.02
    assert (image[strip] - flat[strip]).std() < 0.02


@pytest.mark.parametrize(("tilt", "probes"), [(0, 1), (60, 2), (80, 4)])
def test_mip_level_follows_the_footprint(monkeypatch: pytest.MonkeyPatch, tilt: int, probes: int) -> None:
    """A pyramid whose levels are painted 0, 0.1, 0.2… shows which level is taken where."""
    pyramid = build_mip_pyramid(np.zeros((1024, 1024, 1), np.float32), last=6)
    texels = pyramid.texels.copy()
    for level, (start, height, width) in enumerate(pyramid.levels):
        texels[start : start + height * width] = (0.1 * level, 0.1 * level, 0.1 * level, 1)
    coded = pyramid._replace(texels=frozen_array(texels))
    monkeypatch.setattr("upholster.model.render.picture.build_mip_pyramid", lambda *_, **__: coded)
    place, normals, uv, triangles = sheet()
    c, s = math.cos(math.radians(tilt)), math.sin(math.radians(tilt))
    turn = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    model = place @ turn.T, normals @ turn.T, uv, triangles
    camera = Camera.fit(place, size=(91, 91), view=(0, 0))
    image = render(*model, np.zeros((1, 1, 1), np.float32), camera=camera, shadows=False)
    monkeypatch.undo()
    black, grey = (lit(model, (value,), camera=camera) for value in (0, 0.1))
    level = (image - black)[45, 45, 0] / (grey - black)[45, 45, 0]
    texel_pixels = camera.project([(0, 0, 0), (1, 0, 0)])[:, 0]
    sample = 1024 / (2 * np.ptp(texel_pixels))
    assert level == pytest.approx(math.log2(max(sample, sample / c / probes)), abs=0.03)


def test_levels_finer_than_needed_are_not_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    texture = np.random.default_rng(12).random((512, 512, 3), np.float32)
    place, normals, uv, triangles = sphere()
    model = place * (1, 2, 0.3), normals, uv, triangles
    options: dict[str, Any] = {"size": (16, 12), "view": (20, 10), "shadows": False}
    image = render(*model, texture, **options)
    built: list[int] = []

    def whole(texture: Any, *, first: int, last: int) -> MipPyramid:
        built.append(first)
        return build_mip_pyramid(texture, last=last)

    monkeypatch.setattr("upholster.model.render.picture.build_mip_pyramid", whole)
    np.testing.assert_array_equal(render(*model, texture, **options), image)
    assert built[0] > 0


def test_picture_does_not_depend_on_threads() -> None:
    texture = np.random.default_rng(9).integers(0, 256, (256, 256, 4), np.uint8)
    options: dict[str, Any] = {"size": (200, 330), "supersample": 2}
    pictures = []
    for threads in (1, 4):
        with running(threads):
            pictures.append(render(*sphere(), texture, **options))
    one, four = pictures
    np.testing.assert_array_equal(one, four)


def test_bands_and_batches_leave_no_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    texture = np.random.default_rng(10).integers(0, 256, (64, 64, 3), np.uint8)
    options: dict[str, Any] = {"size": (90, 120), "supersample": 2}
    whole = render(*sphere(), texture, **options)
    monkeypatch.setattr("upholster.model.render.picture._BAND_ROWS", 7)
    monkeypatch.setattr("upholster.model.render.picture._BATCH_RAYS", 151)
    np.testing.assert_allclose(render(*sphere(), texture, **options), whole, atol=1e-5)


def test_colours_stay_true() -> None:
    """Most of a lit sphere shows 0.7 to 1 of its colour, at constant hue."""
    color = (0.5, 0.3, 0.1)
    image = lit(sphere(), color, shadows=True, background=None)
    solid = image[image[..., 3] == 1][:, :3]
    share = np.median(solid / color, axis=0)
    assert (share > 0.7).all()
    assert (share < 1.05).all()
    np.testing.assert_allclose(np.median(solid[:, 0] / solid[:, 1]), 0.5 / 0.3, rtol=0.05)


def test_highlights_are_compressed_at_constant_hue() -> None:
    image = lit(sphere(), (3.0, 1.5, 0.75), background=None)
    solid = image[image[..., 3] == 1][:, :3]
    assert image.max() <= 1
    middle = solid[solid[:, 0] > 0.9]
    np.testing.assert_allclose(middle[:, 0] / middle[:, 1], 2, rtol=0.1)


def test_key_light_comes_from_the_upper_left() -> None:
    image = lit(sphere(), (0.4, 0.4, 0.4))
    height, width = image.shape[:2]
    upper, lower = image[height // 4, 3 * width // 8, 0], image[3 * height // 4, 5 * width // 8, 0]
    assert upper > 1.3 * lower


@pytest.mark.parametrize("scale", [1.0, 1e4])
def test_a_sphere_shades_what_is_behind_it_and_the_floor(scale: float) -> None:
    wall = sheet(6, 6, y=1.5)
    model = joined(sphere(0.8), wall)
    model = (model[0] * scale, model[1], model[2], model[3])
    options: dict[str, Any] = {**SMALL, "view": (0, 10)}
    with_shadow, without = render(*model, None, **options), render(*model, None, **options, shadows=False)
    darker = 1 - with_shadow.mean(axis=2) / without.mean(axis=2)
    camera = Camera.fit(model[0], size=(160, 120), view=(0, 10))
    # The key light falls from the upper left, so the shadow lies to the lower right of the sphere.
    x, y, _ = camera.project(scale * np.array([1.2, 1.5, -1.2])).astype(int)
    assert darker[y, x] > 0.2
    x, y, _ = camera.project(scale * np.array([-2.0, 1.5, 2.0])).astype(int)
    assert abs(darker[y, x]) < 0.03


def test_a_convex_model_does_not_shade_itself() -> None:
    for cells in (6, 48):  # coarse facets too
        model = sphere(cells=cells)
        lone, without = (render(*model, None, **SMALL, floor=False, shadows=s) for s in (True, False))
        np.testing.assert_allclose(lone, without, atol=0.02)


def test_floor_shows_nothing_but_shadow() -> None:
    model = sphere()
    floor, none = (render(*model, None, **SMALL, floor=f) for f in (True, False))
    assert (floor <= none + 1e-6).all()
    assert (none - floor).max() > 0.15
    np.testing.assert_array_equal(floor[0], none[0])  # nothing at the horizon
    below = {**SMALL, "view": (0, -20)}
    np.testing.assert_array_equal(render(*model, None, **below), render(*model, None, **below, floor=False))


def test_transparent_picture_composites_to_the_opaque_one() -> None:
    opaque = render(*sphere(), None, **SMALL)
    clear = render(*sphere(), None, **{**SMALL, "background": None})
    over = clear[..., :3] * clear[..., 3:] + 0.9 * (1 - clear[..., 3:])
    np.testing.assert_allclose(over, opaque, atol=1e-5)
    assert clear[0, 0, 3] == 0


def test_alpha_lets_through_what_lies_behind() -> None:
    front, back = sheet(2, 2, y=-0.5), sheet(2, 2, y=0.5)
    texture = np.zeros((1, 2, 4), np.float32)
    texture[0, 0] = (0.6, 0.0, 0.0, 0.25)
    texture[0, 1] = (0.0, 0.4, 0.0, 1.0)
    front = (front[0], front[1], np.full_like(front[2], 0.0), front[3])  # red, see-through
    back = (back[0], back[1], np.full_like(back[2], 1.0), back[3])  # green, solid
    options: dict[str, Any] = {**PLAIN, "view": (0, 0), "background": None, "size": (60, 60)}
    depth = np.empty((60, 60), np.float32)
    both = render(*joined(front, back), texture, **options, depth=depth)[30, 30]
    camera = Camera.fit(joined(front, back)[0], size=(60, 60), view=(0, 0))
    red, green = (lit(model, color, background=None, size=(60, 60), camera=camera)[30, 30]
                  for model, color in ((front, (0.6, 0, 0)), (back, (0, 0.4, 0))))  # fmt: skip
    np.testing.assert_allclose(both[:3], 0.25 * red[:3] + 0.75 * green[:3], atol=2e-3)
    assert both[3] == 1
    assert depth[30, 30] == pytest.approx(camera.project((0, 0.5, 0))[2], rel=1e-5)
    alone = render(*front, texture, **options)[30, 30]
    assert alone[3] == pytest.approx(0.25)
    hole = render(*front, np.zeros((1, 1, 4), np.float32), **options)
    assert (hole[..., 3] == 0).all()


def test_grey_equals_rgb() -> None:
    grey = np.random.default_rng(11).integers(0, 256, (32, 32, 1), np.uint8)
    np.testing.assert_array_equal(
        render(*sphere(), grey, **PLAIN), render(*sphere(), np.repeat(grey, 3, axis=2), **PLAIN)
    )


def test_both_sides_of_a_sheet_are_shown() -> None:
    model = sheet()
    front, back = (lit(model, (0.5, 0.5, 0.5), view=(a, 0))[60, 80, 0] for a in (0, 180))
    assert back == pytest.approx(front, rel=0.02)


def test_normals_may_be_missing_or_of_any_length() -> None:
    place, normals, uv, triangles = sphere()
    smooth, long, none = (
        render(place, n, uv, triangles, None, **PLAIN) for n in (normals, 50 * normals, 0 * normals)
    )
    np.testing.assert_allclose(long, smooth, atol=1e-5)
    assert np.abs(none - smooth).mean() < 0.01


def test_background_is_kept_and_may_be_a_gradient() -> None:
    image = lit(sphere(), (0.5, 0.5, 0.5), background=((0, 0.5, 2), (1, 0.5, 0)))
    share = (np.arange(120) + 0.5) / 120
    np.testing.assert_allclose(
        image[:, 0], np.column_stack([share, 0 * share + 0.5, 2 - 2 * share]), rtol=1e-5
    )


def test_progress_counts_to_the_end() -> None:
    seen: list[tuple[str, int, int]] = []
    with running(1, lambda *step: seen.append(step)):
        render(*sphere(), None, size=(20, 300))
    assert [done for _, done, _ in seen] == list(range(1, seen[-1][2] + 1))
    assert {stage for stage, _, _ in seen} == {"render"}


def test_an_interrupt_ends_the_picture() -> None:
    def stop(stage: str, done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), running(2, stop):
        render(*sphere(), None, size=(20, 1000))


@pytest.mark.parametrize("size", [(1, 1), (1, 50), (50, 1), (2, 3)])
def test_tiny_pictures(size: tuple[int, int]) -> None:
    image = render(*sphere(cells=8), None, size=size)
    assert image.shape == (size[1], size[0], 3)
    assert np.isfinite(image).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positions": np.zeros((5, 2))}, "positions"),
        ({"positions": np.full((25, 3), np.inf)}, "positions"),
        ({"positions": np.zeros((25, 3))}, "one point"),
        ({"normals": np.zeros((24, 3))}, "normals"),
        ({"normals": np.full((25, 3), np.nan)}, "normals"),
        ({"uv": np.zeros((25, 3))}, "uv"),
        ({"triangles": np.zeros((0, 3), int)}, "triangles"),
        ({"triangles": np.zeros((2, 3))}, "triangles"),
        ({"triangles": np.array([[0, 1, 25]])}, "vertex 25"),
        ({"triangles": np.array([[0, -1, 2]])}, "vertex -1"),
        ({"texture": np.zeros((4, 4), np.uint8)}, "texture"),
        ({"texture": np.full((4, 4, 3), np.nan, np.float32)}, "texture"),
        ({"size": (0, 10)}, "size"),
        ({"view": (0, math.inf)}, "view"),
        ({"supersample": 0}, "supersample"),
        ({"supersample": 9}, "supersample"),
        ({"supersample": 1.5}, "supersample"),
        ({"max_level": -1}, "max_level"),
        ({"background": (1, 2)}, "background"),
        ({"background": (1, 2, math.nan)}, "background"),
        ({"background": (-1, 0, 0)}, "background"),
        ({"depth": np.zeros((4, 4), np.float32)}, "depth"),
    ],
)
def test_bad_input_is_one_line(change: dict[str, Any], message: str) -> None:
    place, normals, uv, triangles = sheet()
    arguments: dict[str, Any] = {
        "positions": place, "normals": normals, "uv": uv, "triangles": triangles, "texture": None, **change
    }  # fmt: skip
    with pytest.raises(InputError, match=message) as caught:
        render(**arguments)
    assert "\n" not in str(caught.value)


def test_kernels_are_compiled_once() -> None:
    """Sizes, options, dtypes and read-only arrays do not ask for another compilation."""
    model = sphere(cells=8)
    for array in model:
        array.setflags(write=False)
    for texture in (None, np.zeros((8, 8, 4), np.uint8), np.zeros((8, 8, 1), np.float32)):
        render(*model, texture, size=(20, 20))
        render(*model, texture, size=(1, 1), supersample=1)
        render(*model, texture, size=(5, 200), shadows=False)
        render(*model, texture, size=(20, 20), background=None)
    compiled: tuple[Any, ...] = (shade, resolve)
    for kernel in compiled:
        assert len(kernel.signatures) == 1
