"""How many readers it takes at least, wherever they are mounted."""

import math

from rfiddesign.geometry.travel import lattice_rows
from rfiddesign.optimize.reader_placement.motion import Sweep, sweeps
from rfiddesign.optimize.reader_placement.problem import PlacementProblem

_ROUNDING = 1e-9


def fewest_readers(problem: PlacementProblem) -> tuple[int, str]:
    """A number of readers below which no layout serves every phase and heading, and why, in words.

    Along rows of tags an antenna keeps its lateral place between the rows, so that it reads at no more than a share
    swath / spacing of all lateral phases; and from anywhere, in one motion, at no more than the share that what it
    sweeps has of a cell of the lattice.  All of the readers must together reach every phase as often as wanted.
    """
    wanted = problem.n_wanted
    best, why = wanted, f"{_reads(wanted)} by different antennas"
    for sweep in sweeps(problem):
        for ratio, reason in _ratios(problem, sweep):
            bound = math.ceil(wanted * ratio - _ROUNDING)
            if bound > best:
                best, why = bound, f"{sweep.motion}: {reason}"
    return best, why


def _ratios(problem: PlacementProblem, sweep: Sweep) -> list[tuple[float, str]]:
    if sweep.turn > 0:
        return []
    cell = problem.lattice.cell_area_mm2
    ratios = [(cell / sweep.area, f"an antenna sweeps {sweep.area / cell:.1%} of a cell of the lattice")]
    for row in lattice_rows(problem.lattice, sweep.width)[:1]:
        ratios.append((row.spacing / sweep.width, f"rows {row.spacing:.4g} mm apart, a swath of {sweep.width:.4g} mm"))
    return ratios


def _reads(n: int) -> str:
    return "a read" if n == 1 else f"{n} reads"
