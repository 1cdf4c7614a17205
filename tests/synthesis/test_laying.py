"""Method "quilt", whole: everything is covered, by allowed blocks, the same on any number of threads."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from laying import Folded, Run, alike, covered, cylinder, flat_net, folded, hinge, net, plane, texture
from repeating import repeating
from tests.charts.meshes import box, sphere

from upholster.base.errors import CancelledError, InputError
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.surface_to_cover import as_covered
from upholster.charts.unwrap.flat_islands import unwrap
from upholster.covering.measure.cuts import cut_seam_ratio
from upholster.covering.synthesis import synthesize
from upholster.geometry.meshes.triangle_mesh import MeshSurface, TriangleMesh
from upholster.image.elements.lattice import find_lattice
from upholster.quilt.model import Quilt
from upholster.quilt.painting import paint
from upholster.runtime.parallel import Stop, cancelled_by, running
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt import laying
from upholster.synthesis.quilt.match_pyramid import SamplePart, match_pyramid
from upholster.synthesis.quilt.method import laid_quilt, lay_plan
from upholster.synthesis.quilt.quilt_options import QuiltOptions
from upholster.synthesis.quilt.scene import Scene
from upholster.synthesis.setup import prepare

EXEMPLAR = texture(64, 72, passes=8)
HALVES: dict[str, Any] = {"islands": np.tile(np.arange(12) // 6, 12), "turned": (0.0, 33.0)}


def holed() -> MeshSurface:
    """Return a sheet of one island with a hole, of which some triangles are left plain."""
    flat = flat_net(2.0, 2.0, 12, 12)
    triangles = net(12, 12)
    middle = flat[triangles].mean(axis=1)
    kept = triangles[np.abs(middle - (0.7, 1.0)).max(axis=1) > 0.3]
    mesh = TriangleMesh(np.column_stack([flat, 0.1 * np.sin(3 * flat[:, 0])]), kept)
    plain = np.abs(flat[kept].mean(axis=1) - (1.6, 0.4)).max(axis=1) < 0.25
    parameters = np.stack([-flat[kept][..., 1], flat[kept][..., 0]], axis=2)
    return MeshSurface(mesh, np.where(plain, -1, 0), parameters)


PATCHES = {"sphere": 2.5, "cone": 2.5, "torus": 4.5, "cyclide": 18.0}


@lru_cache
def made(name: str) -> Run:
    """Return a quilt on one of the surfaces, and what was laid for it."""
    size = {"texels": 12_000, "block": 20}
    if name in PATCHES:
        return covered(EXEMPLAR, name, sample_size=PATCHES[name], **size)
    if name == "minified":
        return covered(texture(256, 240, passes=30), "sphere", texels=6000, sample_size=3.0, block=32)
    if name == "cube":
        return covered(EXEMPLAR, unwrap(box((1.0, 1.0, 1.0)))[0], sample_size=1.5, **size)
    if name == "ball":
        return covered(EXEMPLAR, unwrap(sphere(10))[0], sample_size=2.5, **size)
    if name == "holed":
        return covered(EXEMPLAR, holed(), sample_size=1.5, **size)
    surface = {"plane": plane, "cylinder": lambda: cylinder(**HALVES), "hinge": hinge}[name]()
    return surface.laid(EXEMPLAR, block=20)


NAMES = (
    "sphere",
    "cone",
    "torus",
    "cyclide",
    "minified",
    "cube",
    "ball",
    "holed",
    "plane",
    "cylinder",
    "hinge",
)


@pytest.mark.parametrize("name", NAMES)
def test_everything_is_covered_by_parts_of_the_sample(name: str) -> None:
    run = made(name)
    quilt, numbers, records = run.quilt, run.numbers, run.laid.records
    assert numbers.level == (2 if name == "minified" else 0)
    for chart in range(len(quilt.charts)):
        on, owners = run.on(chart, "triangles") >= 0, run.on(chart, "owners")
        assert (owners[on] >= 0).all()
        assert (owners[~on] < 0).all()
        # What shows at a step is about the pixel that the block's sheet reads there, inside its frame.
        at = np.nonzero(owners >= 0)
        read, own = run.shown(chart, at), records[owners[at]]
        source = np.stack(np.divmod(run.on(chart, "sources")[at], numbers.width), axis=1)
        off = np.abs(read - source).max(axis=1)
        assert np.quantile(off, 0.9) <= 1.2
        assert np.quantile(off, 0.99) <= 2.4
        assert np.quantile(np.abs(read - own[:, :2]).max(axis=1), 0.99) <= 0.5 * numbers.size + 1.0
        # Frames may reach into the fringe, but nothing of it shows.
        assert (source >= numbers.fringe).all()
        assert (source < np.array([numbers.height, numbers.width]) - numbers.fringe).all()
    laid = records[records[:, 3] > 0]
    assert set(laid[:, 3].tolist()) == {1, 2}
    assert (laid[:, 3] == 2).sum() < 0.5 * len(laid)  # on nothing, begun anew
    # A frame is inside the sample and its fringe wherever it lies.
    half = numbers.size // 2
    assert (laid[:, :2] >= half).all()
    assert (laid[:, :2] <= np.array([numbers.height, numbers.width]) - half).all()
    assert (quilt.placements["source_row"] >= 0).all()
    assert (quilt.placements["source_row"] < 16 * quilt.exemplar_shape[0]).all()
    # Nobody asked for turned blocks; where lines have no sense, charts turn theirs by quarters.
    assert not laid[:, 2].any()
    assert (quilt.placements["symmetry"] < 4).all()


@pytest.mark.parametrize("name", ["sphere", "cube", "cylinder"])
def test_the_seed_alone_decides(name: str) -> None:
    def run(seed: int, threads: int) -> Quilt:
        size = {"texels": 12_000, "block": 20, "seed": seed, "threads": threads}
        if name == "sphere":
            return covered(EXEMPLAR, "sphere", sample_size=1.0, **size).quilt
        if name == "cube":
            return covered(EXEMPLAR, unwrap(box((1.0, 1.0, 1.0)))[0], sample_size=0.5, **size).quilt
        surface = cylinder(250, 240, **HALVES)
        return surface.laid(EXEMPLAR, block=20, seed=seed, threads=threads).quilt

    first = run(3, 1)
    assert all(alike(first, run(3, threads)) for threads in (2, 5))
    other = run(4, 1)
    assert not alike(first, other)
    apart = [(a != b).any(axis=2).mean() for a, b in zip(first.sources(), other.sources(), strict=True)]
    assert np.mean(apart) > 0.5


def test_blocks_do_not_cross_creases() -> None:
    surface = unwrap(box((1.0, 1.0, 1.0)))[0]
    options = SynthesisOptions(texels=12_000, block=20, sample_size=0.8)
    scene = prepare(Exemplar(EXEMPLAR), surface, options)
    assert isinstance(scene, Scene)
    shown = {}
    for crease in (None, 30.0):
        bent = replace(scene, options=replace(scene.options, crease=crease))
        run = Run.of(lay_plan(bent, Exemplar(EXEMPLAR)))
        canvases, mesh = run.ground.canvases, run.ground.mesh
        on = canvases.owners >= 0
        normals = np.rint(mesh.normals[canvases.triangles[on]]).astype(int) @ (1, 2, 4)
        pairs = np.unique(np.stack([canvases.owners[on], normals]), axis=1)
        shown[crease] = np.bincount(np.bincount(pairs[0]))
    # Of how many sides of the cube a block shows something.
    assert len(shown[30.0]) == 2
    assert len(shown[None]) > 2


def near(run: Run, chart: int) -> np.ndarray:
    """Return which steps show the same block as all cells round them."""
    owners = run.on(chart, "owners")
    found = owners >= 0
    for down, right in np.ndindex(7, 7):
        found &= np.roll(owners, (down - 3, right - 3), (0, 1)) == owners
    found[:3] = found[-3:] = found[:, :3] = found[:, -3:] = False
    return np.asarray(found)


def bilinear(image: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return an image's colours between pixels."""
    low = np.floor(places).astype(int)
    i, j = (low[..., k].clip(0, image.shape[k] - 2) for k in (0, 1))
    f, g = ((places[..., k] - at)[..., None] for k, at in enumerate((i, j)))
    upper, lower = ((1 - g) * image[at, j] + g * image[at, j + 1] for at in (i, i + 1))
    return np.asarray((1 - f) * upper + f * lower)


