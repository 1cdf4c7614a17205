"""What somebody meets who names a sample and a surface, and nothing else."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gltf_models import BOX, BOX_TRIANGLES

from upholster import surface_from_spec
from upholster.base.errors import InputError
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts import layout
from upholster.charts.layout import texture_scale
from upholster.charts.surface_to_cover import as_covered
from upholster.covering import notes
from upholster.covering.notes import notes_before
from upholster.geometry.meshes.triangle_mesh import TriangleMesh
from upholster.image.files.read import read_exemplar
from upholster.image.files.write import write_image
from upholster.pipeline import cover
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.setup import prepare

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture
def box(tmp_path):
    """A box from 0 to 1, as people write it down."""
    corners = (
        *(((0, 0, 1), (1, 0, 0), (0, 0, -1)), ((1, 0, 1), (0, 1, 0), (0, 0, -1))),
        *(((1, 1, 1), (-1, 0, 0), (0, 0, -1)), ((0, 1, 1), (0, -1, 0), (0, 0, -1))),
        *(((0, 1, 1), (1, 0, 0), (0, -1, 0)), ((0, 0, 0), (1, 0, 0), (0, 1, 0))),
    )
    nets = [np.array([[o, o + r], [o + d, o + r + d]]) for o, r, d in np.array(corners, float)]
    path = tmp_path / "box.json"
    path.write_text(json.dumps({"patches": [{"points": net.tolist()} for net in nets]}))
    return str(path)


PAIRS = [
    *(
        ("pebbles", "64", "torus"),
        ("pebbles", "200", "sphere"),
        ("pebbles", "64", "vase"),
        ("pebbles", "200", "box"),
    ),
    # Photographs, wide and high, on other surfaces.
    *(("brick", "150x90", "cyclide"), ("gravel", "90x150", "ellipsoid")),
    *(("grass", "300", "cylinder"), ("bricks_material", "128", "cone")),
]
"""Sample, its pixels, surface: a few of many."""


@pytest.mark.slow(reason="covers several models, or one several times")
@pytest.mark.parametrize(("sample", "pixels", "spec"), PAIRS)
def test_the_sample_is_a_sixth_of_the_model_wide_whatever_its_pixels(sample, pixels, spec, box, tmp_path):
    on = box if spec == "box" else spec
    folder = EXAMPLES / sample
    source, out = str(folder if folder.is_dir() else folder.with_suffix(".png")), tmp_path / "x.npz"
    found = cover(source, on, [str(out)], sample={"resize": pixels}, synthesis={"texels": 60_000})
    wide = float(found.settled["sample"].split()[0])
    assert wide == pytest.approx(surface_from_spec(on).size / 6, rel=1e-3)
    assert "--sample-size" in found.settled["sample"]
    # All of it is covered, evenly, by colours of the sample.
    albedo = read_exemplar(folder / "bricks_albedo.png" if folder.is_dir() else source)
    with np.load(out) as file:
        charts = [file[name] for name in file.files if name.startswith("chart_")]
    texels = np.concatenate([chart.reshape(-1, chart.shape[2]) for chart in charts])
    assert len(texels) == pytest.approx(60_000, rel=0.35)
    np.testing.assert_allclose(texels.mean(axis=0), albedo.mean(axis=(0, 1)), atol=12)


@pytest.mark.slow(reason="covers several models, or one several times")
def test_what_is_soft_or_very_large_is_reported_before_the_work(tmp_path, monkeypatch):
    sample = tmp_path / "small.png"
    write_image(sample, np.random.default_rng(1).integers(0, 255, (40, 40, 3), np.uint8))
    reported, stages = [], []

    def progress(stage, *_):
        if stage == "blocks":
            stages.append(stage)

    def run(**synthesis):
        reported.clear()
        return cover(
            str(sample), "sphere", [str(tmp_path / "x.npz")], synthesis=synthesis,
            tell=lambda note: reported.append((note, len(stages))), progress=progress,
        )  # fmt: skip

    assert run(texels=40_000).notes == []
    stages.clear()
    assert "soft" in run(texels=600_000).notes[0]
    assert [count for _, count in reported] == [0]
    monkeypatch.setattr(notes, "_MANY_TEXELS", 30_000)
    assert "GB of texels in memory" in run(texels=40_000).notes[0]


def test_a_note_says_how_many_texels_an_element_needs(tmp_path, monkeypatch):
    # 8 texels per element of 20 pixels need a texel per 2.5 pixels: 512 x 512 pixels are 205 x 205 texels.
    row, column = np.mgrid[:160, :160]
    noise = np.random.default_rng(1).integers(0, 30, (160, 160, 1))
    for name, side in (("tiles.png", 20), ("small.png", 8)):
        joints = (row % side < side // 6) | (column % side < side // 6)
        write_image(tmp_path / name, np.uint8(np.where(joints[:, :, None], 210, 100) + noise))
    write_image(tmp_path / "noise.png", np.random.default_rng(1).integers(0, 255, (160, 160, 3), np.uint8))
    monkeypatch.setattr(notes, "sample_notes", lambda _: [])

    surface = surface_from_spec("plane")
    few = SynthesisOptions(texels=2000, sample_size=0.3125)
    prepared = {
        name: prepare(Exemplar(read_exemplar(tmp_path / name)), surface, few)
        for name in ("tiles.png", "small.png", "noise.png")
    }

    def run(name, texels):
        scale = texture_scale(surface, 160, sample_size=0.3125, texels=texels)
        exemplar = read_exemplar(tmp_path / name)
        return notes_before(surface, replace(prepared[name], scale=scale), exemplar, 1)

    (note,) = run("tiles.png", 10_000)
    assert "3.9 texels on its shorter side: --texels 42k gives it 8" in note
    assert run("tiles.png", 42_000) == []
    # Elements of 8 pixels cannot have 8 texels; a note is due only above 2 pixels to a texel.
    (note,) = run("small.png", 60_000)
    assert note.endswith("has only 3.8 texels on its shorter side: --texels 270k gives it 8")
    assert run("small.png", 70_000) == []
    (note,) = run("noise.png", 2_000)
    assert note == "a texel is 11 pixels of the sample wide: --texels 4.1k makes that 8"
    assert run("noise.png", 4_100) == []


def test_a_sample_wider_than_the_model_is_noted(tmp_path):
    exemplar = np.random.default_rng(1).integers(0, 255, (80, 80, 3), np.uint8)
    surface = surface_from_spec("plane:width=2,height=0.5")

    def run(size):
        prepared = prepare(Exemplar(exemplar), surface, SynthesisOptions(sample_size=size, texels=4000))
        return [note for note in notes_before(surface, prepared, exemplar, 1) if "part of it shows" in note]

    assert run(2) == []
    (note,) = run(2.1)
    assert "2.1 units wide and the model only 2 long" in note
    assert "--sample-size 0.5 fits it 4 times" in note


def test_faces_that_point_inward_are_noted():
    exemplar = np.random.default_rng(1).integers(0, 255, (64, 64, 3), np.uint8)
    for inward in (False, True):
        triangles = BOX_TRIANGLES[:, ::-1] if inward else BOX_TRIANGLES
        surface = as_covered(TriangleMesh(BOX.astype(float), triangles, parts=("Box",))).surface
        scene = prepare(Exemplar(exemplar), surface, SynthesisOptions(texels=8000))
        found = notes_before(surface, scene, exemplar, 1)
        assert [note for note in found if "the faces of Box point inward" in note] == found
        assert len(found) == inward


def test_a_sample_that_is_no_texture_is_reported(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 60, (64, 64, 3), np.uint8)
    pixels[:32] += 180
    write_image(tmp_path / "sky.png", pixels)
    words = str(tmp_path / "sky.png"), "plane", [str(tmp_path / "x.npz")]
    (note,) = cover(*words, synthesis={"texels": 10_000}).notes
    assert "not look like one texture: the upper half" in note
    assert cover(*words, sample={"crop": (0, 32, 64, 32)}, synthesis={"texels": 10_000}).notes == []


def test_the_size_of_an_element_stands_for_that_of_the_sample(tmp_path):
    row, column = np.mgrid[:128, :192]
    joints = (row % 16 < 3) | ((column + 24 * (row // 16 % 2)) % 48 < 3)  # bricks of 48 x 16 pixels
    sample = tmp_path / "bricks.png"
    noise = np.random.default_rng(1).integers(0, 30, (128, 192, 1))
    write_image(sample, np.uint8(np.where(joints[:, :, None], 210, [120, 60, 40]) + noise))

    def run(**synthesis):
        return cover(
            str(sample), "plane", [str(tmp_path / "x.npz")], synthesis={"texels": 40_000} | synthesis
        )

    found = run(element_size=0.12)
    assert float(found.settled["sample"].split()[0]) == pytest.approx(0.12 * 192 / 48, rel=0.02)
    width, _, height, *_ = found.settled["element"].split()
    assert (float(width), float(height)) == pytest.approx((0.12, 0.04), rel=0.03)
    assert found.parameters["element_size"] == 0.12
    with pytest.raises(InputError, match="sample size and element size are both given"):
        run(element_size=0.1, sample_size=1)
    write_image(sample, np.random.default_rng(1).integers(0, 255, (80, 80, 3), np.uint8))
    with pytest.raises(InputError, match="no pattern clearly repeats in the sample; allowed: sample size"):
        run(element_size=0.1)


def test_texels_follow_the_sample_up_to_a_ceiling_that_is_reported(tmp_path, monkeypatch):
    sample = tmp_path / "small.png"
    write_image(sample, np.random.default_rng(1).integers(0, 255, (40, 40, 3), np.uint8))

    def run():
        found = cover(str(sample), "plane", [str(tmp_path / "x.npz")])
        with np.load(tmp_path / "x.npz") as file:
            (chart,) = (file[name] for name in file.files if name.startswith("chart_"))
        wide = float(found.settled["sample"].split()[0])
        side = surface_from_spec("plane").size / 2**0.5
        return chart.shape[0] / (40 * side / wide), found.notes

    texels_a_pixel, found = run()
    assert texels_a_pixel == pytest.approx(2, rel=0.02)
    assert found == []
    monkeypatch.setattr(layout, "MOST_TEXELS", 100_000)
    texels_a_pixel, found = run()
    assert texels_a_pixel == pytest.approx(1, rel=0.02)
    assert found == []
    monkeypatch.setattr(layout, "MOST_TEXELS", 10_000)
    monkeypatch.setattr(notes, "MOST_TEXELS", 10_000)
    _, (note,) = run()
    assert "a texel is" in note
    assert "--texels" in note


def test_a_sample_of_few_stones_is_reported(tmp_path):
    rows, columns = np.mgrid[:192, :192]
    noise = np.random.default_rng(1).normal(0, 4, (192, 192))
    for side, reported in ((64, True), (24, False)):
        joint = np.minimum((rows + side // 2) % side, (columns + side // 2) % side) < 4
        pixels = np.clip(np.where(joint, 60, 130) + noise, 0, 255).astype(np.uint8)
        write_image(tmp_path / "stones.png", pixels[:, :, None])
        words = str(tmp_path / "stones.png"), "plane", [str(tmp_path / "x.npz")]
        reported_notes = cover(*words, synthesis={"texels": 10_000}).notes
        assert any("tiles across" in note for note in reported_notes) is reported
