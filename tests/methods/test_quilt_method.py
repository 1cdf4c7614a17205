"""Method "quilt": equal to its plain twin, whole, the same on any number of threads, and without borders."""

from dataclasses import replace

import numpy as np
import pytest
from plain_quilt import check_same, matrix, offset, plain_quilt, shown_blocks, texture

from upholster.charts.seams import find_seams
from upholster.charts.transitions import transitions
from upholster.errors import InputError
from upholster.geometry import RationalPatch, Surface, cone, plane, ring_cyclide, sphere, torus
from upholster.measure.cuts import cut_seam_ratio
from upholster.methods import synthesize
from upholster.methods.quilt.masked import step_matrices
from upholster.methods.quilt.method import emitted, lay_all, synthesize_quilt
from upholster.methods.quilt.options import QuiltOptions
from upholster.methods.quilt.run import planned
from upholster.quilt import Chart, paint
from upholster.quilt.displacement import levels_of
from upholster.quilt.warp_field import WarpField

EXEMPLAR = texture()
SMALL = QuiltOptions(effort=0, block=20)


def whole(surface, height=48, width=None):
    return tuple(on_patch(surface, n, height, width or height) for n in range(len(surface.patches)))


def on_patch(surface, patch, height, width):
    face, row, column = surface.place(patch)
    return Chart(face, height, width, row, row + 1, column, column + 1)


def turning(scale, degrees, bend=0.0):
    """Return a field of rotations, and more of them with each node."""
    i, j = np.mgrid[:6, :7]
    angle = np.radians(degrees) + bend * (i - 1.5 * j)
    symmetry = np.stack([np.cos(angle), np.sin(angle), -np.sin(angle), np.cos(angle)], -1).reshape(6, 7, 2, 2)
    return WarpField.quantised(scale * 2 ** (0.5 * bend * (i + j))[..., None, None] * symmetry)


def laid_on(exemplar, surface, charts, fields, *, options, wrap=False, seed=0):
    """Return what is laid on each chart."""
    return lay_all(planned(exemplar, surface, charts, fields, options=options, wrap=wrap, seed=seed))


def alike(a, b):
    return np.array_equal(a.placements, b.placements) and all(
        np.array_equal(one[0].labels, other[0].labels) for one, other in zip(a.labels, b.labels, strict=True)
    )


