"""Rows of the cover: poses from which reads must come in time, and how far each mount point is from its read there."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rfiddesign.geometry.coverage import GOLDEN_RATIO
from rfiddesign.geometry.travel import lattice_rows
from rfiddesign.optimize.reader_placement.motion import Sweep, sweeps
from rfiddesign.optimize.reader_placement.problem import MOTIONS, PlacementProblem

#: Rows times mount points.
MAX_ENTRIES = 100_000_000
#: Phases along each axis, at each of the headings below, that the search begins with.
FIRST_PHASES, FIRST_OBLIQUE = 12, 8
#: Only so many of the widest rows of tags are driven along from the start; a check finds the others.
FIRST_ALIGNED = 12
#: Spreads headings and phases of samples independently of each other (R3 sequence, Roberts 2018).
_SPREAD = tuple((1 / 1.2207440846057596) ** k % 1.0 for k in (1, 2, 3))


@dataclass(frozen=True, eq=False)
class Demand:
    """Rows of the cover.

    Parameters
    ----------
    poses : (n, 3) places against the lattice [mm] and headings [rad].
    motion : (n,) number of each row's motion within the problem's.
    distances : (n, m) float32: how far each mount point is from its read, as a share of the motion; infinite if none.
    """

    poses: NDArray[np.float64]
    motion: NDArray[np.int64]
    distances: NDArray[np.float32]

    @property
    def is_served(self) -> NDArray[np.bool_]:
        """Whether a reader at each mount point (n, m) reads in time."""
        return np.isfinite(self.distances)

    def n_reading(self, chosen: NDArray[np.int64]) -> NDArray[np.int64]:
        """How many of the chosen mount points (k,) read in time in each row (n,)."""
        return np.count_nonzero(np.isfinite(self.distances[:, chosen]), axis=1)


def demand(
    problem: PlacementProblem, poses_by_motion: list[NDArray[np.float64]], *, is_distinct: bool = True
) -> Demand:
    """Rows for the poses (n, 3) of each motion; if `is_distinct`, those that the same mount points serve, once.

    Raises
    ------
    ValueError : if rows times mount points are more than `MAX_ENTRIES`.
    """
    n_rows = sum(len(poses) for poses in poses_by_motion)
    if n_rows * len(problem.mounts) > MAX_ENTRIES:
        raise ValueError(
            f"grid_mm = {problem.grid_mm:g}: {len(problem.mounts)} mount points for {n_rows} rows are too many"
        )
    parts = [
        sweep.first_reads(poses, problem.basis, problem.mounts)
        for sweep, poses in zip(sweeps(problem), poses_by_motion, strict=True)
    ]
    motion = np.repeat(np.arange(len(parts)), [len(poses) for poses in poses_by_motion])
    rows = Demand(np.concatenate(poses_by_motion), motion, np.concatenate(parts))
    return _distinct(rows) if is_distinct else rows


def joined(one: Demand, other: Demand) -> Demand:
    """The rows of both, each once."""
    return _distinct(
        Demand(*(np.concatenate([getattr(one, name), getattr(other, name)]) for name in one.__dataclass_fields__))
    )


def first_demand(problem: PlacementProblem) -> Demand:
    """The rows that the search begins with: headings along rows of tags, and some oblique ones, on a grid of phases."""
    return demand(problem, [_first_poses(problem, sweep) for sweep in sweeps(problem)])


def sampled_poses(problem: PlacementProblem, sweep: Sweep, n_oblique: int, n_lanes: int) -> NDArray[np.float64]:
    """Poses (n, 3) to look at: spread over all phases and headings, and lanes along rows of tags.

    Parameters
    ----------
    n_oblique : poses spread over all phases and headings.
    n_lanes : poses at each heading along rows of tags that are farther apart than an antenna's swath is wide.
    """
    at = np.arange(n_oblique)[:, None] * _SPREAD % 1.0
    oblique = np.column_stack([at[:, :2] @ problem.basis, at[:, 2] * problem.sector_rad])
    lanes = np.arange(n_lanes)
    phases = np.stack([(lanes + 0.5) / n_lanes, lanes * GOLDEN_RATIO % 1.0], axis=-1) @ problem.basis
    aligned = [_at_heading(phases, heading) for heading in aligned_headings_rad(problem, sweep)]
    return np.concatenate([oblique, *aligned])


def aligned_headings_rad(problem: PlacementProblem, sweep: Sweep) -> list[float]:
    """Headings [rad] at which the motion runs along rows of tags farther apart than a swath, the widest first."""
    if MOTIONS[sweep.motion] is None:
        return []
    headings = [
        round((row.direction - sweep.course) % problem.sector_rad, 12) % problem.sector_rad
        for row in lattice_rows(problem.lattice, sweep.width)
    ]
    return list(dict.fromkeys(headings))


def _first_poses(problem: PlacementProblem, sweep: Sweep) -> NDArray[np.float64]:
    line = (np.arange(FIRST_PHASES) + 0.5) / FIRST_PHASES
    phases = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2) @ problem.basis
    oblique = problem.sector_rad * (np.arange(FIRST_OBLIQUE) + 0.5) / FIRST_OBLIQUE
    headings = [*aligned_headings_rad(problem, sweep)[:FIRST_ALIGNED], *oblique]
    return np.concatenate([_at_heading(phases, heading) for heading in headings])


def _at_heading(places: NDArray, heading: float) -> NDArray:
    return np.column_stack([places, np.full(len(places), heading)])


def _distinct(rows: Demand) -> Demand:
    """Each row once: the first of those that the same mount points serve."""
    packed = np.packbits(rows.is_served, axis=1)
    _, first = np.unique(packed, axis=0, return_index=True)
    keep = np.sort(first)
    return replace(rows, poses=rows.poses[keep], motion=rows.motion[keep], distances=rows.distances[keep])
