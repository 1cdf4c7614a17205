"""Samples and models that come with the program: by name, from a checkout and installed."""

import tomllib
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster.apps.project.file import read_project, save_project
from upholster.apps.project.project import Project
from upholster.apps.studio.folder import Folder
from upholster.apps.studio.routes import Studio
from upholster.base.errors import InputError
from upholster.base.examples import included_models, included_samples, model_path, sample_path
from upholster.base.options.model_options import ModelOptions
from upholster.charts.surface_to_cover import as_covered, covered_files, covered_parts
from upholster.covering.tasks.jobs import check_within, read_jobs
from upholster.image.files.read import read_image
from upholster.image.files.source import Sample, read_source, source_files
from upholster.image.files.write import write_image

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


def test_the_wheel_has_what_a_checkout_has() -> None:
    configured = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    forced = configured["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    packed = {source: target for source, target in forced.items() if source.endswith((".png", ".glb"))}
    assert set(packed) == {f"examples/{file.name}" for file in EXAMPLES.glob("*.[pg][nl][gb]")}
    for source, target in packed.items():
        assert target == f"upholster/apps/studio/{source}"
    assert included_samples() == {file.stem: file for file in EXAMPLES.glob("*.png")}
    assert included_models() == {file.stem: file for file in EXAMPLES.glob("*.glb")}


@pytest.mark.parametrize("name", ["brick", "bricks", "granite", "grass", "gravel", "pebbles", "weave"])
def test_each_is_read_by_its_name(name: str) -> None:
    expected = upholster.read_exemplar(EXAMPLES / f"{name}.png")
    np.testing.assert_array_equal(upholster.read_exemplar(f"sample:{name}"), expected)
    np.testing.assert_array_equal(read_source(f"sample:{name}"), expected)


def test_it_stands_wherever_a_source_does() -> None:
    file = str(EXAMPLES / "bricks.png")
    assert Sample("sample:bricks", "30cm") == Sample(file, "30cm")
    assert Sample(["sample:bricks"]).files == [file]
    assert Sample(("sample:bricks",)).source == (file,)
    assert Sample({"albedo": "sample:bricks"}).source == {"albedo": file}
    assert Project("torus", Sample("sample:bricks")).files() == [file]
    assert source_files(Sample.of("sample:bricks").source) == [file]
    part = upholster.Project("torus", materials={"Seat": "sample:weave@30cm"}).materials["Seat"]
    assert part == Sample(str(EXAMPLES / "weave.png"), "30cm")


def test_a_saved_project_keeps_a_copy(tmp_path: Path) -> None:
    project = Project("torus", Sample("sample:bricks", "30cm"))
    assert save_project(project, tmp_path / "a.upholster.json") == [str(tmp_path / "bricks.png")]
    found = read_project(tmp_path / "a.upholster.json").sample
    assert found == Sample(str(tmp_path / "bricks.png"), "30cm")
    np.testing.assert_array_equal(read_source(found), read_source("sample:bricks"))


def test_a_model_stands_wherever_a_surface_does(tmp_path: Path) -> None:
    named, file = "sample:chair", str(EXAMPLES / "chair.glb")
    assert covered_files(named) == Project(named, Sample("sample:weave")).files()[1:] == [file]
    assert run_cli("info", named).stdout == run_cli("info", file).stdout
    seat = ModelOptions(part=("Seat",))
    found, expected = (as_covered(on, seat) for on in (named, file))
    np.testing.assert_array_equal(found.surface.parameters, expected.surface.parameters)  # type: ignore[union-attr]
    assert list(covered_parts(named, ["Seat"])) == ["Seat"]
    project = Project(named, Sample("sample:weave", "18cm"))
    assert str(tmp_path / "chair.glb") in save_project(project, tmp_path / "a.upholster.json")
    assert read_project(tmp_path / "a.upholster.json").model == str(tmp_path / "chair.glb")
    (tmp_path / "b.upholster.json").write_text(
        '{"upholster": 1, "model": "sample:chair", "sample": {"source": "weave.png"}}'
    )
    assert read_project(tmp_path / "b.upholster.json").model == named
    assert_one_line(
        run_cli("cover", "sample:weave", "--on", "sample:table", "-o", tmp_path / "x.glb"), "'table'"
    )


def test_the_studio_has_them_on_its_shelf() -> None:
    folder = Folder(1 << 20)
    try:
        assert folder.included("image") == [f"included/{name}.png" for name in included_samples()]
        assert folder.included("model") == ["included/chair.glb"]
    finally:
        folder.close()


def test_the_studio_takes_their_names() -> None:
    with closing(Studio(["sample:weave", "sample:chair"], None, 10**7)) as session:
        found = session.state
    assert found is not None
    assert found["model"].endswith("chair.glb")
    assert found["sample"]["source"].endswith("weave.png")
    with pytest.raises(InputError, match="did you mean 'chair'"):
        Studio(["sample:chiar"], None, 10**7)


def test_files_stay_what_they_are(tmp_path: Path) -> None:
    for path in ("bricks.png", "./sample:bricks", "SAMPLE:bricks", tmp_path / "x.png"):
        assert sample_path(path) is model_path(path) is path
    assert model_path(4.0) == 4.0


@pytest.mark.parametrize("read", [sample_path, read_source, upholster.read_exemplar, Sample])
def test_an_unknown_name_is_refused_with_those_that_there_are(read: type) -> None:
    for name in ("brickz", "", "../examples/bricks", "bricks.png"):
        with pytest.raises(
            InputError, match="brick, bricks, granite, grass, gravel, pebbles, weave"
        ) as reported:
            read(f"sample:{name}")
        assert repr(name) in str(reported.value)
    with pytest.raises(InputError, match="did you mean 'granite'"):
        read("sample:granit")


def test_jobs_may_read_them_and_nothing_else_there(tmp_path: Path) -> None:
    table = tmp_path / "jobs.toml"
    table.write_text('on = "torus"\noutput = "{sample}.png"\n[[jobs]]\nsample = "sample:bricks"\n')
    jobs = read_jobs(table)
    check_within(jobs, Sample("sample:bricks").files, [tmp_path])
    with pytest.raises(InputError, match="LICENSE"):
        check_within(jobs, [str(EXAMPLES / "LICENSE.md")], [tmp_path])


def test_the_commands_know_them(tmp_path: Path) -> None:
    part = ("--crop", "0,0,64,48", "--picture", "both.png")
    done = run_cli("prepare", "sample:granite", "-o", "x.png", *part, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    expected = read_image(EXAMPLES / "granite.png")[:48, :64]
    np.testing.assert_array_equal(read_image(tmp_path / "x.png"), expected)
    write_image(tmp_path / "hole.png", np.eye(256, dtype=np.uint8)[:, :, None] * 255)
    done = run_cli("fill", "sample:bricks", "--hole", "hole.png", "-o", "filled.png", cwd=tmp_path)
    assert "256x256 pixels" in done.stdout, done.stderr
    assert run_cli("encode", "sample:bricks", "-o", "x.ezw", "--bytes", "2k", cwd=tmp_path).returncode == 0
    listed = run_cli("surfaces", cwd=tmp_path).stdout
    assert all(f"sample:{name}" in listed for name in included_samples())
    refused = run_cli("cover", "sample:brikcs", "--on", "torus", "-o", "x.glb", cwd=tmp_path)
    assert_one_line(refused)
    assert "did you mean 'bricks'?" in refused.stderr
