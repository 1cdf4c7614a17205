"""Parcels: a surface laid cube by cube is as good as one laid as a whole, and one parcel is the whole."""

import pickle
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from laying import alike, quilt_on

from upholster import read_exemplar
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.phases.course_phases import CourseField
from upholster.charts.subdivision import subdivided, subdivided_in
from upholster.charts.surface_to_cover import as_covered
from upholster.covering.measure.cuts import cut_seam_ratio
from upholster.quilt.painting import paint
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt import parcels
from upholster.synthesis.quilt.emit import emitted_quilt, label_pieces
from upholster.synthesis.quilt.lay_plan import LayPlan
from upholster.synthesis.quilt.laying import draw_parcel, lay_parcel
from upholster.synthesis.quilt.method import laid_quilt, lay_plan
from upholster.synthesis.quilt.scene import Scene
from upholster.synthesis.setup import prepare

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
SAMPLE = read_exemplar(EXAMPLES / "granite.png")[:64, :64]
SPHERE = "sphere:r=1"


@contextmanager
def in_small_parcels() -> Iterator[None]:
    """Cut surfaces into many parcels, those whose plans are made within."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parcels, "MOST_WHOLE", 1000)
        patch.setattr(parcels, "SIDE", 60)
        patch.setattr(parcels, "BLOCKS", 4)
        yield


@pytest.fixture
def small_parcels() -> Iterator[None]:
    with in_small_parcels():
        yield


def plan_on(surface: str, **wanted: object) -> LayPlan:
    options = SynthesisOptions(**{"texels": 120_000, "block": 20, **wanted})  # type: ignore[arg-type]
    sample = Exemplar(SAMPLE)
    scene = prepare(sample, as_covered(surface).surface, options)
    assert isinstance(scene, Scene)
    return lay_plan(scene, sample, seed=5)


@pytest.fixture(scope="module")
def whole() -> LayPlan:
    return plan_on(SPHERE)


@pytest.fixture(scope="module")
def cut() -> LayPlan:
    with in_small_parcels():
        return plan_on(SPHERE)


@pytest.fixture(scope="module")
def sized() -> LayPlan:
    """Return a plan with blocks of two sizes and all between; once in one parcel, once in many."""
    return plan_on(SPHERE, size_map="height=0.6,1.5")


@pytest.fixture(scope="module")
def sized_cut() -> LayPlan:
    with in_small_parcels():
        return plan_on(SPHERE, size_map="height=0.6,1.5")


@pytest.fixture(scope="module")
def coursed() -> LayPlan:
    """Return a plan of bricks whose courses slip, in one parcel."""
    return bricks_on_a_vase()


@pytest.fixture(scope="module")
def coursed_cut() -> LayPlan:
    with in_small_parcels():
        return bricks_on_a_vase()


def bricks_on_a_vase() -> LayPlan:
    sample = Exemplar(read_exemplar(EXAMPLES / "bricks.png", resize=128))
    options = SynthesisOptions(texels=300_000, sample_size=0.8, direction="around:z")
    scene = prepare(sample, as_covered("vase").surface, options)
    assert isinstance(scene, Scene)
    assert isinstance(scene.phases[0], CourseField)
    return lay_plan(scene, sample, seed=5)


def test_tasks_can_have_a_plan_of_any_direction() -> None:
    # They get vectors in place of the function, which can not be pickled.
    plan = plan_on("torus", texels=20_000, direction=lambda points: points[:, ::-1])
    found = pickle.loads(pickle.dumps(plan))
    np.testing.assert_array_equal(found.scene.vectors, plan.scene.vectors)
    assert found.scene.field is None


def test_parcels_tile_the_surface(cut: LayPlan) -> None:
    found = cut.parcels
    assert len(found) > 8
    fine = subdivided(cut.scene.charted, cut.scene.vectors, 0.4 * found.block).surface
    middles = fine.mesh.corners.mean(axis=1)
    own = found.of_points(middles)
    assert own.min() == 0
    for n in np.unique(own).tolist():
        box = found.box(n, 0)
        assert box is not None
        assert (middles[own == n] >= box[0]).all()
        assert (middles[own == n] <= box[1]).all()
        assert set(fine.chart[own == n].tolist()) <= set(found.charts[n])
    # Two of a rank do not touch, and a parcel waits for neighbours only of lower ranks.
    for start, stop in found.ranks:
        apart = np.abs(found.cubes[start:stop, None] - found.cubes[start:stop])
        assert (apart.max(axis=2)[~np.eye(stop - start, dtype=bool)] >= 2).all()
    # What is bare belongs to the last parcel near by.
    last = found.last_of_points(middles, 1.0)
    assert (last >= own).all()
    assert (last > own).any()
    assert all(other in found.near(n) for n, other in set(zip(own.tolist(), last.tolist(), strict=True)))


def test_triangles_in_a_box_are_those_of_the_whole(cut: LayPlan) -> None:
    longest = 0.4 * cut.parcels.block
    all_of_it = subdivided(cut.scene.charted, cut.scene.vectors, longest)
    box = cut.parcels.box(0, 1)
    assert box is not None
    part = subdivided_in(cut.scene.charted, cut.scene.vectors, longest, box)
    assert part is not None
    corners = all_of_it.surface.mesh.corners
    met = ((corners.min(axis=1) <= box[1]) & (corners.max(axis=1) >= box[0])).all(axis=1)
    assert np.array_equal(corners[met], part.surface.mesh.corners)
    assert np.array_equal(all_of_it.surface.places[met], part.surface.places)
    assert subdivided_in(cut.scene.charted, cut.scene.vectors, longest, box + 100) is None


@pytest.mark.parametrize("plan", ["whole", "sized", "coursed"])
def test_one_parcel_drawn_again_is_as_it_was_laid(plan: str, request: pytest.FixtureRequest) -> None:
    whole = request.getfixturevalue(plan)
    assert len(whole.parcels) == 1
    blocks, laid = lay_parcel(whole, 0, [])
    drawn = draw_parcel(whole, 0, [blocks])
    assert laid is not None
    assert drawn is not None
    assert alike(
        emitted_quilt(whole, label_pieces(whole, laid)), emitted_quilt(whole, label_pieces(whole, drawn))
    )


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
@pytest.mark.parametrize("plan", ["cut", "sized_cut", "coursed_cut"])
def test_threads_do_not_change_a_quilt_of_parcels(plan: str, request: pytest.FixtureRequest) -> None:
    found = request.getfixturevalue(plan)
    assert alike(quilt_on(1, found), quilt_on(3, found))


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
@pytest.mark.parametrize(("one", "many"), [("whole", "cut"), ("sized", "sized_cut")])
def test_seams_of_parcels_do_not_show(one: str, many: str, request: pytest.FixtureRequest) -> None:
    whole, cut = request.getfixturevalue(one), request.getfixturevalue(many)
    quilts = [laid_quilt(plan) for plan in (whole, cut)]
    counts = [len(quilt.placements) for quilt in quilts]
    assert counts[1] == pytest.approx(counts[0], rel=0.08)  # each parcel lays again within itself
    surface = as_covered(SPHERE).surface
    ratios = [cut_seam_ratio(quilt, paint(quilt.on(surface), SAMPLE)) for quilt in quilts]
    assert ratios[1] == pytest.approx(ratios[0], rel=0.06)


@pytest.mark.parametrize("shape", [(190, 160), (90, 70)])
def test_a_tile_is_one_parcel_and_the_same_on_threads(small_parcels: None, shape: tuple[int, int]) -> None:
    plan = plan_on("plane", texels=shape, tileable=True)
    assert len(plan.parcels) == 1
    assert alike(quilt_on(1, plan), quilt_on(3, plan))
