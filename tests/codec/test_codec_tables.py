"""The tables: their formulas once more in longer arithmetic, and no entry that rounds near a tie."""

from decimal import ROUND_HALF_EVEN, Decimal, getcontext
from hashlib import sha256

import numpy as np
import pytest

from upholster.codec.tables import POINTS, QUANTA, RECIPROCALS, SQUASH, STRETCH, THRESHOLDS

getcontext().prec = 40


def squash(x):
    return Decimal(65536) / (1 + (Decimal(-x) / 256).exp())


def stretch(p):
    q = (Decimal(p) + Decimal("0.5")) / 4096
    return 256 * (q / (1 - q)).ln()


def point(ones):
    q = min(Decimal("0.499"), (Decimal(ones) + Decimal("0.5")) / 64)
    r = -2 * (q / (1 - q)).ln()
    return 64 * min(Decimal("0.55"), max(Decimal("0.3"), 1 / r - 1 / (r.exp() - 1)))


EXACT = {
    "squash": (SQUASH, [squash(n - 2048) for n in range(4096)], (16, 65520)),
    "stretch": (STRETCH, [stretch(n) for n in range(4096)], (-2047, 2047)),
    "reciprocals": (RECIPROCALS, [Decimal(16384) / (n + Decimal("1.6")) for n in range(1024)], (0, 16384)),
    "points": (POINTS, [point(n) for n in range(65)], (0, 64)),
}


@pytest.mark.parametrize("name", EXACT)
def test_entries_are_the_rounded_formula_and_none_is_near_a_tie(name):
    table, exact, (least, most) = EXACT[name]
    assert len(table) == len(exact)
    for n, value in enumerate(exact):
        rounded = value.quantize(Decimal(1), ROUND_HALF_EVEN)
        assert table[n] == min(most, max(least, int(rounded))), n
        # Other languages' exp and log may err by a few units in the last place, not by 1e-9.
        assert abs(abs(value - rounded) - Decimal("0.5")) > Decimal("1e-9"), n


def test_quanta_are_two_steps_an_octave_and_none_is_near_a_step():
    assert QUANTA[0] == 0
    for t in range(1, 256):
        # floor(2·log2((t+1)/2) + 1/2) = k if and only if 2^(2k − 1) ≤ ((t+1)/2)^4 < 2^(2k + 1).
        fourth = (t + 1) ** 4
        k = next(k for k in range(40) if fourth < 2 ** (2 * k + 1 + 4))
        assert QUANTA[t] == min(15, 1 + k)
        value = 2 * (Decimal(t + 1) / 2).ln() / Decimal(2).ln() + Decimal("0.5")
        assert abs(value - value.quantize(Decimal(1), ROUND_HALF_EVEN)) > Decimal("1e-9")
    assert (np.diff(QUANTA) >= 0).all()


def test_thresholds_are_their_probabilities():
    assert [round(65536 * p) for p in (0.4, 0.2, 0.1, 0.05, 0.025, 0.012)] == THRESHOLDS.tolist()


def test_squash_and_stretch_are_each_others_inverse():
    inner = np.arange(-1500, 1501)
    assert np.abs(STRETCH[SQUASH[inner + 2048] >> 4] - inner).max() < 50
    assert (np.diff(SQUASH) >= 0).all()
    assert (np.diff(STRETCH) >= 0).all()


def test_tables_are_part_of_the_format_and_stay_as_they_are():
    joined = (
        np.concatenate([STRETCH, SQUASH, RECIPROCALS, QUANTA, THRESHOLDS, POINTS]).astype("<i4").tobytes()
    )
    assert sha256(joined).hexdigest()[:16] == "f3dbafaffa84ba01"
