"""Bernstein polynomials and the nets' algebra."""

from math import comb

import numpy as np
import pytest

from upholster.geometry.patches.bernstein import bernstein, bernstein_derivative, elevate_axis, split_axis


@pytest.mark.parametrize("degree", [0, 1, 2, 4, 11, 32])
def test_partition_of_unity(degree: int) -> None:
    t = np.linspace(0.0, 1.0, 1001)
    values = bernstein(degree, t)
    assert (values >= 0.0).all()
    np.testing.assert_allclose(values.sum(axis=-1), 1.0, rtol=0, atol=1e-14)
    np.testing.assert_allclose(bernstein_derivative(degree, t).sum(axis=-1), 0.0, atol=1e-12)


@pytest.mark.parametrize("degree", [1, 3, 8, 32])
def test_equal_to_the_binomial_formula(degree: int) -> None:
    t = np.linspace(0.0, 1.0, 57)
    expected = np.stack(
        [comb(degree, j) * t**j * (1 - t) ** (degree - j) for j in range(degree + 1)], axis=-1
    )
    np.testing.assert_allclose(bernstein(degree, t), expected, rtol=1e-12, atol=1e-300)
    step = 1e-6
    slope = (bernstein(degree, t + step) - bernstein(degree, t - step)) / (2 * step)
    np.testing.assert_allclose(bernstein_derivative(degree, t), slope, atol=1e-6)


def test_split_and_elevate_keep_the_curve() -> None:
    rng = np.random.default_rng(1)
    net = rng.normal(size=(5, 4))
    t = np.linspace(0.0, 1.0, 21)
    before, behind = split_axis(net, 0.3)
    np.testing.assert_allclose(bernstein(4, t) @ before, bernstein(4, 0.3 * t) @ net, atol=1e-14)
    np.testing.assert_allclose(bernstein(4, t) @ behind, bernstein(4, 0.3 + 0.7 * t) @ net, atol=1e-14)
    assert (before[-1] == behind[0]).all()
    raised = elevate_axis(net, 9)
    assert raised.shape == (10, 4)
    np.testing.assert_allclose(bernstein(9, t) @ raised, bernstein(4, t) @ net, atol=1e-14)
