"""The front of an exploration: chosen on its runs, measured on fresh ones."""

from dataclasses import replace

import numpy as np
import pytest

from rfiddesign.optimize.explore import (
    FIRST_FRONT_RUN,
    FIRST_RUN,
    ExplorePlan,
    Fixed,
    Objectives,
    choose,
    explore,
    measure_front,
)
from rfiddesign.optimize.explore.explorer import MAX_TRIALS
from tests.optimize.explore.conftest import LIMIT, FormulaBench, run_with

TWO = Objectives(("cost", "position_p95_mm"), 60.0)
PLAN = ExplorePlan(LIMIT, 0.95, n_trials=64, n_runs=6, n_pilot=6, seed=5, objectives=TWO, slack=4.0)


@pytest.fixture
def trials(variables):
    return explore(variables, Fixed(), FormulaBench(), PLAN)


def error_of(trial):
    return np.mean([run.position_p95_mm for run in trial.runs])


def test_what_is_chosen_is_the_front_and_within_the_slack(trials):
    chosen = choose(trials, PLAN, 1000)
    eligible = [t for t in trials if t.is_built and not t.is_stopped and t.score <= 4.0]
    assert {t.proposal.key for t in chosen} == {t.proposal.key for t in eligible}
    few = choose(trials, PLAN, 5)
    assert len(few) == 5
    for trial in few:
        assert not any(other.cost_cents < trial.cost_cents and error_of(other) < error_of(trial) for other in eligible)
    assert min(t.cost_cents for t in eligible) == min(t.cost_cents for t in few)
    assert min(error_of(t) for t in eligible) == min(error_of(t) for t in few)


def test_a_measured_front_has_errors_chances_and_a_knee_on_it(trials):
    generator = np.random.Generator(np.random.PCG64(1))
    noise = generator.normal(0, 0.1, 200)
    bench = FormulaBench()
    chosen = choose(trials, PLAN, 12)
    front = measure_front(
        chosen, PLAN, lambda trial: [run_with(bench.error_mm(trial.proposal) * float(np.exp(x))) for x in noise]
    )
    assert [m.trial.cost_cents for m in front.members] == sorted(t.cost_cents for t in chosen)
    for member in front.members:
        assert member.values[0] == member.trial.cost_cents / 100
        assert member.values[1] == pytest.approx(bench.error_mm(member.trial.proposal), rel=0.05)
        assert member.stderr[0] == 0.0
        assert member.stderr[1] == pytest.approx(0.1 * member.values[1] / np.sqrt(200), rel=0.2)
        # All runs are equally hard for all: redrawing them changes no order.
        assert member.chance == float(member.is_on)
    assert front.members[front.knee.index].is_on


def test_a_fast_design_stays_beside_a_cheap_one(variables):
    objectives = Objectives(("speed_mm_per_s", "cost", "convergence_s"), 60.0)
    plan = replace(PLAN, objectives=objectives, speed_mm_per_s=300.0)
    trials = explore(variables, Fixed(), FormulaBench(), plan)
    front = measure_front(trials[:2], plan, lambda trial: [run_with(1.0, 2.0), run_with(1.0, 4.0)])
    assert front.names == ("speed_mm_per_s", "cost", "convergence_s")
    for member in front.members:
        assert member.values.tolist() == [300.0, member.trial.cost_cents / 100, 3.0]
        assert member.stderr.tolist() == [0.0, 0.0, 1.0]


def test_fronts_have_runs_of_their_own():
    assert FIRST_RUN + MAX_TRIALS < FIRST_FRONT_RUN < FIRST_FRONT_RUN + MAX_TRIALS < 2**63


def test_nothing_and_unequal_runs_are_refused(trials):
    assert choose([], PLAN, 5) == []
    with pytest.raises(ValueError, match="no trial"):
        measure_front([], PLAN, lambda trial: trial.runs)
    with pytest.raises(ValueError, match="must be equal"):
        measure_front(trials[:2], PLAN, lambda trial: [run_with(1.0)] * (1 + trial.number))
