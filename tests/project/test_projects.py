"""Projects: what changes, what runs again, what is seen, and their files."""

import json
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

from upholster import FormatError, InputError, Project, Sample, read_project, save_project, synthesize
from upholster.apps.project.joint_progress import JointProgress
from upholster.image.files.write import write_image
from upholster.quilt.painting import paint

EXAMPLES = Path(__file__).parents[2] / "examples"
CHAIR = str(EXAMPLES / "chair.glb")
WEAVE = str(EXAMPLES / "weave.png")
PATIENCE = 600
"""Seconds after which what has not come never will: the machine may be busy."""

SMALL = {"texels": 12_000, "sample_size": "40cm"}


@pytest.fixture(scope="module")
def chair():
    project = Project(CHAIR, Sample(WEAVE), synthesis=SMALL)
    list(project.preview())
    return project


def ran(project):
    project.previews.stages.ran.clear()
    list(project.preview())
    return {one.name for one in project.previews.stages.ran}


READ = {"_covered_model", "_read_files"}
CHARTS = {"mesh_charts", "charted_mesh"}
DIRECTIONS = {"direction_field"}
PHASES = {"phase_field"}
SAMPLE = {"find_lattice", "match_pyramid", "_read_files"}
GROUND = {"whole_ground"}
LAID = {"execute"}
PAINTED = {"painted"}


