"""Polls of a robot whose pose is known: tags are read where they are in the lobe, at the least distance that does."""

import math

import numpy as np
import pytest

from rfiddesign.geometry import compose
from rfiddesign.models.lobe import Lobe
from rfiddesign.simulation.tag_polls import antenna_poses, poll_tags
from tests.estimators.tag_mapping.numpy_windows import in_ellipse

DISTANCES = (700.0, 1000.0, 1400.0, 2000.0)


def test_antennas_poll_in_turn_where_they_are_mounted():
    poses = np.array([[0.0, 0.0, 0.0], [1000.0, 500.0, math.pi / 2]])
    mountings = [(100.0, 50.0, 0.5), (0.0, 0.0, -0.5)]
    found = antenna_poses(poses, mountings)
    for k, (pose, mounting) in enumerate((pose, mounting) for pose in poses for mounting in mountings):
        assert found[k] == pytest.approx(compose(pose, np.array(mounting)))


@pytest.mark.parametrize("signal_db", [-6.0, 0.0, 6.0])
def test_a_tag_is_read_at_the_least_distance_whose_ellipse_holds_it(signal_db):
    """40 dB are ten times the distance."""
    rng = np.random.default_rng(4)
    poses = np.column_stack([rng.uniform(0, 4000, (50, 2)), rng.uniform(-4, 4, 50)])
    tags = rng.uniform(0, 4000, (40, 2))
    polls = poll_tags(Lobe(), poses, tags, DISTANCES, rng, signal_db=signal_db)
    reads = {
        (poll, tag): distance
        for poll, tag, distance in zip(polls.read_poll, polls.read_tag, polls.read_distance_mm, strict=True)
    }
    larger = 10 ** (signal_db / 40)
    expected = {}
    for distance in reversed(DISTANCES):
        for poll, pose in enumerate(poses):
            for tag in np.flatnonzero(in_ellipse(pose, tags, larger * distance)):
                expected[poll, tag] = distance
    assert reads == expected
    assert len(reads) > 20


def test_soft_reads_come_as_often_as_their_chance():
    lobe = Lobe("sector", softness=0.2, read_probability=0.6)
    poses, tags = np.zeros((20_000, 3)), np.array([[900.0, 200.0], [1900.0, 0.0]])
    polls = poll_tags(lobe, poses, tags, (1000.0,), np.random.default_rng(1))
    shares = np.bincount(polls.read_tag, minlength=2) / len(poses)
    assert shares == pytest.approx(lobe.probability(tags, 1000.0), abs=0.012)


def test_no_tag_near_is_no_read():
    polls = poll_tags(Lobe(), np.zeros((3, 3)), np.array([[1e6, 0.0]]), DISTANCES, np.random.default_rng(1))
    assert polls.n_reads == 0
    assert polls.n_tags == 1


def test_more_pairs_than_a_computer_holds_are_refused_before_they_are_listed():
    rng = np.random.default_rng(1)
    with pytest.raises(ValueError, match="have 20,004,000 tags near them in all, at most 20,000,000"):
        poll_tags(Lobe(), np.zeros((5001, 3)), rng.uniform(-100, 100, (4000, 2)), DISTANCES, rng)
