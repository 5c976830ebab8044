"""Exploring: the same trials whatever happens, constraints on every path, and better than chance."""

import importlib.util
from dataclasses import replace

import numpy as np
import optuna
import pytest

from rfiddesign.optimize.explore import (
    FIRST_RUN,
    SAMPLERS,
    Choice,
    ExplorePlan,
    Fixed,
    Objectives,
    Range,
    Variables,
    apparent_optimum,
    explore,
    explorer,
)
from tests.optimize.explore.conftest import LIMIT, FormulaBench

PLAN = ExplorePlan(LIMIT, 0.95, n_trials=40, n_runs=8, n_pilot=4, seed=3)
FRONT = Objectives(("cost", "position_p95_mm"), 60.0)
USABLE = [name for name in SAMPLERS if name != "cmaes"]


def told(trials):
    return [(trial.drawn, trial.proposal.key, trial.cost_cents, trial.score, trial.is_stopped) for trial in trials]


@pytest.mark.parametrize("sampler", USABLE)
def test_the_same_seed_gives_the_same_trials_and_another_others(variables, sampler):
    plan = replace(PLAN, sampler=sampler)
    first = told(explore(variables, Fixed(), FormulaBench(), plan))
    assert told(explore(variables, Fixed(), FormulaBench(), plan)) == first
    assert told(explore(variables, Fixed(), FormulaBench(), replace(plan, seed=4))) != first