@pytest.mark.parametrize(("name", "least"), [("plane", 45), ("cylinder", 38), ("cyclide", 30), ("ball", 30)])
def test_inside_of_blocks_texels_are_what_canvases_tell(name: str, least: float) -> None:
    run, squares = made(name), []
    painted = paint(replace(run.quilt, has_tones=False), EXEMPLAR, density=1.0).arrays
    for chart, texels in enumerate(painted):
        at = np.nonzero(near(run, chart))
        read = run.shown(chart, at) - run.numbers.fringe
        squares.append((texels[at] - bilinear(EXEMPLAR.astype(float), read)) ** 2)
    error = np.concatenate(squares)
    assert len(error) > 400
    assert 10 * np.log10(255**2 / error.mean()) > least


@pytest.mark.parametrize("name", ["plane", "cylinder", "sphere", "cyclide", "ball"])
def test_cuts_hardly_show(name: str) -> None:
    quilt = made(name).quilt
    assert cut_seam_ratio(quilt, paint(quilt, EXEMPLAR, density=1.0)) < 1.5


def test_what_repeats_goes_on_without_error() -> None:
    exemplar = np.tile(texture(16, 16, passes=2), (4, 4, 1))
    run = plane(58, 58).laid(exemplar, block=20)
    assert (run.laid.records[:, 3] == 2).sum() == 1
    on = np.argwhere(run.on(0, "triangles") >= 0)
    shown = paint(replace(run.quilt, has_tones=False), exemplar).arrays[0]
    array = shown[tuple(map(slice, on.min(axis=0), on.max(axis=0) + 1))]
    assert (array[16:] == array[:-16]).all()
    assert (array[:, 16:] == array[:, :-16]).all()
    assert np.ptp(array) > 100


