"""Fronts: who is on them, where their knee is, and how sure that is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rfiddesign.optimize.pareto import BY_OPTIMA, BY_SUM, knee, layers, membership, non_dominated

# Few values, so that many designs are equal in some objective.
tables = arrays(float, st.tuples(st.integers(0, 30), st.integers(1, 4)), elements=st.integers(0, 4).map(float))


def dominates(ours, theirs):
    return all(a <= b for a, b in zip(ours, theirs, strict=True)) and any(
        a < b for a, b in zip(ours, theirs, strict=True)
    )


@given(tables)
@settings(deadline=None)
def test_front_is_what_no_row_dominates(values):
    expected = [not any(dominates(other, row) for other in values.tolist()) for row in values.tolist()]
    assert non_dominated(values).tolist() == expected


def test_many_rows_are_compared_with_all_others():
    values = np.random.Generator(np.random.PCG64(1)).random((350, 2))
    found = values[non_dominated(values)]
    found = found[found[:, 0].argsort()]
    assert (np.diff(found[:, 1]) < 0).all()
    lowest = np.minimum.accumulate(values[values[:, 0].argsort(), 1])
    assert set(found[:, 1]) == set(lowest)


@given(tables)
@settings(deadline=None)
def test_every_row_of_a_later_layer_is_dominated_by_one_of_the_layer_before(values):
    layer = layers(values)
    assert (layer >= 0).all()
    for row, number in zip(values.tolist(), layer, strict=True):
        before = values[layer == number - 1].tolist()
        assert number == 0 or any(dominates(other, row) for other in before)
        assert not any(dominates(other, row) for other in values[layer == number].tolist())


def test_knee_of_a_hyperbola_is_its_corner():
    # y = 1/x from 1/10 to 10 is symmetric about x = y, where it is farthest from the line through its ends.
    x = np.geomspace(0.1, 10.0, 101)
    found = knee(np.stack([x, 1 / x], axis=1))
    assert (found.index, found.method) == (50, BY_OPTIMA)
    assert found.depth == pytest.approx((1 - 2 * (1 - 0.1) / (10 - 0.1)) / np.sqrt(2))


def test_knee_of_a_spherical_front_of_three_objectives_is_in_its_middle():
    # 1 - an octant of a sphere: convex towards the ideal point (0, 0, 0); each optimum is at an axis.
    angles = np.linspace(0, np.pi / 2, 9)
    points = [(np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)) for a in angles for b in angles]
    values = 1 - np.array([*points, np.ones(3) / np.sqrt(3)])
    values = values[non_dominated(values)]
    found = knee(values)
    assert values[found.index] == pytest.approx(np.full(3, 1 - 1 / np.sqrt(3)))


@given(
    arrays(float, st.tuples(st.integers(1, 20), st.integers(1, 4)), elements=st.floats(0, 1, width=16)),
    st.lists(st.tuples(st.floats(0.1, 10), st.floats(-5, 5)), min_size=4, max_size=4),
)
@settings(deadline=None)
def test_knee_is_on_the_front_and_depends_on_no_unit(values, units):
    values = values[non_dominated(values)]
    found = knee(values)
    assert 0 <= found.index < len(values)
    assert found.depth >= 0
    scale, shift = np.array(units[: values.shape[1]]).T
    other = knee(values * scale + shift)
    # Ties within rounding may fall either way; the depth may not.
    if other.method == found.method:
        assert other.depth == pytest.approx(found.depth, abs=1e-6)


def test_a_member_best_in_two_objectives_leaves_the_sum():
    values = np.array([[0.0, 0.0, 1.0], [1.0, 0.9, 0.0], [0.1, 0.3, 0.1]])
    found = knee(values)
    assert (found.index, found.method) == (2, BY_SUM)


def test_knee_of_nothing_is_refused_and_that_of_one_is_itself():
    with pytest.raises(ValueError, match="values has no row"):
        knee(np.empty((0, 2)))
    assert knee([[3.0, 4.0]]).index == 0


def test_a_value_that_is_no_number_is_refused():
    with pytest.raises(ValueError, match="without nan"):
        non_dominated([[np.nan, 1.0]])


def test_membership_is_certain_without_noise_and_shared_between_equals_with_it():
    exact = np.array([[1.0], [2.0], [3.0]])
    quiet = np.array([[[3.0]] * 8, [[2.0]] * 8, [[2.5]] * 8])
    assert membership(exact, quiet, seed=1, n_draws=50).tolist() == [1.0, 1.0, 0.0]
    generator = np.random.Generator(np.random.PCG64(2))
    noisy = np.concatenate([np.zeros((1, 400, 1)), generator.standard_normal((1, 400, 1))])
    noisy[1] -= noisy[1].mean()
    # The second costs more and is on the front only where its redrawn mean is below that of the first: half the time.
    chance = membership(exact[:2], noisy, seed=3, n_draws=2000)
    assert chance[0] == 1.0
    assert chance[1] == pytest.approx(0.5, abs=0.05)


def test_runs_are_redrawn_together():
    # The second design is worse on every single run, however much runs differ: paired draws must see that.
    runs = np.random.Generator(np.random.PCG64(4)).normal(100.0, 50.0, (1, 30, 1))
    assert membership(np.zeros((2, 0)), np.concatenate([runs, runs + 0.1]), seed=5).tolist() == [1.0, 0.0]


def test_membership_refuses_shapes_that_do_not_fit():
    with pytest.raises(ValueError, match="must be"):
        membership(np.zeros((2, 1)), np.zeros((3, 4, 1)), seed=0)
