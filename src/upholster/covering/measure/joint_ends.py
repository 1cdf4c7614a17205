"""Joints that end nowhere: cuts where a joint of the sample meets the middle of a stone, or of a board."""

from dataclasses import dataclass

import numpy as np

from upholster.base.types import IntArray
from upholster.charts.charted_surface import charted_surface
from upholster.charts.creases import CREASE
from upholster.covering.measure.faults import STAIRS
from upholster.covering.measure.measure_rows import Row, figure
from upholster.covering.measure.source_cuts import cuts_of
from upholster.geometry.any_surface import AnySurface
from upholster.image.elements.joints import Joints
from upholster.quilt.model import Quilt

__all__ = ["JointEnds", "joint_ends"]

_HALF = 128
"""A joint ends at a cut if `Joints.distances` differs by this much across it."""


@dataclass(frozen=True, slots=True)
class JointEnds:
    """Cuts across which the distance to the nearest joint jumps by more than half its range.

    Attributes
    ----------
    share
        Share of the length of all cuts, 0 to 1. More harmless cuts would lower it.
    per_area
        Length of such cuts, in pixels of the sample, per 1,000 square pixels of it.
    """

    share: float
    per_area: float

    def rows(self) -> list[Row]:
        """Return the rows of a table."""
        return [
            ("joints that end nowhere", f"{100 * self.share:.1f} %", "of the cuts"),
            ("  per 1,000 square pixels", figure(self.per_area), "pixels; 0: none"),
        ]


def joint_ends(
    quilt: Quilt, joints: Joints, surface: AnySurface | None = None, *, crease: float = CREASE
) -> JointEnds:
    """Measure where a result's cuts break the joints of its sample, and so its stones or boards.

    The sample's distance at the second texel through its own source is compared with that through the first
    one's, as `broken_elements` compares phases; the same texels and cuts count.

    Parameters
    ----------
    quilt
        The result of a synthesis.
    joints
        The sample's joints, see `upholster.image.elements.joints.find_joints`.
    surface, crease
        As for `broken_elements`.
    """
    charted = None if surface is None else charted_surface(surface, quilt.charts)
    cuts, _, area = cuts_of(quilt, charted, crease)
    ends = np.abs(_distances(joints, cuts.onward) - _distances(joints, cuts.found)) > _HALF
    length = float(cuts.lengths[ends].sum())
    return JointEnds(length / max(float(cuts.lengths.sum()), 1e-9), 1000 * STAIRS * length / max(area, 1e-9))


def _distances(joints: Joints, places: IntArray) -> IntArray:
    # At places (n, 2) of the sample in 1/16 pixel; beyond its edges the value at the edge.
    height, width = joints.distances.shape
    rows, columns = (places.T + 8) >> 4
    found: IntArray = joints.distances[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)].astype(
        np.int32
    )
    return found