@pytest.mark.slow(reason="covers a model again and again")
@pytest.mark.parametrize(
    ("change", "runs", "stays"),
    [
        ({"seed": 7}, LAID | PAINTED, READ | CHARTS | DIRECTIONS | PHASES | SAMPLE | GROUND),
        ({"variety": 1.3}, LAID | PAINTED, READ | CHARTS | DIRECTIONS | PHASES | SAMPLE | GROUND),
        ({"phase": 1.0}, LAID | PAINTED, READ | CHARTS | DIRECTIONS | PHASES | SAMPLE | GROUND),
        ({"mirror": True}, LAID | PAINTED, READ | CHARTS | DIRECTIONS | PHASES | SAMPLE | GROUND),
        ({"direction": "around:z"}, DIRECTIONS | PHASES | LAID, READ | CHARTS | SAMPLE),
        ({"stroke": "0,0,0.5:0,1,0"}, DIRECTIONS | PHASES | LAID, READ | CHARTS | SAMPLE),
        ({"sample_size": "35cm"}, PHASES | LAID, READ | DIRECTIONS | SAMPLE),
        ({"texels": 10_000}, CHARTS | LAID, READ | DIRECTIONS | SAMPLE),
        ({"crop": (0, 0, 128, 128)}, SAMPLE | LAID, {"_covered_model"} | CHARTS),
        ({"quality": 80}, set(), LAID | PAINTED | READ | CHARTS | DIRECTIONS | PHASES | SAMPLE | GROUND),
        ({"size": (64, 48)}, set(), LAID | PAINTED | READ),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_what_a_change_runs_again(chair, change, runs, stays):
    list(chair.preview())
    found = ran(chair.change(**change))
    assert runs <= found
    assert not stays & found
    assert not ran(chair)  # undone: all of it is known


@pytest.mark.slow(reason="covers a model again and again")
def test_larger_blocks_lie_on_ground_of_larger_triangles(chair):
    finer = chair.change(texels=60_000)
    list(finer.preview())
    found = ran(finer.change(block=40))
    assert found >= LAID | GROUND
    assert not found & (READ | CHARTS | DIRECTIONS | PHASES | SAMPLE)


@pytest.mark.slow(reason="covers a model again and again")
def test_another_material_on_one_part_leaves_the_others(tmp_path):
    project = Project(
        CHAIR,
        Sample(WEAVE),
        {"Leg*": Sample(str(EXAMPLES / "granite.png"))},
        synthesis={"texels": 12_000},
    )
    list(project.preview())
    changed = project.change(materials={"Leg*": str(EXAMPLES / "brick.png")})
    project.previews.stages.ran.clear()
    list(changed.preview())
    found = [one.name for one in project.previews.stages.ran]
    assert "covered_parts" not in found
    assert found.count("_read_files") == 1
    assert found.count("execute") == 2  # coarse and final, of one part


@pytest.mark.slow(reason="covers a model again and again")
def test_the_last_look_is_what_is_exported(chair, tmp_path):
    looks = list(chair.change(seed=3).preview(texels=6_000))
    assert [look.is_final for look in looks] == [False, True]
    fresh = Project(CHAIR, Sample(WEAVE), synthesis=SMALL, seed=3)
    report = fresh.cover(str(tmp_path / "x.npz"))
    (quilt,) = looks[-1].quilts
    assert report.model is not None
    assert report.model.quilt is not None
    for name in quilt.placements.dtype.names:
        np.testing.assert_array_equal(quilt.placements[name], report.model.quilt.placements[name])
    texels = paint(quilt, chair.request().read()[0].source)
    for one, other in zip(texels.arrays, report.model.texels.arrays, strict=True):
        np.testing.assert_array_equal(one, other)
    for look in looks:  # as many texels as are asked for, whatever the steps
        assert look.model.texels.count == pytest.approx(6_000, rel=0.1)


def test_the_next_preview_cancels_the_one_before(chair):
    big = chair.change(texels=400_000, seed=11)
    big.previews.stages.ran.clear()
    first = big.preview()
    while not big.previews.stages.ran:  # it is under way
        time.sleep(0.001)
    second = chair.change(seed=12).preview()
    assert list(first) == []
    assert first.is_cancelled
    assert first.wait(PATIENCE)
    assert [look.is_final for look in second][-1]


def test_progress_over_all_stages_and_looks_only_grows():
    said = []
    for total in (0, 4):  # a pass over nothing, too
        preview = JointProgress()
        for start, end in ((0.2, 0.4), (0.4, 1.0)):
            preview.begin(start, end)
            for stage, count in (("blocks", 9), ("blocks", 3), ("paint", total), ("blocks", 9)):
                said += [preview(stage, done, count) for done in range(1, count + 1)]
        shares = [done for _, done, _ in said]
        assert shares == sorted(shares)
        assert len(set(shares)) > 30
        assert (shares[0] > 200, shares[-1] < 1000, {all_ for *_, all_ in said}) == (True, True, {1000})
        said.clear()


def test_a_previews_progress_only_grows(chair):
    said = []
    materials = {"Seat": Sample(str(EXAMPLES / "granite.png"))}
    list(chair.change(materials=materials, seed=21).preview(progress=lambda *one: said.append(one)))
    shares = [done / total for _, done, total in said]
    assert len(set(shares)) > 5
    assert shares == sorted(shares)


def test_what_fails_is_raised_where_looks_are_awaited():
    with pytest.raises(InputError, match="no pattern clearly repeats"):
        list(
            Project(CHAIR, Sample(str(EXAMPLES / "granite.png")), synthesis={"element_size": "3cm"}).preview()
        )


def test_the_paper_has_one_look():
    project = Project("sphere", Sample(WEAVE), synthesis={"method": "paper", "chart": 64})
    assert [look.is_final for look in project.preview()] == [True]


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"sample_siz": 1}, "unknown option 'sample_siz'; did you mean 'sample_size'"),
        ({"sample_size": "3 feet"}, "sample size is '3 feet'"),
        ({"seed": -1}, "seed is -1"),
        ({"texels": "many"}, "texels is 'many'"),
        ({"materials": ["x"]}, "materials are"),
        ({"sample": None}, "no SAMPLE is given"),
        ({"block": 3}, "block is 3"),
    ],
    ids=str,
)
def test_wrong_changes_are_reported(chair, choices, message):
    with pytest.raises(InputError, match=message):
        chair.change(**choices)
    with pytest.raises(InputError, match="texels is"):
        chair.preview(texels=3)


def test_none_brings_back_a_default(chair):
    assert chair.change(sample_size=None).synthesis.sample_size is None
    assert chair.change(seed=3).seed == 3
    assert chair.seed == 0
    assert "chair.glb" in repr(chair)


def saved(tmp_path, **options):
    folder = tmp_path / "project"
    project = Project(CHAIR, Sample(WEAVE, "40cm"), synthesis={"texels": 9000}, seed=5, **options)
    copied = save_project(project, folder / "chair.upholster.json")
    return folder / "chair.upholster.json", copied


