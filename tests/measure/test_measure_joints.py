"""Joints that end nowhere are counted at cuts, and laying heeds them."""

import numpy as np
import pytest
from tests.elements.test_joints import stones
from tests.measure.test_measure_broken import quilt_of

from upholster import synthesize
from upholster.covering.measure import joint_ends, measure_cover
from upholster.geometry.built_in.plane import plane
from upholster.image.elements.joints import Joints, find_joints
from upholster.synthesis.quilt import method


def test_a_joint_that_meets_a_stone_is_counted():
    # A joint in columns 20 to 23 of the sample, all else far from it.
    distances = np.full((64, 64), 255, np.uint8)
    distances[:, 20:24] = 0
    joints = Joints(distances, 9.0, 5.0)
    same = quilt_of([(16, 8, 32, 16, 20, 20, 0), (16, 24, 32, 16, 20, 36, 0)])
    assert joint_ends(same, joints).share == 0
    # The right block begins at the joint; the left one would go on with stone.
    apart = quilt_of([(16, 8, 32, 16, 20, 44, 0), (16, 24, 32, 16, 20, 30, 0)])
    assert joint_ends(apart, joints).share == pytest.approx(1)


def test_laying_keeps_stones_whole(monkeypatch):
    sample = stones(side=192, cells=30)[0]
    joints = find_joints(sample)
    lengths = []
    for heeded in (True, False):
        if not heeded:
            monkeypatch.setattr(method, "find_joints", lambda exemplar: None)
        quilts = [synthesize(sample, plane(), texels=(384, 384), seed=seed) for seed in (1, 2)]
        lengths.append(np.mean([joint_ends(quilt, joints).per_area for quilt in quilts]))
    assert lengths[0] < 0.7 * lengths[1]


@pytest.mark.slow(reason="lays and measures whole quilts")
def test_reports_have_it_where_there_are_joints():
    sample = stones(side=96, cells=12)[0]
    quilt = synthesize(sample, plane(), texels=(96, 96), seed=1)
    found = measure_cover(plane(), quilt, sample)
    assert found.joints is not None
    assert any("joints" in name for name, _, _ in found.rows())
    plain = np.random.default_rng(1).integers(90, 160, (64, 64, 3), np.uint8)
    quilt = synthesize(plain, plane(), texels=(96, 96), seed=1)
    assert measure_cover(plane(), quilt, plain).joints is None
