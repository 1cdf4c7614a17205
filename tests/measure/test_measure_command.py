"""``upholster measure`` as a user meets it, and all measures of one stream."""

import dataclasses
import json

import numpy as np
import pytest
from command_line import assert_one_line, run_cli
from measured import grains

import upholster
from upholster.base.errors import InputError
from upholster.charts.directions.direction import parse_direction
from upholster.codec.stream.writer import encode_stream
from upholster.covering.measure import mapping, measure_cover
from upholster.image.files.write import write_image

pytestmark = pytest.mark.usefixtures("few_samples")


def run(*arguments, cwd):
    return run_cli("measure", *arguments, cwd=cwd)


@pytest.fixture(scope="module")
def parts():
    exemplar, surface = grains(), upholster.torus(3, 1)
    return exemplar, surface, upholster.synthesize(exemplar, surface, chart=40, seed=3, method="paper")


@pytest.fixture(scope="module")
def measured(parts):
    exemplar, surface, quilt = parts
    return measure_cover(surface, quilt, exemplar)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, parts):
    folder = tmp_path_factory.mktemp("measure")
    exemplar, surface, quilt = parts
    data = encode_stream(surface, quilt, exemplar, sample_quality="lossless")
    write_image(folder / "sample.png", exemplar)
    write_image(folder / "more.png", grains(128, 128, seed=1))
    write_image(folder / "grey.png", grains(channels=1))
    write_image(folder / "small.png", grains(31, 40))
    (folder / "ring.uph").write_bytes(data)
    (folder / "cut.uph").write_bytes(data[:1000])
    (folder / "short.uph").write_bytes(data[:20])
    (folder / "bad.uph").write_bytes(data[:900] + b"\xff" + data[901:])
    (folder / "notes.png").write_text("these are notes")
    return folder


@pytest.mark.slow(reason="lays and measures whole quilts")
def test_a_stream_measures_as_what_it_holds(folder, tmp_path, measured):
    done = run("ring.uph", "--json", str(tmp_path / "ring.json"), cwd=folder)
    assert done.returncode == 0, done.stderr
    assert all(len(line) <= 80 for line in done.stdout.splitlines())
    for name in ("chart edges", "block borders", "texel area", "Wasserstein", "patch distance"):
        assert name in done.stdout
    reported = json.loads((tmp_path / "ring.json").read_text())
    assert reported.pop("result") == "ring.uph"
    assert reported.pop("sample") is None
    assert reported.pop("sample_size") is reported.pop("direction") is reported.pop("crease") is None
    assert reported == json.loads(json.dumps(measured.to_json()))
    assert measured.seams.edges < 1.5
    assert 1.5 < measured.scale.spread < 4


