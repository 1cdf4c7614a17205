"""Laying again: the cost of all cuts falls, kept steps stay, and threads change nothing."""

from typing import Any

import numpy as np
import pytest
from laying import Folded, Run, alike, cylinder, plane, texture

from upholster.synthesis.quilt import relaying
from upholster.synthesis.quilt.kernels._relay_kernels import cost_steps

EXEMPLAR = texture(64, 64, passes=3)


def cost(run: Run, surface: Folded, **options: Any) -> float:
    """Return the cost of all cuts."""
    plan, out = surface.plan(EXEMPLAR, **options), np.zeros(len(run.ground.canvases.owners))
    cost_steps(run.ground, plan.match, plan.numbers, run.laid.records, out)
    return float(out.sum())


@pytest.mark.parametrize("name", ["plane", "cylinder"])
def test_cuts_cost_less_each_time(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    surface = plane(140, 160) if name == "plane" else cylinder(140, 160, turned=(20.0,))
    costs = []
    for times in (0, 1, 3):
        monkeypatch.setattr(relaying, "_TIMES", times)
        run = surface.laid(EXEMPLAR, block=20, seed=2)
        assert (run.ground.canvases.owners[run.ground.canvases.triangles >= 0] >= 0).all()
        costs.append(cost(run, surface, block=20))
    assert costs[0] > costs[1] > costs[2] > 0
    assert costs[2] < 0.95 * costs[0]
    assert alike(run.quilt, surface.laid(EXEMPLAR, block=20, seed=2, threads=3).quilt)