def test_a_file_holds_a_project_with_what_it_needs(tmp_path):
    file, copied = saved(tmp_path, reading={"part": ["Seat"]}, writing={"view": (10, 20)})
    assert sorted(Path(name).name for name in copied) == ["chair.glb", "weave.png"]
    found = read_project(file)
    assert (found.seed, found.synthesis.texels, found.reading.part) == (5, 9000, ("Seat",))
    assert found.writing.view == (10, 20)
    assert found.sample == Sample(str(file.parent / "weave.png"), "40cm")
    assert found.notes == ()
    # Saved again where it lies, it is the same, and nothing is copied.
    before = file.read_bytes()
    assert save_project(found, file) == []
    assert file.read_bytes() == before
    with (file.parent / "weave.png").open("ab") as opened:
        opened.write(b" ")
    assert read_project(file).notes == ("weave.png has changed since the project was saved",)


def test_materials_and_models_of_several_files_are_copied_whole(tmp_path):
    project = Project(
        CHAIR,
        Sample(str(EXAMPLES / "bricks_material")),
        {"Leg*": Sample(str(EXAMPLES / "weave.png"), options={"crop": (0, 0, 64, 64)})},
    )
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "weave.png").write_bytes(b"another file of that name")
    save_project(project, tmp_path / "a" / "x.upholster.json")
    found = read_project(tmp_path / "a" / "x.upholster.json")
    assert found.sample is not None
    assert sorted(Path(file).name for file in found.sample.files) == sorted(
        file.name for file in (EXAMPLES / "bricks_material").iterdir() if file.suffix == ".png"
    )
    leg = found.materials["Leg*"]
    assert leg.source == str(tmp_path / "a" / "weave-2.png")
    assert leg.options.crop == (0, 0, 64, 64)


@pytest.mark.slow(reason="covers a model again and again")
@pytest.mark.parametrize(
    ("reported", "message"),
    [
        ({"model": "../other.glb"}, "refers to '../other.glb'; allowed: files in the folder .* --allow DIR"),
        ({"sample": {"source": "/etc/passwd"}}, "refers to '/etc/passwd'"),
        ({"sample": {"source": "weave.png", "maps": {"ao": "/etc/passwd"}}}, "refers to '/etc/passwd'"),
        ({"modle": "chair.glb"}, "unknown key 'modle'; did you mean 'model'"),
        ({"synthesis": {"texls": 1}}, "synthesis has an unknown key 'texls'; did you mean 'texels'"),
        ({"synthesis": [1]}, "synthesis is '\\[1\\]'; allowed: an object"),
        ({"upholster": 2}, "upholster is 2; allowed: 1"),
        ({"sample": {"source": 3}}, "source of sample is 3"),
        ({"sample": {"source": ["weave.png", 3]}}, "a file's name is 3"),
        ({"sample": {"source": "weave.png", "maps": 3}}, "maps is a int"),
        ({"model": 3}, "model is 3"),
        ({"seed": "x"}, "seed is 'x'"),
        ({"materials": 3}, "materials is not an object"),
        ({"files": 3}, "files is '3'"),
    ],
    ids=lambda value: "" if isinstance(value, str) else str(value),
)
def test_wrong_files_are_one_line(tmp_path, reported, message):
    file, _ = saved(tmp_path)
    file.write_text(json.dumps(json.loads(file.read_text()) | reported))
    with pytest.raises((InputError, FormatError), match=message) as caught:
        read_project(file)
    assert str(caught.value).startswith(str(file))


def test_what_is_no_project_is_refused(tmp_path):
    (tmp_path / "x.json").write_text("{}")
    with pytest.raises(InputError, match="another suffix"):
        read_project(tmp_path / "x.json")
    for text in ("", "[" * 100_000, "\x00", "[]"):
        (tmp_path / "x.upholster.json").write_text(text)
        with pytest.raises(FormatError):
            read_project(tmp_path / "x.upholster.json")


