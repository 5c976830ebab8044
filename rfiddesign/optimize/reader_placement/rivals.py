"""What layouts of a usual shape need for the same: the paper's crosses, bars and rings of the best spacing."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from rfiddesign.geometry import LAYOUTS, ReaderLayout, bar, check_layout, make_layout, ring
from rfiddesign.optimize.reader_placement.demand import sampled_poses
from rfiddesign.optimize.reader_placement.motion import Sweep, sweeps
from rfiddesign.optimize.reader_placement.problem import PlacementProblem
from rfiddesign.optimize.reader_placement.recheck import is_guaranteed

MAX_READERS, STEP_MM = 16, 5.0
#: Poses that most layouts already fail.
N_QUICK, N_QUICK_LANES = 400, 64


@dataclass(frozen=True)
class Rival:
    """A layout of a usual shape.

    Parameters
    ----------
    shape : what it is, in words, such as "bar of 6, 45 mm apart".
    n_readers : its readers.
    is_guaranteed : whether it serves every phase and heading.
    """

    shape: str
    n_readers: int
    is_guaranteed: bool


def rivals(problem: PlacementProblem) -> tuple[Rival, ...]:
    """The paper's crosses that fit under the robot, and the smallest bar and ring that do what is asked.

    Of bars and rings every spacing or radius in steps of `STEP_MM` is tried for up to `MAX_READERS` readers; where none
    does it, that is said of the most that fit.
    """
    quick = [(sweep, sampled_poses(problem, sweep, N_QUICK, N_QUICK_LANES)) for sweep in sweeps(problem)]
    crosses = [make_layout(name) for name in LAYOUTS]
    found = [
        Rival(cross.name, cross.n_readers, _serves(problem, cross, quick)) for cross in crosses if _fits(problem, cross)
    ]
    for name, shapes in (("bars", _bars(problem)), ("rings", _rings(problem))):
        found += _smallest(name, problem, shapes, quick)
    return tuple(found)


def _smallest(
    name: str,
    problem: PlacementProblem,
    shapes: Iterator[tuple[str, ReaderLayout]],
    quick: list[tuple[Sweep, np.ndarray]],
) -> list[Rival]:
    most = 0
    for shape, layout in shapes:
        if not _fits(problem, layout):
            continue
        most = layout.n_readers
        if _serves(problem, layout, quick):
            return [Rival(shape, most, True)]
    return [Rival(f"{name} of up to {most}", most, False)] if most else []


def _bars(problem: PlacementProblem) -> Iterator[tuple[str, ReaderLayout]]:
    width, span = problem.antenna.housing_mm[1], 2 * problem.footprint_radius_mm
    for n in range(2, MAX_READERS + 1):
        for spacing in np.arange(math.ceil(width / STEP_MM) * STEP_MM, span / (n - 1), STEP_MM).tolist():
            yield f"bar of {n}, {spacing:g} mm apart", bar(n, spacing)


def _rings(problem: PlacementProblem) -> Iterator[tuple[str, ReaderLayout]]:
    for n in range(2, MAX_READERS + 1):
        for radius in np.arange(STEP_MM, problem.footprint_radius_mm, STEP_MM).tolist():
            yield f"ring of {n}, radius {radius:g} mm", ring(n, radius)


def _fits(problem: PlacementProblem, layout: ReaderLayout) -> bool:
    footprint = shapely.Point(0, 0).buffer(problem.footprint_radius_mm, quad_segs=64)
    try:
        check_layout(layout, problem.antenna.outline(), footprint)
    except ValueError:
        return False
    return True


def _serves(problem: PlacementProblem, layout: ReaderLayout, quick: list[tuple[Sweep, np.ndarray]]) -> bool:
    mounts = layout.poses_mm[:, :2].copy()
    for sweep, poses in quick:
        reads = sweep.first_reads(poses, problem.basis, mounts)
        if (np.count_nonzero(np.isfinite(reads), axis=1) < problem.n_wanted).any():
            return False
    return is_guaranteed(problem, layout)
