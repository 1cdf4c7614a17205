"""Pictures of materials: the light that they mirror, formulas against integrals; what each map does."""

from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from render_shapes import sheet, sphere

from upholster.base.errors import InputError
from upholster.model.render import _material_kernels, environment
from upholster.model.render.camera import Camera
from upholster.model.render.environment import HORIZON, HORIZON_WIDTH, KEY_LIGHT, SKY_ABOVE, SKY_BELOW, lamps
from upholster.model.render.material_maps import build_maps
from upholster.model.render.picture import render

AXES = Camera.fit(np.eye(3), view=(30, 20)).axes
LAMPS = lamps(AXES)
SMALL: dict[str, Any] = {"size": (96, 72), "background": (0.5, 0.5, 0.5), "shadows": False}


@numba.njit
def sky_mirrored(mirrored: Any, s: float, around: Any) -> float:
    """Call what only kernels can call."""
    return environment.sky_mirrored(mirrored, s, around)


@numba.njit
def key_mirrored(cosine: float, s: float) -> float:
    """Likewise."""
    return environment.key_mirrored(cosine, s)


@numba.njit
def reflectance(roughness: float, facing: float) -> tuple[float, float]:
    """Likewise."""
    return environment.reflectance(roughness, facing)


@numba.njit
def material_light(
    maps: Any,
    place: Any,
    one: Any,
    two: Any,
    color: Any,
    normal: Any,
    tangent: Any,
    side: Any,
    eye: Any,
    key: Any,
) -> Any:
    """Likewise."""
    return _material_kernels.material_light(maps, place, one, two, color, normal, tangent, side, eye, key)


def all_around(rows: int = 200) -> tuple[NDArray[Any], float]:
    """Return unit vectors evenly over the sphere, and the area that each stands for."""
    z = (np.arange(rows) + 0.5) / rows * 2 - 1
    angle = (np.arange(2 * rows) + 0.5) / rows * np.pi
    z, angle = (part.reshape(-1) for part in np.meshgrid(z, angle))
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1), 4 * np.pi / len(z)


def radiance(directions: NDArray[Any]) -> NDArray[Any]:
    """What a mirror sees, as the formula has it."""
    z = directions[:, 2]
    light = (SKY_ABOVE + SKY_BELOW) / 2 + 0.75 * (SKY_ABOVE - SKY_BELOW) * z
    light -= HORIZON * np.exp(-((z / HORIZON_WIDTH) ** 2))
    for *toward, strength, sharpness in LAMPS:
        light += strength * np.exp(sharpness * (directions @ np.array(toward) - 1))
    return np.asarray(light)


def test_lamps_turn_with_the_camera() -> None:
    np.testing.assert_allclose(np.linalg.norm(LAMPS[:, :3], axis=1), 1)
    other = lamps(Camera.fit(np.eye(3), view=(120, 50)).axes)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(other[:, :3], LAMPS[:, :3] @ turn.T, atol=1e-12)


