"""The fewest readers, and where to mount them."""

import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.geometry import ReaderLayout, listed
from rfiddesign.optimize.reader_placement.bounds import fewest_readers
from rfiddesign.optimize.reader_placement.demand import Demand, demand, first_demand, joined, sampled_poses
from rfiddesign.optimize.reader_placement.exact import cover_exactly
from rfiddesign.optimize.reader_placement.motion import sweeps
from rfiddesign.optimize.reader_placement.problem import PlacementProblem
from rfiddesign.optimize.reader_placement.recheck import MotionCheck, recheck, sampled_unserved, unserved_by
from rfiddesign.optimize.reader_placement.search import (
    PlacementLimits,
    nearer_reads,
    serving_mounts,
)

MAX_READERS = 200
#: Poses of the sample that counts where not all have to be served: spread over all, and in each lane.
N_SAMPLED, N_LANES = 3000, 48
#: Of the local search over that sample, whose steps take longer; swaps follow.
SAMPLE_RESTARTS, SAMPLE_STEPS = 2, 300


@dataclass(frozen=True)
class Placement:
    """Where readers go, and how good that is.

    Parameters
    ----------
    problem : what was asked.
    layout : the readers.
    lower_bound : no layout with fewer readers serves all poses.
    bound_by : why, in words.
    is_proved : whether the layout serves every phase and heading and none with fewer readers does.
    checks : what the recheck found for each motion.
    is_number_given : whether the number of readers was given, not sought.
    method : how the layout was found, in words.
    n_rows : poses that were rows of the search in the end.
    """

    problem: PlacementProblem
    layout: ReaderLayout
    lower_bound: int
    bound_by: str
    is_proved: bool
    is_number_given: bool
    checks: tuple[MotionCheck, ...]
    method: str
    n_rows: int

    @property
    def n_readers(self) -> int:
        """Number of readers."""
        return self.layout.n_readers

    @property
    def gap(self) -> float:
        """Share of the readers by which the bound falls short of them; 0 if they are fewer than it."""
        return max(self.n_readers - self.lower_bound, 0) / self.n_readers

    @property
    def is_guaranteed(self) -> bool:
        """Whether reads come in time from every phase and heading, without exception."""
        return all(check.is_guaranteed for check in self.checks)


@dataclass(frozen=True, eq=False)
class _Found:
    chosen: NDArray[np.int64]
    rows: Demand
    lower_bound: int
    bound_by: str
    method: str


def place_readers(
    problem: PlacementProblem, n_readers: int | None = None, limits: PlacementLimits | None = None
) -> Placement:
    """Mount the fewest readers that serve all poses; or so many, as well as they can.

    Poses that a layout leaves unserved become rows of the next search, until none is found any more.  A layout of a
    given number of readers that serves all poses is then changed for a shorter mean distance to the wanted read; one
    that cannot serve all, for the fewest unserved poses of a sample.

    Raises
    ------
    ValueError : if no number of readers serves all poses, or `n_readers` do not fit under the robot.
    """
    limits = limits or PlacementLimits()
    if n_readers is not None:
        found = _with_readers(problem, require.count("n_readers", n_readers, at_most=MAX_READERS), limits)
    elif limits.allowed_share > 0:
        found = _fewest_of_sample(problem, limits)
    else:
        found = _fewest(problem, limits)
    layout = _layout(problem, found.chosen)
    checks = recheck(problem, layout)
    is_proved = layout.n_readers == found.lower_bound and all(check.is_guaranteed for check in checks)
    return Placement(
        problem, layout, found.lower_bound, found.bound_by, is_proved, n_readers is not None, checks, found.method,
        len(found.rows.poses),
    )  # fmt: skip


def _fewest(problem: PlacementProblem, limits: PlacementLimits) -> _Found:
    bound, why = fewest_readers(problem)
    rows, n_readers = first_demand(problem), bound
    # With one more reader after every `max_rounds` this ends, for the local search finds none beyond `MAX_READERS`.
    for n_rounds in itertools.count(1):
        _check_servable(problem, rows)
        n_readers, chosen = _serve_all(problem, rows, n_readers, limits)
        late = _late_poses(problem, chosen, limits)
        if not sum(map(len, late)):
            break
        rows = joined(rows, demand(problem, late))
        n_readers += n_rounds % limits.max_rounds == 0
    method = "local search"
    for _ in range(limits.max_rounds):
        if n_readers == bound:
            break
        answer = cover_exactly(problem, rows.is_served, (bound, n_readers - 1), limits.solver)
        if answer.lower_bound > bound:
            bound, why = answer.lower_bound, f"integer program over {answer.n_rows} poses and the mount points"
        if answer.chosen is None:
            break
        late = _late_poses(problem, answer.chosen, limits)
        if not sum(map(len, late)):
            n_readers, chosen, method = len(answer.chosen), answer.chosen, "integer program"
        rows = joined(rows, demand(problem, late))
    return _Found(chosen, rows, bound, why, method)


