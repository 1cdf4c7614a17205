"""Blocks in sizes that a map tells: what is painted is as large as was asked."""

import numpy as np
import pytest
from laying import alike, texture

from upholster import synthesize
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.charts.charted_surface import charted_surface
from upholster.charts.surface_to_cover import as_covered
from upholster.covering.measure.mapping import _at_samples, _jacobian, mapping
from upholster.covering.measure.places import surface_samples
from upholster.covering.measure.samples import Window
from upholster.covering.measure.trace import Trace
from upholster.covering.notes import notes_before
from upholster.image.files.write import write_image
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt.method import laid_quilt, lay_plan
from upholster.synthesis.quilt.scene import coarser
from upholster.synthesis.setup import prepare

SIDE = 128
SAMPLE = texture(SIDE, SIDE)
SIZE = 0.4
SCALE = SIDE / SIZE
PLANE = as_covered("plane").surface


def shown(surface, quilt):
    """Return places spread over a surface, (n, 3), and how many times as large the sample is there, (n,)."""
    charted = charted_surface(surface, quilt.charts, finer=4)
    samples = surface_samples(charted)
    places, found = [], []
    for index, chart in enumerate(quilt.charts):
        own = samples.chart == index
        trace = Trace.of(quilt, Window(index, 0, 0, chart.height, chart.width))
        (rows, columns), triangle = samples.texel[own].T, samples.triangle[own]
        read = _jacobian(trace.field, trace.placements[trace.owners[rows, columns]], rows, columns)
        places.append((samples.shares[own, :, None] * charted.mesh.corners[triangle]).sum(axis=1))
        found.append(SCALE * _at_samples(charted.steps[triangle], read, None)[0])
    return np.concatenate(places), np.concatenate(found)


def prepared(**wanted):
    """Return what is done on the plane."""
    options = SynthesisOptions(**{"texels": 90_000, "block": 40, "sample_size": SIZE, **wanted})
    return prepare(Exemplar(SAMPLE), PLANE, options)


@pytest.mark.slow(reason="lays whole quilts on several surfaces")
@pytest.mark.parametrize(("surface", "axis"), [("plane", 0), ("sphere", 2)])
def test_sizes_are_those_asked_for(surface, axis, tmp_path):
    ramp = np.rint(65535 * np.linspace(0, 1, 64)).astype(np.uint16)
    write_image(tmp_path / "ramp.png", np.broadcast_to(ramp, (4, 64))[..., None])
    target = "height" if axis == 2 else tmp_path / "ramp.png"
    on = as_covered(surface).surface
    choices = {"texels": 60_000, "sample_size": SIZE, "size_map": f"{target}=0.6,2"}
    places, found = shown(on, synthesize(SAMPLE, on, seed=1, **choices))
    low, high = places[:, axis].min(), places[:, axis].max()
    share = (places[:, axis] - low) / (high - low)
    ratio = found / (0.6 * (2 / 0.6) ** share)
    assert (np.abs(np.log(ratio)) < np.log(1.1)).mean() > 0.9
    for start in np.arange(0.0, 1.0, 0.2):
        own = (share >= start) & (share < start + 0.2)
        assert np.median(ratio[own]) == pytest.approx(1, rel=0.04)


def test_one_size_is_that_of_a_larger_sample():
    twice = prepared(size_map="facing:z=2,2", texels=30_000)
    larger = prepared(sample_size=2 * SIZE, texels=30_000)
    for one, other in zip(twice.fields, larger.fields, strict=True):
        np.testing.assert_array_equal(one.nodes, other.nodes)
    quilts = [laid_quilt(lay_plan(each, Exemplar(SAMPLE), seed=1)) for each in (twice, larger)]
    counts = [len(quilt.placements) for quilt in quilts]
    assert counts[0] == pytest.approx(counts[1], rel=0.15)
    assert mapping(PLANE, quilts[0].on(PLANE), scale=SCALE / 2).within > 0.98


def test_once_everywhere_is_as_without_a_map():
    without, once = prepared(), prepared(size_map="height=1,1")
    assert alike(*(laid_quilt(lay_plan(each, Exemplar(SAMPLE), seed=1)) for each in (without, once)))


def test_what_blocks_cannot_follow_is_reported():
    def notes(text):
        return [note for note in notes_before(PLANE, prepared(size_map=text), SAMPLE, 1) if "size" in note]

    assert notes("facing:z=0.5,2") == []
    share = prepared(size_map="0,0,0:0.2>0.5=0.5,2").sizes.smoothed
    words = f"size changes faster than blocks can follow on {100 * share:.0f} % of the surface: smoothed"
    assert notes("0,0,0:0.2>0.5=0.5,2") == [words]
    assert 0.2 < share < 1


def test_a_quick_look_has_the_same_sizes():
    fine = prepared(size_map="facing:z=1.5,1.5", texels=200_000)
    quick = coarser(fine, Exemplar(SAMPLE), 2)
    quilt = laid_quilt(lay_plan(quick, Exemplar(SAMPLE), seed=1))
    assert mapping(PLANE, quilt.on(PLANE), scale=SCALE / 1.5).within > 0.98
