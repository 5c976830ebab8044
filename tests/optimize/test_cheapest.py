"""The walk to the cheapest certified design: what it claims, how often it errs, and what alone can move it."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from rfiddesign.optimize import cheapest, walk
from rfiddesign.optimize.certify import TestPlan
from rfiddesign.optimize.cheapest import cheapest_certified, next_best
from rfiddesign.optimize.conclude import CLAIMS
from rfiddesign.optimize.operating_characteristic import operating_characteristic
from rfiddesign.optimize.walk import SearchRules
from tests.optimize.known_outcomes import Table, draw

N_STUDIES = 2000


def studies(cost, pass_probabilities, plan, n_studies=N_STUDIES):
    for seed in range(n_studies):
        yield cheapest_certified(cost, Table(draw(pass_probabilities, seed, plan.max_runs)), plan)


def most_errors_allowed(alpha, n_studies=N_STUDIES):
    """A walk that errs with chance alpha exactly exceeds this many errors once in a thousand such tests."""
    return int(binom.ppf(0.999, n_studies, alpha))


# --- Shown by 5: error rates on spaces with known pass probabilities, each the hardest for one side ---


def test_margin_separates_the_alphas_from_what_the_unsplit_variant_does():
    assert most_errors_allowed(0.025) == 73


def test_designs_below_p1_are_returned_at_most_at_alpha_certify():
    """Hardest: every design sits exactly at p1, so any winner is an error. Unsplit, the same test fails."""
    p1, n_designs = 0.90, 25
    cost, landscape = np.arange(n_designs), np.full(n_designs, p1)
    split = TestPlan(n_designs=n_designs)
    n_some = 1000
    errors = sum(result.winner is not None for result in studies(cost, landscape, split, n_some))
    assert errors <= most_errors_allowed(split.alpha_certify, n_some)
    expected = 1 - (1 - operating_characteristic(split, p1).certified) ** n_designs  # exact: 1.6 %, close to the bound
    assert errors == pytest.approx(n_some * expected, abs=4 * np.sqrt(n_some * expected))

    unsplit = TestPlan(n_designs=n_designs, is_alpha_split=False)
    n_few = 300
    errors = sum(result.winner is not None for result in studies(cost, landscape, unsplit, n_few))
    assert errors > 5 * most_errors_allowed(unsplit.alpha_certify, n_few)


@pytest.mark.parametrize(
    "holding", ["one at p0 below perfect ones", "all at p0", "p0 among designs in the zone, tied prices"]
)
def test_cheaper_designs_that_hold_are_refuted_at_most_at_alpha_refute(holding):
    """Hardest: the cheapest design that holds sits exactly at p0. A lower bound above its price is an error."""
    p0, plan = 0.95, TestPlan(n_designs=12)
    landscape = np.full(12, p0)
    cost, cheapest_holding = np.arange(12), 0
    if holding.startswith("one"):
        landscape[1:] = 1.0
    elif holding.startswith("p0 among"):
        cost, cheapest_holding = np.arange(12) // 3, 3
        landscape[:] = [0.2, 0.85, 0.5, p0, 0.5, 0.8, 0.94, p0, 0.94, 1.0, 0.99, p0]
    wrong_bound = wrong_claim = wrong_winner = 0
    for result in studies(cost, landscape, plan):
        holding_price = cost[cheapest_holding]
        wrong_bound += result.lower_bound is None or cost[result.lower_bound] > holding_price
        wrong_claim += result.claim == "none holds" or (
            result.claim == "cheapest" and cost[result.winner] > holding_price
        )
        wrong_winner += result.winner is not None and landscape[result.winner] <= plan.fail_probability
    expected = N_STUDIES * operating_characteristic(plan, p0).refuted  # exact: 0.9 % of the studies
    assert wrong_bound == pytest.approx(expected, abs=4 * np.sqrt(expected))
    assert wrong_bound <= most_errors_allowed(plan.alpha_refute)
    assert wrong_claim <= wrong_bound
    assert wrong_winner <= most_errors_allowed(plan.alpha_certify)


def test_common_random_numbers_leave_the_error_rates_alone():
    """Run i meets all designs with the same luck, the extreme case: at p1 they all pass or all fail together."""
    plan = TestPlan(n_designs=5)
    errors = 0
    for seed in range(N_STUDIES):
        luck = np.random.Generator(np.random.PCG64(seed)).random(1000)
        rows = luck < np.append(np.full(4, 0.90), 0.95)[:, None]
        result = cheapest_certified(np.arange(5), Table(rows), plan)
        errors += result.winner is not None and result.winner < 4
        errors += result.claim == "none holds"
    assert errors <= most_errors_allowed(plan.alpha_certify + plan.alpha_refute)


def test_a_study_of_thousands_of_designs_consumes_few_runs():
    """Most cheap designs are hopeless, few lie near the limits. At 264 runs for each it would take 836,352."""
    p = np.clip(np.linspace(-15, 15, 3168), 0.0, 0.99)
    result = cheapest_certified(np.arange(3168), Table(draw(p, 1)), TestPlan(n_designs=3168))
    assert result.claim in ("cheapest", "certified, cheaper undecided")
    assert p[result.winner] > 0.90
    assert result.n_runs_used < 0.02 * 836_352


# --- The result is a function of the consumed outcomes and of nothing else ---

SPACES = st.integers(1, 14).flatmap(
    lambda n: st.tuples(
        st.lists(st.integers(0, 5), min_size=n, max_size=n),
        st.lists(st.sampled_from([0.0, 0.5, 0.85, 0.92, 0.95, 0.98, 1.0]), min_size=n, max_size=n),
        st.integers(0, 10_000),
    )
)
SMALL = TestPlan(n_designs=14, max_runs=150)


@settings(max_examples=60, deadline=None)
@given(space=SPACES)
def test_runs_not_consumed_may_be_anything(space):
    cost, p, seed = space
    rows = draw(p, seed, 150)
    result = cheapest_certified(cost, Table(rows), SMALL)
    others = ~rows
    for design, decision in result.decisions.items():
        others[design, : decision.n_runs] = rows[design, : decision.n_runs]
    assert cheapest_certified(cost, Table(others), SMALL) == result


@settings(max_examples=40, deadline=None)
@given(space=SPACES, calls=st.integers(0, 60), portion=st.integers(1, 200), ahead=st.integers(0, 20))
def test_portions_look_ahead_and_interruption_change_nothing(space, calls, portion, ahead):
    cost, p, seed = space
    rows = draw(p, seed, 150)
    undisturbed = cheapest_certified(cost, Table(rows), SMALL)

    class Generous(Table):
        def scores(self, design, n_runs):
            return super().scores(design, n_runs + portion)  # more was computed than asked for

    with suppress(KeyboardInterrupt):
        cheapest_certified(cost, Table(rows, interrupted_after=calls), SMALL)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(walk, "LOOK_AHEAD", ahead)
        resumed = cheapest_certified(cost, Generous(rows), SMALL)
    assert resumed == undisturbed
    assert resumed.order == undisturbed.order


@settings(max_examples=60, deadline=None)
@given(space=SPACES, budget=st.integers(0, 400))
def test_claims_follow_from_the_decisions(space, budget):
    cost, p, seed = space
    result = cheapest_certified(cost, Table(draw(p, seed, 150)), SMALL, rules=SearchRules(run_budget=budget))
    verdicts = {design: decision.verdict for design, decision in result.decisions.items()}
    assert result.n_runs_used <= budget
    assert result.claim in CLAIMS
    if result.lower_bound is None:
        assert set(verdicts.values()) == {"refuted"}
        assert len(verdicts) == len(cost)
        assert result.claim == "none holds"
    else:
        assert verdicts.get(result.lower_bound) != "refuted"
        cheaper = [d for d in range(len(cost)) if cost[d] < cost[result.lower_bound]]
        assert all(verdicts[d] == "refuted" for d in cheaper)
    if result.winner is not None:
        assert [d for d, v in verdicts.items() if v == "certified"] == [result.winner]
        cheaper = {d for d in range(len(cost)) if cost[d] < cost[result.winner]}
        assert set(result.undecided) == {d for d in cheaper if verdicts[d] == "undecided"}
        assert (result.claim == "cheapest") == (not result.undecided) == (result.lower_bound == result.winner)
        assert all(cost[d] <= cost[result.winner] for d in verdicts)


# --- Small worlds whose answer is plain ---


def plain(p, n_runs=400):
    """Runs that pass at a steady rate without chance: p = 0, 0.95 (two failed in 40) or 1."""
    pattern = {0.0: np.zeros(40, bool), 1.0: np.ones(40, bool), 0.925: np.arange(40) % 14 != 13}[p]
    return np.tile(pattern, n_runs // 40)


def test_an_undecided_cheaper_design_downgrades_the_claim():
    rows = np.array([plain(0.0), plain(0.925), plain(0.0), plain(1.0), plain(1.0)])
    plan = TestPlan(n_designs=5, max_runs=200)
    result = cheapest_certified([10, 20, 30, 40, 50], Table(rows), plan)
    assert result.winner == 3
    assert result.claim == "certified, cheaper undecided"
    assert result.undecided == (1,)
    assert result.lower_bound == 1
    assert result.decisions[1].n_runs == 200
    assert result.order == (0, 1, 2, 3)


def test_ties_race_and_the_losers_of_the_winners_price_do_not_weaken_the_claim():
    rows = np.array([plain(0.925), plain(0.0), plain(1.0), plain(0.925)])
    result = cheapest_certified([7, 7, 7, 7], Table(rows), TestPlan(n_designs=4))
    assert result.winner == 2
    assert result.claim == "cheapest"
    assert result.undecided == ()
    assert result.lower_bound == 2
    assert result.decisions[0].n_runs == result.decisions[3].n_runs == cheapest.PILOT_RUNS
    assert result.decisions[1].n_runs == 2


def test_when_every_design_is_refuted_none_holds():
    result = cheapest_certified([3, 1, 2], Table(np.zeros((3, 50), bool)), TestPlan(n_designs=3, max_runs=50))
    assert (result.winner, result.lower_bound, result.claim) == (None, None, "none holds")
    assert result.order == (1, 2, 0)
    assert result.n_runs_used == 6


def test_a_cap_too_small_to_certify_leaves_all_undecided():
    result = cheapest_certified([3, 1], Table(np.ones((2, 50), bool)), TestPlan(n_designs=2, max_runs=20))
    assert (result.winner, result.lower_bound, result.claim) == (None, 1, "none certified")
    assert result.undecided == (1, 0)


def test_a_budget_stops_the_walk_and_keeps_the_lower_bound():
    rows = np.array([plain(0.0), plain(1.0), plain(1.0)])
    result = cheapest_certified([1, 2, 3], Table(rows), TestPlan(n_designs=3), rules=SearchRules(run_budget=12))
    assert (result.winner, result.lower_bound, result.claim) == (None, 1, "stopped by budget")
    assert result.n_runs_used == 12
    assert result.undecided == (1,)


def test_hopeless_designs_are_not_asked_for_a_whole_pilot():
    table = Table(np.zeros((50, 1000), bool))
    cheapest_certified(np.arange(50), table, TestPlan(n_designs=50))
    assert set(table.n_asked.values()) == {2}
    assert table.n_hinted > 50


def test_next_best_goes_on_above_the_price_of_the_winner():
    rows = np.array([plain(p) for p in (0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0)])
    cost, plan = [1, 2, 2, 3, 4, 4, 5], TestPlan(n_designs=7)
    first = cheapest_certified(cost, Table(rows), plan)
    both = next_best(first, cost, Table(rows), plan, count=2)
    assert (first.winner, both.winner, both.runners_up) == (1, 1, (4, 6))
    assert (both.claim, both.lower_bound, both.undecided) == (first.claim, first.lower_bound, first.undecided)
    assert first.runners_up == ()
    assert 3 not in first.decisions
    one_by_one = next_best(next_best(first, cost, Table(rows), plan), cost, Table(rows), plan)
    assert one_by_one == both
    assert next_best(both, cost, Table(rows), plan) == both
    stopped = next_best(first, cost, Table(rows), plan, rules=SearchRules(run_budget=20))
    assert stopped.runners_up == ()
    assert next_best(stopped, cost, Table(rows), plan, count=2).runners_up == (4, 6)


def test_progress_counts_every_design_once():
    seen = []
    rows = np.array([plain(0.0), plain(0.925), plain(0.925), plain(1.0), plain(1.0)])
    result = cheapest_certified(
        [1, 2, 2, 3, 4], Table(rows), TestPlan(n_designs=5, max_runs=200), on_progress=seen.append
    )
    assert seen[0] == cheapest.Progress(n_refuted=1, n_undecided=0, n_racing=0, n_remaining=4, n_runs=2)
    assert max(p.n_racing for p in seen) == 2
    last = seen[-1]
    assert (last.n_refuted, last.n_undecided, last.n_racing, last.n_remaining) == (1, 2, 0, 1)
    assert last.n_runs == result.n_runs_used
    for p in seen:
        assert p.n_refuted + p.n_undecided + p.n_racing + p.n_remaining in (4, 5)


@pytest.mark.parametrize(
    ("cost", "named"),
    [
        ([], "cost_cents"),
        ([1.5, 2.0], "cost_cents"),
        ([[1]], "cost_cents"),
        ([1, -1], "cost_cents"),
        ([1] * 4, "n_designs"),
    ],
)
def test_costs_that_are_not_exact_cents_and_undeclared_designs_are_refused(cost, named):
    with pytest.raises(ValueError, match=named):
        cheapest_certified(cost, Table(np.zeros((4, 10), bool)), TestPlan(n_designs=3))


def test_continuing_needs_a_winner_and_a_count():
    table, plan = Table(np.zeros((1, 50), bool)), TestPlan(n_designs=1)
    none = cheapest_certified([1], table, plan)
    with pytest.raises(ValueError, match="winner"):
        next_best(none, [1], table, plan)
    table = Table(np.ones((1, 200), bool))
    with pytest.raises(ValueError, match="count"):
        next_best(cheapest_certified([1], table, plan), [1], table, plan, count=0)
    with pytest.raises(ValueError, match="run_budget"):
        cheapest_certified([1], table, plan, rules=SearchRules(run_budget=-1))
