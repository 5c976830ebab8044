"""What an exploration may vary: named variables, each with the values that can be made.

A range has a step, the finest difference that a workshop or an installer keeps (1 mm, 1 tag/m2), so that even a space
of "continuous" variables has a number of designs that one can state. The space is flat: every variable has a value in
every trial, and a layout uses those of its kind; the others are left out of the proposal.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution

Value = str | int | float

#: What each kind of layout is made of, beside what every design has.
KIND_VARIABLES: dict[str, tuple[str, ...]] = {
    "cross": ("readers_per_arm", "first_mm", "spacing_mm"),
    "bar": ("readers", "spacing_mm"),
    "ring": ("readers", "radius_mm"),
    "single": (),
}
NEEDED = ("kind", "antenna", "pattern", "tags_per_m2")
OPTIONAL = ("antenna_height_mm", "estimator", "n_particles", "speed_mm_per_s")
CHOICES = ("kind", "antenna", "pattern", "estimator")
#: Estimators that have a number of particles; it is left out of proposals with others.
WITH_PARTICLES = ("mcl", "particle_filter")
COUNTS = ("readers_per_arm", "readers", "n_particles")
MEASURES = ("tags_per_m2", "first_mm", "spacing_mm", "radius_mm", "antenna_height_mm", "speed_mm_per_s")
_SUMMED = ("kind", "estimator")
MAX_VALUES = 1_000_000_000
# Digits that a step of a millionth of a unit leaves.
_DIGITS = 9


@dataclass(frozen=True)
class Choice:
    """A variable with listed values."""

    name: str
    values: tuple[str, ...]

    def __post_init__(self):
        if not self.values or len(set(self.values)) < len(self.values):
            raise ValueError(f"{self.name} is {list(self.values)}, must name at least one value and none twice")

    @property
    def n_values(self) -> int:
        """How many values it has."""
        return len(self.values)

    @property
    def distribution(self) -> BaseDistribution:
        """What a sampler draws from."""
        return CategoricalDistribution(self.values)

    def made(self, drawn: Value) -> str:
        """The value that is made where `drawn` was drawn."""
        return str(drawn)

    def beside(self, value: Value) -> tuple[str, ...]:
        """The other values."""
        return tuple(other for other in self.values if other != value)


@dataclass(frozen=True)
class Range:
    """A variable with values low, low + step, ... up to high.

    Parameters
    ----------
    name : as the study calls it.
    low, high : its bounds.
    step : distance between values that can be made.
    is_log : whether samplers spread their draws over its logarithm.
    """

    name: str
    low: float
    high: float
    step: float = 1.0
    is_log: bool = False

    def __post_init__(self):
        if not 0 < self.low <= self.high < math.inf:
            raise ValueError(f"{self.name}: low is {self.low:g} and high {self.high:g}, must be 0 < low <= high")
        if not 0 < self.step < math.inf:
            raise ValueError(f"{self.name}: step is {self.step:g}, must be above 0")
        if (self.high - self.low) / self.step >= MAX_VALUES:
            raise ValueError(f"{self.name}: step {self.step:g} makes more than {MAX_VALUES:,} values")
        if self.is_count and any(part != int(part) for part in (self.low, self.high, self.step)):
            raise ValueError(f"{self.name}: low, high and step must be whole numbers")

    @property
    def is_count(self) -> bool:
        """Whether it counts things."""
        return self.name in COUNTS

    @property
    def n_values(self) -> int:
        """How many values it has."""
        # A tenth may fall short of its multiple by a rounding.
        return math.floor((self.high - self.low) / self.step + 1e-9) + 1

    @property
    def distribution(self) -> BaseDistribution:
        """What a sampler draws from; steps come after it, for none takes both a step and a logarithm."""
        if self.is_count:
            return IntDistribution(int(self.low), int(self.high), log=self.is_log)
        return FloatDistribution(self.low, self.high, log=self.is_log)

    def made(self, drawn: Value) -> float | int:
        """The value that is made where `drawn` was drawn: the nearest one that can be."""
        place = min(max(round((float(drawn) - self.low) / self.step), 0), self.n_values - 1)
        return self._at(place)

    def beside(self, value: Value) -> tuple[float | int, ...]:
        """Values a step, and about 4 and 12 % of the value, below and above."""
        place = round((float(value) - self.low) / self.step)
        places = []
        for share in (0.0, 0.04, 0.12):
            away = max(1, round(share * float(value) / self.step))
            places += [place - away, place + away]
        return tuple(self._at(other) for other in dict.fromkeys(places) if 0 <= other < self.n_values)

    def _at(self, place: int) -> float | int:
        value = round(self.low + place * self.step, _DIGITS)
        return int(value) if self.is_count else value


Variable = Choice | Range


@dataclass(frozen=True)
class Variables:
    """All variables of an exploration.

    Parameters
    ----------
    all : the variables; those of `NEEDED` must be among them, and those that a kind of layout is made of.
    layouts : names of layouts that need no variable and may stand among the values of `kind`.

    Raises
    ------
    ValueError : if a variable is missing, unknown, double, or of the wrong sort.
    """

    all: tuple[Variable, ...]
    layouts: tuple[str, ...] = ()

    def __post_init__(self):
        known = {*CHOICES, *COUNTS, *MEASURES}
        names = [variable.name for variable in self.all]
        for name in names:
            if name not in known:
                raise ValueError(f"{name!r} is no variable, must be one of {', '.join((*CHOICES, *COUNTS, *MEASURES))}")
            if names.count(name) > 1:
                raise ValueError(f"{name!r} stands there twice")
            if isinstance(self.by_name[name], Choice) != (name in CHOICES):
                raise ValueError(f"{name} must be {'a list of names' if name in CHOICES else 'a range'}")
        for name in NEEDED:
            if name not in names:
                raise ValueError(f"{name} is missing")
        for kind in self.by_name["kind"].values:
            if kind not in KIND_VARIABLES and kind not in self.layouts:
                raise ValueError(f"kind {kind!r} must be one of {', '.join((*KIND_VARIABLES, *self.layouts))}")
            for name in KIND_VARIABLES.get(kind, ()):
                if name not in names:
                    raise ValueError(f"{name} is missing, a layout of kind {kind!r} needs it")

    @cached_property
    def by_name(self) -> dict[str, Variable]:
        """The variables by name."""
        return {variable.name: variable for variable in self.all}

    @property
    def searched(self) -> dict[str, BaseDistribution]:
        """What samplers draw from, by name; a variable with one value is not drawn."""
        return {variable.name: variable.distribution for variable in self.all if variable.n_values > 1}

    @property
    def n_designs(self) -> int:
        """How many different proposals the space holds: per layout kind and estimator the product of what they use."""
        estimators = self.by_name["estimator"].values if "estimator" in self.by_name else (None,)
        return sum(
            math.prod(self.by_name[name].n_values for name in self.used(kind, estimator) if name not in _SUMMED)
            for kind in self.by_name["kind"].values
            for estimator in estimators
        )

    def used(self, kind: str, estimator: str | None) -> tuple[str, ...]:
        """Names of the variables that a proposal with these is made of, in the order of the variables.

        `estimator` : None: the study's, which the exploration does not vary.
        """
        named = {*NEEDED, *OPTIONAL, *KIND_VARIABLES.get(kind, ())}
        if estimator is not None and estimator not in WITH_PARTICLES:
            named.discard("n_particles")
        return tuple(variable.name for variable in self.all if variable.name in named)

    def made(self, drawn: Mapping[str, Value]) -> tuple[tuple[str, Value], ...]:
        """The values of a proposal, where a sampler drew `drawn`: (name, value) of what its kind uses."""
        values = {
            variable.name: variable.made(drawn[variable.name]) if variable.name in drawn else self._only(variable)
            for variable in self.all
        }
        return tuple((name, values[name]) for name in self.used(values["kind"], values.get("estimator")))

    def _only(self, variable: Variable) -> Value:
        return variable.values[0] if isinstance(variable, Choice) else variable.made(variable.low)
