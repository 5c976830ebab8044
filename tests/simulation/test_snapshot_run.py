"""What was learned of a place stands in for the place: drives are recorded in it, tags expected, robots localized."""

import numpy as np
import pytest

from rfiddesign.estimators.snapshot import SnapshotMcl
from rfiddesign.floor.scenes import warehouse
from rfiddesign.metrics import summarize
from rfiddesign.models.reads_over_floor import reads_over_floor
from rfiddesign.models.uhf import UhfField, UhfWorld
from rfiddesign.numerics._noise_kernels import run_key
from rfiddesign.simulation.snapshot_drive import DriveSettings, record_snapshots
from rfiddesign.simulation.snapshot_run import localize, train

SCENE = warehouse(6_000.0, 5_000.0, aisle_mm=1_800.0, shelf_depth_mm=800.0, tags_per_m=3.0, footprint_mm=300.0)
SETTINGS = DriveSettings(duration_s=150.0)
N_CYCLES = 2


def drives(field, day, n, settings=SETTINGS):
    return [record_snapshots(field, SCENE, settings, N_CYCLES, seed=1, day=day, number=i) for i in range(n)]


@pytest.fixture(scope="module")
def world():
    return UhfWorld(SCENE, UhfField(), seed=1)


@pytest.fixture(scope="module")
def trained(world):
    return train(drives(world, 0, 3), SCENE.floor.navigable, np.array(SETTINGS.mountings))


def test_a_learned_field_is_a_world_to_drive_in(world, trained):
    """Snapshots drawn from the learned field hold about as many tags as those of the world that it was learned of."""
    sizes = [
        np.mean([len(part.tag) / len(part) for log in drives(field, 5, 2) for part in log.antennas])
        for field in (world, trained.field)
    ]
    # A tag that no snapshot knows of is still expected now and then, hence more.
    assert 0.8 < sizes[1] / sizes[0] < 2.0


def test_a_learned_field_tells_where_tags_are_to_be_expected(world, trained):
    found = [
        reads_over_floor(field, SCENE.floor, SETTINGS.mountings, 0.0, N_CYCLES, 300.0)[2]
        for field in (world, trained.field)
    ]
    is_floor = np.isfinite(found[0])
    assert (np.isfinite(found[1]) == is_floor).all()
    assert np.corrcoef(found[0][is_floor], found[1][is_floor])[0, 1] > 0.5


def test_a_robot_is_localized_where_the_training_was(world, trained):
    (log,) = drives(world, 7, 1)
    errors = [localize(trained, SnapshotMcl(), log, run_key(np.uint64(1), np.uint64(i))) for i in range(5)]
    middle = np.array(SCENE.floor.navigable.centroid.coords[0])
    at_random = np.hypot(*(log.true_poses[:, :2] - middle).T).mean()
    means = [error.position_error_mm.mean() for error in errors]
    assert np.median(means) < 0.3 * at_random
    summary = summarize(errors[0].position_error_mm, errors[0].heading_error_rad, 0.77, 0)
    assert summary.position_mean_mm == pytest.approx(means[0])


def test_the_same_key_gives_the_same_run(world, trained):
    (log,) = drives(world, 8, 1)
    first, again, other = (localize(trained, SnapshotMcl(), log, key).poses for key in (1, 1, 2))
    assert first.tolist() == again.tolist()
    assert first.tolist() != other.tolist()
