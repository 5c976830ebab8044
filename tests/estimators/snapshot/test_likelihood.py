"""The likelihood from the look-up table is the one that eqs. 8 and 9 write, for any snapshot and any k'."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from rfiddesign.estimators.snapshot import SnapshotMcl, build, log_likelihood
from rfiddesign.estimators.snapshot import _snapshot_kernels as kernels
from rfiddesign.models.fingerprint_table import TableGrid, tabulate
from rfiddesign.models.snapshots import SnapshotLog, Snapshots

N_TAGS, N_CYCLES = 30, 4
ROOM = shapely.box(0, 0, 2000, 1500)
# Around the room, on the same cells.
AROUND = shapely.box(-500, -500, 2500, 2000)
GRID = TableGrid(cell_mm=250.0, n_headings=8, least_support=0.0)
ANTENNAS = np.array([[150.0, 100.0, math.pi / 4], [150.0, -100.0, -math.pi / 4]])


class Patches:
    """A detection field of some tags near to each place, in patches as wide as the table's cells."""

    n_tags = N_TAGS

    def read_probability(self, antenna_poses):
        cell = np.floor(antenna_poses[:, :2] / GRID.cell_mm) @ [7, 131]
        heading = np.round(antenna_poses[:, 2] / (2 * math.pi) * GRID.n_headings) % GRID.n_headings
        near = np.random.default_rng(5).random((4096, N_TAGS))
        chances = near[(cell * 8 + heading).astype(int) % 4096]
        return np.where(chances < 0.6, 0.02, 0.99 * chances**2).astype(np.float32)


def log_of(counts):
    """A log of one step whose antennas counted that (n_antennas, n_tags)."""
    still = np.zeros((1, 3))
    parts = tuple(Snapshots.of_counts(row[None], still, N_CYCLES) for row in counts)
    return SnapshotLog(np.zeros(1), still, still, still, parts)


def ready_for(k_prime):
    """A filter that knows all tags from training."""
    table = tabulate(Patches(), AROUND, GRID)
    training = [log_of(np.ones((2, N_TAGS), int))]
    return build(SnapshotMcl(k_prime=k_prime), table, ANTENNAS, ROOM, training, N_CYCLES)


def kernel_logs(ready, log, poses):
    from rfiddesign.estimators.snapshot.mcl import _compiled, _room

    logs = np.empty(len(poses), np.float32)
    kernels.weigh_poses(0, _compiled(log), ready.model, poses, _room(ready), logs)
    return logs


def grid_poses(seed, n=40):
    """Robot poses whose antennas are within the table, with the antennas' headings on its grid."""
    rng = np.random.default_rng(seed)
    eighths = rng.integers(0, 8, n) * math.pi / 4
    return np.column_stack([rng.uniform(400, 1600, n), rng.uniform(400, 1100, n), eighths])


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    k_prime=st.sampled_from([1, 2, 5, 12, N_TAGS, None]),
    share=st.floats(0, 1),
)
def test_the_table_and_the_direct_evaluation_agree(seed, k_prime, share):
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, N_CYCLES + 1, (2, N_TAGS)) * (rng.random((2, N_TAGS)) < share)
    poses = grid_poses(seed)
    expected = np.zeros(len(poses))
    for antenna, row in zip(ANTENNAS, counts, strict=True):
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        at = np.column_stack(
            [
                poses[:, 0] + c * antenna[0] - s * antenna[1],
                poses[:, 1] + s * antenna[0] + c * antenna[1],
                poses[:, 2] + antenna[2],
            ]
        )
        expected += log_likelihood(Patches(), at, row, N_CYCLES, k_prime)
    found = kernel_logs(ready_for(k_prime), log_of(counts), poses)
    # A level is within 1/512 of its log odds; a tag's logarithm is that times N off at most.
    tags = 2 * min(k_prime or N_TAGS, N_TAGS)
    assert found == pytest.approx(expected, abs=tags * N_CYCLES / 512 + 1e-3)


def test_all_tags_make_the_plain_product_of_binomials():
    counts = np.array([3, 0, 1] + [0] * (N_TAGS - 3))
    pose = np.array([[700.0, 700.0, 0.0]])
    chances = Patches().read_probability(pose)[0].astype(float)
    plain = binom.logpmf(counts, N_CYCLES, chances).sum()
    assert log_likelihood(Patches(), pose, counts, N_CYCLES) == pytest.approx(plain)


def weighed_tags(counts, chances, most):
    """Numbers of the tags of eq. 9."""
    tags = np.arange(len(counts))
    n_read = min(np.count_nonzero(counts), most)
    by_chance = np.lexsort((tags, -chances))
    others = by_chance[counts[by_chance] == 0][: most - n_read]
    return np.concatenate([np.lexsort((tags, -counts))[:n_read], others])


@given(seed=st.integers(0, 10**6), share=st.floats(0, 1), most=st.integers(1, N_TAGS))
def test_tags_that_count_are_those_read_most_often_and_then_the_likeliest_others(seed, share, most):
    rng = np.random.default_rng(seed)
    counts = rng.integers(1, N_CYCLES + 1, N_TAGS) * (rng.random(N_TAGS) < share)
    poses = grid_poses(seed, 3)
    found = log_likelihood(Patches(), poses, counts, N_CYCLES, most)
    for value, chances in zip(found, Patches().read_probability(poses).astype(float), strict=True):
        tags = weighed_tags(counts, chances, most)
        assert value == pytest.approx(binom.logpmf(counts[tags], N_CYCLES, chances[tags]).sum())


def test_counts_of_other_tags_or_cycles_are_refused():
    pose = np.zeros((1, 3))
    with pytest.raises(ValueError, match=r"counts has shape \(3,\), must be \(30,\)"):
        log_likelihood(Patches(), pose, [1, 2, 3], N_CYCLES)
    with pytest.raises(ValueError, match="counts: holds 0 to 9, must be within 0 to 4"):
        log_likelihood(Patches(), pose, [9] + [0] * (N_TAGS - 1), N_CYCLES)


def test_places_off_the_table_and_off_training_are_impossible():
    ready = ready_for(10)
    logs = kernel_logs(ready, log_of(np.ones((2, N_TAGS), int)), np.array([[1e5, 0.0, 0.0], [1000.0, 700.0, 0.0]]))
    assert logs[0] <= kernels.IMPOSSIBLE < logs[1]


def test_tags_that_training_does_not_know_do_not_count():
    """Whether a new tag is read or not, no pose gains by it."""
    table = tabulate(Patches(), AROUND, GRID)
    known = np.ones((2, N_TAGS), int)
    known[:, 20:] = 0
    ready = build(SnapshotMcl(k_prime=12), table, ANTENNAS, ROOM, [log_of(known)], N_CYCLES)
    poses, counts = grid_poses(1), np.zeros((2, N_TAGS), int)
    counts[:, 3:6] = 2
    without = kernel_logs(ready, log_of(counts), poses)
    counts[:, 25] = 4
    assert kernel_logs(ready, log_of(counts), poses).tolist() == without.tolist()
