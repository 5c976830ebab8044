"""What the runs of a proposal are worth: how near they came to the limits, and what a front is made of."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from rfiddesign.metrics import Requirement, RunMetrics

#: A run this many times over a limit is as bad as any; so is one that never converged.
WORST_MARGIN = 8.0
_LEAST_MARGIN = 1e-3

COST, SPEED, CONVERGENCE = "cost", "speed_mm_per_s", "convergence_s"
#: Objectives that are known without a run.
EXACT = (COST, SPEED)
#: Objectives that are means over runs; an error is that of a whole run.
SAMPLED = (
    "position_mean_mm", "position_rms_mm", "position_p95_mm", "position_max_mm", "heading_mean_rad", "heading_rms_rad",
    "heading_p95_rad", "heading_max_rad", "lost_share", CONVERGENCE,
)  # fmt: skip


def margins(requirement: Requirement, runs: Sequence[RunMetrics]) -> NDArray[np.float64]:
    """How near each run came to its limits: the largest of metric over limit, shape (n,).

    A run passes if its margin is at most 1; margins end at `WORST_MARGIN`. One of a run that was stopped because it had
    certainly failed is that up to the stop, when some metric had passed its limit for good.
    """
    return np.array([_margin(requirement, run) for run in runs])


def _margin(requirement: Requirement, run: RunMetrics) -> float:
    parts = [getattr(run, metric) / limit for metric, limit in requirement.limits]
    if requirement.converged_within_s is not None:
        parts.append(run.convergence_s / requirement.converged_within_s)
    return float(np.clip(max(parts), _LEAST_MARGIN, WORST_MARGIN))


def score(found: NDArray[np.float64], share: float) -> float:
    """Margin that about `share` of a proposal's runs keep, from some of them, shape (n,): at most 1, and it may hold.

    The quantile of a lognormal distribution fitted to the margins. It is biased where some runs are lost and others
    are not; it ranks proposals and certifies none.
    """
    logs = np.log(found)
    spread = logs.std(ddof=1) if logs.size > 1 else 0.0
    return float(np.clip(math.exp(logs.mean() + norm.ppf(share) * spread), _LEAST_MARGIN, WORST_MARGIN))


@dataclass(frozen=True)
class Objectives:
    """What a front is made of, by name: some of `EXACT` and of `SAMPLED`.

    Parameters
    ----------
    names : the objectives. All are minimised but the speed, which is maximised.
    duration_s : length of a run [s]; stands for the time to converge of a run that did not.

    Raises
    ------
    ValueError : fewer than two objectives, an unknown or double one.
    """

    names: tuple[str, ...]
    duration_s: float

    def __post_init__(self):
        if len(self.names) < 2 or len(set(self.names)) < len(self.names):
            raise ValueError(f"objectives are {list(self.names)}, must be at least two and none twice")
        for name in self.names:
            if name not in (*EXACT, *SAMPLED):
                raise ValueError(f"objective {name!r} must be one of {', '.join((*EXACT, *SAMPLED))}")

    @property
    def exact(self) -> tuple[str, ...]:
        """Those known without a run."""
        return tuple(name for name in self.names if name in EXACT)

    @property
    def sampled(self) -> tuple[str, ...]:
        """Those that are means over runs."""
        return tuple(name for name in self.names if name in SAMPLED)

    def sign(self, name: str) -> float:
        """-1 for what is maximised, else 1."""
        return -1.0 if name == SPEED else 1.0

    def known(self, cost_cents: int, speed_mm_per_s: float) -> NDArray[np.float64]:
        """Values of the exact objectives, all to be minimised: cost [currency] and the speed's negative [mm/s]."""
        values = {COST: cost_cents / 100, SPEED: speed_mm_per_s}
        return np.array([self.sign(name) * values[name] for name in self.exact])

    def measured(self, runs: Sequence[RunMetrics]) -> NDArray[np.float64]:
        """Values of the sampled objectives on each run, shape (n_runs, k)."""
        return np.array([[min(getattr(run, name), self._most(name)) for name in self.sampled] for run in runs]).reshape(
            len(runs), len(self.sampled)
        )

    def _most(self, name: str) -> float:
        return self.duration_s if name == CONVERGENCE else math.inf