TURNED = QuiltOptions(effort=0, block=20, mirror=True, rotate=True)
ONE = (Chart(0, 90, 75),)
RING = (Chart(0, 130, 90, 0, 4, 0, 2), Chart(0, 100, 80, 0, 4, 2, 4))
SIXTEEN = tuple(on_patch(torus(), n, 40, 30 + n) for n in range(16))
TWINS = {
    "plain": (EXEMPLAR, plane(), ONE, None, SMALL, False),
    "cheap": (
        EXEMPLAR,
        plane(),
        ONE,
        None,
        QuiltOptions(effort=0, block=20, evenness=0, variety=0, tolerance=1),
        False,
    ),
    "dear": (
        EXEMPLAR,
        plane(),
        ONE,
        None,
        QuiltOptions(effort=0, block=20, evenness=1, variety=1, tolerance=1.5),
        False,
    ),
    "grey, few": (
        texture(50, 50, 1),
        plane(),
        ONE,
        None,
        QuiltOptions(effort=0, block=24, overlap=12, shortlist=5),
        False,
    ),
    "all judged": (
        texture(30, 30),
        plane(),
        ONE,
        None,
        QuiltOptions(effort=0, block=16, shortlist=4000),
        False,
    ),
    "every second pixel": (texture(80, 90), plane(), ONE, None, SMALL, False),
    "every fourth pixel": (
        texture(400, 390),
        plane(),
        ONE,
        None,
        QuiltOptions(effort=0, block=30, shortlist=9),
        False,
    ),
    "small exemplar": (texture(14, 11), plane(), ONE, None, SMALL, False),
    "thin chart": (EXEMPLAR, plane(), (Chart(0, 9, 150),), None, SMALL, False),
    "wrapped": (EXEMPLAR, plane(), (Chart(0, 70, 85),), None, SMALL, True),
    "wrapped, small": (EXEMPLAR, plane(), (Chart(0, 15, 33),), None, SMALL, True),
    "turned": (EXEMPLAR, plane(), ONE, (turning(1.3, 30),), QuiltOptions(effort=0, block=16), False),
    "bent": (EXEMPLAR, plane(), ONE, (turning(0.8, -10, 0.1),), QuiltOptions(effort=0, block=16), False),
    "minified": (
        texture(96, 120),
        plane(),
        ONE,
        (turning(2.6, -70, 0.02),),
        QuiltOptions(effort=0, block=40),
        False,
    ),
    "minified, large": (
        texture(160, 170),
        plane(),
        ONE,
        (turning(2.5, 5),),
        QuiltOptions(effort=0, block=64),
        False,
    ),
    "minified, of few texels": (
        *(texture(220, 240), plane(), ONE, (turning(5.5, 5),), QuiltOptions(effort=0, block=64), False),
    ),
    "magnified": (
        EXEMPLAR,
        plane(),
        (Chart(0, 120, 150),),
        (turning(0.45, 10),),
        QuiltOptions(effort=0, block=16),
        False,
    ),
    "larger than the exemplar": (
        EXEMPLAR,
        plane(),
        ONE,
        (turning(6, 20),),
        QuiltOptions(effort=0, block=40),
        False,
    ),
    "four charts": (EXEMPLAR, plane(2, 2, spans=(2, 2)), whole(plane(spans=(2, 2)), 60), None, SMALL, False),
    "two rings": (EXEMPLAR, torus(), RING, [turning(1, 8), turning(0.9, -5)], SMALL, False),
    "mirrored": (EXEMPLAR, plane(), ONE, None, QuiltOptions(effort=0, block=20, mirror=True), False),
    "rotated": (
        EXEMPLAR,
        plane(),
        ONE,
        (turning(1.3, 30),),
        QuiltOptions(effort=0, block=16, rotate=True),
        False,
    ),
    "wrapped, all symmetries": (EXEMPLAR, plane(), (Chart(0, 70, 85),), None, TURNED, True),
    "minified, all symmetries": (texture(96, 120), plane(), ONE, (turning(2.6, -70, 0.02),), TURNED, False),
    "four charts, all symmetries": (
        *(EXEMPLAR, plane(2, 2, spans=(2, 2)), whole(plane(spans=(2, 2)), 60), None, TURNED, False),
    ),
    "two rings, all symmetries": (EXEMPLAR, torus(), RING, [turning(1, 8), turning(0.9, -5)], TURNED, False),
    "all round": (EXEMPLAR, torus(), (Chart(0, 110, 95, 0, 4, 0, 4),), (turning(1, 4),), SMALL, False),
    "narrow ring": (EXEMPLAR, torus(), (Chart(0, 60, 12, 0, 4, 0, 4),), None, SMALL, False),
    "torus": (EXEMPLAR, torus(), SIXTEEN, [turning(1 + 0.02 * n, 3 * n) for n in range(16)], SMALL, False),
}


@pytest.mark.parametrize("name", TWINS)
def test_it_equals_its_twin(name):
    exemplar, surface, charts, fields, options, wrap = TWINS[name]
    found = laid_on(exemplar, surface, charts, fields, options=options, wrap=wrap, seed=5)
    wanted = plain_quilt(exemplar, surface, charts, fields, options=options, wrap=wrap, seed=5)
    assert sum(len(one.placements) for one in found) > 4
    check_same(found, wanted)


SURFACES = {
    "plane": plane(2, 1, spans=(1, 2)),
    "torus": torus(),
    "cyclide": ring_cyclide(),
    "six": sphere(),
    "octants": sphere(tiling="octants"),
    "cone": cone(r2=0.0),
    "junction": Surface(
        [
            RationalPatch.from_points([[(*p, 0) for p in row] for row in net])
            for net in (
                [[(-1, 0), (1, 0)], [(-1, -1), (1, -1)]],
                [[(-1, 1), (-0.5, 1)], [(-1, 0), (0, 0)]],
                [[(-0.5, 1), (0, 2)], [(0, 0), (0.5, 1)]],
                [[(0.5, 1), (1, 1)], [(0, 0), (1, 0)]],
            )
        ]
    ),
}


