"""Polls: reads by tag, and what is refused."""

import numpy as np
import pytest

from rfiddesign.models.polls import Polls


def polls(poses=None, poll=(0, 1, 1, 2), tag=(2, 0, 2, 2), distance=(1.0, 2.0, 3.0, 4.0), n_tags=4):
    poses = np.zeros((3, 3)) if poses is None else poses
    return Polls(poses, np.array(poll), np.array(tag), np.array(distance), n_tags)


def test_reads_of_a_tag_come_in_the_order_of_time():
    found = polls()
    assert [found.reads_of(tag).tolist() for tag in range(4)] == [[1], [], [0, 2, 3], []]
    assert found.n_reads == 4


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"poses": np.zeros((3, 2))}, "poses"),
        ({"poses": np.full((3, 3), np.nan)}, "poses"),
        ({"poll": (0, 2, 1, 2)}, "read_poll falls"),
        ({"poll": (0, 1, 1, 3)}, "read_poll"),
        ({"tag": (0, 1, 2, 4)}, "read_tag"),
        ({"tag": (0, 1, 2)}, "one entry"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(change, named):
    with pytest.raises(ValueError, match=named):
        polls(**change)
