"""Drives that take snapshots: as long and as quick as the paper's, and counts are draws of the chances they met."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
import shapely
from scipy import stats

from rfiddesign.floor import prepared_copy
from rfiddesign.floor.scenes import corridor, laboratory
from rfiddesign.geometry import se2
from rfiddesign.models.motion import DifferentialMotion, OdometryFaults
from rfiddesign.models.uhf import UhfWorld
from rfiddesign.simulation import snapshot_drive
from rfiddesign.simulation.snapshot_drive import (
    DriveSettings,
    drive_key,
    drive_poses,
    inquiry_duration_s,
    record_snapshots,
)

LAB = laboratory()
DRIVE = DriveSettings()
SHORT = replace(DRIVE, duration_s=60.0)
EXACT = replace(
    SHORT, motion=DifferentialMotion(0.0), reference_mm=0.0, reference_rad=0.0, mountings=((100.0, -50.0, 0.3),)
)


@dataclass(frozen=True)
class EvenField:
    """A field that reads every tag with a chance of its own, from anywhere."""

    chance: np.ndarray

    @property
    def n_tags(self):
        return len(self.chance)

    def read_probability(self, antenna_poses):
        return np.tile(self.chance.astype(np.float32), (len(antenna_poses), 1))


@dataclass(frozen=True)
class AskedField:
    """A field that reads nothing and keeps the poses it was asked for."""

    n_tags: int
    asked: list

    def read_probability(self, antenna_poses):
        self.asked.append(antenna_poses.copy())
        return np.zeros((len(antenna_poses), self.n_tags), np.float32)


def record(settings=SHORT, n_cycles=4, field=None, scene=LAB, number=0, day=1):
    field = field or UhfWorld(scene, seed=2, day=day)
    return record_snapshots(field, scene, settings, n_cycles, seed=2, day=day, number=number)


@pytest.mark.parametrize("scene", [LAB, corridor()], ids=["laboratory", "corridor"])
def test_drives_are_as_long_as_the_papers_and_stay_on_the_floor(scene):
    region = prepared_copy(scene.floor.navigable.buffer(1e-6))
    for number in range(20):
        poses = drive_poses(scene, DRIVE, drive_key(5, 1, number))
        way_m = np.hypot(*np.diff(poses[:, :2], axis=0).T).sum() / 1e3
        assert 89 <= way_m <= 188
        assert shapely.contains_xy(region, *poses[::25, :2].T).all()


def test_inquiries_last_as_table_i_says():
    assert inquiry_duration_s(2) == (0.77, 0.02)
    assert inquiry_duration_s(6) == (1.99, 0.03)
    assert inquiry_duration_s(3)[0] == pytest.approx((0.77 + 1.46) / 2)
    assert inquiry_duration_s(1)[0] == pytest.approx(0.385)
    assert inquiry_duration_s(16)[0] == pytest.approx(5.32)
    assert inquiry_duration_s(2, 4) == pytest.approx((1.54, 0.04))
    log = record(DRIVE, 2)
    between = np.diff(log.time_s)
    assert between.mean() == pytest.approx(0.77, abs=5 * 0.02 / math.sqrt(len(between)))
    # Stamps are middles: half of one inquiry and half of the next.
    assert between.std() == pytest.approx(0.02 / math.sqrt(2), rel=0.15)
    assert 300 - 0.77 * 1.6 < log.time_s[-1] < 300


def test_counts_are_binomial_draws_of_the_chances():
    chance = np.linspace(0, 1, LAB.n_tags)
    n_cycles = 4
    log = record(DRIVE, n_cycles, EvenField(chance))
    counts = np.concatenate([snapshots.dense() for snapshots in log.antennas])
    assert counts[:, 0].max() == 0
    assert counts[:, -1].min() == n_cycles
    n = len(counts) * n_cycles
    inner = slice(1, -1)
    z = (counts.sum(0) - n * chance)[inner] / np.sqrt(n * chance * (1 - chance))[inner]
    low, high = stats.chi2.ppf([1e-5, 1 - 1e-5], len(z))
    assert low < (z**2).sum() < high
    # Cycles are independent: the variance within snapshots is that of the binomial distribution.
    observed = ((counts - n_cycles * chance) ** 2).sum(0)[inner] / (n * chance * (1 - chance))[inner]
    assert observed.mean() == pytest.approx(1.0, abs=0.02)
    # And so are tags and snapshots.
    middle = (counts[:, 200:280] - n_cycles * chance[200:280]) / np.sqrt(n_cycles * chance * (1 - chance))[200:280]
    assert abs(np.mean(middle[:-1] * middle[1:])) < 5 / math.sqrt(middle.size)
    assert abs(np.mean(middle[:, :-1] * middle[:, 1:])) < 5 / math.sqrt(middle.size)


def test_counts_follow_the_world_the_drive_was_in():
    world = UhfWorld(LAB, seed=2, day=1)
    slow = replace(EXACT, duration_s=300.0, least_speed_mm_per_s=1.0, most_speed_mm_per_s=1.0)
    log = record(slow, 8, world)
    (snapshots,) = log.antennas
    expected = 8 * world.read_probability(snapshots.poses).astype(float)
    variance = (expected * (1 - expected / 8)).sum()
    # At 1 mm/s the pose of the stamp is that of all cycles but for 1 mm.
    assert abs(snapshots.dense().sum() - expected.sum()) < 5 * math.sqrt(variance) + 0.01 * expected.sum()


def test_cycles_are_spread_over_the_inquiry_while_the_robot_moves():
    asked = []
    log = record(replace(EXACT, mountings=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))), 2, AskedField(LAB.n_tags, asked))
    left, right = (poses.reshape(-1, 2, 3) for poses in asked)
    # The order is left, right, left, right: steps of the same length within a straight leg.
    in_turn = np.stack([left[:, 0], right[:, 0], left[:, 1], right[:, 1]], axis=1)
    steps = np.hypot(*np.diff(in_turn[..., :2], axis=1).transpose(2, 0, 1))
    is_straight = np.ptp(in_turn[..., 2], axis=1) < 1e-12
    is_moving = is_straight & (steps.min(axis=1) > 50)
    assert is_moving.sum() > 20
    assert np.allclose(steps[is_moving], steps[is_moving][:, :1], rtol=1e-6)
    middle = in_turn[is_moving][..., :2].mean(axis=1)
    assert np.abs(middle - log.true_poses[is_moving, :2]).max() < 1e-6


def test_exact_odometry_and_reference_tell_the_truth():
    log = record(EXACT, 4)
    assert np.array_equal(log.reference_poses, log.true_poses)
    expected = se2.between(log.true_poses[:-1], log.true_poses[1:])
    assert np.allclose(log.odometry[1:, :2], expected[:, :2], atol=1e-6)
    assert np.allclose(se2.wrap_angle(log.odometry[1:, 2] - expected[:, 2]), 0, atol=1e-9)
    mounted = se2.compose(log.reference_poses, np.array(EXACT.mountings[0]))
    assert np.allclose(log.antennas[0].poses[:, :2], mounted[:, :2])
    assert np.allclose(se2.wrap_angle(log.antennas[0].poses[:, 2] - mounted[:, 2]), 0, atol=1e-9)


def test_noise_of_odometry_and_reference_is_as_large_as_declared():
    motion = DifferentialMotion(15.0, 300.0)
    logs = [record(replace(DRIVE, motion=motion), 4, number=number) for number in range(3)]
    off = np.concatenate([log.reference_poses - log.true_poses for log in logs])
    assert off.std(axis=0) == pytest.approx([30, 30, 0.02], rel=0.15)
    residual, variance = [], []
    for log in logs:
        true = se2.between(log.true_poses[:-1], log.true_poses[1:])
        turn = np.diff(log.true_poses[:, 2])
        way = np.hypot(*true[:, :2].T)
        is_straight = np.abs(turn) < 1e-9
        residual.append((log.odometry[1:] - true)[is_straight])
        variance.append(motion.noise(1.0)[[0, 2], 1] * way[is_straight, None])
    residual, variance = np.concatenate(residual), np.concatenate(variance)
    low, high = stats.chi2.ppf([1e-5, 1 - 1e-5], len(residual))
    assert len(residual) > 200
    for column, axis in enumerate((0, 2)):
        assert low < (residual[:, axis] ** 2 / variance[:, column]).sum() < high


def test_faults_of_the_odometry_show():
    faults = OdometryFaults(scale_x=0.02)
    straight = record(replace(EXACT, faults=faults), 4)
    plain = record(EXACT, 4)
    moved = np.hypot(*plain.odometry[1:, :2].T) > 200
    is_straight = moved & (np.abs(plain.odometry[1:, 2]) < 1e-9)
    assert np.allclose(straight.odometry[1:, 0][is_straight], 1.02 * plain.odometry[1:, 0][is_straight])


def test_a_drive_is_its_seed_day_and_number():
    one, again = record(), record()
    for a, b in zip(one.antennas, again.antennas, strict=True):
        assert np.array_equal(a.dense(), b.dense())
        assert np.array_equal(a.poses, b.poses)
    assert np.array_equal(one.odometry, again.odometry)
    for other in (record(number=1), record(day=2)):
        assert not np.array_equal(one.true_poses[:20], other.true_poses[:20])
    # Drives with other numbers of cycles go the same way.
    assert np.allclose(record(n_cycles=2).true_poses[0, :2], one.true_poses[0, :2], atol=400)


def test_what_is_held_at_a_time_changes_nothing(monkeypatch):
    one = record()
    monkeypatch.setattr(snapshot_drive, "_MAX_CHANCES", 5_000)
    for a, b in zip(one.antennas, record().antennas, strict=True):
        assert np.array_equal(a.dense(), b.dense())


def test_bad_drives_are_refused_by_name():
    with pytest.raises(ValueError, match="field is of 3 tags"):
        record(field=EvenField(np.zeros(3)))
    with pytest.raises(ValueError, match="an inquiry of 8 cycles takes"):
        record(replace(SHORT, duration_s=2.0), 8)
    with pytest.raises(ValueError, match="most_speed_mm_per_s is 100"):
        DriveSettings(most_speed_mm_per_s=100.0)
    with pytest.raises(ValueError, match="mountings has 0 antennas"):
        DriveSettings(mountings=())
    with pytest.raises(ValueError, match="day"):
        drive_key(1, -1, 0)


def test_drives_read_the_374_tags_that_the_paper_knew():
    world = UhfWorld(LAB, seed=2, day=1)
    logs = [record_snapshots(world, LAB, DRIVE, 2, seed=2, day=1, number=number) for number in range(10)]
    known = np.unique(np.concatenate([snapshots.tag for log in logs for snapshots in log.antennas]))
    assert len(known) == 374
    assert not LAB.is_buried()[known].any()
