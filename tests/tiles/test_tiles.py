"""Tiles that are written one by one are those of the whole atlas, and a run that was stopped goes on."""

import errno
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import assert_one_line, run_cli

import upholster
from upholster.base.errors import FormatError, InputError, StoppedError
from upholster.base.limits import Limits
from upholster.base.options.write_options import WriteOptions
from upholster.base.types import frozen_array
from upholster.covering.tasks.storage import Place
from upholster.covering.tasks.work import load, store
from upholster.image.files.material import Material
from upholster.output.reports import CoverReport
from upholster.pipeline import cover, refine
from upholster.runtime.parallel import TaskPool, thread_pool

ROOT = Path(__file__).parent.parent.parent
SAMPLE = ROOT / "examples" / "weave.png"
TORUS = "torus:R=2,r=0.9"
NAME = "x.<UDIM>.png"
SQUARES = "o Boards\nusemtl oak\n" + "".join(
    f"v 0 0 {k}\nv 1 0 {k}\nv 1 1 {k}\nv 0 1 {k}\nf {4 * k + 1} {4 * k + 2} {4 * k + 3} {4 * k + 4}\n"
    for k in range(6)
)


@pytest.fixture(scope="module")
def material() -> Material:
    sample = upholster.read_exemplar(SAMPLE)[:64, :64]
    return Material({"albedo": sample, "normal": sample[::-1].copy(), "roughness": sample[:, :, :1].copy()})


def _cover(material: Material, *targets: object, seed: int = 3, **more: Any) -> CoverReport:
    wanted = {"texels": 200_000, "sample_size": 1.5, "direction": "around:z"}
    options = {"atlas_size": 256, "padding": 6}
    more = {"threads": 2} | more
    files = [str(target) for target in targets]
    return cover(material, TORUS, files, synthesis=wanted, options=options, seed=seed, **more)


