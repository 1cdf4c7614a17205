"""Method "pixel" against a plain twin, and what must hold of every quilt that it makes."""

import numpy as np
import pytest
from plain_pixel import PlainSurface, plain_levels, plain_pixel

from upholster.base.errors import InputError
from upholster.charts.layout import uniform_layout
from upholster.covering.measure.mesh_seams import mesh_seams
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.image.files.write import write_image
from upholster.pipeline import cover
from upholster.quilt.painting import paint
from upholster.synthesis.pixel.method import PASSES, SIMILAR, PixelOptions, synthesize_pixel
from upholster.synthesis.pixel.surface_levels import SurfaceLevel
from upholster.synthesis.working_form import working_form

SEARCHES = ("coherent", "full")


def texture(height=40, width=40, channels=3, seed=0):
    """Return a smooth random texture."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(height, width, channels))
    for axis in (0, 1):
        for _ in range(3):
            noise = (noise + np.roll(noise, 1, axis)) / 2
    noise = (noise - noise.min()) / np.ptp(noise)
    return np.rint(noise * 255).astype(np.uint8)


def pair():
    return plane(2, 1, spans=(1, 2))


def turned_pair():
    first, second = pair().patches
    return Surface([first, second.transpose().reverse(0)])


def plain_surface(layout):
    """Return a level's charts and frames as the twin takes them."""

    def place(number):
        starts = np.array(layout.firsts) - 2 * np.array(layout.strides) - 2
        n = int(np.searchsorted(starts, number, side="right")) - 1
        row, column = divmod(int(number - starts[n]), layout.strides[n])
        return n, row - 2, column - 2

    beyond = {place(a): place(b) for a, b in zip(layout.frame, layout.beyond, strict=True)}
    return PlainSurface([(chart.height, chart.width) for chart in layout.charts], beyond)