@pytest.mark.parametrize("size", [(85, 70), (64, 64), (130, 26)])
def test_a_tiles_edges_are_like_any_other_place(size: tuple[int, int]) -> None:
    apart, near_by = [], []
    for seed in range(3):
        run = covered(EXEMPLAR, "plane", texels=size, tileable=True, block=20, seed=seed)
        picture = paint(run.quilt, EXEMPLAR).arrays[0].astype(int)
        for axis in (0, 1):
            lines = np.moveaxis(picture, axis, 0)
            apart.append(np.abs(lines[0] - lines[-1]).mean())
            near_by.append(np.abs(np.diff(lines, axis=0)).mean())
    # Across a tile hardly wider than a block, one block fits itself.
    assert 0.75 < np.mean(apart) / np.mean(near_by) < (1.2 if min(size) > 60 else 1.6)


@pytest.mark.parametrize("surface", ["sphere", "torus"])
def test_a_lattice_keeps_its_phases(surface: str) -> None:
    exemplar, _ = repeating(96, 96, [(1 / 12.4, 0), (0, 1 / 10.7)], noise=0.3)

    def misfit(phase: float) -> float:
        options = SynthesisOptions(texels=15_000, sample_size=3.0, block=32, phase=phase)
        prepared = prepare(Exemplar(exemplar), as_covered(surface).surface, options)
        lattice = find_lattice(exemplar)
        assert lattice is not None
        run = Run.of(lay_plan(prepared, Exemplar(exemplar)))
        pyramid = match_pyramid(exemplar, run.numbers.level, [SamplePart.whole(exemplar, lattice)])
        level = pyramid.levels[run.numbers.level]
        laid = run.laid.records[run.laid.records[:, 3] > 0]
        own = level.match.phases[:, laid[:, 0] * level.width + laid[:, 1]].astype(int)
        return float((1 - np.cos(2 * np.pi * (own - laid[:, 4:6].T) / 65536)).mean())

    kept, free = misfit(8.0), misfit(1e-6)
    assert kept < 0.1
    assert kept < 0.3 * free


