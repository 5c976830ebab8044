"""Which variables matter, by optuna's evaluators, and which act together, by two-way analysis of variance.

optuna's evaluators tell one variable's importance at a time. Whether two act together is asked of the same trials: each
variable is cut into a few groups, and of the variance of the score what the pair's cells explain beyond the sum of both
variables is their interaction. It is corrected for the number of cells (omega squared), so that noise alone gives about
0. Trials of a sampler crowd where it found good designs: both are descriptions of what it tried.

References
----------
.. [1] S. Watanabe, A. Bansal, F. Hutter, PED-ANOVA: efficiently quantifying hyperparameter importance in arbitrary
   subspaces, IJCAI 2023.
.. [2] F. Hutter, H. Hoos, K. Leyton-Brown, An efficient approach for assessing hyperparameter importance, ICML 2014.
.. [3] W. L. Hays, Statistics for Psychologists, 1963, chapters 10 and 12 (omega squared).
"""

import importlib.util
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import optuna
from numpy.typing import ArrayLike, NDArray
from optuna.distributions import BaseDistribution
from optuna.exceptions import ExperimentalWarning
from optuna.importance import (
    BaseImportanceEvaluator,
    FanovaImportanceEvaluator,
    MeanDecreaseImpurityImportanceEvaluator,
    PedAnovaImportanceEvaluator,
)
from scipy.stats import rankdata

from rfiddesign.optimize.explore.variables import Value

#: Groups that a range is cut into for interactions, equally full.
N_GROUPS = 3
#: Fewer trials tell nothing of a pair.
MIN_TRIALS = 30

# Evaluator by name, and the package it needs beside optuna.
EVALUATORS: dict[str, tuple[Callable[[int], BaseImportanceEvaluator], str | None]] = {
    "ped_anova": (lambda seed: PedAnovaImportanceEvaluator(), None),
    "fanova": (lambda seed: FanovaImportanceEvaluator(seed=seed), "sklearn"),
    "impurity": (lambda seed: MeanDecreaseImpurityImportanceEvaluator(seed=seed), "sklearn"),
}


@dataclass(frozen=True)
class Importance:
    """Importance of each variable by one evaluator: shares that sum to 1, the largest first."""

    evaluator: str
    shares: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Interaction:
    """Share of the variance of the score that two variables explain together and not one by one."""

    first: str
    second: str
    share: float


def check_evaluator(name: str) -> None:
    """Raise ValueError if there is no such evaluator, or its package is not installed."""
    if name not in EVALUATORS:
        raise ValueError(f"evaluator is {name!r}, must be one of {', '.join(EVALUATORS)}")
    needs = EVALUATORS[name][1]
    if needs is not None and importlib.util.find_spec(needs) is None:
        package = {"sklearn": "scikit-learn"}.get(needs, needs)
        raise ValueError(f"evaluator {name!r} needs the package {package!r}, which is not installed")


def importance(
    evaluator: str, searched: dict[str, BaseDistribution], drawn: Sequence[dict[str, Value]], scores: ArrayLike,
    *, seed: int = 0,
) -> Importance:  # fmt: skip
    """Importance of each searched variable for scores (n,), the lower the better, of trials made of `drawn` (n).

    A variable may be missing from trials that are not made of it. PED-ANOVA takes those that have it; the others take
    only variables that all trials have.

    Raises
    ------
    ValueError : as `check_evaluator`, or where there are not as many scores as trials.
    """
    check_evaluator(evaluator)
    build, _ = EVALUATORS[evaluator]
    scores = np.asarray(scores, float)
    if len(scores) != len(drawn):
        raise ValueError(f"{len(drawn)} trials with {len(scores)} scores, must be as many")
    if not searched or len(scores) < 2 or np.ptp(scores) == 0:
        return Importance(evaluator, tuple((name, 0.0) for name in searched))
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study()
    study.add_trials(
        [
            optuna.trial.create_trial(
                params=dict(each), distributions={name: searched[name] for name in each}, value=float(value)
            )
            for each, value in zip(drawn, scores, strict=True)
        ]
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExperimentalWarning)
        found = optuna.importance.get_param_importances(study, evaluator=build(seed % 2**32))
    return Importance(evaluator, tuple(sorted(found.items(), key=lambda item: (-item[1], item[0]))))


def interactions(names: Sequence[str], drawn: Sequence[dict[str, Value]], scores: ArrayLike) -> list[Interaction]:
    """Interaction of pairs of variables in scores (n,) of trials made of `drawn` (n), the largest first.

    The scores' ranks are analysed, so that a few hopeless trials do not make up all the variance. A pair is told of
    where at least `MIN_TRIALS` trials are made of both.
    """
    scores = np.asarray(scores, float)
    found = []
    for first, second in combinations(names, 2):
        both = [i for i, each in enumerate(drawn) if first in each and second in each]
        if len(both) >= MIN_TRIALS:
            groups = (_grouped([drawn[i][name] for i in both]) for name in (first, second))
            found.append(Interaction(first, second, _interaction_share(*groups, rankdata(scores[both]))))
    return sorted(found, key=lambda each: (-each.share, each.first, each.second))


def _grouped(values: Sequence[Value]) -> NDArray[np.int64]:
    """Group (n,) of each value: its own for names and few numbers, else one of `N_GROUPS` about equally full ones."""
    distinct, which = np.unique(np.array(values), return_inverse=True)
    if isinstance(values[0], str) or len(distinct) <= N_GROUPS:
        return which
    cuts = np.quantile(np.array(values, float), np.arange(1, N_GROUPS) / N_GROUPS)
    return np.searchsorted(np.unique(cuts), np.array(values, float), side="left")


def _interaction_share(first: NDArray[np.int64], second: NDArray[np.int64], values: NDArray[np.float64]) -> float:
    """Omega squared of the interaction: least squares with cells against least squares with both variables alone."""
    n, total = len(values), float(((values - values.mean()) ** 2).sum())
    _, cells = np.unique(np.stack([first, second]), axis=1, return_inverse=True)
    alone = np.concatenate([_indicator(first), _indicator(second)], axis=1)
    left_alone, rank_alone = _left(alone, values)
    left_cells, rank_cells = _left(_indicator(cells.ravel()), values)
    n_free, n_more = n - rank_cells, rank_cells - rank_alone
    if total == 0 or n_free <= 0 or n_more <= 0:
        return 0.0
    noise = left_cells / n_free
    return max(float((left_alone - left_cells - n_more * noise) / (total + noise)), 0.0)


def _indicator(groups: NDArray[np.int64]) -> NDArray[np.float64]:
    return (groups[:, None] == np.unique(groups)).astype(float)


def _left(columns: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[float, int]:
    """Sum of squares that a least-squares fit leaves, and the rank of its columns."""
    fitted, _, rank, _ = np.linalg.lstsq(columns, values, rcond=None)
    return float(((values - columns @ fitted) ** 2).sum()), int(rank)
