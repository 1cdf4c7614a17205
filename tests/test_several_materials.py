"""Several materials on one model: which part gets which, in every output, and what is refused."""

import json
import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from gltf_models import Glb

from upholster.base.errors import InputError
from upholster.base.options.model_options import ModelOptions
from upholster.base.options.write_options import WriteOptions
from upholster.charts.surface_to_cover import covered_parts
from upholster.covering.joint_work import share_of
from upholster.covering.sample_arguments import read_materials
from upholster.geometry.meshes.triangle_mesh import MeshSurface
from upholster.image.files.read import read_image
from upholster.image.files.write import write_image
from upholster.pipeline import CoverReport, cover
from upholster.runtime.parallel import report_progress, running

RED, GREEN = (200, 40, 30), (30, 160, 50)
SMALL = {"texels": 60_000}


def sample(path: Path, color: tuple[int, int, int], channels: int = 3, dtype: str = "uint8") -> None:
    noise = np.random.default_rng(1).integers(-20, 20, (64, 64, 1))
    pixels = np.clip(np.array(color) + noise, 0, 255).astype(np.uint8)[:, :, :channels]
    write_image(path, pixels if dtype == "uint8" else pixels.astype(np.uint16) * 257)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of three boxes in a row, and samples that are red, green, and a material."""
    folder = tmp_path_factory.mktemp("table")
    glb = Glb(materials=[{"name": "Cloth"}, {"name": "Oak"}])
    for x, (name, material) in enumerate([("Top", 0), ("Leg 1", 1), ("Leg 2", 1)]):
        glb.node(
            name=name, mesh=glb.mesh(name, glb.box() | {"material": material}), translation=[2 * x, 0, 0]
        )
    glb.write(folder / "table.glb")
    sample(folder / "red.png", RED)
    sample(folder / "green.png", GREEN)
    (folder / "wall").mkdir()
    sample(folder / "wall" / "wall_albedo.png", GREEN, dtype="uint16")
    sample(folder / "wall" / "wall_metallic.png", (128, 128, 128), channels=1)
    return folder


def covered(folder: Path, target: Path | list[Path], materials: dict[str, Any], **more: Any) -> CoverReport:
    named = {
        name: str(folder / source) if isinstance(source, str) else source
        for name, source in materials.items()
    }
    exemplar = folder / more.pop("exemplar") if "exemplar" in more else None
    on = more.pop("on", folder / "table.glb")
    options = {"synthesis": SMALL, "threads": 1} | more
    return cover(exemplar, on, target, materials=named, **options)


def document(path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    found: dict[str, Any] = json.loads(data[20 : 20 + length])
    return found


def materials_of(path: Path) -> list[str]:
    """Names of the materials of all meshes, in their order."""
    glb = document(path)
    return [glb["materials"][mesh["primitives"][0]["material"]]["name"] for mesh in glb["meshes"]]


@pytest.mark.slow(reason="covers several models, or one several times")
def test_the_first_pattern_that_fits_a_part_wins_and_the_file_stays(folder: Path, tmp_path: Path) -> None:
    target = tmp_path / "a.glb"
    report = covered(folder, [target, tmp_path / "a.png"], {"leg 2": "red.png", "*": "green.png@0.5"})
    assert materials_of(target) == ["green", "green", "red"]
    assert [node["name"] for node in document(target)["nodes"]] == ["Top", "Leg 1", "Leg 2"]
    assert report.counts["materials"] == 2
    assert report.counts["left plain"] == 0
    assert list(report.settled) == ["leg 2", "*"]
    assert "sample 0.5 units wide" in report.settled["*"]
    assert report.parameters["materials"]["*"].endswith("green.png@0.5")
    assert report.model is not None
    charts = report.model.texels.charts
    assert [chart.face for chart in charts] == list(range(len(charts)))
    # Texels are shared by area: all are of one size.
    assert np.ptp([chart.height / (chart.s1 - chart.s0) for chart in charts]) < 1
    # Both colours are in the picture, and the two charts' colours are not mixed up.
    seen = read_image(tmp_path / "a.png", notes=[]).reshape(-1, 3).astype(int)
    for one, other in ((0, 1), (1, 0)):
        assert (seen[:, one] > seen[:, other] + 60).sum() > 2000


def test_every_triangle_shows_its_own_sample(folder: Path, tmp_path: Path) -> None:
    arrays = {"Leg*": np.full((64, 64, 3), RED, np.uint8), "*": np.full((64, 64, 3), GREEN, np.uint8)}
    report = cover(
        None, folder / "table.glb", tmp_path / "x.npz", materials=arrays, synthesis=SMALL, threads=1
    )
    model = report.model
    assert model is not None
    assert isinstance(model.surface, MeshSurface)
    leg = np.char.startswith(np.array(model.surface.mesh.parts), "Leg")[model.surface.mesh.part]
    for triangle, island in enumerate(model.surface.island):
        wanted = RED if leg[triangle] else GREEN
        assert (model.texels.arrays[island] == wanted).all()
    u, v = np.moveaxis(model.uv[model.mesh.triangles].mean(axis=1), 1, 0)
    height, width = model.atlas.pixels.shape[:2]
    shown = model.atlas.pixels[(v * height).astype(int), (u * width).astype(int)]
    assert (shown == np.where(leg[:, None], RED, GREEN)).all()


def test_each_chart_is_counted_once(folder: Path, tmp_path: Path) -> None:
    report = covered(folder, tmp_path / "x.npz", {"Leg*": "red.png", "*": "green.png"})
    assert report.model is not None
    parts, charts = report.model.parts, report.model.texels.charts
    counts = {name: report.counts[name] for name in ("charts", "texels", "painted texels", "placements")}
    assert counts == {
        "charts": 9,
        "texels": 60_000,
        "painted texels": sum(chart.height * chart.width for chart in charts),
        "placements": sum(len(part.quilt.placements) for part in parts if part.quilt is not None),
    }


def test_parts_without_a_material_stay_as_they_are(folder: Path, tmp_path: Path) -> None:
    reported: list[str] = []
    covered(folder, tmp_path / "a.glb", {"oak": "red.png"}, tell=reported.append)
    assert materials_of(tmp_path / "a.glb") == ["Cloth", "red", "red"]
    assert any("no material is given for Top: left as in the file" in note for note in reported)


@pytest.mark.slow(reason="covers several models, or one several times")
def test_the_sample_covers_the_rest(folder: Path, tmp_path: Path) -> None:
    report = covered(folder, tmp_path / "a.glb", {"Leg 1": "red.png"}, exemplar="green.png")
    assert materials_of(tmp_path / "a.glb") == ["green", "red", "green"]
    assert list(report.settled) == ["Leg 1", "the others"]
    only = ModelOptions(part=("Top",))
    covered(folder, tmp_path / "b.glb", {"Leg 1": "red.png"}, exemplar="green.png", model=only)
    assert materials_of(tmp_path / "b.glb") == ["green", "red", "Oak"]


def test_a_pattern_for_which_nothing_is_left_is_reported(folder: Path, tmp_path: Path) -> None:
    report = covered(folder, tmp_path / "a.glb", {"*": "red.png", "Top": "none.png"})
    assert materials_of(tmp_path / "a.glb") == ["red", "red", "red"]
    assert any("'Top' covers nothing" in note for note in report.notes)


@pytest.mark.slow(reason="covers several models, or one several times")
def test_maps_that_a_material_lacks_are_neutral(folder: Path, tmp_path: Path) -> None:
    targets = [tmp_path / name for name in ("a.glb", "a.obj", "a.png")]
    report = covered(folder, targets, {"Top": "wall", "*": "red.png"})
    assert report.counts["maps"] == 2
    assert report.counts["bits"] == 16
    model = report.model
    assert model is not None
    first = model.parts[0].surface
    assert isinstance(first, MeshSurface)
    assert all((metal == 0).all() for metal in model.maps["metallic"].arrays[first.islands :])
    assert all((metal > 0).all() for metal in model.maps["metallic"].arrays[: first.islands])
    rough = [material["pbrMetallicRoughness"] for material in document(tmp_path / "a.glb")["materials"]]
    assert [("metallicRoughnessTexture" in each) for each in rough] == [True, False]
    assert (tmp_path / "a_texture_metallic.png").exists()


@pytest.mark.slow(reason="covers several models, or one several times")
def test_the_same_bytes_on_any_number_of_threads(folder: Path, tmp_path: Path) -> None:
    chosen = {"Leg*": "red.png", "*": "green.png"}
    for threads in (1, 2):
        covered(folder, tmp_path / f"{threads}.glb", chosen, threads=threads)
    assert (tmp_path / "1.glb").read_bytes() == (tmp_path / "2.glb").read_bytes()


def test_islands_of_several_share_no_triangle(folder: Path) -> None:
    parts = covered_parts(folder / "table.glb", ["Leg*", "Leg 1"], rest=True)
    assert list(parts) == ["Leg*", ""]
    surfaces = [each.surface for each in parts.values() if isinstance(each.surface, MeshSurface)]
    laid = np.array([surface.island >= 0 for surface in surfaces])
    assert (laid.sum(axis=0) == 1).all()
    assert surfaces[0].mesh is surfaces[1].mesh


def test_progress_goes_on_over_all_of_them() -> None:
    seen: list[tuple[str, int, int]] = []
    requests = [SimpleNamespace(texels=100), SimpleNamespace(texels=300)]
    with running(progress=lambda *at: seen.append(at)):
        for number, done in ((0, ((5, 10), (10, 10))), (1, ((1, 3), (3, 3)))):
            with share_of(requests, number):  # type: ignore[arg-type]
                for at in done:
                    report_progress("blocks", *at)
    assert seen == [("blocks", 50, 400), ("blocks", 100, 400), ("blocks", 200, 400), ("blocks", 400, 400)]


def test_an_at_in_a_name_is_no_size(tmp_path: Path) -> None:
    (tmp_path / "x@2").mkdir()
    sources = {"a": "oak.jpg@30 cm", "b": "oak@2x.jpg", "c": str(tmp_path / "x@2"), "d": "a@b/c.png@.5"}
    sizes = [(sample.source, sample.size) for sample in read_materials(sources).values()]
    assert sizes == [("oak.jpg", "30 cm"), ("oak@2x.jpg", None), (sources["c"], None), ("a@b/c.png", ".5")]


WRONG: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "no part": ({"Sofa": "red.png"}, {}, "no part is called 'Sofa'; allowed: Top, Leg 1, Leg 2"),
    "twice": ({"Top": "red.png", "top": "green.png"}, {}, "'top' is given twice"),
    "no file": ({"Top": "none.png"}, {}, "material for 'Top': "),
    "no size": ({"Top": "red.png@wide"}, {}, "size of the material for 'Top' is 'wide'"),
    "size": ({"Top": "red.png@90m"}, {}, "material for 'Top': sample size is 90"),
    "stream": ({"Top": "red.png"}, {"target": "a.uph"}, "a.uph holds one sample"),
    "method": ({"Top": "red.png"}, {"synthesis": {"method": "paper"}}, "method is 'paper'"),
    "patches": ({"Top": "red.png"}, {"on": "torus"}, "several materials are for models"),
    "part": ({"Top": "red.png"}, {"model": {"part": ["Top"]}}, "part says what the sample covers"),
    "crop": (
        {"Top": "red.png"},
        {"sample": {"crop": (0, 0, 32, 32)}},
        "crop is for SAMPLE, and none is given",
    ),
    "guide": (
        {"Top": "red.png"},
        {"synthesis": {"guide": ("luminance=height",)}},
        "guide is given with several materials; allowed: with one sample",
    ),
    "again": (
        {"Top": "red.png"},
        {"synthesis": {"again": ("height",)}},
        "again is given with several materials",
    ),
    "no sample": ({}, {}, "no SAMPLE is given"),
    "over a sample": ({"Top": "red.png"}, {"target": "red.png"}, "red.png"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_reported_and_nothing_written(folder: Path, tmp_path: Path, case: str) -> None:
    materials, more, message = WRONG[case]
    options = dict(more)
    target = options.pop("target", "a.glb")
    before = (folder / "red.png").read_bytes()
    with pytest.raises(InputError) as found:
        covered(folder, (folder if target == "red.png" else tmp_path) / target, materials, **options)
    assert message in str(found.value)
    assert "\n" not in str(found.value)
    assert not list(tmp_path.iterdir())
    assert (folder / "red.png").read_bytes() == before


def test_a_solid_needs_the_height_of_all(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="displace needs a height map"):
        covered(folder, tmp_path / "a.stl", {"*": "red.png"}, options=WriteOptions(displace="1cm"))