@pytest.mark.parametrize("sizes", [(48, 48), (9, 70), (33, 20), (1, 1)])
@pytest.mark.parametrize("name", SURFACES)
def test_every_texel_is_painted(name, sizes):
    surface = SURFACES[name]
    charts = whole(surface, *sizes)
    for fields in (None, [turning(0.9, 7 * n) for n in range(len(charts))]):
        quilt = synthesize_quilt(EXEMPLAR, surface, charts, fields, options=SMALL)
        for chart, sources in zip(charts, quilt.sources(), strict=True):
            assert sources.shape == (chart.height, chart.width, 2)
            assert (sources >= 0).all()
            assert (sources <= 16 * (np.array(EXEMPLAR.shape[:2]) - 1)).all()
        # Each step shows a block that was laid there: where none was, the label is the nearest one's.
        for chart, one in zip(charts, laid_on(EXEMPLAR, surface, charts, fields, options=SMALL), strict=True):
            assert shown_blocks(one, chart).min() >= 0


@pytest.mark.parametrize("name", ["plain", "wrapped", "turned", "bent", "minified", "magnified"])
def test_blocks_lie_inside_the_exemplar(name):
    exemplar, surface, charts, fields, options, wrap = TWINS[name]
    (laid,) = laid_on(exemplar, surface, charts, fields, options=options, wrap=wrap)
    placed = laid.placements
    assert (placed["source_row"] >= 0).all()
    field = fields[0] if fields else turning(1, 0)
    assert not placed["symmetry"].any()
    centres = step_matrices(field, placed)
    levels = levels_of(centres, 6)
    for one, centre, level in zip(placed, centres, levels, strict=True):
        down, right = (np.arange(one[name]) - one[name] // 2 for name in ("height", "width"))
        here = matrix(field, one["row"] + down[:, None], one["column"] + right)
        read = offset(centre, here, down[:, None], right)
        for source, positions, size in zip(
            ("source_row", "source_column"), read, exemplar.shape[:2], strict=True
        ):
            # to the pixel of the level that is read; continuations may add the fraction of one
            assert one[source] + positions.min() >= -(16 << level)
            assert one[source] + positions.max() < 16 * size + (16 << level)


@pytest.mark.parametrize("wrap", [False, True])
def test_the_seed_alone_decides(wrap):
    surface = plane() if wrap else torus()
    charts = ONE if wrap else whole(surface, 40)
    runs = [
        synthesize_quilt(EXEMPLAR, surface, charts, options=SMALL, wrap=wrap, seed=seed, threads=threads)
        for seed, threads in ((3, 1), (3, 2), (3, 3), (3, None), (4, 1))
    ]
    assert all(alike(runs[0], other) for other in runs[1:4])
    assert not alike(runs[0], runs[4])
    sources = [np.concatenate([one.reshape(-1, 2) for one in runs[n].sources()]) for n in (0, 4)]
    assert (sources[0] != sources[1]).any(axis=1).mean() > 0.5


def tiling(count=4, period=16):
    """Return a texture that tiles."""
    return np.tile(texture(period, period, passes=2), (count, count, 1))


@pytest.mark.parametrize(
    "options", [QuiltOptions(effort=0, block=n, evenness=0, variety=0) for n in (20, 24)]
)
def test_what_tiles_goes_on_without_error(options):
    exemplar = tiling()
    array = paint(synthesize_quilt(exemplar, plane(), ONE, options=options), exemplar).arrays[0]
    assert (array[16:] == array[:-16]).all()
    assert (array[:, 16:] == array[:, :-16]).all()
    assert np.ptp(array) > 100
    # transferred blocks' rims may end beyond the exemplar, whose edge repeats there
    surface = plane(2, 2, spans=(2, 2))
    for array in paint(
        synthesize_quilt(exemplar, surface, whole(surface, 56), options=options), exemplar
    ).arrays:
        assert (array[16:] == array[:-16]).mean() > 0.98
        assert (array[:, 16:] == array[:, :-16]).mean() > 0.98
    tiles = synthesize_quilt(exemplar, plane(), (Chart(0, 64, 80),), options=options, wrap=True)
    array = np.tile(paint(tiles, exemplar).arrays[0], (2, 2, 1))
    assert (array[16:] == array[:-16]).all()
    assert (array[:, 16:] == array[:, :-16]).all()


def steps(sources, axis):
    """Return where the texture simply goes on from one texel to the next along an axis."""
    return (np.diff(sources, axis=axis) == 16 * np.eye(2, dtype=int)[axis]).all(axis=-1)


def test_charts_of_a_plane_are_one():
    surface = plane(3, 3, spans=(3, 3))
    exemplar = texture(64, 64, passes=8)
    inside, across, apart, near = [], [], [], []
    for seed in range(3):
        quilt = synthesize_quilt(exemplar, surface, whole(surface, 50), options=SMALL, seed=seed)
        rows = [np.concatenate(quilt.sources()[3 * n : 3 * n + 3], axis=1) for n in range(3)]
        sources = np.concatenate(rows)
        arrays = paint(quilt, exemplar).arrays
        picture = np.concatenate([np.concatenate(arrays[3 * n : 3 * n + 3], axis=1) for n in range(3)])
        for axis in (0, 1):
            goes_on = np.moveaxis(steps(sources, axis), axis, 0)
            apart_by = np.moveaxis(np.abs(np.diff(picture.astype(int), axis=axis)), axis, 0)
            edges = np.isin(np.arange(149), (49, 99))
            across.append(goes_on[edges].mean())
            inside.append(goes_on[~edges].mean())
            apart.append(apart_by[edges].mean())
            near.append(apart_by[~edges].mean())
    assert np.mean(across) >= 0.85
    assert np.mean(across) > np.mean(inside) - 0.05
    assert np.mean(apart) <= 1.2 * np.mean(near)  # some lines only


@pytest.mark.parametrize("name", ["torus", "six", "cyclide"])
def test_across_the_edges_of_a_surface_the_texture_goes_on(name):
    surface = SURFACES[name]
    charts = whole(surface, 60)
    exemplar = texture(64, 64, passes=8)
    quilt = synthesize_quilt(exemplar, surface, charts, options=SMALL)
    arrays = paint(quilt, exemplar).arrays
    found = find_seams(surface, charts)
    across = []
    for transition in transitions(surface, charts, found):
        m = transition.seam
        line = np.arange(60)
        mine = ((0, line), (line, 59), (59, line), (line, 0))[m.edge]
        rows, columns = (np.broadcast_to(at, 60) for at in mine)
        out = np.array([(-1, 0), (0, 1), (1, 0), (0, -1)])[m.edge]
        there = transition.apply(rows + out[0] * 1.0, columns + out[1] * 1.0)[:2]
        i, j = (np.rint(np.nan_to_num(at)).clip(0, 59).astype(int) for at in there)
        a = arrays[m.chart][rows, columns].astype(int)
        across.append(np.abs(a - arrays[m.other_chart][i, j]).mean())
    inside = [np.abs(np.diff(array.astype(int), axis=axis)).mean() for array in arrays for axis in (0, 1)]
    # neighbours across an edge may be a texel and a half apart
    assert np.mean(across) <= 1.4 * np.mean(inside)


def test_a_chart_that_meets_itself_goes_on_across_its_edges():
    surface, exemplar = torus(), texture(64, 64, passes=8)
    whole_face = (Chart(0, 110, 95, 0, 4, 0, 4),)
    apart, near = [], []
    for seed in range(4):
        quilt = synthesize_quilt(exemplar, surface, whole_face, options=SMALL, seed=seed)
        (laid,) = laid_on(exemplar, surface, whole_face, None, options=SMALL, seed=seed)
        assert (laid.steps > 0).sum() > 10  # blocks come in again at opposite edges
        picture = paint(quilt, exemplar).arrays[0].astype(int)
        for axis in (0, 1):
            lines = np.moveaxis(picture, axis, 0)
            apart.append(np.abs(lines[0] - lines[-1]).mean())
            near.append(np.abs(np.diff(lines, axis=0)).mean())
    assert 0.75 < np.mean(apart) / np.mean(near) < 1.25


def test_blocks_of_few_texels_do_not_show():
    # A sample of 43 texels: blocks of 16, cut as well as larger ones.
    exemplar = texture(512, 512, passes=200)
    quilt = synthesize(exemplar, "ellipsoid", texels=60_000, block=160)
    assert cut_seam_ratio(quilt, paint(quilt, exemplar)) < 1.15


@pytest.mark.parametrize("size", [(70, 85), (64, 64), (25, 130)])
def test_wrapped_edges_are_like_any_other_place(size):
    exemplar = texture(64, 64, passes=8)
    apart, near, goes_on = [], [], []
    for seed in range(4):
        quilt = synthesize_quilt(exemplar, plane(), (Chart(0, *size),), options=SMALL, wrap=True, seed=seed)
        picture = paint(quilt, exemplar).arrays[0].astype(int)
        sources = quilt.sources()[0]
        for axis in (0, 1):
            turned = np.moveaxis(picture, axis, 0)
            apart.append(np.abs(turned[0] - turned[-1]).mean())
            near.append(np.abs(np.diff(turned, axis=0)).mean())
            ends = np.take(sources, [-1, 0], axis)
            goes_on.append(steps(ends, axis).mean())
    assert 0.8 < np.mean(apart) / np.mean(near) < 1.15
    # A cut that lies near an edge lies on it where cells do.
    assert np.mean(goes_on) > 0.5


def test_wrapped_blocks_come_in_again_at_the_opposite_edge():
    height, width = 70, 85
    (laid,) = laid_on(EXEMPLAR, plane(), (Chart(0, height, width),), None, options=SMALL, wrap=True)
    placed = laid.placements
    known = {(int(p["row"]), int(p["column"]), int(p["source_row"]), int(p["source_column"])) for p in placed}
    crossing = 0
    for one in placed:
        bottom = one["row"] - one["height"] // 2 + one["height"] > height
        right = one["column"] - one["width"] // 2 + one["width"] > width
        for down, across in ((bottom, 0), (0, right), (bottom and right, bottom and right)):
            if down or across:
                crossing += 1
                at = int(one["row"]) - down * height, int(one["column"]) - across * width
                assert (*at, int(one["source_row"]), int(one["source_column"])) in known
    assert crossing > 10


def spread(quilt, exemplar):
    """Return how unevenly the exemplar's pixels are used: standard deviation over mean, on 8 by 8 pixels."""
    counts = np.zeros(exemplar.shape[:2])
    for sources in quilt.sources():
        np.add.at(counts, tuple(sources.reshape(-1, 2).T // 16), 1)
    tiles = counts.reshape(counts.shape[0] // 8, 8, counts.shape[1] // 8, 8).sum(axis=(1, 3))
    return tiles.std() / tiles.mean()


def repeats(placed, block):
    """Return how many blocks show about the same as another one near by, beside what simply goes on."""
    at = np.stack([placed["row"], placed["column"]], 1)
    read = np.stack([placed["source_row"], placed["source_column"]], 1) // 16
    apart, moved = np.abs(at[:, None] - at[None]), np.abs(read[:, None] - read[None])
    goes_on = (np.abs((at[:, None] - at[None]) - (read[:, None] - read[None])) < 3).all(axis=2)
    seen = (apart < 2 * block).all(axis=2) & (moved < block // 2).all(axis=2) & ~goes_on
    return np.triu(seen, 1).sum() / len(placed)


def test_evenness_spreads_use_and_variety_avoids_repeats():
    exemplar = texture(64, 64, passes=4)

    def mean(measure, **changes):
        options = replace(QuiltOptions(effort=0, block=20, evenness=0, variety=0), **changes)
        charts = (Chart(0, 200, 200),)
        shape, found = exemplar.shape[:2], []
        for seed in range(4):
            run = planned(exemplar, plane(), charts, options=options, seed=seed)
            found.append(measure(run, lay_all(run), shape))
        return np.mean(found)

    def uneven(run, laid, shape):
        return spread(emitted(run, laid, shape), exemplar)

    uses = [mean(uneven, evenness=much) for much in (0, 0.3, 3)]
    assert uses[1] < 0.9 * uses[0]
    assert uses[2] < 0.9 * uses[1]
    seen = [mean(lambda _run, laid, _shape: repeats(laid[0].placements, 20), variety=m) for m in (0, 3)]
    assert seen[1] < 0.6 * seen[0]


def test_use_counts_over_all_charts():
    # charts that do not even touch share the exemplar
    patches = [RationalPatch(p.net + n * np.array([5.0, 0, 0, 0])) for n in range(6) for p in plane().patches]
    surface = Surface(patches)
    exemplar = texture(64, 64, passes=4)
    options = QuiltOptions(effort=0, block=20, variety=0, evenness=3)
    quilt = synthesize_quilt(exemplar, surface, whole(surface, 60), options=options)
    alone = spread(synthesize_quilt(exemplar, plane(), (Chart(0, 60, 60),), options=options), exemplar)
    assert spread(quilt, exemplar) < 0.7 * alone


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("channels", [1, 2, 4, 7])
def test_any_kind_of_exemplar(dtype, channels):
    exemplar = texture(40, 48, channels).astype(dtype)
    if dtype == np.uint16:
        exemplar *= 257
    quilt = synthesize_quilt(exemplar, plane(), (Chart(0, 50, 50),), options=SMALL)
    assert (quilt.sources()[0] >= 0).all()
    constant = np.full_like(exemplar, 9)
    assert (synthesize_quilt(constant, plane(), (Chart(0, 50, 50),), options=SMALL).sources()[0] >= 0).all()


def test_progress_counts_charts():
    surface = torus()
    calls = []
    synthesize_quilt(
        EXEMPLAR, surface, whole(surface, 40), options=SMALL, threads=2, progress=lambda *c: calls.append(c)
    )
    assert calls == [("blocks", n, 16) for n in range(1, 17)]


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"block": 7}, "block is 7; allowed: 8 to 512"),
        ({"block": 513}, "block is 513"),
        ({"overlap": 3}, "overlap is 3; allowed: 4 to half a block"),
        ({"block": 20, "overlap": 11}, r"overlap is 11; allowed: 4 to half a block \(10\)"),
        ({"evenness": -0.1}, "evenness is -0.1; allowed: 0 to 10"),
        ({"evenness": float("nan")}, "evenness is nan"),
        ({"variety": 11}, "variety is 11; allowed: 0 to 10"),
        ({"tolerance": 0.9}, "tolerance is 0.9; allowed: 1 to 2"),
        ({"tolerance": float("inf")}, "tolerance is inf"),
        ({"shortlist": 0}, "shortlist is 0; allowed: 1 to 4096"),
        ({"shortlist": 5000}, "shortlist is 5000"),
    ],
)
def test_wrong_options_are_refused(given, says):
    with pytest.raises(InputError, match=says):
        QuiltOptions(**given)


def test_wrong_seeds_and_layouts_are_refused():
    for seed in (-1, 2**63):
        with pytest.raises(InputError, match="seed is"):
            synthesize_quilt(EXEMPLAR, plane(), ONE, seed=seed)
    with pytest.raises(InputError, match="2 charts can not wrap"):
        synthesize_quilt(EXEMPLAR, plane(spans=(1, 2)), whole(plane(spans=(1, 2))), wrap=True)
    with pytest.raises(InputError, match="chart 0 lies on face 3"):
        synthesize_quilt(EXEMPLAR, plane(), (Chart(3, 40, 40),))
    with pytest.raises(InputError, match="threads is 0"):
        synthesize_quilt(EXEMPLAR, plane(), ONE, threads=0)
