"""Naming candidates: what was liked, what is cheaper beside it, and no design twice."""

from dataclasses import replace

import pytest

from rfiddesign.optimize.explore import (
    ExplorePlan,
    Fixed,
    NamingPlan,
    apparent_optimum,
    explore,
    name_candidates,
)
from tests.optimize.explore.conftest import LIMIT, FormulaBench

PLAN = ExplorePlan(LIMIT, 0.95, n_trials=64, n_runs=8, n_pilot=4, seed=5)


@pytest.fixture
def bench():
    return FormulaBench()


@pytest.fixture
def trials(variables, bench):
    return explore(variables, Fixed(), bench, PLAN)


def test_named_are_distinct_buildable_and_as_many_as_asked(trials, variables, bench):
    named = name_candidates(trials, variables, Fixed(), bench, NamingPlan(100))
    assert len(named) == 100
    assert len({each.proposal.key for each in named}) == 100
    for each in named:
        assert bench.fault(each.proposal) is None
        assert each.cost_cents == bench.cost_cents(each.proposal)


def test_the_apparent_optimum_is_named_and_so_are_cheaper_designs_beside_it(trials, variables, bench):
    best = apparent_optimum(trials)
    named = {each.proposal.key: each for each in name_candidates(trials, variables, Fixed(), bench, NamingPlan(60))}
    assert best.proposal.key in named
    beside = [each for each in named.values() if not each.is_tried and each.trial == best.number]
    assert any(each.cost_cents < best.cost_cents for each in beside)
    for each in beside:
        before, after = dict(best.proposal.values), dict(each.proposal.values)
        assert 1 <= sum(before[name] != after[name] for name in before) <= 2


def test_naming_needs_no_run_and_is_the_same_again(trials, variables, bench):
    n_before = bench.n_runs_made
    first = name_candidates(trials, variables, Fixed(), bench, NamingPlan(50))
    assert bench.n_runs_made == n_before
    assert name_candidates(trials, variables, Fixed(), bench, NamingPlan(50)) == first


def test_the_true_optimum_is_nearly_reached_by_what_is_named(trials, variables, bench):
    # Without noise the cheapest design whose error is 10 mm can be computed for every number of readers and kind.
    named = name_candidates(trials, variables, Fixed(), bench, NamingPlan(150))
    holding = [each.cost_cents for each in named if bench.error_mm(each.proposal) * 1.18 <= 10.0]  # 95 % of runs
    least = min(10_000 * n + 1_000 * 30 * (40 * 1.18 / 10 / (1.5 if n > 1 else 1)) ** 2 / n for n in range(1, 9))
    assert min(holding) <= 1.1 * least
    tried = [t.cost_cents for t in trials if t.is_built and bench.error_mm(t.proposal) * 1.18 <= 10.0]
    assert min(holding) <= min(tried)


def test_fewer_are_named_where_there_are_no_more(variables, bench):
    trials = explore(variables, Fixed(), bench, replace(PLAN, n_trials=1, n_runs=1, n_pilot=1))
    named = name_candidates(trials, variables, Fixed(), bench, NamingPlan(10_000))
    assert 1 <= len(named) < 10_000
    assert name_candidates([], variables, Fixed(), bench, NamingPlan(5)) == []


def test_a_plan_out_of_bounds_is_refused():
    for arguments in ({"n_candidates": 0}, {"dearest": 0.5}, {"slack": 0.5}):
        with pytest.raises(ValueError, match=next(iter(arguments))):
            NamingPlan(**arguments)
