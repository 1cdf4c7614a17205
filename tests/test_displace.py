"""Displacement from the command line's options to files: units, what is refused, what is told."""

import struct
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

from upholster.base.errors import InputError
from upholster.base.files import outputs
from upholster.base.options.write_options import WriteOptions
from upholster.charts.layout import density_layout
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.surface import Surface
from upholster.model.textured_model import TexturedModel, check_displacement
from upholster.output.outputs import Output, parse_output, parse_outputs, write_output
from upholster.quilt.model import Texels

EXAMPLES = Path(__file__).parent.parent / "examples"


def model(surface: Surface, *, height: bool = True, **options: object) -> TexturedModel:
    charts = density_layout(surface, texels=4000)
    color = Texels(charts, tuple(np.full((c.height, c.width, 3), 128, np.uint8) for c in charts))
    heights = Texels(charts, tuple(np.full((c.height, c.width, 1), 255, np.uint8) for c in charts))
    chosen = WriteOptions(quads=1000, **options)  # type: ignore[arg-type]
    return TexturedModel(surface, color, chosen, maps={"height": heights} if height else {})


def in_metres(model: TexturedModel, monkeypatch: pytest.MonkeyPatch, metres: float) -> TexturedModel:
    monkeypatch.setattr(type(model), "metres", property(lambda _: metres))
    return model


def written(path: Path, model: TexturedModel) -> bytes:
    output = parse_output(path, displaced=model.options.displace is not None)
    assert output == Output(output.kind, path)
    assert output.kind.solid
    assert output.files(["height"], 3) == (path,)
    with outputs(output.files()) as files:
        write_output(output, model, files)
    return path.read_bytes()


def stl_points(data: bytes) -> np.ndarray:
    record = np.dtype([("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")])
    assert struct.unpack_from("<I", data, 80)[0] * 50 + 84 == len(data)
    return np.frombuffer(data, record, offset=84)["p"].reshape(-1, 3)


def test_files_hold_the_displaced_surface(tmp_path: Path) -> None:
    plain, moved = model(sphere()), model(sphere(), displace=0.1)
    for one, radius in ((plain, 1.0), (moved, 1.1)):
        points = stl_points(written(tmp_path / "a.stl", one))
        assert np.linalg.norm(points, axis=1) == pytest.approx(radius, rel=3e-3)
    for name in ("a.3mf", "a.obj", "a.PLY"):
        assert len(written(tmp_path / name, moved)) > 10_000


def test_luminance_moves_where_it_is_asked_for(tmp_path: Path) -> None:
    points = stl_points(written(tmp_path / "a.stl", model(sphere(), displace=0.1, displace_by="luminance")))
    assert np.linalg.norm(points, axis=1) == pytest.approx(1 + 0.1 * 128 / 255, rel=3e-3)


def test_units_are_millimetres_where_the_model_knows_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = in_metres(model(sphere(), displace="5cm", keep="z<-50 cm"), monkeypatch, 1.0)
    points = stl_points(written(tmp_path / "a.stl", made))
    distances = np.linalg.norm(points, axis=1)
    assert distances[points[:, 2] > 0] == pytest.approx(1050, rel=3e-3)
    assert distances[points[:, 2] < -560] == pytest.approx(1000, rel=5e-3)
    lines = made.solid_notes()
    assert lines[0].endswith("cm³ before it was displaced)")
    assert lines[1].startswith("thinnest wall 2")


def test_an_open_surface_is_written_and_reported(tmp_path: Path) -> None:
    made = model(plane(), displace=0.1)
    assert len(written(tmp_path / "a.stl", made)) > 1000
    (line,) = made.solid_notes()
    assert "which are not a solid" in line


