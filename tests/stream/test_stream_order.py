"""The order of a stream's parts: what takes most of the error away comes first."""

from streams import laid

from upholster.stream.order import Part, chart_parts, label_parts, ordered
from upholster.stream.plan import encode_plan

ERRORS = 10.0, {0: 5.0, 100: 1.0}


def tags(right: float) -> str:
    """The order where so many of 1000 steps are right before the labels come."""
    charts, labels = [Part((("P", bytes(100)),), right)], [Part((("M", bytes(100)),), 1000 - right)]
    sample = [Part((("D", bytes(100)),), 100)]
    return "".join(chr(chunk[0]) for chunk in ordered(charts, labels, sample, ERRORS, 0))


def test_a_sample_that_is_seen_in_few_places_waits_for_labels() -> None:
    assert tags(900) == "PDM"
    assert tags(300) == "PMD"


def test_parts_tell_all_and_all_steps() -> None:
    _, quilt, _ = laid(side=128)
    plan = encode_plan(quilt)
    charts, labels = chart_parts(quilt.charts, plan, None), label_parts(plan)
    assert min(len(charts), len(labels)) > 1
    assert b"".join(data for part in charts for _, data in part.chunks) == plan.placements
    assert b"".join(data for part in labels for _, data in part.chunks) == plan.labels
    assert abs(sum(part.steps for part in [*charts, *labels]) - quilt.steps) < 1
    assert 0 < sum(part.steps for part in labels) < 0.3 * quilt.steps
