"""Texels of neighbouring charts: the map over an edge agrees with where the texels lie in space."""

import numpy as np
import pytest

from upholster.charts.layout import uniform_layout
from upholster.geometry.built_in.cyclide import ring_cyclide
from upholster.geometry.built_in.plane import plane
from upholster.geometry.built_in.revolution import cylinder
from upholster.geometry.built_in.sphere import sphere
from upholster.geometry.patches.patch import RationalPatch
from upholster.geometry.patches.surface import Surface
from upholster.quilt.chart import Chart
from upholster.quilt.placement import SYMMETRIES
from upholster.synthesis.paper.layers import edge_placements
from upholster.synthesis.paper.strips import color_classes, strip_along


def symmetry_of(strip, charts):
    """Return the symmetry with which chart B shows an edge block."""
    none = np.zeros((1, 2), np.int64)
    return int(edge_placements(strip, charts, 16, none, none)["symmetry"][0, 1])


def mixed_plane():
    """Return a 3 × 3 plane whose patches are turned and mirrored each in its own way."""
    patches = []
    for index, patch in enumerate(plane(3, 3, spans=(3, 3)).patches):
        turned = patch.reverse(0) if index & 1 else patch
        turned = turned.reverse(1) if index & 2 else turned
        patches.append(turned.transpose() if index % 3 == 0 else turned)
    return Surface(patches)


SURFACES = {
    "cyclide": ring_cyclide(),
    "six": sphere(),
    "octants": sphere(tiling="octants"),
    "cylinder": cylinder(),
    "turned": mixed_plane(),
}


@pytest.mark.parametrize("name", SURFACES)
def test_a_texel_beyond_the_edge_lies_next_to_the_last_one(name):
    surface, size = SURFACES[name], 32
    charts = uniform_layout(surface, chart=size)
    centres = (np.arange(size) + 0.5) / size
    points = [patch.points_grid(centres, centres) for patch in surface.patches]
    assert surface.shared
    for edge in surface.shared:
        found = strip_along(edge, charts, 16)
        assert found is not None
        assert (found.start, found.length, found.other) == (0, size, 0)
        a, b = charts[edge.patch], charts[edge.other_patch]
        along = np.arange(size)
        inside, beyond = ((0, -1), (size - 1, size), (size - 1, size), (0, -1))[found.edge_a]

        def place(line, along=along, found=found):
            across = np.full(size, line)
            return (along, across) if found.along_rows else (across, along)

        row, column = place(inside)
        near = points[edge.patch][row, column]
        row_b, column_b = found.to_b(*place(beyond), a, b)
        far = points[edge.other_patch][row_b, column_b]
        other = edge.other_edge
        assert (row_b == {0: 0, 2: size - 1}.get(other, row_b)).all()
        assert (column_b == {3: 0, 1: size - 1}.get(other, column_b)).all()
        # The nearest texel of the neighbour's rim is the one the map names.
        rim = points[edge.other_patch][row_b, column_b]
        nearest = np.linalg.norm(near[:, None] - rim[None], axis=2).argmin(axis=1)
        np.testing.assert_array_equal(nearest[2:-2], along[2:-2])
        assert np.linalg.norm(near - far, axis=1).max() < surface.size / size * 4


@pytest.mark.parametrize("name", SURFACES)
def test_the_symmetry_undoes_the_maps_linear_part(name):
    surface = SURFACES[name]
    charts = uniform_layout(surface, chart=32)
    symmetries = set()
    for edge in surface.shared:
        strip = strip_along(edge, charts, 16)
        found = strip.map_to_b(charts[strip.a], charts[strip.b])
        linear, origin = found[:4].reshape(2, 2), found[4:]
        symmetry = symmetry_of(strip, charts)
        np.testing.assert_array_equal(SYMMETRIES[symmetry].reshape(2, 2) @ linear, np.eye(2))
        places = np.random.default_rng(1).integers(-9, 50, (2, 20))
        there = strip.to_b(*places, charts[strip.a], charts[strip.b])
        np.testing.assert_array_equal(linear @ places + origin[:, None], np.stack(there))
        symmetries.add(symmetry)
    if name in ("cyclide", "cylinder"):
        assert symmetries == {0}
    if name == "six":
        assert len(symmetries) > 2
        assert symmetries <= {0, 1, 2, 3}  # outward patches meet by rotations, never by reflections
    if name == "turned":
        assert symmetries & {4, 5, 6, 7}


def test_a_partial_edge_maps_to_its_part_or_not_at_all():
    whole = plane(2, 1, spans=(1, 2)).patches
    upper, lower = whole[1].split(s=0.5)
    surface = Surface([whole[0], upper, lower])
    partial = [edge for edge in surface.shared if 0 in (edge.patch, edge.other_patch)]
    assert len(partial) == 2
    charts = (Chart(0, 64, 64), Chart(1, 32, 64), Chart(2, 32, 64))
    spans = set()
    for edge in partial:
        found = strip_along(edge, charts, 16)
        spans.add((found.start, found.length) if found.a == 0 else (found.other, found.length))
        assert strip_along(edge, [Chart(n, 64, 64) for n in range(3)], 16) is None
        assert strip_along(edge, charts, 33) is None  # no block fits
    assert spans == {(0, 32), (32, 32)}


def test_classes_take_every_edge_once_and_no_chart_twice():
    pairs = [(edge.patch, edge.other_patch) for edge in SURFACES["cyclide"].shared] + [(3, 3)]
    schedule = color_classes(pairs)
    assert sorted(n for members in schedule for n in members) == list(range(len(pairs)))
    for members in schedule:
        charts = [chart for n in members for chart in set(pairs[n])]
        assert len(charts) == len(set(charts))


def test_a_patch_may_meet_itself():
    angle = np.linspace(0, 2 * np.pi, 4)
    net = np.zeros((2, 4, 3))
    net[:, :, 0], net[:, :, 1] = np.cos(angle), np.sin(angle)
    net[1, :, 2] = -1
    surface = Surface([RationalPatch.from_points(net)])
    (edge,) = surface.shared
    charts = (Chart(0, 40, 40),)
    strip = strip_along(edge, charts, 16)
    assert (strip.a, strip.b) == (0, 0)
    assert symmetry_of(strip, charts) == 0
