"""What a study asks of a design in every scenario: limits for each drive, and means and quantiles over drives."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.optimize import Criterion, MeanCriterion, ShareCriterion
from rfiddesign.study.requirements_config import FurtherRequirement
from rfiddesign.units import DEG_PER_RAD

BASE = "base"


@dataclass(frozen=True)
class MeanLimit:
    """A limit on a mean over drives of a metric, or of its square: the criterion, and what its scores are a share of.

    Parameters
    ----------
    metric : name in `RunMetrics`.
    limit, hold_limit, cap : in the metric's own unit (mm, rad, s or 1).
    is_squared : whether the root of the mean square is meant.
    words : the limit in words.
    """

    metric: str
    limit: float
    hold_limit: float
    cap: float
    is_squared: bool
    words: str

    def criterion(self, name: str) -> Criterion:
        """What is tested."""
        return MeanCriterion(name, self._score(self.hold_limit), self._score(self.limit))

    def score(self, run: RunMetrics) -> float:
        """What a drive measured over the most that counts, 1 if it was not completed."""
        return self._score(min(getattr(run, self.metric), self.cap)) if run.is_complete else 1.0

    def scaled(self, factor: float) -> "MeanLimit":
        """The same with limits and cap times `factor`."""
        return replace(self, limit=factor * self.limit, hold_limit=factor * self.hold_limit, cap=factor * self.cap)

    def _score(self, value: float) -> float:
        return (value / self.cap) ** 2 if self.is_squared else value / self.cap


@dataclass(frozen=True)
class QuantileLimit:
    """A limit on a quantile over drives of a metric, in the metric's own unit (mm, rad, s or 1)."""

    metric: str
    limit: float
    quantile: float
    hold_quantile: float
    words: str

    def criterion(self, name: str) -> Criterion:
        """What is tested."""
        return ShareCriterion(name, self.hold_quantile, self.quantile)

    def score(self, run: RunMetrics) -> float:
        """1 for a drive that keeps the limit."""
        return float(run.is_complete and getattr(run, self.metric) <= self.limit)

    def scaled(self, factor: float) -> "QuantileLimit":
        """The same with the limit times `factor`."""
        return replace(self, limit=factor * self.limit)


@dataclass(frozen=True)
class Criteria:
    """All that a study asks.

    Parameters
    ----------
    requirement : limits that a drive must keep to pass.
    hold, fail : shares of drives that pass, see `ShareCriterion`.
    further : limits on means and quantiles.
    scenarios : names of the scenarios; everything is asked in each.
    """

    requirement: Requirement
    hold: float
    fail: float
    further: tuple[MeanLimit | QuantileLimit, ...] = ()
    scenarios: tuple[str, ...] = (BASE,)

    @property
    def is_one_share(self) -> bool:
        """Whether only one share of drives is asked for."""
        return not self.further and len(self.scenarios) == 1

    def declared(self) -> tuple[Criterion, ...]:
        """The criteria as tested, scenario by scenario; none where one share is all, which is the usual test."""
        if self.is_one_share:
            return ()
        found: list[Criterion] = []
        for scenario in self.scenarios:
            where = f"{scenario}: " if len(self.scenarios) > 1 else ""
            found.append(ShareCriterion(f"{where}drives pass", self.hold, self.fail))
            found += [limit.criterion(where + limit.words) for limit in self.further]
        return tuple(found)

    def scores(self, runs: Sequence[Sequence[RunMetrics]]) -> NDArray:
        """Scores (n_runs, n_criteria) of runs, one row of them per scenario; bool (n_runs,) where one share is all."""
        if self.is_one_share:
            return np.array([self.requirement.is_met(run) for run in runs[0]], bool)
        columns = []
        for row in runs:
            columns.append([float(self.requirement.is_met(run)) for run in row])
            columns += [[limit.score(run) for run in row] for limit in self.further]
        return np.array(columns, float).T

    def scaled(self, factor: float) -> "Criteria":
        """The same with every limit on an error multiplied by `factor`."""
        return replace(
            self,
            requirement=self.requirement.scaled(factor),
            further=tuple(limit.scaled(factor) for limit in self.further),
        )


def further_limit(section: FurtherRequirement) -> MeanLimit | QuantileLimit:
    """A limit over drives as a study file says it."""
    metric, scale = section.metric, 1.0
    if metric.endswith("_deg"):
        metric, scale = metric.removesuffix("_deg") + "_rad", 1 / DEG_PER_RAD
    if section.kind == "quantile":
        words = f"{100 * section.quantile:g} % quantile of {section.metric} at most {section.limit:g}"
        return QuantileLimit(metric, scale * section.limit, section.quantile, section.holds_in, words)
    words = (
        f"{'root mean square' if section.kind == 'rms' else 'mean'} over drives of {section.metric} below"
        f" {section.limit:g}, drives above {section.most:g} counted as that"
    )
    return MeanLimit(
        metric, scale * section.limit, scale * section.holds_at, scale * section.most, section.kind == "rms", words
    )
