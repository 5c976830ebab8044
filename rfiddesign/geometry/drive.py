"""How far a robot drives straight on between two reads, and the headings at which it never reads at all.

Along a row of tags a robot keeps its lateral place between the rows. If the antennas' lateral offsets, modulo the
distance between rows, leave a lane free, a robot in that lane reads nothing until its course drifts out of it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
import shapely.affinity
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.geometry._drive_kernels import lane_gaps
from rfiddesign.geometry.areas import DetectionArea
from rfiddesign.geometry.coverage import GOLDEN_RATIO
from rfiddesign.geometry.layouts import ReaderLayout
from rfiddesign.geometry.patterns import ListedPattern, TagPattern
from rfiddesign.geometry.symmetry import lattice_order
from rfiddesign.geometry.travel import Row, Travel, free_lanes, like_heading, rotated, travel

N_OBLIQUE = 6
ALIGNED_LANES, OBLIQUE_LANES = 1024, 256
#: Length [mm] of an oblique lane over which starts are spread, and first guess at how far it is to the next read.
OBLIQUE_WINDOW, NEAR = 1000.0, 600.0
#: Width [mm] of the floor on which lanes over patterns without a lattice start.
FLOOR_WIDTH = 4000.0
#: Directions nearer than this [rad] to a row of tags count as along it.
ALIGNED_WITHIN = math.radians(1e-3)


@dataclass(frozen=True)
class HeadingDrive:
    """Distance driven straight on from a random pose at one heading to the next read; 0 where a tag is in view.

    Parameters
    ----------
    heading_deg : heading of the robot against the lattice's frame [deg].
    mean_mm, p95_mm, max_mm : mean, 95th percentile and maximum over starting positions [mm], each distance capped at
        the horizon.
    share_over_limit : fraction of starting positions from which it is farther than the limit.
    is_aligned : whether the course runs along rows of tags that are farther apart than an antenna sees.
    """

    heading_deg: float
    mean_mm: float
    p95_mm: float
    max_mm: float
    share_over_limit: float
    is_aligned: bool


@dataclass(frozen=True)
class Aliasing:
    """Lanes along the rows of a lattice in which a robot never reads.

    Parameters
    ----------
    heading_deg : heading of the robot against the lattice's frame [deg].
    row_spacing_mm : distance between the rows along which it drives [mm].
    blind_share : fraction of lateral positions at which no antenna passes over any tag.
    blind_distance_mm : distance [mm] driven there without a read: the horizon, since it has no end.
    message : the same in words.
    """

    heading_deg: float
    row_spacing_mm: float
    blind_share: float
    blind_distance_mm: float
    message: str


def blind_distances(
    layout: ReaderLayout,
    area: DetectionArea,
    pattern: TagPattern,
    headings_deg: Sequence[float] | None = None,
    *,
    limit_mm: float = 500.0,
    horizon_mm: float = 5000.0,
    course_deg: float = 0.0,
) -> tuple[HeadingDrive, ...]:
    """Return how far it is to the next read, heading by heading, over all starting positions.

    Along rows of a lattice the lanes repeat and are followed once around; at other headings, and on patterns without a
    lattice, evenly spread lanes stand for all (the maximum is then that of the lanes followed).

    Parameters
    ----------
    headings_deg : headings of the robot [deg]; if None, those along rows that are farther apart than an antenna sees,
        one of each set that symmetry makes alike, and some oblique ones evenly between.
    limit_mm : distance above which a start counts in `share_over_limit` [mm].
    horizon_mm : distance at which looking ends [mm].
    course_deg : direction of travel against the robot's heading [deg], such as 90 to the left.

    Raises
    ------
    ValueError : if a distance or heading is out of bounds, or `pattern` is a list, which has no floor of its own.
    """
    limit, horizon = _bounds(limit_mm, horizon_mm)
    if isinstance(pattern, ListedPattern):
        raise ValueError("pattern = list: must be a pattern without end for blind distances")
    robot = travel(layout, area, pattern, course_deg)
    if headings_deg is None:
        headings_deg = _default_headings(robot)
    drives = []
    for heading in headings_deg:
        direction = math.radians(require.finite("headings_deg", heading) + robot.course_deg)
        row = next((row for row in robot.rows if _is_along(row, direction)), None)
        gaps, total = _gaps(robot, direction, row, horizon)
        drives.append(_heading_drive(heading, gaps, total, (limit, horizon), row is not None))
    return tuple(drives)


def aliased_headings(
    layout: ReaderLayout,
    area: DetectionArea,
    pattern: TagPattern,
    *,
    limit_mm: float = 500.0,
    horizon_mm: float = 5000.0,
    course_deg: float = 0.0,
) -> tuple[Aliasing, ...]:
    """Return the headings at which lanes are never read although the antennas, spaced otherwise, could close them.

    Together the antennas see at least the distance between rows, but modulo that distance their lateral offsets
    coincide or leave gaps. One heading of each set that symmetry makes alike is listed, rows far apart first.

    Parameters
    ----------
    limit_mm : distance without a read [mm] for which the message tells how exactly a course has to follow the rows.
    horizon_mm : distance at which looking ends [mm].
    course_deg : direction of travel against the robot's heading [deg].
    """
    return _blind_rows(travel(layout, area, pattern, course_deg), limit_mm, horizon_mm, is_closable=True)


def blind_corridors(
    layout: ReaderLayout,
    area: DetectionArea,
    pattern: TagPattern,
    *,
    limit_mm: float = 500.0,
    horizon_mm: float = 5000.0,
    course_deg: float = 0.0,
) -> tuple[Aliasing, ...]:
    """Return, as `aliased_headings`, those at which lanes are never read because there are too few antennas."""
    return _blind_rows(travel(layout, area, pattern, course_deg), limit_mm, horizon_mm, is_closable=False)


def _is_along(row: Row, direction: float) -> bool:
    return abs(math.remainder(direction - row.direction, math.pi)) < ALIGNED_WITHIN


def _default_headings(robot: Travel) -> list[float]:
    sector = 180.0 if robot.lattice is None else 360.0 / lattice_order(robot.lattice)
    oblique = {like_heading(robot, sector * (k + 0.5) / (2 * N_OBLIQUE)) for k in range(2 * N_OBLIQUE)}
    aligned = {like_heading(robot, math.degrees(row.direction) - robot.course_deg) for row in robot.rows}
    return sorted(aligned) + sorted(oblique - aligned)


def _gaps(robot: Travel, direction: float, row: Row | None, horizon: float) -> tuple[NDArray, float]:
    """Return the gaps, as `lane_gaps`, with their distances up to the horizon; and the length of all starts [mm]."""
    is_repeating = robot.pattern.lattice is not None
    if row is not None and is_repeating:
        window, looks = row.period, (min(row.period, horizon),)
    else:
        window, looks = OBLIQUE_WINDOW, (min(NEAR, horizon), horizon)
    starts = _starts(robot, direction, row if is_repeating else None)
    for look in looks:
        u, v = _tags_along(robot, direction, starts, window + look)
        gaps = lane_gaps(starts, window, look, robot.antennas, robot.radius, robot.edges, u, v)
        is_open = gaps[:, 0] < 0
        if not is_open.any():
            break
    gaps[is_open] = horizon + np.stack([np.zeros(is_open.sum()), gaps[is_open, 1]], axis=-1)
    return gaps, window * len(starts)


def _starts(robot: Travel, direction: float, row: Row | None) -> NDArray:
    """Return where lanes begin (n, 2) in the frame of travel [mm], evenly over all phases of the pattern."""
    if row is not None:
        return np.stack([np.zeros(ALIGNED_LANES), row.spacing * _midpoints(ALIGNED_LANES)], axis=-1)
    if robot.lattice is None or robot.pattern.lattice is None:
        return np.stack([np.zeros(OBLIQUE_LANES), FLOOR_WIDTH * _midpoints(OBLIQUE_LANES)], axis=-1)
    shares = np.stack([_midpoints(OBLIQUE_LANES), np.arange(OBLIQUE_LANES) * GOLDEN_RATIO % 1.0], axis=-1)
    return shares @ rotated(robot.lattice.reduced_basis_mm, -direction)


def _tags_along(robot: Travel, direction: float, starts: NDArray, length: float) -> tuple[NDArray, NDArray]:
    """Return all tags that an antenna may see from lanes of that length: u and v (n,) [mm], sorted by v."""
    margin = robot.area.reach_mm + 1.0
    u0, v0 = starts.min(axis=0) + robot.antennas.min(axis=0) - margin
    u1, v1 = starts.max(axis=0) + robot.antennas.max(axis=0) + (length, 0.0) + margin
    corridor = shapely.affinity.rotate(shapely.box(u0, v0, u1, v1), direction, origin=(0, 0), use_radians=True)
    origin = robot.lattice.origin_mm if robot.pattern.lattice is not None else (0.0, 0.0)
    tags = robot.pattern.lay(shapely.affinity.translate(corridor, *origin)) - origin
    tags = rotated(tags, -direction)
    tags = tags[np.argsort(tags[:, 1], kind="stable")]
    return tags[:, 0].copy(), tags[:, 1].copy()


def _heading_drive(
    heading_deg: float, gaps: NDArray, total: float, bounds: tuple[float, float], is_aligned: bool
) -> HeadingDrive:
    limit, horizon = bounds
    near, far = gaps.T
    near_capped, far_capped = np.minimum(near, horizon), np.minimum(far, horizon)
    beyond = (far - near) - (far_capped - near_capped)
    return HeadingDrive(
        heading_deg=float(heading_deg),
        mean_mm=float((far_capped**2 - near_capped**2).sum() / 2 + horizon * beyond.sum()) / total,
        p95_mm=min(_quantile(near, far, total, 0.95), horizon),
        max_mm=float(far_capped.max(initial=0.0)),
        share_over_limit=float(np.maximum(far - np.maximum(near, limit), 0.0).sum() / total),
        is_aligned=is_aligned,
    )


def _quantile(near: NDArray, far: NDArray, total: float, share: float) -> float:
    """Return the distance that `share` of all starts stay below; those outside of gaps have distance 0."""
    in_gaps = float((far - near).sum())
    wanted = in_gaps - (1 - share) * total
    if wanted <= 0:
        return 0.0
    distances = np.concatenate([near, far])
    order = np.argsort(distances, kind="stable")
    distances = distances[order]
    n_gaps_there = np.cumsum(np.where(order < len(near), 1, -1))
    below = np.concatenate([[0.0], np.cumsum(n_gaps_there[:-1] * np.diff(distances))])
    return float(np.interp(wanted, below, distances))


def _blind_rows(robot: Travel, limit_mm: float, horizon_mm: float, *, is_closable: bool) -> tuple[Aliasing, ...]:
    limit, horizon = _bounds(limit_mm, horizon_mm)
    found = {}
    for row in robot.rows:
        lanes = free_lanes(robot.swaths, row.spacing)
        if len(lanes) == 0 or is_closable != ((robot.swaths[:, 1] - robot.swaths[:, 0]).sum() >= row.spacing):
            continue
        heading = like_heading(robot, math.degrees(row.direction) - robot.course_deg)
        share = float(lanes.sum() / row.spacing)
        cause = "reader offsets coincide modulo" if is_closable else "too few readers for"
        message = (
            f"heading {heading:.4g} deg: {cause} the row spacing of {row.spacing:.4g} mm; {share:.1%} of the lanes "
            f"along the rows are never read, and the robot is blind over {limit:g} mm at courses within "
            f"{math.degrees(math.atan2(lanes.max(), limit)):.2g} deg of them"
        )
        found.setdefault(heading, Aliasing(heading, row.spacing, share, horizon, message))
    return tuple(found.values())


def _bounds(limit_mm: float, horizon_mm: float) -> tuple[float, float]:
    limit, horizon = require.positive("limit_mm", limit_mm), require.positive("horizon_mm", horizon_mm)
    if limit >= horizon:
        raise ValueError(f"limit_mm = {limit:g}: must be below horizon_mm = {horizon:g}")
    return limit, horizon


def _midpoints(n: int) -> NDArray:
    return (np.arange(n) + 0.5) / n
