"""Recorded drives come back from their files as they went in, teach the same field, and faults are one line."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.errors import StudyError
from rfiddesign.geometry import compose
from rfiddesign.models.fingerprint import FingerprintField
from rfiddesign.models.snapshot_files import (
    ANTENNAS,
    COUNTS,
    INQUIRIES,
    read_snapshot_logs,
    write_snapshot_log,
)
from rfiddesign.models.snapshots import SnapshotLog, Snapshots

MOUNTINGS = ((190.0, 190.0, math.pi / 4), (190.0, -190.0, -math.pi / 4))


def a_log(seed, n=12, n_tags=20, n_cycles=4):
    rng = np.random.default_rng(seed)
    poses = np.column_stack([rng.uniform(-5e3, 5e3, (n, 2)), rng.uniform(-9, 9, n)])
    odometry = rng.normal(size=(n, 3)) * [300, 10, 0.2]
    odometry[:1] = 0
    counts = rng.integers(1, n_cycles + 1, (2, n, n_tags)) * (rng.random((2, n, n_tags)) < 0.2)
    # The last tag is read, so that a reader of the files knows how many there are.
    counts[0, 0, -1] = n_cycles
    parts = tuple(
        Snapshots.of_counts(count, compose(poses, mounting), n_cycles)
        for count, mounting in zip(counts, MOUNTINGS, strict=True)
    )
    return SnapshotLog(np.cumsum(rng.uniform(0.5, 1.0, n)), poses, poses, odometry, parts)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 20), n_cycles=st.integers(1, 8))
def test_a_log_comes_back_as_it_was_written(tmp_path_factory, seed, n, n_cycles):
    folder, log = tmp_path_factory.mktemp("log"), a_log(seed, n, n_cycles=n_cycles)
    write_snapshot_log(folder, log, MOUNTINGS)
    (back,) = read_snapshot_logs([folder])
    assert back.time_s == pytest.approx(log.time_s, abs=1e-6)
    assert back.reference_poses == pytest.approx(log.reference_poses, abs=1e-3)
    assert back.odometry == pytest.approx(log.odometry, abs=1e-3)
    for part, before in zip(back.antennas, log.antennas, strict=True):
        assert part.n_cycles == n_cycles
        assert part.dense().tolist() == before.dense().tolist()
        assert part.poses[:, :2] == pytest.approx(before.poses[:, :2], abs=2e-3)


def test_recorded_drives_teach_the_field_that_simulated_ones_teach(tmp_path):
    logs = [a_log(seed) for seed in (1, 2)]
    for i, log in enumerate(logs):
        write_snapshot_log(tmp_path / str(i), log, MOUNTINGS)
    back = read_snapshot_logs([tmp_path / "0", tmp_path / "1"])
    fields = [FingerprintField([part for log in some for part in log.antennas]) for some in (logs, back)]
    poses = np.random.default_rng(0).uniform([-5e3, -5e3, -3], [5e3, 5e3, 3], (50, 3))
    simulated, recorded = (field.read_probability(poses) for field in fields)
    assert recorded == pytest.approx(simulated, abs=1e-4)


FAULTS = {
    "no file": (COUNTS, None, f"{COUNTS}: cannot be read: No such file"),
    "another header": (INQUIRIES, "t,x,y\n", f"{INQUIRIES}: begins with 't,x,y', must begin with time_s,x_mm"),
    "no number": (COUNTS, "inquiry,antenna,tag,count\n0,0,x,1\n", f"{COUNTS}: line 2 is '0,0,x,1', must be 4 numbers"),
    "half a tag": (COUNTS, "inquiry,antenna,tag,count\n0,0,1.5,1\n", f"{COUNTS}: line 2: tag is 1.5, must be a whole"),
    "too many cycles": (COUNTS, "inquiry,antenna,tag,count\n0,0,1,9\n", "count: holds 9 to 9, must be within 1 to 4"),
    "no such inquiry": (COUNTS, "inquiry,antenna,tag,count\n99,0,1,1\n", f"{COUNTS}: line 2: inquiry is 99, there"),
    "no such antenna": (COUNTS, "inquiry,antenna,tag,count\n0,5,1,1\n", f"{COUNTS}: line 2: antenna is 5, there are 2"),
    "a tag twice": (COUNTS, "inquiry,antenna,tag,count\n0,0,1,1\n0,0,1,2\n", "tag: must rise within each snapshot"),
    "no antenna": (ANTENNAS, "antenna,x_mm,y_mm,yaw_rad,n_cycles\n", f"{ANTENNAS}: has no antenna"),
}  # fmt: skip


@pytest.mark.parametrize(("name", "text", "words"), FAULTS.values(), ids=FAULTS)
def test_a_faulty_log_is_one_line_that_names_file_and_line(tmp_path, name, text, words):
    write_snapshot_log(tmp_path, a_log(3), MOUNTINGS)
    (tmp_path / name).unlink()
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(StudyError) as caught:
        read_snapshot_logs([tmp_path])
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_logs_of_different_robots_are_refused(tmp_path):
    write_snapshot_log(tmp_path / "a", a_log(1), MOUNTINGS)
    write_snapshot_log(tmp_path / "b", a_log(2), ((0.0, 0.0, 0.0), MOUNTINGS[1]))
    with pytest.raises(StudyError, match="differs from that of"):
        read_snapshot_logs([tmp_path / "a", tmp_path / "b"])
