"""The waist of the program: how well does a design localize in a scenario?"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rfiddesign.design import Design
from rfiddesign.estimators.histogram import Histogram
from rfiddesign.estimators.registry import Settings
from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.simulation.computing import ComputingTime
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.scenario import Scenario

MAX_RUNS = 1_000_000
# What the exact reference believes of the field where the filter says nothing: blur of its border [mm], chance of a
# read at most.
SOFTNESS_MM, MOST_CERTAIN_READ = 1.0, 0.98
AVERAGED_METRICS = (
    "position_mean_mm", "position_rms_mm", "position_p95_mm", "position_max_mm",
    "heading_mean_rad", "heading_rms_rad", "heading_p95_rad", "heading_max_rad", "lost_share",
)  # fmt: skip


@dataclass(frozen=True)
class Mean:
    """A mean over runs and its standard error (None from a single run)."""

    mean: float
    stderr: float | None


@dataclass(frozen=True)
class Gap:
    """How far a filter is from the exact reference, on the same runs.

    Parameters
    ----------
    reference_mm : mean position error of the reference [mm].
    ratio : the filter's mean position error over that, 1 being optimal, with its standard error over the runs.
    """

    reference_mm: Mean
    ratio: Mean


@dataclass(frozen=True)
class Evaluation:
    """Runs of one design in one scenario.

    Parameters
    ----------
    design_name : the design in a line.
    runs : metrics of each run, in the order of their numbers.
    is_passed : whether each run met the requirement; empty where there was none.
    n_particles : particles of the filter; 0: it has none.
    wall_s : time taken [s].
    gap : how far the filter is from the exact one; None: not asked for.
    """

    design_name: str
    runs: tuple[RunMetrics, ...]
    is_passed: tuple[bool, ...]
    n_particles: int
    wall_s: float
    gap: Gap | None = None

    @property
    def n_steps(self) -> int:
        """Filter steps over all runs."""
        return sum(run.n_steps for run in self.runs)

    def metrics(self) -> dict[str, Mean]:
        """Mean and standard error of every metric over the runs; shares of converged and passed runs.

        `convergence_s` is the mean over the runs that converged.
        """
        columns = {name: [getattr(run, name) for run in self.runs] for name in AVERAGED_METRICS}
        columns["converged_share"] = [float(math.isfinite(run.convergence_s)) for run in self.runs]
        times = [run.convergence_s for run in self.runs if math.isfinite(run.convergence_s)]
        if times:
            columns["convergence_s"] = times
        if self.is_passed:
            columns["pass_share"] = [float(passed) for passed in self.is_passed]
        return {name: mean_of(values) for name, values in columns.items()}


def mean_of(values: list[float]) -> Mean:
    """Mean of at least one value with its standard error."""
    array = np.asarray(values, float)
    stderr = float(array.std(ddof=1) / math.sqrt(array.size)) if array.size > 1 else None
    return Mean(float(array.mean()), stderr)


def ratio_of_means(values: np.ndarray, others: np.ndarray) -> Mean:
    """The mean of some values (n_runs,) over that of others of the same runs."""
    ratio = float(values.mean() / others.mean())
    # Runs are paired: the error of a ratio of means, from its residuals.
    residuals = (values - ratio * others) / others.mean()
    stderr = float(residuals.std(ddof=1) / math.sqrt(values.size)) if values.size > 1 else None
    return Mean(ratio, stderr)


def exact_reference(scenario: Scenario) -> Histogram:
    """The exact filter for a scenario: it believes what is true of the odometry, and of the field what the filter does.

    Where the filter has no such belief it takes 1 mm and the installation error (squares added) for the blur of the
    field's border, and the true chance of a read, at most 0.98.
    """
    filter_, world = scenario.estimator, scenario.world
    softness = math.hypot(SOFTNESS_MM, world.installation_error_mm)
    probability = min(max(world.reads.read_probability, 0.01), MOST_CERTAIN_READ)
    return Histogram(
        motion=world.motion,
        softness_mm=getattr(filter_, "softness_mm", softness),
        radius_tolerance=getattr(filter_, "radius_tolerance", 0.0),
        read_probability=getattr(filter_, "read_probability", probability),
    )


def _gap(runs: tuple[RunMetrics, ...], exact: tuple[RunMetrics, ...]) -> Gap:
    """The mean position error of a filter over that of the exact one on the same runs."""
    ours, best = (np.array([run.position_mean_mm for run in found]) for found in (runs, exact))
    return Gap(mean_of(best.tolist()), ratio_of_means(ours, best))


def evaluate(
    design: Design, scenario: Scenario, n_runs: int, *, seed: int = 0, requirement: Requirement | None = None,
    n_workers: int | None = None, on_run: Callable[[int], None] | None = None, compare_to_exact: bool = False,
    reference: Settings | None = None,
) -> Evaluation:  # fmt: skip
    """Simulate `n_runs` runs of a design and measure the error of its filter.

    Run i draws its route and noise from (seed, i) alone: every design meets the same runs, and the answer does not
    depend on the number of workers.

    Parameters
    ----------
    design, scenario : what is tried, and how.
    n_runs : number of runs.
    seed : seed of the study.
    requirement : limits each run is held against.
    n_workers : threads; None: one per core.
    on_run : called with the number of finished runs, those of the reference included.
    compare_to_exact : whether the same runs are tracked by the exact filter, too, for `Evaluation.gap`.  Slow: it takes
        milliseconds per step.
    reference : what to compare with in place of `exact_reference`.

    Raises
    ------
    ValueError : if `n_runs` is not from 1 to a million, or seed or workers are out of bounds.
    """
    if not 1 <= n_runs <= MAX_RUNS:
        raise ValueError(f"runs is {n_runs!r}, must be from 1 to {MAX_RUNS:,}")
    begin = time.perf_counter()
    exact = (reference or exact_reference(scenario)) if compare_to_exact else None
    filters = (None,) if exact is None else (None, exact)
    jobs = (Job(design, run, filter_) for filter_ in filters for run in range(n_runs))
    found = []
    with Simulator(scenario, seed, n_workers) as simulator:
        for metrics in simulator.runs(jobs):
            found.append(metrics)
            if on_run is not None:
                on_run(len(found))
    runs = tuple(found[:n_runs])
    passed = tuple(requirement.is_met(run) for run in runs) if requirement is not None else ()
    gap = _gap(runs, tuple(found[n_runs:])) if exact is not None else None
    wall = time.perf_counter() - begin
    return Evaluation(design.name, runs, passed, getattr(scenario.estimator, "n_particles", 0), wall, gap)


def computing_time(design: Design, scenario: Scenario, *, seed: int = 0) -> ComputingTime:
    """What the scenario's estimator computes per step of the robot: measured on this machine, and counted.

    It tracks a recording of run 0, some times, on one thread; the quickest counts.
    """
    with Simulator(scenario, seed, 1) as simulator:
        return simulator.computing_time(Job(design, 0))
