import numpy as np

from upholster.charts.layout import density_layout
from upholster.covering.measure.crossings import crossings
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.catalog import surface_from_spec
from upholster.quilt.chart import Chart
from upholster.quilt.labels import LabelMap, label_shape
from upholster.quilt.model import Quilt
from upholster.quilt.placement import PLACEMENT
from upholster.quilt.warp_field import WarpField

SAMPLE = np.random.default_rng(1).integers(0, 255, (64, 64, 3), np.uint8)


def two_charts(shift: int, beside: int = 0) -> Quilt:
    """Return a plane in two charts, each with one placement, the second `shift` sixteenths of a pixel off."""
    charts = (Chart(0, 40, 30, 0.0, 1.0, 0.0, 0.5), Chart(0, 40, 30, 0.0, 1.0, 0.5, 1.0))
    placed = np.zeros(2, PLACEMENT)
    placed["chart"], placed["row"], placed["column"] = (0, 1), 320, 240
    placed["source_row"], placed["source_column"] = 320, (240, 720 + shift + 16 * beside)
    labels = np.zeros(label_shape(40, 30, 2), np.int32)
    layers = ((LabelMap(2, labels),), (LabelMap(2, labels.copy()),))
    return Quilt(charts, (64, 64), placed, layers, (WarpField.identity(),) * 2)


def test_what_goes_on_over_a_seam_reads_apart_by_what_it_is_off() -> None:
    surface = surface_from_spec("plane")
    for shift in (0, 4, 24):
        found = crossings(surface, two_charts(shift))
        assert found is not None
        np.testing.assert_allclose([found.apart, found.apart_most], shift / 16, atol=0.07)
        assert (found.cuts, found.cuts_inside) == (0, 0)
    found = crossings(surface, two_charts(0, 9))
    assert found is not None
    assert (found.cuts, found.cuts_inside) == (1, 0)


def test_charts_without_seams_have_none() -> None:
    surface = surface_from_spec("plane")
    quilt = synthesize(SAMPLE, surface, texels=4000, sample_size=0.5)
    assert len(density_layout(surface, texels=4000)) == len(quilt.charts) == 1
    assert crossings(surface, quilt) is None


def test_a_rings_blocks_mind_seams_little() -> None:
    surface = surface_from_spec("cyclide")
    found = crossings(surface, synthesize(SAMPLE, surface, texels=60_000, sample_size=4))
    assert found is not None
    assert found.apart < 0.4
    assert found.cuts < 2.5 * found.cuts_inside + 0.05
