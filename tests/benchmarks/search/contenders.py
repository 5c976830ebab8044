"""The searches that are compared: each asks for runs of designs and names one, or none.

Run i of a design is the same for every contender of a seed.  Rules that the others leave to taste (how many runs for
each design, what share of them must pass) are tried over a grid, and the best in hindsight is held against us.
"""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
import optuna
from numpy.typing import NDArray

from rfiddesign.optimize import cheapest_certified
from tests.benchmarks.search.landscape import Landscape

N_FIXED = 264
#: Runs of each design that random search and TPE may make.
RANDOM_RUNS, TPE_RUNS = (8, 16, 32, 64, 128, 264), (64,)
#: Shares of its runs that a design must pass to be returned by one who does not certify.
SHARES = (0.90, 0.92, 0.94, 0.95, 0.96, 0.98, 1.0)


class Runs:
    """Passed and failed runs of a landscape's designs, drawn when first asked for; the protocol `Outcomes`."""

    def __init__(self, landscape: Landscape, seed: int):
        self._landscape, self._seed = landscape, seed
        self._drawn: dict[int, NDArray[np.bool_]] = {}

    def scores(self, design: int, n_runs: int) -> NDArray[np.bool_]:
        """The first runs of a design, True where passed."""
        if design not in self._drawn:
            luck = np.random.default_rng((self._seed, design)).random(self._landscape.plan.max_runs)
            self._drawn[design] = luck < self._landscape.pass_probability[design]
        return self._drawn[design][:n_runs]

    def prefetch(self, requests: list[tuple[int, int]]) -> None:
        """Nothing takes time here."""


@dataclass(frozen=True)
class Found:
    """What a search returned: a design or None, and the runs it used."""

    design: int | None
    n_runs: int


#: What each rule of a contender found, by the rule in words.
ByRule = dict[str, Found]


def certified(landscape: Landscape, seed: int) -> Found:
    """Our search."""
    result = cheapest_certified(landscape.cost_cents, Runs(landscape, seed), landscape.plan)
    return Found(result.winner, result.n_runs_used)


def exhaustive(landscape: Landscape, seed: int) -> ByRule:
    """264 runs of every design; the cheapest that passed enough of them, by each possible number of them."""
    runs, n = Runs(landscape, seed), len(landscape.designs)
    passed = np.array([np.count_nonzero(runs.scores(design, N_FIXED)) for design in range(n)])
    return {
        f"{least} of {N_FIXED}": Found(_cheapest(landscape, passed >= least), n * N_FIXED)
        for least in range(round(0.85 * N_FIXED), N_FIXED + 1)
    }


def random_search(landscape: Landscape, seed: int, budget: int) -> ByRule:
    """As many designs as the budget lasts for, drawn without repetition, each run equally often."""
    found: ByRule = {}
    runs, order = Runs(landscape, seed), np.random.default_rng(seed).permutation(len(landscape.designs))
    for n in RANDOM_RUNS:
        drawn = order[: max(budget // n, 1)]
        share = np.full(len(order), -1.0)
        share[drawn] = [runs.scores(int(design), n).mean() for design in drawn]
        found |= _by_share(landscape, share, n, n * len(drawn))
    return found


def tpe(landscape: Landscape, seed: int, budget: int) -> ByRule:
    """Optuna's TPE on the price, its constraint the share of runs passed; a design asked for again is run further."""
    found: ByRule = {}
    for n in TPE_RUNS:
        share, n_used = _optimized(landscape, seed, budget, n)
        found |= _by_share(landscape, share, n, n_used)
    return found


def _optimized(landscape: Landscape, seed: int, budget: int, n_each: int) -> tuple[NDArray[np.float64], int]:
    """Shares of runs passed, -1 where TPE never asked, and the runs it used."""
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    number = {design: i for i, design in enumerate(landscape.designs)}
    layouts, antennas, patterns = (sorted({design[i] for design in number}) for i in range(3))
    densities = sorted({density for *_, density in number})
    runs, n_runs, n_used = Runs(landscape, seed), defaultdict(int), 0
    share = np.full(len(number), -1.0)
    dearest = float(landscape.cost_cents.max())
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed))
    while n_used + n_each <= budget:
        trial = study.ask()
        chosen = (
            trial.suggest_categorical("layout", layouts),
            trial.suggest_categorical("antenna", antennas),
            trial.suggest_categorical("pattern", patterns),
            densities[trial.suggest_int("density", 0, len(densities) - 1)],
        )
        design = number.get(chosen)
        if design is None:  # cannot be built, which costs no runs
            trial.set_constraint("share passed", 1.0)
            study.tell(trial, dearest)
            continue
        n_runs[design] = min(n_runs[design] + n_each, landscape.plan.max_runs)
        n_used += n_each
        share[design] = runs.scores(design, n_runs[design]).mean()
        trial.set_constraint("share passed", landscape.plan.hold_probability - share[design])
        study.tell(trial, float(landscape.cost_cents[design]))
    return share, n_used


def _by_share(landscape: Landscape, share: NDArray[np.float64], n_each: int, n_used: int) -> ByRule:
    return {f"{least:.0%} of {n_each}": Found(_cheapest(landscape, share >= least), n_used) for least in SHARES}


def _cheapest(landscape: Landscape, is_taken: NDArray[np.bool_]) -> int | None:
    taken = np.flatnonzero(is_taken)
    return int(taken[landscape.cost_cents[taken].argmin()]) if taken.size else None
