"""Check a layout apart from the search that found it: over all phases and headings, and by driving."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rfiddesign.geometry import ReaderLayout, blind_distances, listed
from rfiddesign.optimize.reader_placement._guarantee_kernels import unserved_poses
from rfiddesign.optimize.reader_placement.demand import aligned_headings_rad, sampled_poses
from rfiddesign.optimize.reader_placement.motion import Sweep, sweeps
from rfiddesign.optimize.reader_placement.problem import PlacementProblem

#: Boxes over which a tag moves no more than this [mm] are not halved any further.
FINEST_MM = 0.25
MAX_BOXES = 3_000_000
#: Poses sampled and lanes along rows of tags, and headings driven at beside those.
N_SAMPLED, N_LANES, N_HEADINGS = 40_000, 512, 12
#: How many times the distance is looked ahead where reads come late.
HORIZON = 10.0


@dataclass(frozen=True)
class MotionCheck:
    """What became of one motion of a layout.

    Parameters
    ----------
    motion : its name.
    unserved_share, undecided_share : of all phases and headings: where reads surely come too late; where it could not
        be told.
    n_boxes : boxes of phases and headings that were looked at.
    sampled_unserved_share : of sampled poses.
    worst : distance to the wanted read [mm], the longest found by driving (any one reader dead, if that is asked for)
        at headings along and between rows of tags; of a turn, in degrees, the largest sampled.  `HORIZON` times the
        distance allowed, or the whole turn, if none comes.
    unit : "mm" or "deg".
    """

    motion: str
    unserved_share: float
    undecided_share: float
    n_boxes: int
    sampled_unserved_share: float
    worst: float
    unit: str

    @property
    def is_guaranteed(self) -> bool:
        """Whether reads come in time from every phase and heading, without exception."""
        return self.unserved_share == 0 and self.undecided_share == 0 and self.sampled_unserved_share == 0


def recheck(problem: PlacementProblem, layout: ReaderLayout) -> tuple[MotionCheck, ...]:
    """Check each motion of the problem for a layout, whose antennas must not be turned if they see no disc."""
    return tuple(_check_motion(problem, layout, sweep) for sweep in sweeps(problem))


def unserved_by(
    problem: PlacementProblem,
    sweep: Sweep,
    mounts: NDArray[np.float64],
    max_found: int = 1_000_000,
    finest_mm: float = FINEST_MM,
) -> tuple[NDArray[np.float64], float, float, int]:
    """Poses (n, 3) from which reads come too late; shares surely and perhaps unserved; and boxes looked at."""
    found, shares, n_boxes = unserved_poses(
        problem.basis, mounts, sweep.numbers, sweep.swept, problem.n_wanted, problem.sector_rad, finest_mm, MAX_BOXES,
        max_found,
    )  # fmt: skip
    return found, float(shares[0]), float(shares[1]), int(n_boxes)


def is_guaranteed(problem: PlacementProblem, layout: ReaderLayout) -> bool:
    """Whether reads come in time from every phase and heading, told as soon as one is found from which they do not."""
    mounts = layout.poses_mm[:, :2].copy()
    for sweep in sweeps(problem):
        if len(sampled_unserved(problem, sweep, mounts)):
            return False
        found, unserved, undecided, _ = unserved_by(problem, sweep, mounts, max_found=1)
        if len(found) or unserved or undecided:
            return False
    return True


def sampled_unserved(problem: PlacementProblem, sweep: Sweep, mounts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sampled poses (n, 3) from which reads come too late."""
    poses = sampled_poses(problem, sweep, N_SAMPLED, N_LANES)
    reads = sweep.first_reads(poses, problem.basis, mounts)
    return poses[np.count_nonzero(np.isfinite(reads), axis=1) < problem.n_wanted]


def _check_motion(problem: PlacementProblem, layout: ReaderLayout, sweep: Sweep) -> MotionCheck:
    mounts = layout.poses_mm[:, :2].copy()
    _, unserved, undecided, n_boxes = unserved_by(problem, sweep, mounts)
    poses = sampled_poses(problem, sweep, N_SAMPLED, N_LANES)
    sampled = len(sampled_unserved(problem, sweep, mounts)) / len(poses)
    if sweep.turn > 0:
        worst, unit = _worst_turn(problem, sweep, mounts, poses), "deg"
    elif problem.n_reads == 1:
        worst, unit = _worst_drive(problem, layout, sweep), "mm"
    else:
        worst, unit = _worst_sampled_drive(problem, sweep, mounts, poses), "mm"
    return MotionCheck(sweep.motion, unserved, undecided, n_boxes, sampled, worst, unit)


def _worst_turn(problem: PlacementProblem, sweep: Sweep, mounts: NDArray, poses: NDArray) -> float:
    reads = np.sort(sweep.first_reads(poses, problem.basis, mounts), axis=1)
    if reads.shape[1] < problem.n_wanted:
        return problem.turn_deg
    return math.degrees(float(np.minimum(reads[:, problem.n_wanted - 1], 1.0).max()) * sweep.turn)


def _worst_sampled_drive(problem: PlacementProblem, sweep: Sweep, mounts: NDArray, poses: NDArray) -> float:
    """As by driving, at sampled poses and up to the distance allowed; beyond it, `HORIZON` times that distance."""
    reads = np.sort(sweep.first_reads(poses, problem.basis, mounts), axis=1)
    wanted = reads[:, problem.n_wanted - 1] if reads.shape[1] >= problem.n_wanted else np.array([np.inf])
    worst = float(wanted.max())
    return sweep.distance * (worst if math.isfinite(worst) else HORIZON)


def _worst_drive(problem: PlacementProblem, layout: ReaderLayout, sweep: Sweep) -> float:
    """The longest distance driven to a read, by `geometry.drive`, an independent piece of code."""
    between = math.degrees(problem.sector_rad) * (np.arange(N_HEADINGS) + 0.5) / N_HEADINGS
    along = np.degrees(aligned_headings_rad(problem, sweep)[:N_HEADINGS])
    layouts = [layout]
    if problem.is_one_dead:
        poses = layout.poses
        layouts = [listed(poses[:k] + poses[k + 1 :]) for k in range(len(poses))] if len(poses) > 1 else []
    horizon = HORIZON * sweep.distance
    drives = [
        drive
        for alive in layouts
        for drive in blind_distances(
            alive, problem.antenna.area, problem.pattern, [*along.tolist(), *between.tolist()],
            limit_mm=sweep.distance, horizon_mm=horizon, course_deg=math.degrees(sweep.course),
        )
    ]  # fmt: skip
    return max((drive.max_mm for drive in drives), default=horizon)