def test_folders_that_are_allowed_may_hold_files(tmp_path):
    file, _ = saved(tmp_path)
    (tmp_path / "other").mkdir()
    (file.parent / "weave.png").rename(tmp_path / "other" / "weave.png")
    reported = json.loads(file.read_text()) | {"sample": {"source": "../other/weave.png"}}
    file.write_text(json.dumps(reported))
    with pytest.raises(InputError, match="refers to"):
        read_project(file)
    assert read_project(file, allow=[tmp_path / "other"]).sample is not None


def test_arrays_and_functions_are_not_saved(tmp_path):
    picture = np.zeros((64, 64, 3), np.uint8)
    with pytest.raises(InputError, match="sample is a ndarray"):
        save_project(Project(CHAIR, Sample(picture)), tmp_path / "x.upholster.json")
    project = Project("torus", Sample(WEAVE), synthesis={"direction": lambda places: places})
    with pytest.raises(InputError, match="direction is a function"):
        save_project(project, tmp_path / "x.upholster.json")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow(reason="covers a model again and again")
def test_a_samples_size_counts_in_synthesize():
    options = {"texels": 20_000, "seed": 3}
    sized = synthesize(Sample(WEAVE, 1.5), "torus", **options)
    reported = synthesize(WEAVE, "torus", sample_size=1.5, **options)
    other = synthesize(WEAVE, "torus", sample_size=1.0, **options)
    assert (sized.placements["source_row"] == reported.placements["source_row"]).all()
    assert len(sized.placements) != len(other.placements)


def test_a_preview_ends_however_often_it_is_asked(chair):
    looks = chair.preview()
    assert list(looks)
    assert list(looks) == []
    granite = Project(CHAIR, Sample(str(EXAMPLES / "granite.png")), synthesis={"element_size": "3cm"})
    failing = granite.preview()
    for _ in range(2):
        with pytest.raises(InputError):
            list(failing)


@pytest.mark.slow(reason="covers a model again and again")
def test_what_is_said_last_of_the_samples_size_counts(chair):
    sized = chair.change(sample=Sample(WEAVE, "40cm"))
    assert sized.request().read()[0].on_surface.options.sample_size == "40cm"
    assert sized.change(sample_size="30cm").request().read()[0].on_surface.options.sample_size == "30cm"


def test_pixels_that_change_later_are_not_those_of_the_project():
    pixels = np.random.default_rng(1).integers(0, 256, (64, 64, 3), np.uint8)
    project = Project("torus", Sample(pixels), synthesis={"texels": 9000})
    assert project.sample is not None
    before = pixels.copy()
    pixels[:] = 0
    assert (project.sample.source == before).all()
    assert project.change(seed=1).sample.source is project.sample.source


def test_a_file_of_strokes_counts_as_it_is_and_lies_in_the_folder(tmp_path, chair):
    strokes = tmp_path / "strokes.json"
    strokes.write_text("[[[0, 0, 0.5], [0, 1, 0]]]")
    project = chair.change(stroke=(str(strokes),))
    assert project.request().read()[0].on_surface.options.stroke == ("0.0,0.0,0.5:0.0,1.0,0.0",)
    save_project(project, tmp_path / "a" / "x.upholster.json")
    strokes.write_text("[[[0, 0, 0.5], [1, 0, 0]]]")
    assert project.request().read()[0].on_surface.options.stroke == ("0.0,0.0,0.5:1.0,0.0,0.0",)
    saved_one = tmp_path / "a" / "x.upholster.json"
    assert read_project(saved_one).synthesis.stroke == ("0.0,0.0,0.5:0.0,1.0,0.0",)
    reported = json.loads(saved_one.read_text())
    reported["synthesis"]["stroke"] = ["../strokes.json"]
    saved_one.write_text(json.dumps(reported))
    with pytest.raises(InputError, match=r"refers to '\.\./strokes.json'"):
        read_project(saved_one)


