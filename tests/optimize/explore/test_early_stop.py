"""Early stopping: it ends what is clearly worse and never what is best."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.optimize.explore.early_stop import Standing, is_beaten, is_worse, rival_of


def standing(values, exact=(0.0,)):
    return Standing(np.array(exact, float), np.array(values, float).reshape(len(values), -1))


@given(
    st.lists(st.integers(0, 5), min_size=1, max_size=8),
    st.lists(st.floats(-100, 100, width=32), min_size=1, max_size=20),
    st.lists(st.integers(0, 3), min_size=8, max_size=8),
)
@settings(deadline=None)
def test_the_best_of_a_table_without_noise_is_never_stopped(qualities, routes, costs):
    # Without noise a design's quality is the same on every run; a run may be hard, then it is so for all.
    table = [
        standing([quality + route for route in routes], (cost,))
        for quality, cost in zip(qualities, costs, strict=False)
    ]
    best = min(range(len(table)), key=lambda i: qualities[i])
    others = [other for i, other in enumerate(table) if i != best]
    assert not is_beaten(table[best], others, 0.5)


def test_what_is_worse_on_every_run_is_stopped_and_what_is_cheaper_is_not():
    runs = np.random.Generator(np.random.PCG64(1)).normal(10, 5, 8)
    good, bad = standing(runs, (5.0,)), standing(runs + 0.1, (5.0,))
    assert is_beaten(bad, [good], 0.01)
    assert not is_beaten(standing(runs + 0.1, (4.9,)), [good], 0.01)
    assert not is_beaten(bad, [], 0.01)


def test_being_worse_in_one_of_two_sampled_values_is_not_enough():
    runs = np.random.Generator(np.random.PCG64(2)).normal(10, 5, (8, 2))
    assert not is_beaten(standing(runs + np.array([1.0, -1.0])), [standing(runs)], 0.01)
    assert is_beaten(standing(runs + np.array([1.0, 1.0])), [standing(runs)], 0.01)


def test_rival_has_as_many_runs_and_asks_for_no_more():
    ours = standing([5.0, 5.0], (3.0,))
    short, dear = standing([0.0], (1.0,)), standing([0.0, 0.0], (4.0,))
    first, better = standing([4.0, 4.0, 9.0], (3.0,)), standing([1.0, 2.0, 99.0], (2.0,))
    assert rival_of(ours, [short, dear, first, better]) is better
    assert rival_of(ours, [short, dear]) is None


def test_equal_designs_are_stopped_about_as_often_as_the_test_says():
    generator = np.random.Generator(np.random.PCG64(3))
    n_stopped = sum(is_worse(*generator.normal(0, 1, (2, 12)), 0.05) for _ in range(1000))
    assert n_stopped <= 80  # 50 expected; more than 72 happens once in a thousand times
    assert n_stopped >= 25


def test_runs_that_are_all_equal_tell_nothing():
    assert not is_worse(np.full(16, 8.0), np.full(16, 8.0), 0.5)
