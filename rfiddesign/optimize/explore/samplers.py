"""Samplers by name: optuna's, seeded, and told what they can and cannot do."""

import importlib.util
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil, sqrt

import optuna
from optuna.distributions import BaseDistribution, CategoricalDistribution
from optuna.exceptions import ExperimentalWarning
from optuna.samplers import BaseSampler

#: Trials that are drawn at random before a model is made: one in so many, and at least.
_STARTUP_SHARE, _LEAST_STARTUP = 3, 16
_POPULATION_SHARE = 8
_LARGEST_POPULATION = 48


@dataclass(frozen=True)
class SamplerKind:
    """A sampler on offer.

    Parameters
    ----------
    build : makes it from a seed (a whole number below 2^32) and the number of trials.
    takes_many : whether it takes several objectives.
    takes_choices : whether it takes variables with listed values.
    takes_constraints : whether it heeds constraints; for the others they go into the objective as a penalty.
    needs : the package it needs beside optuna.
    """

    build: Callable[[int, int], BaseSampler]
    takes_many: bool = True
    takes_choices: bool = True
    takes_constraints: bool = True
    needs: str | None = None


def _tpe(seed: int, n_trials: int) -> BaseSampler:
    startup = max(_LEAST_STARTUP, n_trials // _STARTUP_SHARE)
    return optuna.samplers.TPESampler(seed=seed, n_startup_trials=startup, gamma=_n_good)


def _n_good(n_trials: int) -> int:
    """How many trials TPE takes for good ones.

    optuna's default of a tenth takes in nearly all designs that hold, the dear ones of the commonest antenna included,
    and slides down from there: with a few it goes on from the cheapest.
    """
    return max(4, ceil(0.4 * sqrt(n_trials)))


def _population(n_trials: int) -> int:
    return min(max(_LEAST_STARTUP, n_trials // _POPULATION_SHARE), _LARGEST_POPULATION)


SAMPLERS: dict[str, SamplerKind] = {
    "tpe": SamplerKind(_tpe),
    "nsga2": SamplerKind(lambda seed, n: optuna.samplers.NSGAIISampler(seed=seed, population_size=_population(n))),
    "nsga3": SamplerKind(lambda seed, n: optuna.samplers.NSGAIIISampler(seed=seed, population_size=_population(n))),
    "cmaes": SamplerKind(
        lambda seed, n: optuna.samplers.CmaEsSampler(seed=seed),
        takes_many=False, takes_choices=False, takes_constraints=False, needs="cmaes",
    ),
    "qmc": SamplerKind(lambda seed, n: optuna.samplers.QMCSampler(seed=seed, scramble=True), takes_constraints=False),
    "random": SamplerKind(lambda seed, n: optuna.samplers.RandomSampler(seed=seed), takes_constraints=False),
}  # fmt: skip


def check_sampler(name: str, searched: dict[str, BaseDistribution], n_objectives: int) -> None:
    """Raise ValueError if a sampler is unknown, lacks its package, or cannot take these variables or objectives."""
    if name not in SAMPLERS:
        raise ValueError(f"sampler is {name!r}, must be one of {', '.join(SAMPLERS)}")
    kind = SAMPLERS[name]
    choices = [key for key, each in searched.items() if isinstance(each, CategoricalDistribution)]
    if choices and not kind.takes_choices:
        raise ValueError(f"sampler {name!r} takes no lists of names, give {', '.join(choices)} one value each")
    if n_objectives > 1 and not kind.takes_many:
        raise ValueError(f"sampler {name!r} takes one objective, found {n_objectives}")
    if kind.needs is not None and importlib.util.find_spec(kind.needs) is None:
        raise ValueError(f"sampler {name!r} needs the package {kind.needs!r}, which is not installed")


@contextmanager
def _quiet() -> Iterator[None]:
    """No warnings of what is known here: experimental parts, constraints not heeded, `gamma` that optuna 6 drops."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExperimentalWarning)
        warnings.filterwarnings("ignore", "Constraints have been set", UserWarning)
        warnings.filterwarnings("ignore", "`gamma`", FutureWarning)
        yield


def new_study(name: str, seed: int, n_trials: int, n_objectives: int) -> optuna.Study:
    """A study in memory that minimises, with the sampler of that name."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    with _quiet():
        # optuna's generators take 32 bits of a seed.
        sampler = SAMPLERS[name].build(seed % 2**32, n_trials)
        return optuna.create_study(directions=["minimize"] * n_objectives, sampler=sampler)


def ask(study: optuna.Study, searched: dict[str, BaseDistribution]) -> optuna.Trial:
    """A new trial with a value for each variable."""
    with _quiet():
        return study.ask(searched)


def tell(study: optuna.Study, trial: optuna.Trial, values: tuple[float, ...], constraints: dict[str, float]) -> None:
    """Tell what a trial was worth. Constraints, kept where at most 0, go with every one: without, it counts as kept."""
    for name, value in constraints.items():
        trial.set_constraint(name, value)
    with _quiet():
        study.tell(trial, list(values))