@pytest.fixture(scope="module")
def whole(material: Material, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The tiles as they come with another output: of an atlas that is in memory as a whole."""
    folder = tmp_path_factory.mktemp("whole")
    report = _cover(material, folder / NAME, folder / "x.npz")
    counts = {name: count for name, count in report.counts.items() if "page" not in name}  # of whole atlases
    (folder / "counts.json").write_text(json.dumps(counts))
    return {file.name: file.read_bytes() for file in folder.iterdir() if file.suffix != ".npz"}


def _tiles(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.glob("*.png")}


@pytest.mark.slow(reason="lays and writes tiles several times")
def test_tiles_are_those_of_the_whole_atlas(
    material: Material, whole: dict[str, bytes], tmp_path: Path
) -> None:
    tasks: list[tuple[str, int]] = []
    with _stopping(-1, tasks):
        report = _cover(material, tmp_path / NAME, threads=1)
    maps = report.counts["maps"]
    assert len(_tiles(tmp_path)) // maps > 5
    # Several tiles are painted in a task, while many are left.
    assert len([key for key in tasks if key[0] == "tile"]) < len(_tiles(tmp_path)) // maps - 1
    assert _tiles(tmp_path) == {name: data for name, data in whole.items() if name.endswith(".png")}
    assert report.counts == json.loads(whole["counts.json"])
    assert {Path(name).name: size for name, size in report.written.items()} == {
        name: len(data) for name, data in _tiles(tmp_path).items()
    }
    # Nothing else is left.
    assert {file.suffix for file in tmp_path.iterdir()} == {".png"}


@pytest.mark.slow(reason="lays and writes tiles several times")
def test_an_obj_refers_to_the_tiles(material: Material, whole: dict[str, bytes], tmp_path: Path) -> None:
    (tmp_path / "models").mkdir()
    report = _cover(material, tmp_path / "models" / "x.obj", tmp_path / NAME)
    assert report.model is None  # nothing held all texels
    assert _tiles(tmp_path) == {name: data for name, data in whole.items() if name.endswith(".png")}
    assert sorted(file.name for file in (tmp_path / "models").iterdir()) == ["x.mtl", "x.obj"]
    lines = (tmp_path / "models" / "x.mtl").read_text().splitlines()
    assert [line for line in lines if "<UDIM>" in line] == [
        "map_Kd ../x.<UDIM>.png", "norm ../x_normal.<UDIM>.png", "map_Pr ../x_roughness.<UDIM>.png",
    ]  # fmt: skip
    # Mesh and texture coordinates are those of an OBJ that is made in memory, in tiles as well.
    _cover(material, tmp_path / "y.obj", tmp_path / "y.<UDIM>.png", tmp_path / "y.npz")
    ours, other = (
        [line for line in file.read_text().splitlines() if line[:2] in ("v ", "vt", "vn", "f ")]
        for file in (tmp_path / "models" / "x.obj", tmp_path / "y.obj")
    )
    assert sorted(ours) == sorted(other)


def test_an_obj_of_a_model_refers_to_the_tiles(material: Material, tmp_path: Path) -> None:
    """A covered mesh, and a stream: each has one material for all tiles, and no second textures."""
    (tmp_path / "boards.obj").write_text(SQUARES)
    (tmp_path / "out").mkdir()
    targets = [tmp_path / "out" / name for name in ("b.obj", "b.<UDIM>.png")]
    options = WriteOptions(atlas_size=256, padding=6)
    files = [str(tmp_path / "b.uph"), *map(str, targets)]
    asked = {"texels": 40_000}
    cover(material, tmp_path / "boards.obj", files, synthesis=asked, options=options, threads=2)
    for again in (False, True):
        if again:
            refine(tmp_path / "b.uph", targets, options=options, threads=2)
        names = {file.name for file in (tmp_path / "out").iterdir()}
        assert {"b.1001.png", "b.1002.png"} < names
        assert names - {*_tiles(tmp_path / "out")} == {"b.obj", "b.mtl"}
        assert all(name.startswith(("b.", "b_normal.", "b_roughness.")) for name in names)
        lines = (tmp_path / "out" / "b.mtl").read_text().splitlines()
        assert [line for line in lines if line.startswith(("newmtl", "map_", "norm"))] == [
            f"newmtl {'b' if again else 'oak'}",
            *("map_Kd b.<UDIM>.png", "norm b_normal.<UDIM>.png", "map_Pr b_roughness.<UDIM>.png"),
        ]
        for file in (tmp_path / "out").iterdir():
            file.unlink()


@pytest.mark.slow(reason="lays and writes tiles several times")
def test_tiles_of_a_stream_are_painted_one_by_one(material: Material, tmp_path: Path) -> None:
    _cover(material, tmp_path / "x.uph", tmp_path / NAME)  # its charts fit tiles
    options = WriteOptions(atlas_size=256, padding=6)
    for folder, others in (("alone", ()), ("whole", ("x.npz",))):
        (tmp_path / folder).mkdir()
        targets = [tmp_path / folder / name for name in (NAME, *others)]
        reported = refine(tmp_path / "x.uph", targets, options=options, threads=2)
        # Nothing has all texels where tiles alone are written.
        assert (reported.model is None) == (not others)
        assert {Path(name).name for name in reported.written} - {*others} == set(_tiles(tmp_path / folder))
    assert len(_tiles(tmp_path / "alone")) > 9
    assert _tiles(tmp_path / "alone") == _tiles(tmp_path / "whole")
    # A caller's limit counts here as well.
    with pytest.raises(FormatError, match=r"layout has .* texels; allowed here: 1000"):
        refine(tmp_path / "x.uph", [tmp_path / NAME], limits=Limits(texels=1000))
    with pytest.raises(InputError, match=r"'memory://wall/x\.<UDIM>\.png' is a URL"):
        refine(tmp_path / "x.uph", ["memory://wall/x.<UDIM>.png"])


@contextmanager
def _stopping(after: int, names: list[tuple[str, int]]) -> Iterator[Callable[..., Any]]:
    """A pool that is stopped after so many tasks; `names` are those that it was given."""

    class Pool:
        def __init__(self, pool: TaskPool) -> None:
            self.pool, self.left = pool, after

        def submit(self, key: tuple[str, int], *arguments: Any, **options: Any) -> None:
            names.append(key)
            self.pool.submit(key, *arguments, **options)

        def next(self) -> tuple[str, int]:
            if not self.left:
                raise KeyboardInterrupt
            self.left -= 1
            return self.pool.next()

        def __getattr__(self, name: str) -> Any:
            return getattr(self.pool, name)

    @contextmanager
    def make() -> Iterator[Pool]:
        with thread_pool() as pool:
            yield Pool(pool)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("upholster.covering.tasks.task_covering.thread_pool", make)
        yield make


@pytest.mark.slow(reason="lays and writes tiles several times")
@pytest.mark.parametrize("after", [5, 38])
def test_what_is_done_is_not_done_again(
    material: Material, whole: dict[str, bytes], tmp_path: Path, after: int
) -> None:
    expected = {name: data for name, data in whole.items() if name.endswith(".png")}
    reported = r"stopped; .* parcels, .* charts and .* tiles are done"
    with pytest.raises(StoppedError, match=reported), _stopping(after, []):
        _cover(material, tmp_path / NAME)
    record = tmp_path / "x.upholster" / "record.json"
    done = json.loads(record.read_text())
    assert len(done["parcel"]) + len(done["label"]) + len(done["chart"]) + len(done["tile"]) >= after
    # What is not whole is made again.
    broken = {kind: min(done[kind], default=None) for kind in ("parcel", "label", "chart", "tile")}
    for kind, n in broken.items():
        if n is not None:
            folder = tmp_path if kind == "tile" else record.parent
            (folder / next(iter(done[kind][n]))).write_bytes(b"")
    again: list[tuple[str, int]] = []
    notes: list[str] = []
    with _stopping(-1, again):
        _cover(material, tmp_path / NAME, tell=notes.append)
    kept = {(kind, int(n)) for kind in broken for n in done[kind] if n != broken[kind]}
    # A chart that lies in one parcel is written with that parcel's labels.
    assert not {key for key in kept & set(again) if key[0] in ("parcel", "tile")}
    assert ("parcel", int(broken["parcel"])) in again
    assert any(note.startswith(f"continuing: {len(done['parcel']) - 1} of") for note in notes)
    assert _tiles(tmp_path) == expected
    assert not record.parent.exists()


@pytest.mark.slow(reason="lays and writes tiles several times")
def test_a_run_of_other_options_starts_anew(material: Material, tmp_path: Path) -> None:
    with pytest.raises(StoppedError), _stopping(3, []):
        _cover(material, tmp_path / NAME)
    names: list[tuple[str, int]] = []
    with pytest.raises(StoppedError), _stopping(0, names):
        _cover(material, tmp_path / NAME, seed=4)
    first = [("parcel", 0)]  # all others wait for it
    assert names == first
    record = json.loads((tmp_path / "x.upholster" / "record.json").read_text())
    assert record["parcel"] == {}
    # A record that is broken is as none.
    (tmp_path / "x.upholster" / "record.json").write_text("{")
    with pytest.raises(StoppedError), _stopping(0, names):
        _cover(material, tmp_path / NAME, seed=4)
    assert names == first * 2


@pytest.mark.slow(reason="lays and writes tiles several times")
def test_tiles_can_be_written_to_a_url(material: Material, whole: dict[str, bytes], tmp_path: Path) -> None:
    fsspec = pytest.importorskip("fsspec")
    report = _cover(material, f"memory://walls/{NAME}")
    memory = fsspec.filesystem("memory")
    found = {name.rpartition("/")[2]: memory.cat(name) for name in memory.ls("/walls", detail=False)}
    assert found == {name: data for name, data in whole.items() if name.endswith(".png")}
    assert f"memory://walls/{NAME.replace('<UDIM>', '1001')}" in report.written


@pytest.mark.parametrize(
    ("output", "more", "named"),
    [
        ("nosuch://wall/x.<UDIM>.png", (), "'nosuch://wall/x.upholster' cannot be opened"),
        ("file:///dev/null/x.<UDIM>.png", (), "'file:///dev/null/x.upholster"),
        ("memory://wall/x.png", (), "is a URL; allowed: URLs of tiles"),
        ("memory://wall/x.<UDIM>.png", ("-o", "x.glb"), "written to a URL, but not alone"),
        (
            "x.<UDIM>.png",
            ("--workers", 2, "--scheduler", "tcp://a:1"),
            "workers and scheduler are both given",
        ),
        ("x.<UDIM>.png", ("--workers", 0), "workers is 0"),
        ("x.<UDIM>.png", ("--workers", 2, "--method", "paper", "--chart", 64), "no work for several"),
        ("x.<UDIM>.png", ("--scheduler", "nonsense://"), "scheduler 'nonsense://' does not answer"),
        ("x.<UDIM>.png", ("--atlas-size", 300), "atlas_size is 300"),
    ],
)
def test_what_cannot_be_done_is_one_line(
    tmp_path: Path, output: str, more: tuple[object, ...], named: str
) -> None:
    pytest.importorskip("distributed")
    size = () if "--method" in more else ("--texels", 20_000)
    done = run_cli("cover", SAMPLE, "--on", "torus", *size, "-o", output, *more, "-q", cwd=tmp_path)
    assert_one_line(done, named)
    assert not list(tmp_path.glob("*.png"))


def test_what_tasks_read_is_as_it_was_stored(tmp_path: Path) -> None:
    place = Place(str(tmp_path))
    frozen, open_to_all = frozen_array(np.arange(3)), np.arange(4)
    found: Any = load(place, store(place, (frozen, open_to_all)))  # type: ignore[arg-type]
    # Kernels are compiled for read-only arrays and for others apart, and only for what there is elsewhere.
    assert [array.flags.writeable for array in found] == [False, True]
    assert [array.tolist() for array in found] == [[0, 1, 2], [0, 1, 2, 3]]
    with pytest.raises(InputError, match="is of another run; allowed: one run at a time in a folder"):
        load(place, "another")


def test_a_disk_that_fills_is_one_line_and_leaves_no_half_file(tmp_path: Path) -> None:
    place = Place(str(tmp_path))

    def fill(name: str) -> None:
        with place.writing(name) as path:
            path.write_bytes(b"half")
            raise OSError(errno.ENOSPC, "No space left on device")

    for name in ("tile.png", "chart-1"):
        with pytest.raises(InputError, match=f"{name}' cannot be written: No space left on device"):
            fill(name)
    assert not list(tmp_path.iterdir())
    assert place.write("whole", b"1234") == place.size("whole") == 4
    assert place.size("none") == -1
    with pytest.raises(InputError, match="none' cannot be read: No such file"):
        place.read("none")
    assert np.array_equal(sorted(place.names()), ["whole"])
