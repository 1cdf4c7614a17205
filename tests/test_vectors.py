"""Vectors of length 1."""

import numpy as np

from upholster.base.vectors import unit_vectors


def test_unit_vectors_keep_directions_and_have_length_1() -> None:
    vectors = np.random.default_rng(0).normal(size=(5, 4, 3)) * np.logspace(-100, 100, 5)[:, None, None]
    unit = unit_vectors(vectors)
    np.testing.assert_allclose(np.linalg.norm(unit, axis=-1), 1.0)
    np.testing.assert_allclose(np.cross(unit, vectors / np.abs(vectors).max()), 0.0, atol=1e-15)


def test_short_vectors_stay_short_or_are_replaced() -> None:
    vectors = np.array([[0.0, 0.0, 0.0], [3e-13, 0.0, 0.0], [0.0, 2.0, 0.0]])
    unit = unit_vectors(vectors, least=1e-12)
    np.testing.assert_allclose(unit, [[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 1.0, 0.0]])
    replaced = unit_vectors(vectors, least=1e-12, instead=np.array([0.0, 0.0, 1.0]))
    np.testing.assert_array_equal(replaced, [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    assert not unit_vectors(np.zeros((2, 3))).any()