def _with_readers(problem: PlacementProblem, n_readers: int, limits: PlacementLimits) -> _Found:
    bound, why = fewest_readers(problem)
    rows = first_demand(problem)
    is_hopeful = n_readers >= bound
    for _ in range(limits.max_rounds if is_hopeful else 0):
        chosen, n_left = serving_mounts(problem, rows, n_readers, limits)
        if n_left:
            break
        chosen = nearer_reads(problem, rows, chosen, limits)
        late = _late_poses(problem, chosen, limits)
        if not sum(map(len, late)):
            return _Found(chosen, rows, bound, why, "local search, then swaps")
        rows = joined(rows, demand(problem, late))
    sample, limits = _sample(problem), _for_sample(limits)
    chosen, _ = serving_mounts(problem, sample, n_readers, limits)
    if len(chosen) < n_readers:
        raise ValueError(f"n_readers = {n_readers}: {len(chosen)} fit under the robot")
    return _Found(nearer_reads(problem, sample, chosen, limits), sample, bound, why, "local search over a sample")


def _fewest_of_sample(problem: PlacementProblem, limits: PlacementLimits) -> _Found:
    """The fewest readers that leave no more than the allowed share of a fixed sample of poses unserved."""
    sample, limits = _sample(problem), _for_sample(limits)
    allowed = int(limits.allowed_share * len(sample.poses))
    n_served = np.sort(np.count_nonzero(sample.is_served, axis=0))[::-1].cumsum()
    enough = np.flatnonzero(n_served >= problem.n_wanted * (len(sample.poses) - allowed))
    bound = max(problem.n_wanted, int(enough[0]) + 1) if len(enough) else MAX_READERS + 1
    for n_readers in range(bound, MAX_READERS + 1):
        chosen, n_left = serving_mounts(problem, sample, n_readers, limits)
        if len(chosen) < n_readers:
            break
        if n_left <= allowed:
            why = f"what the best mount points serve of {len(sample.poses)} sampled poses"
            return _Found(chosen, sample, bound, why, "local search over a sample")
    raise ValueError(f"allowed_share = {limits.allowed_share:g}: no layout found leaves so few poses unserved")


def _serve_all(
    problem: PlacementProblem, rows: Demand, at_least: int, limits: PlacementLimits
) -> tuple[int, NDArray[np.int64]]:
    """The fewest mount points, from `at_least` on, for which the local search leaves no row unserved."""
    for n_readers in range(at_least, MAX_READERS + 1):
        chosen, n_left = serving_mounts(problem, rows, n_readers, limits)
        if not n_left:
            return len(chosen), chosen
        if len(chosen) < n_readers:
            break
    raise ValueError(
        f"distance_mm = {problem.distance_mm:g}: no layout found that reads so soon from every phase and heading"
    )


def _late_poses(
    problem: PlacementProblem, chosen: NDArray[np.int64], limits: PlacementLimits
) -> list[NDArray[np.float64]]:
    """Poses (n, 3) of each motion that the chosen mount points leave unserved, sampled and found by halving boxes."""
    mounts = problem.mounts[chosen]
    late = []
    for sweep in sweeps(problem):
        sampled = sampled_unserved(problem, sweep, mounts)
        sampled = sampled[np.linspace(0, len(sampled) - 1, min(len(sampled), limits.n_added)).astype(int)]
        # Boxes find more where the sample holds few.
        found = unserved_by(problem, sweep, mounts, limits.n_added - len(sampled) + 1)[0]
        late.append(np.concatenate([sampled, found]))
    return late


def _sample(problem: PlacementProblem) -> Demand:
    poses = [sampled_poses(problem, sweep, N_SAMPLED, N_LANES) for sweep in sweeps(problem)]
    return demand(problem, poses, is_distinct=False)


def _for_sample(limits: PlacementLimits) -> PlacementLimits:
    return replace(
        limits,
        n_restarts=min(limits.n_restarts, SAMPLE_RESTARTS),
        n_steps=min(limits.n_steps, SAMPLE_STEPS),
    )


def _check_servable(problem: PlacementProblem, rows: Demand) -> None:
    n_serving = np.count_nonzero(rows.is_served, axis=1)
    if n_serving.min() < problem.n_wanted:
        worst = int(n_serving.argmin())
        raise ValueError(
            f"distance_mm = {problem.distance_mm:g}: too short, {n_serving[worst]} mount points read in time from"
            f" heading {np.degrees(rows.poses[worst, 2]):.4g} deg ({problem.motions[rows.motion[worst]]})"
        )


def _layout(problem: PlacementProblem, chosen: NDArray[np.int64]) -> ReaderLayout:
    places = sorted(problem.mounts[chosen].tolist())
    return replace(listed(places), name=f"placed-{len(places)}")
