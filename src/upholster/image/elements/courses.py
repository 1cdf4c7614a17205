"""Courses: rows of equal elements between long joints, each half an element off the next, such as bricks."""

from dataclasses import dataclass

import numpy as np

from upholster.base.types import FloatArray
from upholster.image.elements.joints import Joints
from upholster.image.elements.lattice import Lattice

__all__ = ["Courses", "find_courses"]

_NEAR = 40
"""Pixels belong to a joint if their number in `Joints.distances` is below this."""

_BINS = 24
"""Parts of a period in which joints are counted."""

_UNBROKEN, _APART = 0.65, 0.4
"""Where one wave has one phase, at least the first share of the pixels is in a joint: that wave counts
courses. No other wave has nearly so many: in a grid or a weave another one comes near."""

_MULTIPLES = ((1, 1), (1, -1), (2, 1), (2, -1), (1, 2), (1, -2))
"""Sums of the two shortest waves that may count courses: the first two for elements that are up to 3½ times
as long as high, the others for longer ones."""

_UNIT = 65536


@dataclass(frozen=True, slots=True)
class Courses:
    """The courses of a sample in running bond.

    Attributes
    ----------
    multiples
        Of the lattice's two waves, one of them once: their sum is the wave that counts courses.
    joint
        Its phase, 0 to 1 turn, in the middle of the joints between courses.
    """

    multiples: tuple[int, int]
    joint: float

    @property
    def once(self) -> int:
        """The wave, 0 or 1, that the sum contains once: its phase follows from the sum and the other wave."""
        return 1 if abs(self.multiples[1]) == 1 else 0

    def wave(self, waves: FloatArray) -> FloatArray:
        """Return the wave (2,) that counts courses, in cycles per pixel, from the lattice's waves (2, 2)."""
        found: FloatArray = np.array(self.multiples, np.float64) @ waves
        return found


def find_courses(lattice: Lattice | None, joints: Joints | None) -> Courses | None:
    """Find the courses of a sample that repeats in running bond; None: it does not.

    In running bond a sum of the two shortest waves counts courses, and where it has one phase, there is a
    joint without gaps. A grid of tiles has two kinds of such joints, a weave or herringbone none.
    """
    if lattice is None or joints is None or len(lattice.waves) != 2:
        return None
    near, first, second = joints.distances < _NEAR, *lattice.phases.astype(np.int64)
    found = []
    for multiples in _MULTIPLES:
        phases = (multiples[0] * first + multiples[1] * second) % _UNIT
        bins = (phases * _BINS // _UNIT).reshape(-1)
        covered = np.bincount(bins, near.reshape(-1), _BINS) / np.bincount(bins, minlength=_BINS).clip(1)
        # The joint's middle is the mean phase of the pixels in it; fewer lie in joints along courses.
        around = (covered[bins] > 0.5 * covered.max()) & near.reshape(-1)
        turns = np.exp(2j * np.pi * phases.reshape(-1)[around] / _UNIT).sum()
        joint = float(np.arctan2(turns.imag, turns.real) / (2 * np.pi) % 1.0)
        found.append((float(covered.max()), Courses(multiples, joint)))
    *_, (other, _), (most, courses) = sorted(found, key=lambda one: one[0])
    return courses if most >= _UNBROKEN and most - other >= _APART else None
