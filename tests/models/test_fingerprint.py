"""A learned field is the weighted mean that eq. 5 writes, and its table is the field to a fraction of a percent."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.models._fingerprint_table_kernels import TAG_BITS, UNTRAINED
from rfiddesign.models.fingerprint import FingerprintField, Smoothing
from rfiddesign.models.fingerprint_table import TableGrid, level_chances, tabulate
from rfiddesign.models.snapshots import Snapshots


def some_snapshots(seed, n=60, n_tags=25, n_cycles=4, side_mm=4000.0):
    rng = np.random.default_rng(seed)
    poses = np.column_stack([rng.random((n, 2)) * side_mm, rng.uniform(-math.pi, math.pi, n)])
    counts = rng.binomial(n_cycles, rng.random((n, n_tags)) * (rng.random((n, n_tags)) < 0.3))
    return Snapshots.of_counts(counts, poses, n_cycles)


def by_hand(snapshots, smoothing, poses):
    """Eq. 5, snapshot by snapshot and tag by tag."""
    estimates, counts = smoothing.prior.estimates(snapshots.n_cycles), snapshots.dense()
    chances, support = [], []
    for pose in poses:
        way = np.hypot(*(snapshots.poses[:, :2] - pose[:2]).T) / smoothing.sigma_mm
        turn = (snapshots.poses[:, 2] - pose[2] + math.pi) % (2 * math.pi) - math.pi
        d2 = way**2 + (turn / smoothing.sigma_rad) ** 2
        alpha = np.where(d2 <= smoothing.reach**2, np.exp(-d2 / 2), 0.0)
        support.append(alpha.sum())
        mean = alpha @ estimates[counts] + smoothing.beta * smoothing.prior.mean
        chances.append(mean / (alpha.sum() + smoothing.beta))
    return np.array(chances), np.array(support)


@settings(max_examples=30)
@given(
    seed=st.integers(0, 10**6),
    sigma_mm=st.floats(50, 3000),
    sigma_rad=st.floats(0.05, 10),
    beta=st.floats(1e-3, 5),
    reach=st.floats(0.5, 4),
)
def test_the_field_is_the_weighted_mean_of_the_papers_equation_5(seed, sigma_mm, sigma_rad, beta, reach):
    snapshots = some_snapshots(seed)
    smoothing = Smoothing(sigma_mm, sigma_rad, beta, reach)
    poses = np.random.default_rng(seed + 1).uniform([-500, -500, -9], [4500, 4500, 9], (12, 3))
    learned = FingerprintField([snapshots], smoothing)
    chances, support = learned.with_support(poses)
    expected, expected_support = by_hand(snapshots, smoothing, poses)
    assert chances == pytest.approx(expected, abs=2e-6)
    assert support == pytest.approx(expected_support, rel=1e-5, abs=1e-5)


def test_far_from_all_training_every_tag_has_the_priors_chance():
    learned = FingerprintField([some_snapshots(1)])
    chances, support = learned.with_support(np.array([[1e5, 1e5, 0.0]]))
    assert support == 0
    assert chances == pytest.approx(learned.smoothing.prior.mean, rel=1e-6)


def test_orientation_counts():
    """A snapshot taken the other way round says nothing; one taken nearby with the same heading does."""
    one = Snapshots.of_counts(np.array([[4, 0]]), np.array([[0.0, 0.0, 0.0]]), 4)
    learned = FingerprintField([one])
    same, turned = learned.read_probability(np.array([[0.0, 0.0, 0.1], [0.0, 0.0, math.pi]]))
    assert same[0] > 0.6 > 0.2 > same[1]
    assert turned == pytest.approx(learned.smoothing.prior.mean, rel=1e-6)


def test_the_order_of_training_does_not_matter():
    first, second = some_snapshots(3), some_snapshots(4)
    poses = some_snapshots(5).poses
    there, back = FingerprintField([first, second]), FingerprintField([second, first])
    assert there.read_probability(poses) == pytest.approx(back.read_probability(poses), rel=1e-6)


def test_seven_thousand_snapshots_of_400_tags_take_less_than_200_mb():
    rng = np.random.default_rng(0)
    counts = rng.random((7000, 400)) < 0.1
    poses = np.column_stack([rng.random((7000, 2)) * 9e3, rng.uniform(-3, 3, 7000)])
    learned = FingerprintField([Snapshots.of_counts(counts.astype(np.int16), poses, 2)])
    # Above 280,000 reads, which no map could leave out.
    assert 280_000 < learned.n_bytes < 200e6
    assert learned.n_bytes < 5e6


def test_no_snapshots_are_refused():
    with pytest.raises(ValueError, match="has no snapshots"):
        FingerprintField([])


def test_a_table_holds_the_field_of_every_row_that_has_support():
    """Of each row: every tag's chance within 0.3 %, tags by falling chance, and no row without support."""
    learned = FingerprintField([some_snapshots(7)])
    where, grid = shapely.box(0, 0, 4000, 3000).difference(shapely.box(1000, 1000, 2000, 2000)), TableGrid(250.0, 12)
    table = tabulate(learned, where, grid)
    chances, n_checked = level_chances(), 0
    n_y, n_x = table.cell_row.shape
    for line in range(n_y):
        for column in range(n_x):
            centre = (column + 0.5) * 250.0, (line + 0.5) * 250.0
            cell = table.cell_row[line, column]
            assert (cell >= 0) == shapely.contains_xy(where, *centre)
            if cell < 0:
                continue
            for k in range(grid.n_headings):
                row = cell * grid.n_headings + k
                expected, support = learned.with_support([[*centre, 2 * math.pi * k / grid.n_headings]])
                assert (table.bases[row] == UNTRAINED) == (support[0] < grid.least_support)
                if table.bases[row] == UNTRAINED:
                    assert table.start[row] == table.start[row + 1]
                    continue
                entries = table.entries[table.start[row] : table.start[row + 1]]
                levels, tags = entries >> TAG_BITS, entries & ((1 << TAG_BITS) - 1)
                found = np.full(learned.n_tags, chances[table.bases[row]])
                found[tags] = chances[levels]
                assert found == pytest.approx(expected[0], rel=3e-3)
                assert (np.diff(levels.astype(int)) <= 0).all()
                same = np.diff(levels.astype(int)) == 0
                assert (np.diff(tags.astype(int))[same] > 0).all()
                n_checked += 1
    assert n_checked > 300


def test_a_table_too_fine_is_refused():
    with pytest.raises(ValueError, match=r"cell_mm = 5 makes .* rows, must be 20,000,000 at most"):
        tabulate(FingerprintField([some_snapshots(1)]), shapely.box(0, 0, 1e5, 1e5), TableGrid(5.0))
