"""The order of a stream's parts: what takes most of the error away comes first."""

from streams import laid, woven

from upholster.stream.order import Part, ordered, plan_parts
from upholster.stream.plan import encode_plan
from upholster.stream.warp_fields import pack_fields

ERRORS = 10.0, {0: 5.0, 100: 1.0}


def tags(right: float) -> str:
    """The order where so many of 1000 steps are right before the labels come."""
    plan = [Part((("P", bytes(100)),), right), Part((("M", bytes(100)),), 1000 - right)]
    sample = [Part((("D", bytes(100)),), 100)]
    return "".join(chr(chunk[0]) for chunk in ordered(plan, sample, ERRORS, 0))


def test_a_sample_that_is_seen_in_few_places_waits_for_labels() -> None:
    assert tags(900) == "PDM"
    assert tags(300) == "PMD"


def test_parts_tell_all_and_all_steps() -> None:
    _, quilt, _ = laid(side=128)
    plan = encode_plan(quilt)
    parts = plan_parts(plan, None)
    for tag, wanted in (("P", plan.placements), ("M", plan.labels)):
        assert sum(part.chunks[0][0] == tag for part in parts) > 1
        assert b"".join(data for part in parts for kind, data in part.chunks if kind == tag) == wanted
    cells = sum(maps[0].cell ** 2 * maps[0].labels.size for maps in quilt.labels)
    assert abs(sum(part.steps for part in parts) - cells) < 1
    assert 0 < sum(part.steps for part in parts if part.chunks[0][0] == "M") < 0.3 * cells


def test_finer_nodes_come_between_placements_and_labels() -> None:
    _, quilt, _ = woven("torus", 200_000)
    fields = pack_fields(quilt.fields, quilt.charts)
    told = [part.chunks[0] for part in plan_parts(encode_plan(quilt), fields)]
    order = "".join(tag for tag, _ in told)
    assert order == "P" * order.count("P") + "N" + "M" * order.count("M")
    assert b"".join(data for tag, data in told if tag == "N") == fields.nodes[fields.coarse :]
    assert 0 < fields.coarse < len(fields.nodes) / 3
