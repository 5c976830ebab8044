"""Simulate the runs of a case and measure their errors as papers print them."""

import math
from collections.abc import Callable

import numpy as np

from rfiddesign.metrics import convergence_time, summarize
from rfiddesign.reproduce.cases import Case
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.run import Trace

# A robot that moves or turns less than this in a step stands [mm, rad].
_STANDS = 1e-6

Errors = dict[str, np.ndarray]


def measure(case: Case, n_runs: int, seed: int, n_workers: int | None, on_run: Callable[[], None]) -> Errors:
    """Metrics of each run of a case, one array (n_runs,) by name; see `metrics_of`."""
    found = []
    with Simulator(case.scenario, seed, n_workers) as simulator:
        jobs = [Job(case.design, run) for run in range(n_runs)]
        # The map and the filter are made once, before the threads ask for them.
        simulator.tags(case.design.pattern)
        for metrics in simulator.map(lambda job: metrics_of(simulator.trace(job), case), jobs):
            found.append(metrics)
            on_run()
    return {name: np.array([metrics[name] for metrics in found]) for name in found[0]}


def metrics_of(trace: Trace, case: Case) -> dict[str, float]:
    """Errors of a run: mean, maximum and variance of |x|, |y|, |theta| and of the distance, and root mean squares.

    `x_mm`, `y_mm`, `theta_rad`, `position_mm` are means over the steps that count, `*_max` and `*_var` the largest and
    the variance; `rmse_mm` is that of the distance, `theta_rmse_deg` of the heading.  Those of `SUMMARIES` are as
    `metrics.RunMetrics` defines them, over the same steps; `converged_*_share` is 1 if the estimate converged within
    that time of the filter's start, else 0.  All are nan if no step counts.
    """
    first = max(round(case.section.settle_s / trace.dt_s), 0) + 1
    off = trace.poses[first:] - trace.true_poses[first:]
    if case.section.scores_standing_only:
        moved = np.abs(np.diff(trace.true_poses[first - 1 :], axis=0))
        off = off[(moved < _STANDS).all(axis=1)]
    if not off.size:
        return dict.fromkeys(METRICS, math.nan)
    turn = np.abs((off[:, 2] + math.pi) % (2 * math.pi) - math.pi)
    errors = {
        "x_mm": np.abs(off[:, 0]),
        "y_mm": np.abs(off[:, 1]),
        "theta_rad": turn,
        "position_mm": np.hypot(off[:, 0], off[:, 1]),
    }
    metrics = {name: float(values.mean()) for name, values in errors.items()}
    metrics |= {f"{name}_max": float(values.max()) for name, values in errors.items()}
    metrics |= {f"{name}_var": float(values.var()) for name, values in errors.items()}
    metrics["rmse_mm"] = float(np.sqrt((errors["position_mm"] ** 2).mean()))
    metrics["theta_rmse_deg"] = math.degrees(float(np.sqrt((turn**2).mean())))
    summary = summarize(errors["position_mm"], turn, trace.dt_s, 0)
    metrics |= {name: factor * getattr(summary, field) for name, (field, factor) in SUMMARIES.items()}
    converged_s = convergence_time(trace.position_error_mm, trace.heading_error_rad, trace.dt_s)
    return metrics | {name: float(converged_s <= within_s) for name, within_s in CONVERGED.items()}


# Metrics of `metrics.RunMetrics` by their names here: which, and how many of the unit here make one of its own.
SUMMARIES = {
    "position_mean_mm": ("position_mean_mm", 1.0),
    "position_p95_mm": ("position_p95_mm", 1.0),
    "heading_mean_mrad": ("heading_mean_rad", 1e3),
    "lost_share": ("lost_share", 1.0),
}
CONVERGED = {"converged_1s_share": 1.0, "converged_6s_share": 6.0}


METRICS = (
    *(f"{name}{part}" for part in ("", "_max", "_var") for name in ("x_mm", "y_mm", "theta_rad", "position_mm")),
    "rmse_mm",
    "theta_rmse_deg",
    *SUMMARIES,
    *CONVERGED,
)