def test_an_image_of_directions_counts_as_it_is_and_lies_in_the_folder(tmp_path):
    image = tmp_path / "rows.png"
    write_image(image, np.full((4, 4, 3), (255, 128, 255), np.uint8))
    sample = Sample(np.random.default_rng(1).integers(0, 256, (64, 64, 3), np.uint8))
    project = Project("plane", sample, synthesis={"texels": 9000, "direction": str(image)})
    assert str(image) in project.files()

    def rows():
        with project.previews.stages.active():
            return project.request().read()[0].scene.vectors[:, 0]

    np.testing.assert_allclose(rows(), np.broadcast_to((1, 0, 0), rows().shape), atol=0.01)
    write_image(image, np.full((8, 4, 3), (128, 255, 255), np.uint8))
    np.testing.assert_allclose(rows(), np.broadcast_to((0, 1, 0), rows().shape), atol=0.01)
    project = project.change(sample=Sample(str(EXAMPLES / "bricks.png")))
    saved_one = tmp_path / "a" / "x.upholster.json"
    assert str(saved_one.parent / "rows.png") in save_project(project, saved_one)
    reported = json.loads(saved_one.read_text())
    assert reported["synthesis"]["direction"] == "rows.png"
    assert "rows.png" in reported["files"]
    assert read_project(saved_one).synthesis.direction == str(saved_one.parent / "rows.png")
    reported["synthesis"]["direction"] = "../rows.png"
    saved_one.write_text(json.dumps(reported))
    with pytest.raises(InputError, match=r"refers to '\.\./rows.png'"):
        read_project(saved_one)


def test_an_image_of_sizes_counts_as_it_is_and_lies_in_the_folder(tmp_path):
    image = tmp_path / "sizes.png"
    write_image(image, np.zeros((4, 4, 1), np.uint8))
    sample = Sample(str(EXAMPLES / "bricks.png"))
    project = Project("plane", sample, synthesis={"texels": 9000, "size_map": f"1-{image}=0.5,2"})
    assert str(image) in project.files()

    def most():
        with project.previews.stages.active():
            return project.request().read()[0].scene.sizes.most

    assert most() == 2
    write_image(image, np.full((8, 4, 1), 255, np.uint8))
    assert most() == 0.5
    saved_one = tmp_path / "a" / "x.upholster.json"
    save_project(project, saved_one)
    reported = json.loads(saved_one.read_text())
    assert reported["synthesis"]["size_map"] == "1-sizes.png=0.5,2.0"
    assert "sizes.png" in reported["files"]
    assert read_project(saved_one).synthesis.size_map == f"1-{saved_one.parent / 'sizes.png'}=0.5,2.0"
    reported["synthesis"]["size_map"] = "../sizes.png=1,2"
    saved_one.write_text(json.dumps(reported))
    with pytest.raises(InputError, match=r"refers to '\.\./sizes.png'"):
        read_project(saved_one)


def test_links_in_a_folder_reach_nothing_outside(tmp_path):
    project = Project(
        CHAIR, Sample(str(EXAMPLES / "bricks_material")), {"Leg*": str(EXAMPLES / "bricks_material")}
    )
    file = tmp_path / "p" / "x.upholster.json"
    save_project(project, file)
    save_project(project, file)  # again: the same files, none twice
    assert sorted(one.name for one in file.parent.iterdir()) == [
        "bricks_material",
        "chair.glb",
        "x.upholster.json",
    ]
    (tmp_path / "secret.png").write_bytes(b"")
    (file.parent / "bricks_material" / "more.png").symlink_to(tmp_path / "secret.png")
    with pytest.raises(InputError, match=r"refers to .*more\.png"):
        read_project(file)
    # A folder that has other files is another one.
    save_project(project, file)
    assert (file.parent / "bricks_material-2").is_dir()
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="holds no images"):
        save_project(Project("torus", Sample(str(tmp_path / "empty"))), file)


def test_info_shows_what_a_project_holds(tmp_path):
    file, _ = saved(tmp_path, reading={"part": ["Seat"]}, writing={"view": (10, 20)})
    done = run_cli("info", file)
    assert done.returncode == 0, done.stderr
    for words in (
        "model: chair.glb",
        "part Seat",
        "sample: weave.png @ 40cm",
        "texels 9000",
        "view 10,20",
        "seed: 5",
    ):
        assert words in done.stdout
    assert_one_line(run_cli("info", tmp_path / "none.upholster.json"), "none.upholster.json")