@pytest.mark.parametrize("sampler", USABLE)
@pytest.mark.parametrize("objectives", [None, FRONT])
def test_an_interrupted_exploration_goes_on_as_if_it_had_not_been(variables, sampler, objectives):
    plan = replace(PLAN, sampler=sampler, objectives=objectives)
    whole = FormulaBench()
    expected = told(explore(variables, Fixed(), whole, plan))
    bench = FormulaBench(interrupted_after=whole.n_runs_made // 2)
    with pytest.raises(KeyboardInterrupt):
        explore(variables, Fixed(), bench, plan)
    n_before = bench.n_runs_made
    bench.interrupted_after = np.inf
    assert told(explore(variables, Fixed(), bench, plan)) == expected
    assert n_before < bench.n_runs_made == whole.n_runs_made


@pytest.mark.parametrize("objectives", [None, FRONT])
def test_every_trial_has_its_constraints(variables, objectives, monkeypatch):
    studies = []
    made = explorer.new_study
    monkeypatch.setattr(explorer, "new_study", lambda *args: studies.append(made(*args)) or studies[-1])
    # Spacings of 30 mm overlap and long bars stick out: some proposals cannot be built.
    tight = Variables(tuple(Range("spacing_mm", 30.0, 200.0) if v.name == "spacing_mm" else v for v in variables.all))
    trials = explore(tight, Fixed(), FormulaBench(), replace(PLAN, objectives=objectives))
    kept = studies[0].trials
    assert [trial.state for trial in kept] == [optuna.trial.TrialState.COMPLETE] * len(trials)
    assert {trial.is_built for trial in trials} == {True, False}
    for trial, frozen in zip(trials, kept, strict=True):
        assert set(frozen.constraints) == {"buildable", "limits"}
        assert (frozen.constraints["buildable"] <= 0) == trial.is_built
        is_promising = trial.is_built and trial.score <= (1.0 if objectives is None else PLAN.slack)
        assert all(value <= 0 for value in frozen.constraints.values()) == is_promising
        assert bool(trial.runs) == trial.is_built


def test_a_stopped_trial_has_fewer_runs_and_a_rival_that_asks_for_no_more(variables):
    trials = explore(variables, Fixed(), FormulaBench(noise=0.02), replace(PLAN, n_runs=16, n_pilot=8))
    stopped = [trial for trial in trials if trial.is_stopped]
    assert stopped
    for trial in stopped:
        assert len(trial.runs) == 8
        rivals = [other for other in trials[: trial.number] if other.is_built and not other.is_stopped]
        assert any(
            other.cost_cents <= trial.cost_cents
            and all(a.position_p95_mm < b.position_p95_mm for a, b in zip(other.runs, trial.runs, strict=False))
            for other in rivals
        )
    assert all(len(trial.runs) == 16 for trial in trials if trial.is_built and not trial.is_stopped)


def test_tpe_finds_cheaper_designs_than_chance_does(variables):
    plan = replace(PLAN, n_trials=64)
    best = {"tpe": [], "random": []}
    for seed in range(3):
        for sampler, found in best.items():
            trials = explore(variables, Fixed(), FormulaBench(), replace(plan, sampler=sampler, seed=seed))
            found.append(apparent_optimum(trials).cost_cents)
    assert np.median(best["tpe"]) < np.median(best["random"])


def test_exploring_ends_between_batches_when_told_so(variables):
    seen = []
    trials = explore(
        variables, Fixed(), FormulaBench(), PLAN, is_over=lambda: len(seen) == 2, on_batch=lambda found: seen.append(1)
    )
    assert len(trials) == 2 * PLAN.batch
    assert told(trials) == told(explore(variables, Fixed(), FormulaBench(), PLAN))[: len(trials)]


@pytest.mark.parametrize("sampler", ["nsga2", "nsga3", "tpe", "qmc"])
def test_a_front_of_four_objectives_is_explored(variables, sampler):
    four = Objectives(("cost", "position_p95_mm", "speed_mm_per_s", "convergence_s"), 60.0)
    fast = Variables((*variables.all, Range("speed_mm_per_s", 100.0, 500.0, 50.0)))
    trials = explore(fast, Fixed(), FormulaBench(), replace(PLAN, sampler=sampler, objectives=four))
    assert len(trials) == PLAN.n_trials
    assert {trial.proposal.speed_mm_per_s % 50 for trial in trials} == {0.0}


NUMBERS = Variables(
    (
        Choice("kind", ("bar",)), Choice("antenna", ("60x60",)), Choice("pattern", ("square",)),
        Range("tags_per_m2", 4.0, 400.0, is_log=True), Range("readers", 2, 8), Range("spacing_mm", 60.0, 200.0),
    )
)  # fmt: skip


def test_cmaes_explores_numbers_and_replays():
    plan = replace(PLAN, sampler="cmaes")
    first = told(explore(NUMBERS, Fixed(), FormulaBench(), plan))
    assert told(explore(NUMBERS, Fixed(), FormulaBench(), plan)) == first


def test_cmaes_says_what_it_lacks(monkeypatch, variables):
    plan = replace(PLAN, sampler="cmaes")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ValueError, match="needs the package 'cmaes', which is not installed"):
        explore(NUMBERS, Fixed(), FormulaBench(), plan)
    with pytest.raises(ValueError, match="takes no lists of names, give kind, pattern one value each"):
        explore(variables, Fixed(), FormulaBench(), plan)
    with pytest.raises(ValueError, match="takes one objective, found 2"):
        explore(NUMBERS, Fixed(), FormulaBench(), replace(plan, objectives=FRONT))


def test_nothing_to_explore_and_an_unknown_sampler_are_refused(variables):
    lone = Variables(
        tuple(Choice(v.name, v.values[:1]) if isinstance(v, Choice) else replace(v, high=v.low) for v in variables.all)
    )
    with pytest.raises(ValueError, match="there is nothing to explore"):
        explore(lone, Fixed(), FormulaBench(), PLAN)
    with pytest.raises(ValueError, match="sampler is 'oracle', must be one of tpe"):
        explore(variables, Fixed(), FormulaBench(), replace(PLAN, sampler="oracle"))


def test_numbers_of_exploring_runs_are_out_of_reach_of_a_certification():
    from rfiddesign.evaluate import MAX_RUNS
    from rfiddesign.optimize.certify import MAX_RUNS_ALLOWED

    assert max(MAX_RUNS, MAX_RUNS_ALLOWED) < FIRST_RUN < FIRST_RUN + explorer.MAX_TRIALS < 2**63
