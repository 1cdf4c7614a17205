"""Blocks pay for phases: levels, symmetries, tiles, and lattices that hold."""

from dataclasses import replace

import numpy as np
import pytest
from repeating import repeating
from tests.charts.test_mesh_layout import sheet

from upholster.base.errors import InputError
from upholster.base.options.synthesis_options import SynthesisOptions
from upholster.covering.notes import notes_before
from upholster.covering.synthesis import synthesize
from upholster.geometry.built_in.cyclide import torus
from upholster.geometry.built_in.plane import plane
from upholster.output.reports import automatic_words
from upholster.synthesis.exemplar import Exemplar
from upholster.synthesis.quilt.phases import better_tile, level_phases, shown_waves, stretched_by, whole_waves
from upholster.synthesis.setup import prepare


def test_levels_have_the_phases_of_their_pixels_middles():
    _, lattice = repeating(40, 52, [(0.05, 0.013), (-0.02, 0.07)])
    for level in range(3):
        height, width = -(-40 >> level), -(-52 >> level)
        middles = [(np.arange(n) + 0.5) * 2**level - 0.5 for n in (height, width)]
        turns = np.einsum("ka,aij->kij", lattice.waves, np.stack(np.meshgrid(*middles, indexing="ij")))
        away = level_phases(lattice, level, height, width) - np.rint(65536 * turns.reshape(2, -1))
        assert np.abs((away + 32768) % 65536 - 32768).max() <= 2
    assert level_phases(None, 1, 20, 26).shape == (0, 520)


def test_symmetries_show_a_wave_another_or_none():
    _, straight = repeating(40, 40, [(0.1, 0), (0, 0.1)])
    # Mirrored columns: the second wave runs the other way. A quarter turn: each shows in the other's place.
    assert shown_waves(straight)[5].tolist() == [1, -2]
    assert np.abs(shown_waves(straight)[1]).tolist() == [2, 1]
    _, rows = repeating(40, 40, [(0.1, 0)])
    assert shown_waves(rows)[:, 0].tolist() == [1, 0, -1, 0, 0, 1, 0, -1]
    assert shown_waves(None).shape == (8, 0)


def test_a_tile_has_whole_periods():
    waves = whole_waves(np.array([(0.1, 0.002), (0.03, -0.051)]), 96, 128)
    np.testing.assert_allclose(waves * (96, 128), np.rint(waves * (96, 128)), atol=1e-9)
    assert np.abs(waves - [(0.1, 0.002), (0.03, -0.051)]).max() <= 0.5 / 96


def broken(quilt, lattice, rim=0):
    """Return how many neighbouring texels differ by more than a quarter turn from their step's phase.

    Those `rim` texels round a chart are left out.
    """
    found = 0
    for chart, (texels, sources) in enumerate(zip(quilt.charts, quilt.sources(), strict=True)):
        at = np.clip(np.rint(sources / 16).astype(int), 0, np.array(lattice.phases.shape[1:]) - 1)
        shown = lattice.phases[:, at[..., 0], at[..., 1]] / 65536
        places = np.meshgrid(np.arange(float(texels.height)), np.arange(float(texels.width)), indexing="ij")
        matrices = quilt.fields[chart].at(*places)
        for axis in (0, 1):
            first = (
                (slice(None), slice(None, -1)) if axis == 0 else (slice(None), slice(None), slice(None, -1))
            )
            turns = np.einsum("ka,ija->kij", lattice.waves, matrices[..., axis])[first]
            jump = np.diff(shown, axis=axis + 1) - turns
            jump = jump[:, rim : jump.shape[1] - rim, rim : jump.shape[2] - rim]
            found += int((np.abs(jump - np.rint(jump)) > 0.25).sum())
    return found


def test_a_flat_lattice_has_no_broken_element():
    exemplar, lattice = repeating(64, 64, [(1 / 11.3, 0), (0.003, 1 / 13.7)], noise=0.5)
    kept = synthesize(exemplar, "plane", texels=(200, 200), block=20, seed=1)
    assert broken(kept, lattice) == 0


def test_rows_on_a_mesh_are_whole():
    exemplar, lattice = repeating(80, 80, [(1 / 14.1, 0), (0, 1 / 12.3)], noise=0.6)
    surface = sheet(0.0, 5.0)
    asked = {"texels": 22_500, "sample_size": 80 / 30, "block": 20, "direction": (1.0, 0.0, 0.0), "seed": 3}
    assert broken(synthesize(exemplar, surface, **asked), lattice, 12) == 0


def test_a_tile_that_stretches_rows_is_offered_a_better_size():
    exemplar, lattice = repeating(96, 96, [(1 / 12.4, 0), (0, 1 / 10.7)])
    height, width = better_tile(lattice.waves, 64, 64)
    assert stretched_by(lattice.waves, height, width) < 0.003 < 0.01 < stretched_by(lattice.waves, 64, 64)
    options = SynthesisOptions(texels=(64, 64), tileable=True)
    prepared = prepare(Exemplar(exemplar), plane(), options)
    height, width = better_tile(prepared.waves, 64, 64)
    (note,) = notes_before(plane(), prepared, exemplar, 1)
    assert f"{width}x{height} texels" in note
    assert "repeats every" in automatic_words(prepared, plane(), options, ())["lattice"]
    better = replace(options, texels=(width, height))
    assert not notes_before(plane(), prepare(Exemplar(exemplar), plane(), better), exemplar, 1)


def test_phases_are_left_out_where_they_are_not_wanted():
    exemplar, _ = repeating(96, 96, [(1 / 12.4, 0), (0, 1 / 10.7)])
    assert prepare(Exemplar(exemplar), plane(), SynthesisOptions(texels=(64, 64), phase=0)).waves is None
    with pytest.raises(InputError, match="phase is 11; allowed: 0 to 10"):
        SynthesisOptions(phase=11)
    prepared = prepare(Exemplar(exemplar), torus(2, 0.8), SynthesisOptions(texels=40000, sample_size=3))
    assert prepared.options.phase == 2
