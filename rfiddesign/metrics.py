"""What is measured on a run, and the limits that a run must keep."""

import math
from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rfiddesign import _metrics_kernels as kernels
from rfiddesign import require
from rfiddesign._metrics_kernels import CONVERGED_HEADING_RAD, CONVERGED_POSITION_MM


@dataclass(frozen=True)
class RunMetrics:
    """Errors of one run, over its steps from the scenario's settling time on.

    Position errors are distances [mm], heading errors absolute angles [rad].

    Parameters
    ----------
    convergence_s : when the estimate came within 50 mm and 0.2 rad of the truth and stayed for a second; inf: never.
    lost_share : share of the scored steps outside those bounds.
    n_steps : filter steps taken.
    is_complete : False if the run was stopped because it had certainly failed; its errors are then those so far.
    """

    position_mean_mm: float
    position_rms_mm: float
    position_p95_mm: float
    position_max_mm: float
    heading_mean_rad: float
    heading_rms_rad: float
    heading_p95_rad: float
    heading_max_rad: float
    convergence_s: float
    lost_share: float
    n_steps: int
    is_complete: bool = True


# Metrics that a requirement may limit.
LIMITED_METRICS = tuple(
    field.name for field in fields(RunMetrics) if field.name.startswith(("position_", "heading_", "lost_"))
)


class LimitTable(NamedTuple):
    """A requirement as the compiled run asks it; see `_metrics_kernels.has_certainly_failed`."""

    of_heading: np.ndarray
    kinds: np.ndarray
    limits: np.ndarray
    within_s: float


NO_LIMITS = LimitTable(np.empty(0, bool), np.empty(0, np.int64), np.empty(0), math.inf)


@dataclass(frozen=True)
class Requirement:
    """Limits that a run must keep to pass: every metric at most its limit, convergence in time.

    Parameters
    ----------
    limits : (metric, limit) pairs; metrics are those of `LIMITED_METRICS`.
    converged_within_s : the run must converge within this time [s]; None: no such demand.
    """

    limits: tuple[tuple[str, float], ...]
    converged_within_s: float | None = None

    def __post_init__(self) -> None:
        if not self.limits and self.converged_within_s is None:
            raise ValueError("requirement has no limit, must have at least one")
        for metric, limit in self.limits:
            if metric not in LIMITED_METRICS:
                raise ValueError(f"requirement limits {metric!r}, must be one of {', '.join(LIMITED_METRICS)}")
            require.within(metric, limit, low=0.0, high=1e9, is_low_open=True)
        if self.converged_within_s is not None:
            require.within("converged_within_s", self.converged_within_s, low=0.0, high=1e6, is_low_open=True)

    def scaled(self, factor: float) -> "Requirement":
        """The same requirement with every limit on an error multiplied by `factor`; the time to converge stays."""
        return Requirement(tuple((metric, limit * factor) for metric, limit in self.limits), self.converged_within_s)

    @cached_property
    def table(self) -> LimitTable:
        """The requirement for compiled code."""
        words = [metric.split("_") for metric, _ in self.limits]
        return LimitTable(
            of_heading=np.array([word[0] == "heading" for word in words], bool),
            kinds=np.array([getattr(kernels, word[1].upper()) for word in words], np.int64),
            limits=np.array([limit for _, limit in self.limits], float),
            within_s=math.inf if self.converged_within_s is None else float(self.converged_within_s),
        )

    def is_met(self, run: RunMetrics) -> bool:
        """Whether a run passes."""
        if not run.is_complete:
            return False
        if self.converged_within_s is not None and not run.convergence_s <= self.converged_within_s:
            return False
        return all(getattr(run, metric) <= limit for metric, limit in self.limits)


def convergence_time(position_mm: np.ndarray, heading_rad: np.ndarray, dt_s: float) -> float:
    """Time [s] after which the errors (n,), one per step, first stay within the bounds of convergence for a second.

    The first error is that at time `dt_s`, after the first step.
    """
    return kernels.convergence_time(position_mm, heading_rad, float(dt_s))


def is_localized(position_mm: np.ndarray, heading_rad: np.ndarray) -> np.ndarray:
    """Which errors lie within the bounds of convergence, shape (n,)."""
    return (position_mm <= CONVERGED_POSITION_MM) & (heading_rad <= CONVERGED_HEADING_RAD)


def summarize(
    position_mm: np.ndarray, heading_rad: np.ndarray, dt_s: float, first_scored: int, *, is_complete: bool = True
) -> RunMetrics:
    """Metrics of a run from its errors after each step (n,), of which those from `first_scored` on count.

    A run stopped before it came to be scored is summarized over the steps it took.
    """
    summary = np.empty(kernels.N_SUMMARY)
    kernels.summarize(position_mm, heading_rad, float(dt_s), first_scored, summary)
    position_mean, position_rms, position_max, heading_mean, heading_rms, heading_max, convergence_s, lost = (
        summary.tolist()
    )
    start = first_scored if position_mm.size > first_scored else 0
    return RunMetrics(
        position_mean_mm=position_mean,
        position_rms_mm=position_rms,
        position_p95_mm=percentile(position_mm[start:]),
        position_max_mm=position_max,
        heading_mean_rad=heading_mean,
        heading_rms_rad=heading_rms,
        heading_p95_rad=percentile(heading_rad[start:]),
        heading_max_rad=heading_max,
        convergence_s=convergence_s,
        lost_share=lost,
        n_steps=int(position_mm.size),
        is_complete=is_complete,
    )


def percentile(errors: np.ndarray) -> float:
    """The least error that at least 95 % of the errors do not exceed."""
    rank = math.ceil(kernels.PERCENTILE * errors.size) - 1
    return float(np.partition(errors, rank)[rank])


def has_certainly_failed(
    requirement: Requirement, position_mm: np.ndarray, heading_rad: np.ndarray, dt_s: float, first_scored: int,
    n_total: int,
) -> bool:  # fmt: skip
    """Whether a run of `n_total` steps must fail whatever comes after its errors so far.

    A limit on a 95th percentile is lost once more than 5 % of all scored steps exceed it, a limit on a mean once the
    sum so far exceeds it (by more than its rounding), a limit on a maximum at once.
    """
    of_heading, kinds, limits, within = requirement.table
    return kernels.has_certainly_failed(
        position_mm, heading_rad, float(dt_s), first_scored, n_total, of_heading, kinds, limits, within
    )