def shown(quilt):
    """Return per chart the pixels that texels show, (height, width, 2)."""
    assert all((places % 16 == 0).all() for places in quilt.sources())
    return [places // 16 for places in quilt.sources()]


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize(
    ("surface", "shape", "levels", "search"),
    [
        (turned_pair(), (20, 21, 1), 2, "coherent"),
        (turned_pair(), (12, 13, 1), 1, "full"),
        (pair(), (13, 12, 3), 1, "coherent"),
        (pair(), (13, 12, 3), 1, "full"),
    ],
)
def test_follows_the_plain_twin(surface, shape, levels, search):
    exemplar = texture(*shape)
    charts = uniform_layout(surface, chart=8)
    options = PixelOptions(levels=levels, search=search)
    found = shown(synthesize_pixel(exemplar, surface, charts, options=options, seed=5))
    layouts = [SurfaceLevel.of(surface, charts, n) for n in range(levels + 1)]
    plain = plain_levels(working_form(exemplar), levels, 0 if search == "full" else SIMILAR)
    lone = [
        plain[-1].inside[np.random.default_rng(child).integers(len(plain[-1].inside))]
        for child in np.random.SeedSequence(5).spawn(len(charts))
    ]
    rounds = [[n] for n in range(len(charts))]  # chart after chart
    wanted = plain_pixel(
        plain, [plain_surface(layout) for layout in layouts], rounds, lone, search == "full", PASSES[search]
    )
    for ours, theirs in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize(
    ("surface", "edges"),
    [(ring_cyclide(), 64), (sphere(), 24), (sphere(tiling="octants"), 24)],
    ids=["cyclide", "sphere", "octants"],
)
@pytest.mark.parametrize("level", [0, 2])
def test_frames_show_what_lies_beside_a_chart(surface, edges, level):
    layout = SurfaceLevel.of(surface, uniform_layout(surface, chart=64), level)
    size = 64 // 2**level
    points = np.full((layout.count, 3), np.nan)
    for n, chart in enumerate(layout.charts):
        s = chart.s0 + (chart.s1 - chart.s0) * (np.arange(size) + 0.5) / size
        t = chart.t0 + (chart.t1 - chart.t0) * (np.arange(size) + 0.5) / size
        found = np.stack(surface.faces[chart.face].points(*np.meshgrid(s, t, indexing="ij")), axis=0)
        for axis in range(3):
            layout.on_chart(points[:, axis], n)[:] = found[..., axis]
    for axis in range(3):
        layout.refresh(points[:, axis])
    assert len(np.unique(layout.frame)) == len(layout.frame) == 2 * size * edges
    assert np.isfinite(points[layout.frame]).all()
    for n in range(len(layout.charts)):
        first = layout.firsts[n] - layout.strides[n] * 2 - 2
        framed = points[first : first + (size + 4) * (size + 4)].reshape(size + 4, size + 4, 3)
        for lines in (framed, framed.swapaxes(0, 1)):
            inner = lines[:, 2:-2]
            step = np.linalg.norm(np.diff(inner, axis=0), axis=2)
            with np.errstate(invalid="ignore"):
                # Across an edge, texels are about as far apart as beside it.
                assert not (step[1:2] > 1.8 * step[2:3] + 1e-9).any()
                assert not (step[1:2] < 0.4 * step[2:3] - 1e-9).any()
    corners = framed[:2, :2]
    assert np.isnan(corners).all()


def test_a_plane_has_no_frame_and_its_map_paints_what_it_names():
    exemplar = texture(40, 48)
    quilt = synthesize(exemplar, plane(), method="pixel", chart=50, seed=1)
    assert len(SurfaceLevel.of(plane(), quilt.charts, 0).frame) == 0
    (sources,) = shown(quilt)
    np.testing.assert_array_equal(
        paint(quilt, exemplar).arrays[0], exemplar[sources[..., 0], sources[..., 1]]
    )
    depth = np.random.default_rng(0).integers(0, 2**16, (40, 48, 2), dtype=np.uint16)
    np.testing.assert_array_equal(paint(quilt, depth).arrays[0], depth[sources[..., 0], sources[..., 1]])


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize("surface", [ring_cyclide(), sphere(), pair()], ids=["cyclide", "sphere", "pair"])
def test_every_source_lies_in_the_exemplar_and_threads_do_not_matter(surface, search):
    exemplar = texture(45, 52, 2)
    one, *others = (
        synthesize(exemplar, surface, method="pixel", chart=19, search=search, seed=3, threads=threads)
        for threads in (1, 2, 5)
    )
    for part in shown(one):
        assert part.min() >= 2
        assert part[..., 0].max() < 40 - 2
        assert part[..., 1].max() < 48 - 2
    for other in others:
        np.testing.assert_array_equal(one.placements, other.placements)
        for (ours,), (theirs,) in zip(one.labels, other.labels, strict=True):
            np.testing.assert_array_equal(ours.labels, theirs.labels)
    other = synthesize(exemplar, surface, method="pixel", chart=19, search=search, seed=4)
    assert any((a != b).any() for a, b in zip(shown(one), shown(other), strict=True))


def test_a_label_for_each_texel_and_a_placement_for_each_offset():
    quilt = synthesize(texture(), pair(), method="pixel", chart=30, seed=2)
    for n, ((layer,), places) in enumerate(zip(quilt.labels, shown(quilt), strict=True)):
        assert (layer.cell, layer.half) == (1, False)
        # Beyond the edges cells are as at the edges.
        inner = layer.labels[1:-1, 1:-1]
        np.testing.assert_array_equal(layer.labels, np.pad(inner, 1, mode="edge"))
        offsets = places - np.stack(np.indices(inner.shape), axis=2)
        pairs = {
            (int(label), *offset)
            for label, offset in zip(inner.flat, offsets.reshape(-1, 2).tolist(), strict=True)
        }
        placed = quilt.on_chart(n)
        assert (
            len(pairs)
            == len({label for label, *_ in pairs})
            == len({tuple(o) for _, *o in pairs})
            == len(placed)
        )
        # Each has its centre in the first of its texels.
        first = np.unique(inner, return_index=True)[1]
        assert (np.diff(first) > 0).all()
        np.testing.assert_array_equal(
            np.stack([placed["row"], placed["column"]]), 16 * np.stack(np.divmod(first, 30)) + 8
        )


@pytest.mark.parametrize("search", SEARCHES)
def test_a_constant_exemplar_gives_its_color(search):
    exemplar = np.full((40, 40, 3), 77, np.uint8)
    quilt = synthesize(exemplar, sphere(), method="pixel", chart=20, search=search)
    assert all((array == 77).all() for array in paint(quilt, exemplar).arrays)


@pytest.mark.parametrize("search", SEARCHES)
def test_a_periodic_exemplar_goes_on_as_it_is(search):
    # Every neighbourhood of the endless pattern is in the exemplar: each choice is free of error.
    tile = texture(8, 8)
    exemplar = np.tile(tile, (6, 6, 1))
    quilt = synthesize(exemplar, pair(), method="pixel", chart=40, levels=2, search=search, seed=2)
    whole = np.concatenate(paint(quilt, exemplar).arrays, axis=1)
    np.testing.assert_array_equal(whole[8:], whole[:-8])
    np.testing.assert_array_equal(whole[:, 8:], whole[:, :-8])


@pytest.mark.slow(reason="compares with plain Python")
@pytest.mark.parametrize("search", SEARCHES)
def test_texture_goes_on_across_patches(search):
    exemplar, surface = texture(), ring_cyclide()
    quilt = synthesize(exemplar, surface, method="pixel", chart=40, search=search, seed=1)
    ratio = mesh_seams(surface, quilt, paint(quilt, exemplar), exemplar).ratio
    assert 0.8 < ratio < 1.35


@pytest.mark.parametrize(("dtype", "channels"), [(np.uint16, 1), (np.float32, 4)])
def test_depths_and_channels(dtype, channels):
    exemplar = texture(40, 40, channels).astype(dtype)
    exemplar = exemplar * 257 if dtype == np.uint16 else exemplar / np.float32(255)
    quilt = synthesize(exemplar, pair(), method="pixel", chart=16)
    texels = paint(quilt, exemplar)
    assert all(array.dtype == dtype and array.shape == (16, 16, channels) for array in texels.arrays)


def test_charts_of_one_texel_and_a_patch_that_meets_itself():
    angle = np.linspace(0, 2 * np.pi, 4)
    net = np.zeros((2, 4, 3))
    net[:, :, 0], net[:, :, 1] = np.cos(angle), np.sin(angle)
    net[1, :, 2] = -1
    closed = Surface([RationalPatch.from_points(net)])
    for surface in (closed, ring_cyclide()):
        quilt = synthesize(texture(160, 160), surface, method="pixel", chart=8, levels=5)
        assert quilt.steps == 64 * len(surface.patches)


def test_bad_samples_are_refused_before_work():
    for shape, levels, reported in (
        ((39, 64), 3, "sample is 64x39 pixels; allowed with 3 levels: 40 or more each way"),
        ((64, 513), 3, "sample is 513x64 pixels; allowed: up to 512 each way"),
        ((64, 64), 4, "allowed with 4 levels: 80"),
    ):
        with pytest.raises(InputError, match=reported):
            synthesize(texture(*shape), plane(), method="pixel", levels=levels)
    with pytest.raises(InputError, match="seed is -1"):
        synthesize(texture(), plane(), method="pixel", chart=8, seed=-1)


def test_a_stream_is_refused_with_its_size(tmp_path):
    write_image(tmp_path / "sample.png", texture())
    settings = {"method": "pixel", "chart": 16}
    with pytest.raises(InputError, match="no stream: 4,096 texels with a source of 11 bits each would take"):
        cover(str(tmp_path / "sample.png"), "cyclide", [str(tmp_path / "a.uph")], synthesis=settings)


def test_progress_counts_all_texels():
    reported = []
    synthesize(
        texture(), sphere(), method="pixel", chart=16, progress=lambda *line: reported.append(line), threads=2
    )
    assert {stage for stage, _, _ in reported} == {"texels"}
    done = [count for _, count, _ in reported]
    assert done == sorted(done)
    # Levels of 16², 8², 4² texels twice each, and 2² on the coarsest, in raster order and once again.
    assert reported[-1][1:] == (2 * 6 * (256 + 64 + 16 + 4),) * 2
