"""Coverage: what the antennas of a robot see of a tag pattern, over all positions and headings of the robot."""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.geometry._coverage_kernels import disc_levels, scanline_levels
from rfiddesign.geometry.areas import DetectionArea, Disc
from rfiddesign.geometry.lattice import Lattice
from rfiddesign.geometry.layouts import ReaderLayout
from rfiddesign.geometry.patterns import TagPattern
from rfiddesign.geometry.sampled_coverage import sampled_levels
from rfiddesign.geometry.symmetry import heading_sector

#: Averages over headings are refined until trebling their number moves no result by more than this, of which less than
#: a third remains as error; scanlines need room for an error of their own.
HEADING_TOLERANCE = {"exact": 1e-4, "scanline": 5e-5}
#: For areas other than discs, the least number of lines between two rows of the lattice and through an area.
LINES_PER_ROW, LINES_PER_AREA = 128, 48
MAX_HEADINGS = 30_000
#: Successive multiples of it, modulo 1, stay evenly spread.
GOLDEN_RATIO = (math.sqrt(5) - 1) / 2


@dataclass(frozen=True)
class Coverage:
    """What a robot's antennas see, averaged over all its positions and headings.

    Parameters
    ----------
    k_coverage : fraction of poses at which at least k readers see at least one tag, for k = 1 to k_max.
    expected_reads : mean number of readers that see a tag, which is the mean number of reads per poll.
    two_tags_share : fraction of poses at which some antenna has two or more tags in view.
    method : "exact" (discs over a lattice), "scanline" (other areas over a lattice) or "sampled" (other patterns).
    stderr : the largest error to expect of the above: what the last refinement of the headings moved, or the standard
        error where poses are sampled.
    """

    k_coverage: tuple[float, ...]
    expected_reads: float
    two_tags_share: float
    method: str
    stderr: float


def coverage(
    layout: ReaderLayout,
    area: DetectionArea,
    pattern: TagPattern,
    *,
    n_headings: int | None = None,
    k_max: int = 3,
) -> Coverage:
    """Return what the antennas of `layout` see of `pattern`, each within its detection area `area`.

    Parameters
    ----------
    n_headings : headings to average over, spread evenly over the sector that symmetry leaves; as many as needed for
        1e-4 if None. Patterns without a lattice are sampled at random headings instead.
    k_max : the largest k of `Coverage.k_coverage`.

    Raises
    ------
    ValueError : if `n_headings` or `k_max` is out of bounds, or a pattern without a lattice is empty.
    """
    k_max = require.count("k_max", k_max, at_most=1000)
    if n_headings is not None:
        n_headings = require.count("n_headings", n_headings, at_most=MAX_HEADINGS)
    if pattern.lattice is None:
        levels, stderr = sampled_levels(layout, area, pattern, k_max)
        return _coverage(levels, "sampled", stderr)
    sector = heading_sector(layout, area, pattern.lattice)

    def averaged(n: int) -> NDArray[np.float64]:
        return coverage_by_heading(layout, area, pattern.lattice, sector.midpoints(n), k_max=k_max).mean(axis=0)

    method = "exact" if isinstance(area, Disc) else "scanline"
    if n_headings is not None:
        levels = averaged(n_headings)
        return _coverage(levels, method, _distance(levels, averaged(n_headings // 3 if n_headings >= 3 else 3)))
    n = _first_headings(layout, area, sector.width_rad)
    levels, error = averaged(n), math.inf
    while error > HEADING_TOLERANCE[method] and 3 * n <= MAX_HEADINGS:
        n *= 3
        finer = averaged(n)
        levels, error = finer, _distance(levels, finer)
    return _coverage(levels, method, error)


def coverage_by_heading(
    layout: ReaderLayout, area: DetectionArea, lattice: Lattice, headings: NDArray[np.float64], *, k_max: int = 3
) -> NDArray[np.float64]:
    """Return coverage over all phases of a lattice, heading by heading.

    Exact for discs; for other areas by scanlines, whose error averages out over headings: at a single one it is some
    1e-4, and up to 1e-3 where straight sides lie nearly along a row of the lattice.

    Parameters
    ----------
    headings : headings (n,) of the robot against the lattice's frame [rad].

    Returns
    -------
    levels : (n, k_max + 2); column k - 1 is the fraction of phases at which at least k readers see a tag, column k_max
        the mean number of readers that do, column k_max + 1 the fraction at which some antenna has two tags in view.
    """
    headings = np.ascontiguousarray(headings, dtype=np.float64)
    poses = layout.poses_mm
    a, b = basis = lattice.reduced_basis_mm
    if -float(area.signed_distance(np.zeros(2))) >= np.hypot(*basis.T).sum():
        # The corners of the cell around an antenna's centre are all in its view, wherever it is.
        n = layout.n_readers
        return np.tile([float(n > k) for k in range(k_max)] + [float(n), 1.0], (len(headings), 1))
    length = math.hypot(*a)
    sheared = (length, float(a @ b) / length, abs(float(a[0] * b[1] - a[1] * b[0])) / length)
    from_row = headings - math.atan2(a[1], a[0])
    if isinstance(area, Disc):
        return disc_levels(poses[:, :2].copy(), float(area.radius_mm), from_row, sheared, k_max)
    phases = np.arange(1, len(headings) + 1) * GOLDEN_RATIO % 1.0
    n_lines = max(LINES_PER_ROW, math.ceil(LINES_PER_AREA * sheared[2] / math.sqrt(area.area_mm2)))
    return scanline_levels(poses, outline_edges(area), from_row, phases, sheared, n_lines, k_max)


def outline_edges(area: DetectionArea) -> NDArray[np.float64]:
    """Return the sides (m, 4) [mm] x0, y0, x1, y1 of the area's outline, holes included, in its antenna's frame.

    Where the outline stands for something round it is scaled to the exact area.
    """
    outline = area.outline()
    rings = shapely.get_rings(shapely.get_parts(outline))
    corners = [shapely.get_coordinates(ring) for ring in rings]
    edges = np.concatenate([np.hstack([ring[:-1], ring[1:]]) for ring in corners])
    return np.ascontiguousarray(edges * math.sqrt(area.area_mm2 / outline.area))


def _first_headings(layout: ReaderLayout, area: DetectionArea, width_rad: float) -> int:
    """Return how many headings it takes so that no antenna steps over its own view from one to the next."""
    positions = layout.poses_mm[:, :2]
    arm = float(np.hypot(*(positions - positions.mean(axis=0)).T).max())
    step = math.sqrt(area.area_mm2 / math.pi) / max(arm, area.reach_mm)
    return min(max(math.ceil(width_rad / step), 8), MAX_HEADINGS)


def _distance(levels: NDArray, others: NDArray) -> float:
    return float(np.abs(levels - others).max())


def _coverage(levels: NDArray, method: str, stderr: float) -> Coverage:
    *k_coverage, expected_reads, two_tags_share = levels.tolist()
    # Rounding may leave sums of arcs 1e-16 outside of what a fraction can be.
    fractions = tuple(min(max(share, 0.0), 1.0) for share in k_coverage)
    return Coverage(fractions, expected_reads, min(max(two_tags_share, 0.0), 1.0), method, stderr)
