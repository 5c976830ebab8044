"""The filter is Bayes' rule on particles: over the floor, over the training poses, and along a drive."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from rfiddesign.estimators._particle_kernels import HEADING, LOG, X, Y
from rfiddesign.estimators.snapshot import SnapshotMcl, build, init, log_likelihood, track
from rfiddesign.estimators.snapshot import _snapshot_kernels as kernels
from rfiddesign.estimators.snapshot.mcl import _compiled, _room
from rfiddesign.estimators.verbs import N_ESTIMATE
from rfiddesign.models.fingerprint_table import TableGrid
from rfiddesign.models.snapshots import part_of
from rfiddesign.simulation.snapshot_run import localize, train
from tests.estimators.snapshot.places import ANTENNAS, ROOM, Walls, antenna_poses, anywhere, circle, log_at, true_table

TRAINING = log_at(anywhere(600, 1), 1)
KEY = np.uint64(12345)


def ready(table=None, **settings):
    return build(SnapshotMcl(**settings), table or true_table(), ANTENNAS, ROOM, [TRAINING], 2)


def positions(state, n):
    drawn, headings, _ = state.arrays
    return drawn[0, :n], drawn[1, :n], headings[:n] * (math.pi / 2**31)


def test_the_first_update_is_the_posterior_over_the_whole_floor():
    """Mean and spread of many particles are those of the likelihood on a fine grid of poses."""
    log = log_at(np.array([[1200.0, 900.0, 0.7]]), 3)
    grid = TableGrid(100.0, 36)
    filter_ = ready(true_table(grid), n_particles=400_000, start="uniform", k_prime=None)
    mean_x, mean_y, heading, xx, _, yy = init(filter_, log, KEY).moments[:6]
    x, y, h = np.meshgrid(np.arange(50, 4000, 100.0), np.arange(50, 3000, 100.0), np.arange(36) * math.pi / 18)
    poses = np.column_stack([x.ravel(), y.ravel(), h.ravel()])
    logs = sum(
        log_likelihood(Walls(), antenna_poses(poses, antenna), part.dense()[0], 2)
        for antenna, part in zip(ANTENNAS, log.antennas, strict=True)
    )
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    expected = weights @ poses[:, :2]
    spread = weights @ (poses[:, :2] - expected) ** 2
    # Half a cell is what the two grids may differ by.
    assert [mean_x, mean_y] == pytest.approx(expected, abs=50)
    assert np.sqrt([xx, yy]) == pytest.approx(np.sqrt(spread), rel=0.1)
    # That is a tight posterior: the walls are 4 and 3 m apart.
    assert np.sqrt(spread).max() < 400
    mean_heading = math.atan2(weights @ np.sin(poses[:, 2]), weights @ np.cos(poses[:, 2]))
    assert heading == pytest.approx(mean_heading, abs=0.1)


def test_a_start_from_training_poses_draws_them_as_likely_as_the_snapshot_is_there():
    log = log_at(np.array([[2500.0, 2000.0, 2.0]]), 4)
    filter_ = ready(n_particles=100_000, start_noise_mm=0.0, start_noise_rad=0.0, k_prime=None)
    state = init(filter_, log, KEY)
    poses = TRAINING.reference_poses
    logs = sum(
        log_likelihood(_Rounded(), antenna_poses(poses, antenna), part.dense()[0], 2)
        for antenna, part in zip(ANTENNAS, log.antennas, strict=True)
    )
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    x, y, _ = positions(state, 100_000)
    for i in np.argsort(-weights)[:5]:
        share = np.mean((np.abs(x - poses[i, 0]) < 1e-2) & (np.abs(y - poses[i, 1]) < 1e-2))
        assert share == pytest.approx(weights[i], rel=0.15, abs=2e-3)
    assert state.step == 1


class _Rounded(Walls):
    """The walls as a table of 100 mm and 10 degrees has them."""

    def read_probability(self, antenna_poses):
        poses = np.array(antenna_poses)
        # The table begins where the room does, less 300 mm.
        poses[:, :2] = np.floor(poses[:, :2] / 100) * 100 + 50
        poses[:, 2] = np.round(poses[:, 2] * 18 / math.pi) * math.pi / 18
        return super().read_probability(poses)


def test_a_drive_that_begins_anywhere_is_tracked():
    """Far better than by the first snapshots alone, and than a robot that knows the room only."""
    log = log_at(circle(150, 2.0), 5, odometry_noise=2.0)
    trained = train([log_at(anywhere(2500, 1), 1)], ROOM, ANTENNAS)
    errors = np.array([localize(trained, SnapshotMcl(), log, key).position_error_mm for key in range(1, 6)])
    assert np.median(errors[:, 10:]) < 0.75 * np.median(errors[:, 0])
    # On the circle of 900 mm the middle of the room is 900 mm off.
    assert np.median(errors[:, 10:]) < 300


def test_the_true_field_localizes_no_worse_than_the_learned_one():
    """What training costs: any detection field may take the place of the fingerprints."""
    log = log_at(circle(150, 2.0), 6)
    learned, known = train([TRAINING], ROOM, ANTENNAS), train([TRAINING], ROOM, ANTENNAS, field=Walls())

    def median(trained):
        return np.median([localize(trained, SnapshotMcl(), log, key).position_error_mm.mean() for key in range(1, 8)])

    assert median(known) < median(learned)


def test_a_drive_in_two_parts_ends_as_in_one():
    log, filter_ = log_at(circle(30), 7, odometry_noise=1.0), ready(n_particles=500)
    whole, parts = np.zeros((30, N_ESTIMATE)), np.zeros((30, N_ESTIMATE))
    track(filter_, init(filter_, log, KEY), log, 30, whole)
    state = track(filter_, init(filter_, log, KEY), log, 11, parts)
    track(filter_, state, log, 30, parts)
    assert parts[1:].tolist() == whole[1:].tolist()
    other = np.zeros((30, N_ESTIMATE))
    track(filter_, init(filter_, log, np.uint64(2)), log, 30, other)
    assert other[1:].tolist() != whole[1:].tolist()


def test_particles_stay_on_the_floor():
    """On a floor whose half is closed, survivors are in the other; without that bound they are on both sides."""
    log, half = log_at(np.array([[2000.0, 1500.0, 0.3]]), 8), shapely.box(0, 0, 2000, 3000)
    beyond = []
    for floor in (half, ROOM):
        filter_ = build(SnapshotMcl(start="uniform"), true_table(), ANTENNAS, floor, [TRAINING], 2)
        x, _, _ = positions(init(filter_, log, KEY), 2000)
        beyond.append(np.mean(x > 2000))
    assert beyond[0] == 0
    assert beyond[1] > 0.2


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"k_prime": 0}, "k_prime = 0: must be a whole number from 1"),
        ({"start": "there"}, "start is 'there', must be one of snapshots, uniform"),
        ({"n_particles": 1}, "n_particles is 1, must be from 2"),
        ({"start_noise_mm": -1.0}, "start_noise_mm is -1.0, must be at least 0"),
    ],
)
def test_settings_out_of_bounds_are_refused(settings, words):
    with pytest.raises(ValueError, match=words):
        SnapshotMcl(**settings)


def test_logs_that_are_not_of_this_robot_and_place_are_refused():
    log, filter_ = log_at(circle(5), 9), ready()
    few = replace(log, antennas=log.antennas[:1])
    other_cycles = replace(log, antennas=tuple(replace(part, n_cycles=7) for part in log.antennas))
    more_tags = replace(log, antennas=tuple(replace(part, n_tags=99) for part in log.antennas))
    cases = {
        "log has no inquiry": part_of(log, 0, 0), "log has 1 antennas, must have 2": few,
        "log has 7 cycles and 34 tags, must have 2 and 34": other_cycles,
        "log has 2 cycles and 99 tags, must have 2 and 34": more_tags,
    }  # fmt: skip
    state = init(filter_, log, KEY)
    for words, wrong in cases.items():
        with pytest.raises(ValueError, match=words):
            init(filter_, wrong, KEY)
        with pytest.raises(ValueError, match=words):
            track(filter_, state, wrong, min(2, len(wrong)), np.zeros((5, N_ESTIMATE)))


def test_particles_are_weighed_like_poses():
    """The filter's own weights, after a start anywhere, are the log likelihoods of the particles' poses."""
    log, n = log_at(np.array([[1500.0, 1200.0, 0.4]]), 12), 500
    filter_ = ready(n_particles=n, start="uniform")
    cloud = init(filter_, log, KEY).arrays[2]
    headings = cloud[HEADING, :n].view(np.int32) * (math.pi / 2**31)
    poses = np.column_stack([cloud[X, :n], cloud[Y, :n], headings]).astype(float)
    logs = np.empty(n, np.float32)
    kernels.weigh_poses(0, _compiled(log), filter_.model, poses, _room(filter_), logs)
    is_on_floor = (poses[:, :2] >= 0).all(axis=1) & (poses[:, 0] < 4000) & (poses[:, 1] < 3000)
    assert is_on_floor.all()
    # A heading on the border of two rows may round either way.
    assert np.mean(np.abs(cloud[LOG, :n] - logs) < 1e-3) > 0.99
