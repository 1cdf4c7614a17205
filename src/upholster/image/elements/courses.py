"""Courses: rows of equal elements between long joints, each half an element off the next, such as bricks."""

from dataclasses import dataclass

import numpy as np

from upholster.base.types import FloatArray
from upholster.image.elements.joints import Joints
from upholster.image.elements.lattice import Lattice

__all__ = ["Courses", "find_courses"]

_NEAR = 40
"""A joint reaches this far, in units of `Joints.distances`."""

_BINS = 24
"""Parts of a period in which joints are counted."""

_UNBROKEN, _BROKEN = 0.9, 0.75
"""A bed joint covers at least this share of its length; no other joint does so of more than the second share,
else the elements form a grid."""

_UNIT = 65536


@dataclass(frozen=True, slots=True)
class Courses:
    """The courses of a sample in running bond.

    Attributes
    ----------
    multiples
        1 or −1 for each of the lattice's two waves: their sum is the wave that counts courses.
    joint
        Its phase, 0 to 1 turn, in the middle of the joints between courses.
    """

    multiples: tuple[int, int]
    joint: float

    def wave(self, waves: FloatArray) -> FloatArray:
        """Return the wave (2,) that counts courses, in cycles per pixel, from the lattice's waves (2, 2)."""
        found: FloatArray = np.array(self.multiples, np.float64) @ waves
        return found


def find_courses(lattice: Lattice | None, joints: Joints | None) -> Courses | None:
    """Find the courses of a sample that repeats in running bond; None: it does not.

    In running bond the two shortest waves run along both diagonals of an element: their sum or difference
    counts courses, and where it has one phase, there is a joint without gaps. A grid of tiles has two kinds
    of such joints, a weave or herringbone none.
    """
    if lattice is None or joints is None or len(lattice.waves) != 2:
        return None
    near, first, second = joints.distances < _NEAR, *lattice.phases.astype(np.int64)
    found = []
    for multiples in ((1, 1), (1, -1)):
        phases = (multiples[0] * first + multiples[1] * second) % _UNIT
        bins = (phases * _BINS // _UNIT).reshape(-1)
        covered = np.bincount(bins, near.reshape(-1), _BINS) / np.bincount(bins, minlength=_BINS).clip(1)
        # The joint's middle is the mean phase of the pixels in it.
        around = np.isin(bins, (int(covered.argmax()) + np.arange(-2, 3)) % _BINS) & near.reshape(-1)
        turns = np.exp(2j * np.pi * phases.reshape(-1)[around] / _UNIT).sum()
        joint = float(np.arctan2(turns.imag, turns.real) / (2 * np.pi) % 1.0)
        found.append((float(covered.max()), Courses(multiples, joint)))
    (other, _), (most, courses) = sorted(found, key=lambda one: one[0])
    return courses if most >= _UNBROKEN and other <= _BROKEN else None
