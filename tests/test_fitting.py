"""Sizes by which whole periods of a sample go round a model."""

import numpy as np
import pytest

from upholster.charts.axis_directions import Round
from upholster.image.elements.lattice import Lattice
from upholster.synthesis.size_fit import MOST_CHANGE, fitted


def test_fit_makes_whole_periods_go_round():
    phases = np.zeros((1, 8, 8), np.int16)
    lattice = Lattice(np.array([[0.0, 0.05]]), phases, np.ones(1))
    rounds = [Round(100.0, 7.0)]
    factor, left = fitted(lattice, rounds, [], 4.1)  # 20.5 periods of 20 pixels
    assert left < 0.01
    assert 4.1 * 100 * 0.05 / factor == pytest.approx(round(4.1 * 100 * 0.05 / factor), abs=0.02)
    assert abs(factor - 1) <= MOST_CHANGE
    assert fitted(lattice, [], rounds, 4.1) == (1.0, 0.0)  # it does not repeat that way
    assert fitted(lattice, rounds, [], 4.0)[0] == pytest.approx(1.0, abs=1e-3)
