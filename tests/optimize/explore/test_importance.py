"""Importance and interactions: they find what was put in and nothing where there is nothing."""

import importlib.util

import numpy as np
import pytest
from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

from rfiddesign.optimize.explore import EVALUATORS, check_evaluator, importance, interactions

SEARCHED = {
    "kind": CategoricalDistribution(("bar", "ring")),
    "readers": IntDistribution(1, 8),
    "spacing_mm": FloatDistribution(50.0, 100.0),
    "radius_mm": FloatDistribution(100.0, 250.0),
}
HAS_FOREST = importlib.util.find_spec("sklearn") is not None


def drawn(n, seed=1):
    generator = np.random.Generator(np.random.PCG64(seed))
    return [
        {
            "kind": str(generator.choice(["bar", "ring"])),
            "readers": int(generator.integers(1, 9)),
            "spacing_mm": float(generator.uniform(50, 100)),
            "radius_mm": float(generator.uniform(100, 250)),
        }
        for _ in range(n)
    ]


@pytest.mark.parametrize(
    "evaluator",
    [
        name if needs is None else pytest.param(name, marks=pytest.mark.skipif(not HAS_FOREST, reason="needs sklearn"))
        for name, (_, needs) in EVALUATORS.items()
    ],
)
def test_the_variable_that_makes_the_score_is_the_most_important(evaluator):
    trials = drawn(300)
    scores = [10.0 / each["readers"] for each in trials]
    found = importance(evaluator, SEARCHED, trials, scores, seed=1)
    assert found.shares[0][0] == "readers"
    assert found.shares[0][1] > 0.8
    assert sum(share for _, share in found.shares) == pytest.approx(1.0)
    assert importance(evaluator, SEARCHED, trials, scores, seed=1) == found


def test_evaluators_that_lack_a_package_are_named(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    check_evaluator("ped_anova")
    with pytest.raises(ValueError, match="'fanova' needs the package 'scikit-learn', which is not installed"):
        importance("fanova", SEARCHED, drawn(5), np.arange(5.0))
    with pytest.raises(ValueError, match="evaluator is 'oracle'"):
        importance("oracle", SEARCHED, drawn(5), np.arange(5.0))


def test_equal_scores_make_nothing_important():
    assert importance("ped_anova", SEARCHED, drawn(20), np.ones(20)).shares[0][1] == 0.0
    with pytest.raises(ValueError, match="must be as many"):
        importance("ped_anova", SEARCHED, drawn(3), [1.0])
    assert importance("ped_anova", SEARCHED, drawn(1), [1.0]).shares[0][1] == 0.0


def test_an_interaction_is_found_where_one_variable_turns_the_other_round():
    trials = drawn(400)
    scores = [each["spacing_mm"] * (1 if each["kind"] == "bar" else -1) for each in trials]
    found = interactions(list(SEARCHED), trials, scores)
    assert {found[0].first, found[0].second} == {"kind", "spacing_mm"}
    assert found[0].share > 0.1
    assert found[1].share < 0.05


def test_variables_that_add_up_and_noise_have_next_to_no_interaction():
    trials = drawn(600, seed=2)
    generator = np.random.Generator(np.random.PCG64(3))
    rank_like = [each["readers"] + 0.16 * each["spacing_mm"] + generator.normal() for each in trials]
    assert max(each.share for each in interactions(list(SEARCHED), trials, rank_like)) < 0.03
    assert max(each.share for each in interactions(list(SEARCHED), trials, generator.normal(size=600))) < 0.03


def test_a_pair_of_balanced_groups_gives_the_textbook_omega_squared():
    # Two variables of two names, five trials each cell; sums of squares by cell means, as in any textbook.
    trials = [{"a": a, "b": b} for a in "xy" for b in "uv" for _ in range(10)]
    generator = np.random.Generator(np.random.PCG64(4))
    scores = generator.permutation(40).astype(float)
    cells = scores.reshape(2, 2, 10)
    grand = scores.mean()
    rows, columns, means = cells.mean(axis=(1, 2)), cells.mean(axis=(0, 2)), cells.mean(axis=2)
    between = 10 * ((means - rows[:, None] - columns[None] + grand) ** 2).sum()
    noise = ((cells - means[..., None]) ** 2).sum() / 36
    expected = max((between - noise) / (((scores - grand) ** 2).sum() + noise), 0.0)
    assert interactions(["a", "b"], trials, scores)[0].share == pytest.approx(expected)


def test_a_variable_counts_where_trials_are_made_of_it():
    trials = drawn(300, seed=5)
    scores = [each["radius_mm"] if each["kind"] == "ring" else 300.0 + each["readers"] for each in trials]
    partly = [
        {name: value for name, value in each.items() if name != "radius_mm" or each["kind"] == "ring"}
        for each in trials
    ]
    shares = dict(importance("ped_anova", SEARCHED, partly, scores).shares)
    assert shares["spacing_mm"] < 0.1 < shares["radius_mm"]
    assert set(shares) == set(SEARCHED)
    pairs = {(each.first, each.second): each.share for each in interactions(list(SEARCHED), partly, scores)}
    # All that have a radius are rings: the two cannot act together.
    assert pairs["kind", "radius_mm"] == 0.0


def test_few_trials_tell_nothing_of_pairs():
    assert interactions(list(SEARCHED), drawn(29), np.arange(29.0)) == []
