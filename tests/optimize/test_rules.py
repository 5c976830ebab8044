"""Tolerance, budgets and assumptions: what they save, what the answer may then claim, and how often it errs."""

import numpy as np
import pytest
from scipy.stats import binom

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.optimize import SearchRules, TestPlan, cheapest_certified, conclude, weaker_designs
from tests.optimize.known_outcomes import Table, draw

PLAN = TestPlan(n_designs=200)
COST = 10_000 + 50 * np.arange(200)


def landscape(n=200):
    """Passes rise with cost: many are refuted late, and none lies where the cap of runs may leave it open."""
    p = np.clip(0.2 + 0.9 * np.arange(n) / n, 0, 0.985)
    return np.where((p > 0.87) & (p < 0.97), 0.87, p)


def test_a_tolerance_saves_runs_and_the_answer_stays_within_it_of_the_bound():
    p, n_runs = landscape(), []
    for tolerance in (0.0, 0.1):
        used = 0
        for seed in range(10):
            rules = SearchRules(cost_tolerance=tolerance)
            found = cheapest_certified(COST, Table(draw(p, seed, 2000)), PLAN, rules=rules)
            assert COST[found.winner] <= (1 + tolerance) * COST[found.lower_bound]
            assert found.claim in ("cheapest", "cheapest within tolerance")
            used += found.n_runs_used
        n_runs.append(used)
    assert n_runs[1] < n_runs[0]


@pytest.mark.parametrize("budget", [60, 300, 1000, 2500])
def test_a_budget_ends_with_an_incumbent_a_bound_and_words_that_claim_no_more(budget):
    p = landscape()
    for seed in range(5):
        rules = SearchRules(run_budget=budget, promise=p)
        found = cheapest_certified(COST, Table(draw(p, seed, 2000)), PLAN, rules=rules)
        assert found.n_runs_used <= budget
        assert COST[found.lower_bound] <= COST[np.argmax(p >= 0.95)]
        if found.winner is None:
            assert found.claim == "stopped by budget"
        else:
            assert p[found.winner] > 0.9
            cheaper_open = [d for d in range(found.winner) if found.decisions.get(d) is None]
            assert found.n_untested == len(cheaper_open)
            assert (found.claim == "cheapest") == (found.lower_bound == found.winner)


def test_a_larger_budget_never_ends_with_a_wider_gap():
    p, rows = landscape(), draw(landscape(), 3, 2000)
    gaps = []
    for budget in (500, 1500, 4000, 20_000):
        found = cheapest_certified(COST, Table(rows), PLAN, rules=SearchRules(run_budget=budget, promise=p))
        gaps.append(np.inf if found.winner is None else COST[found.winner] / COST[found.lower_bound])
    assert gaps == sorted(gaps, reverse=True)
    assert gaps[-1] == 1.0


def test_time_that_is_up_stops_the_search_where_it_stands():
    clock = iter(np.linspace(0, 2, 400))
    rules = SearchRules(time_used=lambda: next(clock), promise=landscape())
    found = cheapest_certified(COST, Table(draw(landscape(), 1, 2000)), PLAN, rules=rules)
    assert found.claim in ("certified, stopped by budget", "stopped by budget")
    assert found.lower_bound != found.winner


# --- Assumptions ---


def designs():
    """Bars of 2, 4 and 6 antennas at one spacing, each within the next, over three densities."""
    bars = [make_layout({"kind": "bar", "n": n, "spacing_mm": 60.0}) for n in (2, 4, 6)]
    patterns = [make_pattern("square", tags_per_m2=density) for density in (4.0, 16.0, 64.0)]
    return [Design(bar, antenna("30x30"), pattern) for bar in bars for pattern in patterns]


def test_what_is_assumed_is_fewer_antennas_and_fewer_tags_of_the_same_kind():
    found = weaker_designs(designs(), ["mcl"] * 9, ["fewer antennas", "fewer tags"], PLAN)
    assert found.than[8] == (0, 1, 2, 3, 4, 5, 6, 7)
    assert found.than[0] == ()
    assert found.than[5] == (0, 1, 2, 3, 4)
    assert weaker_designs(designs(), ["mcl"] * 9, ["fewer tags"], PLAN).than[8] == (6, 7)
    assert weaker_designs(designs(), ["mcl"] * 9, ["fewer antennas"], PLAN).than[8] == (2, 5)
    assert weaker_designs(designs(), [f"filter {i}" for i in range(9)], ["fewer tags"], PLAN) is None
    assert found.refute_threshold == 8 * PLAN.refute_threshold
    with pytest.raises(ValueError, match="assumption is 'more tags'"):
        weaker_designs(designs(), ["mcl"] * 9, ["more tags"], PLAN)


def test_an_antenna_in_another_place_makes_two_layouts_that_say_nothing_of_each_other():
    bars = [make_layout({"kind": "bar", "n": n, "spacing_mm": 60.0}) for n in (2, 3)]
    each = [Design(bar, antenna("30x30"), make_pattern("square", tags_per_m2=4.0)) for bar in bars]
    assert weaker_designs(each, ["mcl"] * 2, ["fewer antennas"], PLAN) is None


def test_designs_ruled_out_by_assumption_are_told_apart_and_spare_their_runs():
    cost = [100, 200, 300, 400, 500, 600, 700, 800, 900]
    p = np.array([0.0, 0.1, 0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.99])
    rows = draw(p, 7, 2000)
    plan = TestPlan(n_designs=9)
    weaker = weaker_designs(designs(), ["mcl"] * 9, ["fewer antennas", "fewer tags"], plan)
    promise = [d.layout.n_readers * d.pattern.tags_per_m2 for d in designs()]
    found = cheapest_certified(cost, Table(rows), plan, rules=SearchRules(weaker=weaker, promise=promise))
    assert found.winner == 8
    assert found.claim == "cheapest"
    assert found.assumed
    assert not found.assumed.keys() & found.decisions.keys()
    for design, stronger in found.assumed.items():
        assert design in weaker.than[stronger]
        assert found.strictly[stronger].verdict == "refuted"
    without = conclude(cost, found.decisions, {}, (0.0, plan.max_runs), found.winner)
    assert without.claim == "certified, stopped by budget"  # what is claimed rests on the assumptions


def test_true_assumptions_rule_out_a_design_that_holds_at_most_at_alpha():
    """Hardest: all designs sit at p0, so that any of them ruled out, by any other, is an error."""
    plan, n_studies = TestPlan(n_designs=9, max_runs=300), 1000
    weaker = weaker_designs(designs(), ["mcl"] * 9, ["fewer antennas", "fewer tags"], plan)
    rules, errors = SearchRules(weaker=weaker), 0
    for seed in range(n_studies):
        found = cheapest_certified(np.arange(9), Table(draw(np.full(9, 0.95), seed, 300)), plan, rules=rules)
        errors += bool(found.assumed)
    assert errors <= binom.ppf(0.999, n_studies, plan.alpha_refute)


@pytest.mark.parametrize("fields", [{"cost_tolerance": -0.1}, {"cost_tolerance": float("nan")}, {"run_budget": -1}])
def test_rules_out_of_bounds_are_refused(fields):
    with pytest.raises(ValueError, match=next(iter(fields))):
        SearchRules(**fields)


def test_rules_for_other_designs_are_refused():
    with pytest.raises(ValueError, match="promise"):
        cheapest_certified([1, 2], Table(np.ones((2, 50), bool)), TestPlan(2), rules=SearchRules(promise=[1.0]))