def test_few_triangles_are_a_coarser_surface_and_are_reported() -> None:
    made = model(sphere(), displace=0.1, displace_by="luminance", triangles=1000)
    assert len(made.displaced.triangles) <= 1000
    rng = np.random.default_rng(1)
    grain = tuple(rng.integers(0, 256, array.shape, np.uint8) for array in made.texels.arrays)
    made = TexturedModel(made.surface, Texels(made.texels.charts, grain), made.options)
    assert made.solid_notes()[-1].startswith("triangles ran out: the surface is up to 0.0")


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"displace": "0.6 furlong"}, "displace is '0.6 furlong'; allowed: a number of model units, or one"),
        ({"displace": 0.0}, "displace is 0.0; allowed: above 0, or below to move inward"),
        ({"displace": True}, "displace is True; allowed: a text or a number"),
        ({"displace": 1, "displace_by": "colour"}, "displace_by is 'colour'; allowed: height, luminance"),
        ({"displace": 1, "mid_level": 2}, "mid_level is 2; allowed: 0 to 1"),
        ({"displace": 1, "keep": "z=1"}, "keep is 'z=1'; allowed: conditions on x, y or z"),
        ({"displace": 1, "triangles": 10}, "triangles is 10; allowed: 1000 to 8,000,000"),
        ({"keep": "z<1"}, "keep is given without displace; allowed: with it"),
        ({"triangles": 10_000}, "triangles is given without displace; allowed: with it"),
    ],
)
def test_wrong_options_are_refused(choices: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        WriteOptions(**choices)  # type: ignore[arg-type]


def test_what_can_not_be_displaced_is_refused_before_work() -> None:
    options = WriteOptions(displace="1mm", keep="z<1")
    with pytest.raises(
        InputError, match=r"displace is for \.stl, \.3mf, \.obj and \.ply, and a\.glb, b\.png is none"
    ):
        parse_outputs(["a.glb", "b.png"], options)
    for name in ("a.stl", "a.3mf", "a.obj", "a.ply"):
        assert [output.kind.solid for output in parse_outputs([name, "b.glb"], options)] == [True, False]
    with pytest.raises(InputError, match="displace needs a height map, and the sample has none"):
        check_displacement(options, roles=("normal",), metres=1.0)
    with pytest.raises(InputError, match="displace is '1mm', and this model does not state"):
        check_displacement(options, roles=("height",), metres=None)
    check_displacement(options, roles=("height",), metres=1.0)
    check_displacement(WriteOptions(), roles=(), metres=None)
    with pytest.raises(InputError, match="displace needs a height map"):
        _ = model(sphere(), height=False, displace=0.1).displaced


@pytest.mark.slow(reason="covers several models, or one several times")
def test_the_command_line_writes_a_solid(tmp_path: Path) -> None:
    material, surface = EXAMPLES / "bricks_material", "torus:R=2,r=0.9"
    asked = ["--texels", "100k", "--displace", "0.05", "--keep", "z<-0.8", "--triangles", "60k"]
    run = run_cli("cover", material, "--on", surface, *asked, "-o", "a.stl", "-q", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    points = stl_points((tmp_path / "a.stl").read_bytes())
    assert 40_000 < len(points) // 3 <= 60_000
    assert points[:, 2].min() == pytest.approx(-0.9, abs=1e-3)
    assert points[:, 2].max() > 0.92


@pytest.mark.parametrize(
    "arguments",
    [
        ["--displace", "far"],
        ["--displace", "1", "--keep", "q<1"],
        ["--displace", "1", "--triangles", "some"],
        ["--displace", "1", "--triangles", "9M"],
        ["--displace", "1mm"],
        ["--mid-level", "0.5"],
    ],
    ids=" ".join,
)
def test_bad_options_are_one_line_and_status_2(arguments: list[str], tmp_path: Path) -> None:
    material = EXAMPLES / "bricks_material"
    done = run_cli(
        "cover", material, "--on", "plane", "--texels", "5k", *arguments, "-o", "a.stl", cwd=tmp_path
    )
    assert_one_line(done)
    assert list(tmp_path.iterdir()) == []