@pytest.mark.slow(reason="lays and measures whole quilts")
def test_the_exemplar_can_be_given(folder, tmp_path):
    done = run("ring.uph", "--sample", "sample.png", "--json", str(tmp_path / "a.json"), "-q", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    reported = json.loads((tmp_path / "a.json").read_text())
    assert reported["sample"] == "sample.png"
    assert reported["wasserstein_mean"] == pytest.approx(np.mean(reported["wasserstein"]))


def test_a_sample_is_prepared_as_for_the_stream(folder, monkeypatch):
    prepared = upholster.read_exemplar(folder / "more.png", crop=(20, 30, 80, 80), resize=64)
    compared = []

    def measured(surface, quilt, exemplar, **asked):
        compared.append(exemplar)
        raise InputError("seen")

    monkeypatch.setattr(upholster.covering.measure, "measure_cover", measured)
    given = ["--sample", "more.png", "--crop", "20,30,80,80", "--resize", "64"]
    assert_one_line(run("ring.uph", *given, cwd=folder), "seen")
    np.testing.assert_array_equal(compared[0], prepared)


@pytest.mark.slow(reason="lays and measures whole quilts")
def test_size_and_direction_that_were_asked_for(folder, tmp_path, parts):
    exemplar, surface, quilt = parts
    asked = ["--sample-size", "2", "--direction", "30", "--json", str(tmp_path / "a.json")]
    done = run("ring.uph", *asked, cwd=folder)
    assert done.returncode == 0, done.stderr
    reported = json.loads((tmp_path / "a.json").read_text())
    expected = mapping(
        surface, quilt, scale=exemplar.shape[1] / 2, direction=parse_direction("30", patches=True)
    )
    assert reported["mapping"] == dataclasses.asdict(expected)
    assert (reported["sample_size"], reported["direction"]) == (2, "30")
    # Method "paper": a texel is a pixel, along the patch's parameters.
    assert reported["mapping"]["angle_95"] == pytest.approx(30, abs=2)
    for name in ("texture size", "direction within"):
        assert name in done.stdout
    assert all(len(line) <= 80 for line in done.stdout.splitlines())


def test_wrapped_edges_are_measured_when_asked_for(folder, tmp_path):
    arguments = ["more.png", "--sample", "sample.png", "--tileable", "--json", str(tmp_path / "a.json")]
    done = run(*arguments, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "wrapped edges" in done.stdout
    assert json.loads((tmp_path / "a.json").read_text())["wrap"]["ratio"] > 1


@pytest.mark.slow(reason="lays and measures whole quilts")
def test_a_cut_stream_is_measured_and_says_so(folder):
    done = run("cut.uph", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "incomplete" in done.stdout


def test_an_image_measures_what_it_can(folder, tmp_path):
    done = run("more.png", "--sample", "sample.png", "--json", str(tmp_path / "a.json"), cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "seam" not in done.stdout
    reported = json.loads((tmp_path / "a.json").read_text())
    assert reported["seams"] is reported["scale"] is reported["mapping"] is None
    assert len(reported["wasserstein"]) == 4


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ([], "Missing argument"),
        (["none.uph"], "none.uph"),
        (["none.png", "--sample", "sample.png"], "none.png"),
        (["more.png"], "--sample"),
        (["more.png", "--sample", "none.png"], "none.png"),
        (["more.png", "--sample", "notes.png"], "notes.png"),
        (["notes.png", "--sample", "sample.png"], "notes.png"),
        (["small.png", "--sample", "sample.png"], "40×31"),
        (["more.png", "--sample", "small.png"], "31"),
        (["more.png", "--sample", "grey.png"], "channels"),
        (["ring.glb"], ".glb"),
        (["ring"], "suffix"),
        (["short.uph"], "more bytes"),
        (["bad.uph"], "byte"),
        (["bad.uph", "--json", "a.json"], "byte"),
        (["ring.uph", "--sample", "grey.png"], "64×64×1"),
        (["ring.uph", "--sample", "more.png"], "128×128×3"),
        (["ring.uph", "--sample", "more.png"], "--crop, --resize"),
        (["ring.uph", "--resize", "64"], "resize is for --sample, and none is given"),
        (["ring.uph", "--json", "nowhere/a.json"], "nowhere"),
        (["ring.uph", "--json", "a.txt"], ".json"),
        (["ring.uph", "--threads", "0"], "threads"),
        (["ring.uph", "--tileable"], "--tileable"),
        (["more.png", "--sample", "sample.png", "--direction", "u"], "--direction"),
        (["more.png", "--sample", "sample.png", "--sample-size", "1"], "--sample-size"),
        (["ring.uph", "--sample-size", "0"], "sample size is 0"),
        (["ring.uph", "--sample-size", "nan"], "sample size is nan"),
        (["ring.uph", "--direction", "north"], "north"),
    ],
)
def test_bad_input_is_one_line_and_status_2(arguments, named, folder):
    before = sorted(folder.iterdir())
    assert_one_line(run("-q", *arguments, cwd=folder), named)
    assert sorted(folder.iterdir()) == before


def test_parts_that_do_not_belong_together_are_refused(parts):
    exemplar, surface, quilt = parts
    other = upholster.synthesize(exemplar, surface, chart=48, seed=3, method="paper")
    with pytest.raises(InputError, match="charts"):
        measure_cover(surface, quilt, exemplar, texels=upholster.paint(other, exemplar))
    with pytest.raises(InputError, match="chart 1 reaches"):
        measure_cover(upholster.plane(), quilt, exemplar)
    with pytest.raises(InputError, match="shape"):
        measure_cover(surface, quilt, exemplar[:40])


def test_infinite_figures_are_null_in_json(measured):
    endless = dataclasses.replace(measured, seams=dataclasses.replace(measured.seams, edges=float("inf")))
    assert json.loads(json.dumps(endless.to_json(), allow_nan=False))["seams"]["edges"] is None
    assert all(len(row) == 3 for row in endless.rows())