def test_diffuse_light_of_the_sky_is_its_integral() -> None:
    directions, area = all_around()
    sky = (SKY_ABOVE + SKY_BELOW) / 2 + 0.75 * (SKY_ABOVE - SKY_BELOW) * directions[:, 2]
    for n in ((0, 0, 1), (0, 0, -1), (0.6, 0, 0.8), (0, 1, 0)):
        found = (sky * np.maximum(directions @ np.array(n), 0)).sum() * area / np.pi
        assert found == pytest.approx(SKY_BELOW + (SKY_ABOVE - SKY_BELOW) * (0.5 + 0.5 * n[2]), abs=2e-4)


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize("s", [0.5, 2.0, 8.0, 40.0, 300.0])
def test_mirrored_light_is_the_mean_under_the_lobe(s: float) -> None:
    directions, _ = all_around(300)
    light = radiance(directions)
    # Lamps and horizon are blurred by a rule of thumb.
    for mirrored in directions[:: len(directions) // 40]:
        lobe = np.exp(s * (directions @ mirrored - 1))
        expected = (light * lobe).sum() / lobe.sum()
        found = sky_mirrored(tuple(mirrored), s, LAMPS)
        assert found == pytest.approx(expected, abs=0.05)
    sharp = [sky_mirrored(tuple(d), 1e5, LAMPS) for d in directions[:500]]
    np.testing.assert_allclose(sharp, radiance(directions[:500]), atol=2e-3)


def test_the_key_light_keeps_its_strength_under_every_lobe() -> None:
    for s in (2.0, 20.0, 200.0):
        total = sum(key_mirrored(z, s) for z in np.linspace(-1, 1, 4001)) * 2 * np.pi * 2 / 4001
        # 2π·a/k of it arrives; over π that is the diffuse light of a surface that faces it.
        assert total / np.pi == pytest.approx(KEY_LIGHT, rel=0.01)


def test_reflectance_is_that_of_ggx() -> None:
    """The fit's a and b against the integral by importance sampling: a rough fit, made for telephones."""
    rng = np.random.default_rng(0)
    for roughness in (0.3, 0.6, 1.0):
        for facing in (0.3, 0.6, 1.0):
            alpha = roughness**2
            one, two = rng.random((2, 200_000))
            cosine = np.sqrt((1 - one) / (1 + (alpha**2 - 1) * one))
            sine = np.sqrt(1 - cosine**2)
            half = np.stack([sine * np.cos(2 * np.pi * two), sine * np.sin(2 * np.pi * two), cosine], axis=1)
            eye = np.array([np.sqrt(1 - facing**2), 0, facing])
            vh = half @ eye
            light = 2 * vh[:, None] * half - eye
            k = alpha / 2
            nl = np.maximum(light[:, 2], 0)
            visible = nl / (nl * (1 - k) + k) * facing / (facing * (1 - k) + k)
            weight = np.where(nl > 0, visible * vh / np.maximum(cosine * facing, 1e-9), 0)
            fresnel = (1 - np.clip(vh, 0, 1)) ** 5
            expected = ((1 - fresnel) * weight).mean(), (fresnel * weight).mean()
            found = reflectance(roughness, facing)
            assert found[0] == pytest.approx(expected[0], abs=0.16)
            assert found[1] == pytest.approx(expected[1], abs=0.03)


def unit(vector: Any) -> NDArray[Any]:
    return np.asarray(vector / np.linalg.norm(vector))


def twin(values: dict[str, Any], frame: Any, side: float, eye: Any, key: Any) -> list[NDArray[Any]]:
    """How a place shines, in NumPy: ambient, key, glow."""
    normal, tangent = frame
    n = normal
    if tangent.any():
        t = unit(tangent - (tangent @ normal) * normal)
        outward = side * normal
        x, y = values["normal"]
        z = np.sqrt(max(1 - x * x - y * y, 0))
        n = side * unit(x * t + y * np.cross(outward, t) + z * outward)
    facing = n @ eye
    mirrored = 2 * facing * n - eye
    facing = max(facing, 0)
    s = 0.5 / (max(values["roughness"] ** 2, 0.01) ** 2 * max(facing, 0.1))
    a, b = reflectance(values["roughness"], facing)
    color, metal = values["color"], values["metallic"]
    spec = (0.04 * (1 - metal) + color * metal) * a + b
    diffuse = SKY_BELOW + (SKY_ABOVE - SKY_BELOW) * (0.5 + 0.5 * n[2]) + 0.1 * facing
    gate = np.clip(4 * (normal @ key), 0, 1)
    above = np.clip(1 + 2 * (mirrored @ normal), 0, 1)
    sky = above * sky_mirrored(tuple(mirrored), s, LAMPS)
    ambient = values["ao"] * (color * (1 - metal) * diffuse + spec * sky)
    direct = color * (1 - metal) * KEY_LIGHT * max(n @ key, 0) + spec * key_mirrored(mirrored @ key, s)
    return [ambient, gate * direct, values["emission"]]


def test_a_place_shines_as_its_twin_does() -> None:
    rng = np.random.default_rng(7)
    for _ in range(60):
        values: dict[str, Any] = {role: rng.random() for role in ("roughness", "metallic", "ao")}
        values |= {"color": rng.random(3), "emission": rng.random(3), "normal": rng.uniform(-0.6, 0.6, 2)}
        normal, eye, key = (unit(rng.normal(size=3)) for _ in range(3))
        eye = eye if eye @ normal > 0 else -eye
        tangent = rng.normal(size=3) * (rng.random() < 0.8)
        side = float(rng.choice([-1, 1]))
        coded = np.append((values["normal"] + 1) / 2, 1)
        maps = {"normal": coded, "emission": values["emission"]}
        maps |= {role: [values[role]] for role in ("roughness", "metallic", "ao")}
        arrays = {role: np.array(part, np.float32).reshape(1, 1, -1) for role, part in maps.items()}
        built = build_maps(arrays, np.zeros((1, 3), np.float32), AXES, first=0, last=0)
        color = (*values["color"], 1.0)
        found = material_light(
            built, (0.5, 0.5), (0.1, 0.0), (0.0, 0.1), color,
            tuple(normal), tuple(tangent), side, tuple(eye), tuple(key),
        )  # fmt: skip
        for part, expected in zip(found, twin(values, (normal, tangent), side, eye, key), strict=True):
            np.testing.assert_allclose(part, expected, rtol=2e-5, atol=2e-6)


def flat(value: float, channels: int = 1) -> Any:
    return np.full((4, 4, channels), value, np.float32)


def test_each_map_does_what_it_says() -> None:
    model, grey = sphere(cells=24), flat(0.3, 3)
    options: dict[str, Any] = {**SMALL, "view": (20, 20)}

    def picture(**maps: Any) -> Any:
        return render(*model, grey, maps=maps, **options)

    plain = render(*model, grey, **options)
    np.testing.assert_array_equal(picture(height=flat(0.2), opacity=flat(1)), plain)  # not shown
    matte = picture(roughness=flat(0.8))
    assert np.abs(matte - plain).max() < 0.1  # without maps a surface looks like a rough one
    smooth, metal = picture(roughness=flat(0.2)), picture(metallic=flat(1), roughness=flat(0.2))
    assert (smooth - matte).max() > 0.1
    assert metal[..., 0].std() > plain[..., 0].std()
    dark = picture(ao=flat(0.0))
    assert (dark <= matte + 1e-6).all()
    assert dark.mean() < matte.mean() - 0.02
    glowing = picture(emission=flat(0.4, 3))
    middle = glowing[30:42, 42:54] - matte[30:42, 42:54]
    assert middle.min() > 0.1
    assert middle.max() <= 0.4 + 1e-6


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_normals_lean_toward_where_they_say(dtype: Any) -> None:
    """On an upright sheet: x to the right, y up; the key light is up on the left."""
    model = sheet()
    tangents = np.tile([1.0, 0.0, 0.0], (len(model[0]), 1))
    top = 1 if dtype == np.float32 else np.iinfo(dtype).max
    options: dict[str, Any] = {**SMALL, "view": (0, 0)}

    def brightness(x: float, y: float, scale: float = 1.0) -> float:
        vector = np.array([x, y, np.sqrt(1 - x * x - y * y)]) / 2 + 0.5
        coded = (vector * top if top == 1 else np.rint(vector * top)).astype(dtype)
        normal = np.broadcast_to(coded, (4, 4, 3)).copy()
        image = render(
            *model, flat(0.4, 3), maps={"normal": normal}, tangents=tangents, normal_scale=scale, **options
        )
        return float(image[36, 48, 0])

    straight = brightness(0, 0)
    assert brightness(-0.4, 0) > straight + 0.01 > straight > brightness(0.4, 0) + 0.01
    assert brightness(0, 0.4) > straight + 0.01 > straight > brightness(0, -0.4) + 0.01
    assert brightness(0.4, 0, 0.0) == pytest.approx(straight, abs=1e-3)


def test_what_does_not_fit_is_refused() -> None:
    model, texture = sheet(), flat(0.4, 3)
    for maps, options, said in (
        ({"roughness": flat(1, 3)}, {}, "roughness map has shape"),
        ({"ao": np.ones((8, 8, 1), np.float32)}, {}, "ao map has shape"),
        ({"normal": flat(1, 3)}, {}, "tangents have shape"),
        ({"normal": flat(1, 3)}, {"tangents": np.ones((2, 3))}, "tangents have shape"),
    ):
        with pytest.raises(InputError, match=said):
            render(*model, texture, maps=maps, **options)
    with pytest.raises(InputError, match="ao map has shape"):
        render(*model, None, maps={"ao": flat(1)})
