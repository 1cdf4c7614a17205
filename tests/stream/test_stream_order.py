"""The order of a stream's parts: what takes most of the error away comes first."""

from itertools import pairwise

import numpy as np
from streams import anything_bent, laid

from upholster.codec.stream.field_chunks import pack_fields
from upholster.codec.stream.order import StreamPart, ordered, plan_parts
from upholster.codec.stream.plan import encode_plan
from upholster.quilt.chart import Chart

ERRORS = 10.0, {0: 5.0, 100: 1.0}


def tags(right: float) -> str:
    """The order where so many of 1000 steps are right before the labels come."""
    queue = [StreamPart((("P", bytes(100)),), right), StreamPart((("M", bytes(100)),), 1000 - right)]
    sample = [StreamPart((("D", bytes(100)),), 100)]
    return "".join(chr(chunk[0]) for chunk in ordered(queue, sample, ERRORS, 0))


def test_a_sample_that_is_seen_in_few_places_waits_for_labels() -> None:
    assert tags(900) == "PDM"
    assert tags(300) == "PMD"


def test_parts_tell_all_and_the_steps_of_all_cells() -> None:
    _, quilt, _ = laid(side=128)
    plan = encode_plan(quilt)
    parts = plan_parts(plan, None)
    reported = {tag: [part for part in parts if part.chunks[0][0] == tag] for tag in "PM"}
    assert min(len(some) for some in reported.values()) > 1
    for tag, data in (("P", plan.placements), ("M", plan.labels)):
        assert b"".join(part.chunks[0][1] for part in reported[tag]) == data
    assert parts == reported["P"] + reported["M"]
    steps = sum(one.cell**2 * one.labels.size for maps in quilt.labels for one in maps)
    assert abs(sum(part.steps for part in parts) - steps) < 1
    assert 0 < sum(part.steps for part in reported["M"]) < 0.3 * steps


def test_finer_nodes_come_between_placements_and_labels() -> None:
    charts = Chart(0, 300, 260), Chart(0, 60, 50)
    quilt = anything_bent(np.random.default_rng(8), (32, 40), charts, 60, 1)
    plan, fields = encode_plan(quilt), pack_fields(quilt.fields, quilt.charts)
    parts = plan_parts(plan, fields)
    found = "".join(part.chunks[0][0] for part in parts)
    assert found == "".join(sorted(found, key="PNM".index))
    nodes = b"".join(data for part in parts for tag, data in part.chunks if tag == "N")
    assert 0 < fields.coarse < len(fields.nodes)
    assert nodes == fields.nodes[fields.coarse :]


def test_every_cut_of_placements_shows_more_steps_right() -> None:
    _, quilt, _ = laid(side=256)
    ends = encode_plan(quilt).placement_ends
    assert len(ends) > 8
    assert all(a[0] < b[0] and a[1] < b[1] for a, b in pairwise(ends))
