"""What a surface is asked for: guides, labels and zones, on every kind of surface."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laying import texture

from upholster import InputError, paint, synthesize
from upholster.base.options.sample_options import SampleOptions
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.maps.map_ground import MapGround
from upholster.charts.maps.map_text import parse_map
from upholster.covering.measure.trace import charted_of
from upholster.image.files.material import Material
from upholster.image.files.read import read_exemplar
from upholster.image.files.write import write_image
from upholster.quilt.model import Quilt
from upholster.synthesis.execution import execute
from upholster.synthesis.exemplar import Exemplar, Guidance, Guide
from upholster.synthesis.guidance import zones_on
from upholster.synthesis.guidance_reader import read_guidance
from upholster.synthesis.quilt.scene import Scene, coarser
from upholster.synthesis.quilt.steering import EITHER, as_guide, guide_costs
from upholster.synthesis.setup import prepare

CHAIR = str(Path(__file__).parents[2] / "examples" / "chair.glb")
PLACES: dict[str, tuple[str, dict[str, Any]]] = {
    "plane": ("plane", {"texels": (200, 190)}),
    "tile": ("plane", {"texels": (160, 160), "tileable": True}),
    "torus": ("torus", {"texels": 30_000, "sample_size": 4.0}),
    "chair": (CHAIR, {"texels": 20_000, "sample_size": 0.8}),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sample that is dark on the left and light on the right, its labels, and other samples."""
    made = tmp_path_factory.mktemp("guides")
    right = np.linspace(0.0, 1.0, 128)[None, :, None]
    sample = 0.5 * texture(128, 128, seed=1, passes=2) + 120 * right
    write_image(made / "sample.png", sample.astype(np.uint8))
    labels = np.zeros((128, 128, 3), np.uint8)
    labels[:, 64:] = 255, 0, 0
    write_image(made / "labels.png", labels)
    write_image(made / "other.png", texture(96, 128, seed=2, passes=2) // 2)
    asked = np.zeros((64, 64, 3), np.uint8)
    asked[:, 20:44] = 255, 0, 0
    write_image(made / "asked.png", asked)
    up = np.linspace(255, 0, 200).astype(np.uint8)[:, None, None].repeat(8, axis=1)
    write_image(made / "up.png", up)
    return made


def share_on(quilt: Quilt, image: np.ndarray) -> np.ndarray:
    """Return what an image (H, W) of the sample's shape is at the steps on the surface."""
    charted, found = charted_of(quilt), []
    for index, array in enumerate(paint(quilt, image.astype(np.float32)[..., None], density=1).arrays):
        own = array[..., 0]
        found.append(own[charted.lies_on(index, (0, 0), own.shape)] if charted is not None else own.ravel())
    return np.concatenate(found)


def height_on(folder: Path, name: str) -> str:
    """Return the map of how far up something lies: on a flat texture an image."""
    return f"{folder}/up.png" if name in ("plane", "tile") else "height"


def same(one: Quilt, other: Quilt) -> bool:
    layers = ([part.labels for own in each.labels for part in own] for each in (one, other))
    return np.array_equal(one.placements, other.placements) and all(map(np.array_equal, *layers))


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
@pytest.mark.parametrize("name", ["plane", "tile", "torus"])
def test_a_guide_leads_light_parts_up(folder: Path, name: str) -> None:
    on, options = PLACES[name]
    up, light = height_on(folder, name), np.linspace(0.0, 1.0, 128)[None].repeat(128, axis=0)
    found = []
    for guide in (None, f"luminance={up}", f"luminance={up}@8", f"luminance=1-{up}@8"):
        quilt = synthesize(str(folder / "sample.png"), on, guide=guide and (guide,), seed=3, **options)
        charted = charted_of(quilt)
        assert charted is not None
        assert quilt.surface is not None
        ground = MapGround(charted, None, quilt.surface, name in ("plane", "tile"))
        heights = parse_map(up).values(ground)
        shown = paint(quilt, light.astype(np.float32)[..., None], density=1).arrays
        pairs = [
            (own[..., 0][np.isfinite(at)], at[np.isfinite(at)])
            for own, at in zip(shown, heights, strict=True)
        ]
        ours, wanted = (np.concatenate(part) for part in zip(*pairs, strict=True))
        found.append(float(np.corrcoef(ours, wanted)[0, 1]))
    without, usual, strong, inverse = found
    assert usual > max(0.5, without + 0.2)
    assert strong > usual - 0.02
    assert inverse < -0.5


def test_without_anything_asked_not_a_texel_changes(folder: Path) -> None:
    exemplar = texture(96, 96)
    for on, options in (PLACES["plane"], PLACES["torus"]):
        asked = SynthesisOptions(**options)
        quilt = synthesize(exemplar, on, options=asked, seed=2)
        assert quilt.surface is not None
        scene = prepare(Exemplar(exemplar), quilt.surface, asked)
        assert isinstance(scene, Scene)
        nothing = tuple(np.zeros((0, chart.height, chart.width), np.uint8) for chart in scene.charts)
        scene = replace(scene, steering=replace(scene.steering, wanted=nothing))
        assert same(execute(scene, Exemplar(exemplar), quilt.surface, seed=2), quilt)


def test_threads_do_not_change_what_is_guided(folder: Path) -> None:
    options: dict[str, Any] = {
        **PLACES["torus"][1], "guide": ("luminance=noise",), "zone": (f"{folder}/other.png=facing:x>0.6",),
        "again": ("2,0,0:1",), "put": ("10,10,40,40=-2,0,0.5",),
    }  # fmt: skip
    one, three = (synthesize(str(folder / "sample.png"), "torus", threads=n, **options) for n in (1, 3))
    assert same(one, three)


def test_labels_lie_where_they_are_asked(folder: Path) -> None:
    given = f"{folder}/labels.png={folder}/asked.png"
    quilt = synthesize(str(folder / "sample.png"), "plane", texels=(192, 192), labels=(given,), seed=1)
    red = np.zeros((128, 128))
    red[:, 64:] = 1
    shown = share_on(quilt, red).reshape(192, 192) > 0.5
    wanted = np.zeros((192, 192), bool)
    wanted[:, 60:132] = True
    assert (shown == wanted).mean() > 0.85
    plain = synthesize(str(folder / "sample.png"), "plane", texels=(192, 192), seed=1)
    assert ((share_on(plain, red).reshape(192, 192) > 0.5) == wanted).mean() < 0.7


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
@pytest.mark.parametrize("name", PLACES)
def test_each_zone_shows_its_own_sample(folder: Path, name: str) -> None:
    on, options = PLACES[name]
    zone = f"{folder}/other.png={height_on(folder, name)}>0.6"
    asked = SynthesisOptions(zone=(zone,), **options)
    source, guidance = read_guidance(asked, Material({"albedo": texture(128, 128)}), SampleOptions(), None)
    assert isinstance(source, Material)
    assert guidance.rectangles == ((0, 0, 128, 128), (0, 128, 96, 128))
    quilt = synthesize(texture(128, 128), on, options=asked, seed=2)
    second = np.zeros(source.shape)
    second[:96, 128:] = 1
    gap = np.zeros(source.shape)
    gap[96:, 128:] = 1
    charted = charted_of(quilt)
    assert charted is not None
    assert quilt.surface is not None
    scene = prepare(Exemplar(source.color(), source.used, guidance), quilt.surface, asked)
    assert isinstance(scene, Scene)
    wanted = scene.steering.zones
    arrays = paint(quilt, np.stack([second, gap], axis=2).astype(np.float32), density=1).arrays
    wrong, count = 0, 0
    for index, (own, zones) in enumerate(zip(arrays, wanted, strict=True)):
        lies = charted.lies_on(index, (0, 0), zones.shape)
        for zone, is_wrong in ((1, own[..., 0] > 0.5), (2, own[..., 0] < 0.5)):
            sure = lies & (zones == zone)
            wrong, count = wrong + int(is_wrong[sure].sum()), count + int(sure.sum())
        assert own[..., 1][lies].max(initial=0) == 0  # what no sample covers
    assert count > 0.2 * sum(zones.size for zones in wanted)
    assert wrong <= 0.02 * count  # at seams, where cells of two charts do not line up
    assert {1, 2} <= {int(zone) % EITHER for zones in wanted for zone in np.unique(zones)}


def test_borders_fray_where_that_is_asked(folder: Path) -> None:
    quilts = []
    for blend in (None, 60.0):
        options: dict[str, Any] = {"texels": (200, 200), "zone": (f"{folder}/other.png={folder}/up.png>0.5",)}
        options |= {} if blend is None else {"blend": blend}
        quilt = synthesize(texture(128, 128), "plane", seed=2, **options)
        second = np.zeros(quilt.exemplar_shape)
        second[:96, 128:] = 1
        quilts.append(share_on(quilt, second).reshape(200, 200) > 0.5)
    hard, frayed = quilts
    # Of each row the share of the second sample: all or nothing but near the border, and slowly less.
    assert ((hard.mean(axis=1) > 0.02) & (hard.mean(axis=1) < 0.98)).sum() < 40
    rows = frayed.mean(axis=1)
    assert ((rows > 0.05) & (rows < 0.95)).sum() > 25
    assert rows[:60].min() > 0.95
    assert rows[-60:].max() < 0.05


def test_steps_near_another_zone_may_show_either(folder: Path) -> None:
    quilt = synthesize(texture(64, 64), "plane", texels=(100, 100))
    charted = charted_of(quilt)
    assert charted is not None
    assert quilt.surface is not None
    ground = MapGround(charted, None, quilt.surface, True)
    maps = Guidance((), ((0, 0, 9, 9), (0, 9, 9, 9)), (parse_map(f"{folder}/up.png"),))
    (zones,) = zones_on(maps, ground, 40.0)
    assert set(np.unique(zones)) == {1, 2, 1 + EITHER, 2 + EITHER}
    border = np.abs(np.arange(100) - 49.5) < 10
    assert (zones[border] >= EITHER).all()
    assert (zones[~border] < EITHER).all()
    assert (zones[:40] % EITHER == 2).all()


def test_a_quick_look_is_asked_the_same(folder: Path) -> None:
    asked = SynthesisOptions(
        zone=(f"{folder}/other.png=facing:x>0.6",), guide=("luminance=height",), **PLACES["torus"][1]
    )
    source, guidance = read_guidance(asked, texture(128, 128), SampleOptions(), None)
    assert isinstance(source, Material)
    quilt = synthesize(texture(128, 128), "torus", options=asked)
    assert quilt.surface is not None
    exemplar = Exemplar(source.color(), source.used, guidance)
    scene = prepare(exemplar, quilt.surface, asked)
    assert isinstance(scene, Scene)
    quick = coarser(scene, exemplar, 1)
    assert [zones.shape for zones in quick.steering.zones] == [(c.height, c.width) for c in quick.charts]
    look = execute(quick, exemplar, quilt.surface, seed=0)
    second = np.zeros(look.exemplar_shape)
    second[:96, 128:] = 1
    share, final = (float((share_on(one, second) > 0.5).mean()) for one in (look, quilt))
    assert abs(share - final) < 0.05


def test_numbers_of_guides_keep_order_and_what_is_not_asked() -> None:
    found = as_guide(np.array([0.0, 0.5, 1.0, np.nan, 2.0]))
    assert found.tolist() == [1, 128, 255, 0, 255]
    asked = parse_map("height")
    value, label = (Guide("", found[None], asked, 2.0, labels) for labels in (None, np.arange(3)))
    costs = guide_costs((value, label), 100.0)
    assert costs.shape == (2, 256)
    assert costs[:, 0].tolist() == [0, 0]
    assert (np.diff(costs[0]) >= 0).all()
    assert set(costs[1, 1:].tolist()) == {costs[0, 254]}


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no pair": ({"guide": ("x",)}, r"guide is 'x'; allowed: SAMPLE=TARGET"),
    "no map": ({"guide": ("luminance=x",)}, r"map is 'x'; allowed: an image's file"),
    "weight 0": ({"guide": ("luminance=height@0",)}, r"weight of guide .* is '0'; allowed: above 0"),
    "weight nan": ({"guide": ("luminance=height@nan",)}, r"is 'nan'; allowed: above 0, at most 100"),
    "weight large": ({"guide": ("luminance=height@1000",)}, r"is '1000'; allowed"),
    "no role": ({"guide": ("roughness=height",)}, r"the sample has no roughness; allowed: luminance"),
    "missing": ({"guide": ("none.png=height",)}, r"'none.png' does not exist"),
    "other size": ({"guide": ("other.png=height",)}, r"guide 'other.png' is 128x96 pixels; allowed: 128x128"),
    "label size": (
        {"labels": ("other.png=height>0.5",)},
        r"image of labels 'other.png' is 128x96 pixels; allowed: 128x128",
    ),
    "label word": (
        {"labels": ("luminance=height>0.5",)},
        r"luminance has no labels; allowed: an image's file",
    ),
    "label values": ({"labels": ("labels.png=height",)}, r"map 'height' has no labels"),
    "label unknown": ({"labels": ("labels.png=part:x",)}, r"map 'part:x' is for models"),
    "label lacks": (
        {"labels": ("labels.png=height>0.5",)},
        r"asks for #ffffff, which the sample's map lacks; .*#000000",
    ),
    "labels many": ({"labels": ("sample.png=height>0.5",)}, r"map has [0-9,]+ colours; allowed: up to 254"),
    "zone no pair": ({"zone": ("x.png",)}, r"zone is 'x.png'; allowed: SAMPLE=TARGET"),
    "zone missing": ({"zone": ("none.png=height",)}, r"'none.png' does not exist"),
    "zone no file": ({"zone": ("@3=height",)}, r"is '@3'; allowed: a file before the @"),
    "zones": ({"zone": ("other.png=height",) * 16}, r"there are 16 zones; allowed: up to 15"),
    "zone size": (
        {"zone": ("other.png@2=height",)},
        r"has a size but the sample has none; allowed: with --sample-size",
    ),
    "zone tiny": (
        {"zone": ("other.png@0.1=height",), "sample_size": 4.0},
        r"at the sample's scale; allowed: 32 to",
    ),
    "blend": ({"blend": 2.0}, r"blend is 2.0 without zones; allowed: with --zone"),
    "blend 0": ({"blend": 0.0, "zone": ("other.png=height",)}, r"blend is 0.0; allowed: a length above 0"),
    "seed": ({"again": ("height@-1",)}, r"seed of again 'height@-1' is '-1'; allowed: 0 to"),
    "region": ({"again": ("9,9,9:0.1",)}, r"region '9,9,9:0.1' contains no part of the surface"),
    "put form": ({"put": ("x.png",)}, r"put is 'x.png'; allowed: FILE=X,Y,Z"),
    "put size": ({"put": ("0,0,9,9=2,0,0*99",)}, r"size of put .* is 99; allowed: 1/16 to 16"),
    "put far": (
        {"put": ("0,0,9,9=99,0,0",)},
        r"put '0,0,9,9=99.*' lies 9\d.* from the surface; .*nearest point of the surface is",
    ),
    "put flat": ({"put": ("0,0,9,9=2,0",)}, r"has two coordinates; allowed: three"),
    "put part": ({"put": ("100,0,99,9=2,0,0",)}, r"is not part of the sample; allowed: .*inside 128x128"),
    "method": (
        {"guide": ("luminance=height",), "method": "paper"},
        r"guide belongs to method 'quilt'; allowed with 'paper'",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_reported(folder: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(folder)
    wanted, words = BAD[name]
    with pytest.raises(InputError, match=words) as reported:
        synthesize("sample.png", "torus", **{"texels": 4000, **wanted} if "method" not in wanted else wanted)
    assert len(str(reported.value).splitlines()) == 1


@pytest.mark.parametrize("reading", [{"resize": 64}, {"rectify": ((0, 0), (99, 0), (99, 99), (0, 99))}])
def test_labels_of_a_photo_that_is_resampled_are_refused(folder: Path, reading: dict[str, Any]) -> None:
    labels = SynthesisOptions(labels=(f"{folder}/labels.png=height>0.5",))
    sample = read_exemplar(folder / "sample.png")
    with pytest.raises(InputError, match="with rectify or resize, which would mix colours; allowed"):
        read_guidance(labels, sample, SampleOptions(**reading), None)


def test_labels_that_would_be_reduced_are_refused(folder: Path, tmp_path: Path) -> None:
    write_image(tmp_path / "labels.png", np.zeros((33, 4100, 3), np.uint8))
    labels = SynthesisOptions(labels=(f"{tmp_path}/labels.png=height>0.5",))
    sample = read_exemplar(folder / "sample.png")
    with pytest.raises(InputError, match="more than 4096 pixels a side, and reducing them would mix colours"):
        read_guidance(labels, sample, SampleOptions(), None)
