"""What is measured on a run, and the limits that a run must keep."""

from dataclasses import dataclass, fields

import numpy as np

from rfiddesign import require

# A robot is localized while it is believed to be within these bounds, and has converged once it has been for this long.
CONVERGED_POSITION_MM = 50.0
CONVERGED_HEADING_RAD = 0.2
CONVERGED_HOLD_S = 1.0

PERCENTILE = 0.95
# More than the relative rounding error of a sum over a run's steps.
_ROUNDING = 1.0 + 1e-9


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
    is_inside = is_localized(position_mm, heading_rad)
    hold = max(1, round(CONVERGED_HOLD_S / dt_s))
    if is_inside.size < hold:
        return float("inf")
    held = np.cumsum(np.concatenate([[0], is_inside]))
    first = np.flatnonzero(held[hold:] - held[:-hold] == hold)
    return float((first[0] + 1) * dt_s) if first.size else float("inf")


def is_localized(position_mm: np.ndarray, heading_rad: np.ndarray) -> np.ndarray:
    """Which errors lie within the bounds of convergence, shape (n,)."""
    return (position_mm <= CONVERGED_POSITION_MM) & (heading_rad <= CONVERGED_HEADING_RAD)


def summarize(
    position_mm: np.ndarray, heading_rad: np.ndarray, dt_s: float, first_scored: int, *, is_complete: bool = True
) -> RunMetrics:
    """Metrics of a run from its errors after each step (n,), of which those from `first_scored` on count.

    A run stopped before it came to be scored is summarized over the steps it took.
    """
    start = first_scored if position_mm.size > first_scored else 0
    position, heading = position_mm[start:], heading_rad[start:]
    return RunMetrics(
        position_mean_mm=float(position.mean()),
        position_rms_mm=float(np.sqrt(np.mean(position**2))),
        position_p95_mm=percentile(position),
        position_max_mm=float(position.max()),
        heading_mean_rad=float(heading.mean()),
        heading_rms_rad=float(np.sqrt(np.mean(heading**2))),
        heading_p95_rad=percentile(heading),
        heading_max_rad=float(heading.max()),
        convergence_s=convergence_time(position_mm, heading_rad, dt_s),
        lost_share=float(np.mean(~is_localized(position, heading))),
        n_steps=int(position_mm.size),
        is_complete=is_complete,
    )


def percentile(errors: np.ndarray) -> float:
    """The least error that at least 95 % of the errors (n,) do not exceed."""
    rank = int(np.ceil(PERCENTILE * errors.size)) - 1
    return float(np.partition(errors, rank)[rank])


def has_certainly_failed(
    requirement: Requirement, position_mm: np.ndarray, heading_rad: np.ndarray, dt_s: float, first_scored: int,
    n_total: int,
) -> bool:  # fmt: skip
    """Whether a run of `n_total` steps must fail whatever comes after its errors so far.

    A limit on a 95th percentile is lost once more than 5 % of all scored steps exceed it, a limit on a mean once the
    sum so far exceeds it (by more than its rounding), a limit on a maximum at once.
    """
    within = requirement.converged_within_s
    if within is not None:
        n_decided = int(np.ceil((within + CONVERGED_HOLD_S) / dt_s)) + 1
        if position_mm.size >= n_decided and convergence_time(position_mm, heading_rad, dt_s) > within:
            return True
    n_scored = n_total - first_scored
    position, heading = position_mm[first_scored:], heading_rad[first_scored:]
    for metric, limit in requirement.limits:
        kind = metric.split("_")[1]
        errors = position if metric.startswith("position") else heading
        if kind == "share":
            is_lost = np.count_nonzero(~is_localized(position, heading)) / n_scored > limit
        elif kind == "max":
            is_lost = bool(np.any(errors > limit))
        elif kind == "p95":
            is_lost = np.count_nonzero(errors > limit) > n_scored - int(np.ceil(PERCENTILE * n_scored))
        elif kind == "rms":
            is_lost = float(np.sum(errors**2)) > limit**2 * n_scored * _ROUNDING
        else:
            is_lost = float(np.sum(errors)) > limit * n_scored * _ROUNDING
        if is_lost:
            return True
    return False
