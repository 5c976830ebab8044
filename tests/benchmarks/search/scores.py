"""How often each search is right on a landscape, and the table of it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from tests.benchmarks.search.contenders import N_FIXED, ByRule, Found, certified, exhaustive, random_search, tpe
from tests.benchmarks.search.landscape import Landscape

N_SEEDS = 20
CERTIFIED, EXHAUSTIVE, TPE, RANDOM = "certified search", "exhaustive", "TPE (optuna)", "random search"


@dataclass(frozen=True)
class Score:
    """A search on a landscape over many seeds.

    Parameters
    ----------
    landscape, contender, rule : what was searched, by whom and by which rule; "" where there is only one.
    n_seeds : seeds.
    median_runs : runs used, the median over seeds.
    right : share of seeds with a right answer.
    below_hold, below_fail : share of seeds that returned a design below p0, and at or below p1.
    none : share of seeds that returned nothing.
    exhaustive_runs : runs of the exhaustive search.
    """

    landscape: str
    contender: str
    rule: str
    n_seeds: int
    median_runs: float
    right: float
    below_hold: float
    below_fail: float
    none: float
    exhaustive_runs: int


def scores(landscape: Landscape, n_seeds: int = N_SEEDS) -> dict[str, Score]:
    """Each contender's score, with the rule that served it best; TPE and random get the runs that ours used."""
    ours = [certified(landscape, seed) for seed in range(n_seeds)]
    budgets = [found.n_runs for found in ours]
    return {
        CERTIFIED: score(landscape, CERTIFIED, "", ours),
        EXHAUSTIVE: _best(landscape, EXHAUSTIVE, [exhaustive(landscape, seed) for seed in range(n_seeds)]),
        TPE: _best(landscape, TPE, _within(tpe, landscape, budgets)),
        RANDOM: _best(landscape, RANDOM, _within(random_search, landscape, budgets)),
    }


def score(landscape: Landscape, contender: str, rule: str, found: list[Found]) -> Score:
    """Count what was found, one for each seed."""
    returned = [one.design for one in found if one.design is not None]
    p, right, plan = landscape.pass_probability[returned], landscape.right[returned], landscape.plan
    share = lambda flags: float(np.count_nonzero(flags)) / len(found)  # noqa: E731
    return Score(
        landscape.name, contender, rule, len(found),
        median_runs=float(np.median([one.n_runs for one in found])),
        right=share(right),
        below_hold=share(p < plan.hold_probability),
        below_fail=share(p <= plan.fail_probability),
        none=1.0 - len(returned) / len(found),
        exhaustive_runs=N_FIXED * len(landscape.designs),
    )  # fmt: skip


def table(rows: Iterable[Score]) -> str:
    """Scores as a markdown table."""
    lines = [
        "| landscape | search | rule | runs (median) | of exhaustive | right | below p0 | at or below p1 | none |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        share = f"{100 * row.median_runs / row.exhaustive_runs:.3g} %"
        rates = " | ".join(f"{100 * rate:.4g} %" for rate in (row.right, row.below_hold, row.below_fail, row.none))
        cells = f"{row.landscape} | {row.contender} | {row.rule} | {row.median_runs:,.0f} | {share} | {rates}"
        lines.append(f"| {cells} |")
    return "\n".join(lines)


def _within(search: Callable[[Landscape, int, int], ByRule], landscape: Landscape, budgets: list[int]) -> list[ByRule]:
    return [search(landscape, seed, budget) for seed, budget in enumerate(budgets)]


def _best(landscape: Landscape, contender: str, found: list[ByRule]) -> Score:
    """The score of the rule that was right most often; of equals the one that returned fewest designs below p0."""
    each = [score(landscape, contender, rule, [one[rule] for one in found]) for rule in found[0]]
    return max(each, key=lambda one: (one.right, -one.below_hold))