ALLOWED: list[tuple[dict[str, bool], set[int]]] = [
    ({}, {0}),
    ({"mirror": True}, {0, 5}),
    ({"rotate": True}, {0, 1, 2, 3}),
    ({"mirror": True, "rotate": True}, set(range(8))),
]


@pytest.mark.parametrize(("asked", "allowed"), ALLOWED)
def test_blocks_have_the_symmetries_that_are_asked_for(asked: dict[str, bool], allowed: set[int]) -> None:
    # A smooth sample goes on with one symmetry for long, so that one seed may miss another.
    for ground in (cylinder(200, 240, **HALVES), plane(200, 200)):
        runs = [ground.laid(EXEMPLAR, block=20, seed=seed, **asked) for seed in range(2)]
        shown = np.concatenate([run.quilt.placements["symmetry"] for run in runs])
        assert set(shown.tolist()) == allowed
        laid = np.concatenate([run.laid.records[run.laid.records[:, 3] > 0, 2] for run in runs])
        shares = np.bincount(laid, minlength=8)[sorted(allowed)] / len(laid)
        assert shares.min() > 0.1 / len(allowed)  # none is rare


def test_mirrored_blocks_exchange_left_and_right() -> None:
    # Rows of different colours, each darker to its left: what is above stays above.
    exemplar = np.zeros((64, 64, 3), np.uint8)
    exemplar[..., 0], exemplar[..., 1] = 4 * np.arange(64)[:, None], 4 * np.arange(64)
    run = plane(200, 200).laid(exemplar, block=20, mirror=True, seed=1)
    plain = replace(run.quilt, has_tones=False)
    picture, at = paint(plain, exemplar).arrays[0].astype(int), near(run, 0)
    mirrored = np.isin(run.on(0, "owners"), np.flatnonzero(run.laid.records[:, 2] == 5)) & at
    slopes = [np.gradient(picture[..., k], axis=axis) for k, axis in ((0, 0), (1, 1))]
    assert mirrored.sum() > 20
    assert (slopes[0][at] >= 0).all()
    assert (slopes[1][mirrored] <= 0).all()
    assert (slopes[1][at & ~mirrored] >= 0).all()


def test_a_block_takes_what_is_not_used_nearby() -> None:
    exemplar, surface = texture(64, 64, passes=4), plane(200, 200)

    def repeats(run: Run) -> int:
        # How many pairs of blocks within 2.5 blocks show about the same, but do not go on in each other.
        laid = run.laid.records[:, 3] > 0
        at, read = run.laid.fits[run.laid.firsts[:-1][laid]][:, 2:4], run.laid.records[laid][:, :2]
        apart, moved = at[:, None] - at, read[:, None] - read
        seen = (np.abs(apart) < 50).all(axis=2) & (np.abs(moved) < 10).all(axis=2)
        return int((seen & (np.abs(apart - moved) > 3).any(axis=2)).sum())

    few, many = (
        sum(repeats(surface.laid(exemplar, block=20, seed=seed, variety=much)) for seed in range(4))
        for much in (0.2, 0.0)
    )
    assert few < 0.75 * many


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [1, 2, 4, 7])
def test_any_kind_of_exemplar(dtype: Any, channels: int) -> None:
    exemplar = texture(40, 48, channels).astype(dtype)
    if dtype == np.uint16:
        exemplar *= 257
    for sample in (exemplar, np.full_like(exemplar, 9)):
        run = plane(50, 50).laid(sample, block=20)
        on = run.on(0, "triangles") >= 0
        assert (run.on(0, "owners")[on] >= 0).all()


