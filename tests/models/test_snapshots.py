"""Snapshots keep counts sparsely and lose nothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from rfiddesign.models.snapshots import SnapshotLog, Snapshots, concatenated

N = 4
tables = hnp.arrays(
    np.int64, st.tuples(st.integers(0, 8), st.integers(1, 12)), elements=st.integers(0, N), fill=st.just(0)
)


def snapshots_of(counts):
    return Snapshots.of_counts(counts, np.arange(3.0 * len(counts)).reshape(-1, 3), N)


@given(tables)
def test_counts_survive_the_sparse_form(counts):
    snapshots = snapshots_of(counts)
    assert np.array_equal(snapshots.dense(), counts)
    assert len(snapshots) == len(counts)
    assert len(snapshots.tag) == np.count_nonzero(counts)


@given(st.lists(st.integers(0, 5), min_size=1, max_size=4), st.data())
def test_joined_snapshots_are_rows_below_each_other(lengths, data):
    parts = [data.draw(hnp.arrays(np.int64, (n, 7), elements=st.integers(0, N), fill=st.just(0))) for n in lengths]
    joined = concatenated([snapshots_of(part) for part in parts])
    assert np.array_equal(joined.dense(), np.concatenate(parts))
    assert np.array_equal(joined.poses, np.concatenate([snapshots_of(part).poses for part in parts]))


GOOD = {
    "n_cycles": 2, "n_tags": 5, "poses": np.zeros((2, 3)), "start": [0, 2, 3], "tag": [1, 4, 0], "count": [1, 2, 1]
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"start": [0, 2, 4]}, "start"),
        ({"start": [0, 3, 2]}, "start"),
        ({"start": [0, 3]}, "start"),
        ({"tag": [1, 5, 0]}, "tag: holds 0 to 5"),
        ({"tag": [4, 1, 0]}, "tag: must rise"),
        ({"tag": [1, 1, 0]}, "tag: must rise"),
        ({"count": [1, 3, 1]}, "count: holds 1 to 3"),
        ({"count": [0, 2, 1]}, "count: holds 0 to 2"),
        ({"count": [1.0, 2.0, 1.5]}, "whole numbers"),
        ({"count": [1, 70_000, 1]}, "count: holds 1 to 70000"),
        ({"poses": np.full((2, 3), np.nan)}, "poses"),
        ({"n_cycles": 0}, "n_cycles"),
    ],
)
def test_bad_snapshots_are_refused_by_name(change, words):
    Snapshots(**GOOD)
    with pytest.raises(ValueError, match=words):
        Snapshots(**(GOOD | change))


def test_a_tag_may_come_again_in_the_next_snapshot_with_a_lower_number():
    assert Snapshots(**(GOOD | {"tag": [1, 4, 4]})).dense()[1, 4] == 1


def test_parts_that_differ_are_not_joined():
    with pytest.raises(ValueError, match="must agree"):
        concatenated([snapshots_of(np.zeros((1, 3), int)), snapshots_of(np.zeros((1, 4), int))])
    with pytest.raises(ValueError, match="empty"):
        concatenated([])
    with pytest.raises(ValueError, match="1 GB"):
        Snapshots(2, 2**31 - 1, np.zeros((1, 3)), [0, 0], np.zeros(0, int), np.zeros(0, int)).dense()


def test_a_log_has_one_row_per_inquiry_everywhere():
    snapshots = snapshots_of(np.eye(3, dtype=int))
    good = {
        "time_s": [0.5, 1.5, 2.5], "true_poses": np.ones((3, 3)), "reference_poses": np.ones((3, 3)),
        "odometry": np.zeros((3, 3)), "antennas": (snapshots, snapshots),
    }  # fmt: skip
    assert len(SnapshotLog(**good)) == 3
    for change, words in (
        ({"time_s": [0.5, 0.5, 2.5]}, "time_s"),
        ({"odometry": np.ones((3, 3))}, "row 0"),
        ({"true_poses": np.ones((2, 3))}, "true_poses"),
        ({"antennas": (snapshots, snapshots_of(np.eye(2, dtype=int)))}, "antennas: one has 2"),
        ({"antennas": ()}, "antennas is empty"),
    ):
        with pytest.raises(ValueError, match=words):
            SnapshotLog(**(good | change))
