"""Certified search against exhaustive, TPE and random search: counts of runs, thus the same on every machine."""

import numpy as np
import pytest

from tests.benchmarks.search.contenders import N_FIXED, RANDOM_RUNS, certified
from tests.benchmarks.search.landscape import FLEETS, LISTS, landscapes
from tests.benchmarks.search.scores import CERTIFIED, EXHAUSTIVE, N_SEEDS, RANDOM, TPE, score, scores

# Of these, the comparison with others takes the first twenty.
N_SEEDS_OF_OURS = 60
N_DESIGNS = 3000
RUNS_BAR = 0.01


@pytest.fixture(scope="module")
def known():
    return {(which, n): one for which in LISTS for n, one in zip(FLEETS, landscapes(which), strict=True)}


@pytest.mark.parametrize("which", LISTS)
def test_landscapes_have_what_makes_a_search_hard(known, which):
    """Hundreds of designs are cheaper than any right answer, some share a price, and pitch is not monotone: in twenty
    series some denser floor fails more often.
    """
    for n_robots in FLEETS:
        landscape = known[which, n_robots]
        assert len(landscape.designs) == N_DESIGNS
        assert 500 < np.unique(landscape.cost_cents).size < N_DESIGNS / 3
        assert np.count_nonzero(landscape.cost_cents < landscape.cost_cents[landscape.right].min()) > 500
    series = {}
    for (layout, antenna, pattern, density), p in zip(landscape.designs, landscape.pass_probability, strict=True):
        series.setdefault((layout, antenna, pattern), []).append((density, p))
    falls = [np.diff([p for _, p in sorted(one)]).min() for one in series.values()]
    assert sum(fall < -0.1 for fall in falls) >= 20


@pytest.fixture(scope="module")
def compared(known, rows):
    """Scores on the evenly spaced list, by fleet."""
    found = {n_robots: scores(known["even", n_robots]) for n_robots in FLEETS}
    rows.extend(score for by_contender in found.values() for score in by_contender.values())
    return found


@pytest.mark.parametrize("n_robots", FLEETS)
def test_certified_search_is_right_more_often_than_others_with_as_many_runs(compared, n_robots):
    found = compared[n_robots]
    ours = found[CERTIFIED]
    assert ours.n_seeds == N_SEEDS
    for other in (TPE, RANDOM):
        # Equal budgets: never more runs than ours, and less by no more than a design's worth.
        assert ours.median_runs - max(RANDOM_RUNS) < found[other].median_runs <= ours.median_runs
        assert ours.right >= found[other].right + 0.2


@pytest.mark.parametrize("n_robots", FLEETS)
def test_certified_search_takes_a_hundredth_of_the_runs_of_exhaustive(compared, n_robots):
    found = compared[n_robots]
    assert found[EXHAUSTIVE].median_runs == N_FIXED * N_DESIGNS
    assert found[CERTIFIED].median_runs <= RUNS_BAR * N_FIXED * N_DESIGNS


@pytest.mark.parametrize("which", LISTS)
def test_certified_search_is_right(known, rows, which):
    """Over the fleets of a list; where the cheapest design that holds lies at p0, one alone may err at alpha_refute."""
    found = []
    for n_robots in FLEETS:
        landscape = known[which, n_robots]
        ours = [certified(landscape, seed) for seed in range(N_SEEDS_OF_OURS)]
        found.append(score(landscape, f"{CERTIFIED}, {N_SEEDS_OF_OURS} seeds", "", ours))
        assert found[-1].right >= 1 - landscape.plan.alpha_refute - landscape.plan.alpha_certify
        assert found[-1].below_fail <= landscape.plan.alpha_certify
    rows.extend(found)
    assert np.mean([one.right for one in found]) >= 0.97