@pytest.mark.parametrize("size", [(9, 150), (3, 3), (150, 12)])
def test_what_is_small_or_narrow_is_covered(size: tuple[int, int]) -> None:
    run = plane(*size).laid(EXEMPLAR, block=20)
    on = run.on(0, "triangles") >= 0
    assert (run.on(0, "owners")[on] >= 0).all()


def test_what_is_all_in_bits_is_covered() -> None:
    flat, triangles = flat_net(24, 24, 12, 12)[net(12, 12)].reshape(-1, 2), np.arange(864).reshape(-1, 3)
    run = folded(flat, np.column_stack([flat, 0 * flat[:, 0]]), triangles).laid(EXEMPLAR, block=20)
    on = run.on(0, "triangles") >= 0
    assert (run.on(0, "owners")[on] >= 0).all()
    assert len(np.unique(run.on(0, "owners"))) > 200


def test_progress_counts_blocks() -> None:
    calls: list[tuple[str, int, int]] = []
    surface = plane(100, 100)
    with running(2, lambda *call: calls.append(call)):
        laid_quilt(surface.plan(EXEMPLAR, block=20))
    assert {stage for stage, _, _ in calls} == {"blocks"}
    assert all(0 < done <= total for _, done, total in calls)
    assert any(done == total for _, done, total in calls)


def test_a_region_under_way_ends_when_work_is_cancelled(monkeypatch: pytest.MonkeyPatch) -> None:
    stop, kernel, shown = Stop(), laying.lay_blocks, []

    def cancelled(*arguments: Any) -> None:
        stop.set()
        kernel(*arguments)
        shown.append(arguments[-3].any())  # masks

    monkeypatch.setattr(laying, "lay_blocks", cancelled)
    surface = plane(100, 100)
    with cancelled_by(stop), running(1), pytest.raises(CancelledError):
        laid_quilt(surface.plan(EXEMPLAR, block=20))
    assert shown == [False]


def test_a_field_that_jumps_ends_blocks() -> None:
    # Two triangles' worth of surface whose directions are a right angle apart.
    whole = cylinder(60, 80, 2, turn=0.0)
    right = whole.flat[..., 0].mean(axis=1) > 40
    vectors = np.where(right[:, None, None], [0.0, 1.0, 0.0], whole.vectors)
    islands = right.astype(int)
    surface = cylinder(60, 80, 2, turn=0.0, islands=islands, turned=(0.0, 90.0))
    run = Folded(surface.charted, surface.flat, vectors, surface.fields, 1.0).laid(EXEMPLAR, block=20)
    owners = [set(run.on(chart, "owners").ravel().tolist()) - {-1} for chart in range(2)]
    assert not owners[0] & owners[1]


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"block": 7}, "block is 7; allowed: 8 to 512"),
        ({"block": 513}, "block is 513"),
        ({"overlap": 3}, "overlap is 3; allowed: 4 to half a block"),
        ({"block": 20, "overlap": 11}, r"overlap is 11; allowed: 4 to half a block \(10\)"),
        ({"variety": -0.1}, "variety is -0.1; allowed: 0 to 10"),
        ({"variety": float("inf")}, "variety is inf"),
        ({"shortlist": 0}, "shortlist is 0; allowed: 1 to 4096"),
        ({"shortlist": 5000}, "shortlist is 5000"),
    ],
)
def test_wrong_options_are_refused(given: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        QuiltOptions(**given)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"seed": -1}, "seed is -1"),
        ({"seed": 2**63}, "seed is"),
        ({"threads": 0}, "threads is 0"),
        ({"block": 60}, "block is 60; allowed: 8 to 48 in a sample of 72x64 pixels"),
        ({"element_size": 0.1}, "no pattern clearly repeats in the sample"),
    ],
)
def test_what_does_not_fit_the_surface_or_the_sample_is_refused(given: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        synthesize(EXEMPLAR, "torus", **given)
