"""The sparsest rows of tags that a given robot reads in time from every phase and heading."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rfiddesign import require
from rfiddesign.geometry import LatticePattern, ReaderLayout, make_pattern
from rfiddesign.geometry.travel import lattice_rows
from rfiddesign.optimize.reader_placement.demand import sampled_poses
from rfiddesign.optimize.reader_placement.motion import sweeps
from rfiddesign.optimize.reader_placement.problem import PlacementProblem
from rfiddesign.optimize.reader_placement.read_time import with_read_time
from rfiddesign.optimize.reader_placement.recheck import unserved_by

#: Shifts of a row against the one before, as shares of the pitch; their mirror images are as good or bad.
STAGGERS = (0.0, 1 / 6, 1 / 4, 1 / 3, 5 / 12, 1 / 2)
#: Poses that most patterns already fail; boxes are halved down to this [mm].
N_QUICK, N_QUICK_LANES, FINEST_MM = 600, 64, 1.0
#: Squares of the step in the largest cell of a lattice that the readers could reach.
MAX_CELLS = 20_000


@dataclass(frozen=True)
class Drive:
    """How the robot drives, and what reading takes.

    Parameters
    ----------
    distance_mm : driven straight on before the read has come [mm].
    speed_mm_per_s : [mm/s].
    read_time_s : for which a tag must be in view [s].
    """

    distance_mm: float
    speed_mm_per_s: float
    read_time_s: float


@dataclass(frozen=True)
class SparsePattern:
    """Rows of tags.

    Parameters
    ----------
    family : "square", "triangular" or "staggered": the best of each.
    pattern : the pattern; None if none of those tried serves.
    pitch_mm, row_spacing_mm, stagger : distance between the tags of a row and between rows [mm], and the shift of a row
        against the one before as a share of the pitch.
    n_tried : patterns tried, all of them sparser but the last.
    """

    family: str
    pattern: LatticePattern | None
    pitch_mm: float
    row_spacing_mm: float
    stagger: float
    n_tried: int


def sparsest_patterns(
    problem: PlacementProblem, layout: ReaderLayout, drive: Drive, step_mm: float = 10.0
) -> tuple[SparsePattern, ...]:
    """The sparsest square, triangular and staggered rows that serve every phase and heading, one of each.

    Whether a pattern serves is not monotone in its pitch: all pitches and spacings in steps of `step_mm` are tried,
    the sparsest first, until one serves.

    Parameters
    ----------
    problem : antenna, reads and dead readers; its pattern and distance do not count.
    layout : readers under the robot, none turned unless it sees a disc.
    drive : the way and the time for a read.

    Raises
    ------
    ValueError : if so many patterns would have to be tried that it takes too long, or a number is out of bounds.
    """
    step = require.positive("step_mm", step_mm)
    asked = with_read_time(replace(problem, distance_mm=drive.distance_mm), drive.speed_mm_per_s, drive.read_time_s)
    (sweep,) = sweeps(asked)
    largest_cell = layout.n_readers * sweep.area / asked.n_wanted
    if largest_cell / step**2 > MAX_CELLS:
        raise ValueError(f"step_mm = {step:g}: too small for a distance of {drive.distance_mm:g} mm, too many patterns")
    return tuple(
        _sparsest(asked, layout, family, _cells(family, step, largest_cell))
        for family in ("square", "triangular", "staggered")
    )


def _sparsest(
    asked: PlacementProblem, layout: ReaderLayout, family: str, cells: Iterator[tuple[float, float, float]]
) -> SparsePattern:
    n_tried = 0
    for pitch, spacing, stagger in cells:
        n_tried += 1
        pattern = make_pattern("staggered", pitch_mm=pitch, row_ratio=spacing / pitch, stagger=stagger)
        if _serves(replace(asked, pattern=pattern), layout):
            return SparsePattern(family, pattern, pitch, spacing, stagger, n_tried)
    return SparsePattern(family, None, 0.0, 0.0, 0.0, n_tried)


def _cells(family: str, step: float, largest_cell: float) -> Iterator[tuple[float, float, float]]:
    """Pitch, spacing and stagger of a family, the largest cell first; none larger than readers can reach."""
    line = step * np.arange(1, int((3 * largest_cell) ** 0.5 / step) + 1)
    if family == "square":
        cells = [(pitch, pitch, 0.0) for pitch in line[line**2 <= largest_cell]]
    elif family == "triangular":
        height = np.sqrt(3) / 2
        cells = [(pitch, pitch * height, 0.5) for pitch in line[line**2 * height <= largest_cell]]
    else:
        # Short pitches over far rows are the same lattices as others, or leave lanes free.
        cells = [
            (pitch, spacing, stagger)
            for pitch in line
            for spacing in line
            if largest_cell / 12 <= pitch * spacing <= largest_cell and spacing <= 3 * pitch and pitch <= 3 * spacing
            for stagger in STAGGERS
        ]
    cells.sort(key=lambda cell: (-cell[0] * cell[1], cell))
    return iter((float(pitch), float(spacing), float(stagger)) for pitch, spacing, stagger in cells)


def _serves(asked: PlacementProblem, layout: ReaderLayout) -> bool:
    (sweep,) = sweeps(asked)
    # Along rows farther apart than all swaths together a lane stays free.
    if lattice_rows(asked.lattice, layout.n_readers * sweep.width / asked.n_wanted):
        return False
    mounts = layout.poses_mm[:, :2].copy()
    poses = sampled_poses(asked, sweep, N_QUICK, N_QUICK_LANES)
    reads = sweep.first_reads(poses, asked.basis, mounts)
    if (np.count_nonzero(np.isfinite(reads), axis=1) < asked.n_wanted).any():
        return False
    found, unserved, undecided, _ = unserved_by(asked, sweep, mounts, 1, FINEST_MM)
    return not len(found) and not unserved and not undecided
