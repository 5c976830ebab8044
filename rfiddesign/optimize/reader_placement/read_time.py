"""Readers that take time: a tag is read once it has been in view for so long, from a robot that drives on."""

from dataclasses import replace

import shapely
import shapely.affinity

from rfiddesign import require
from rfiddesign.geometry import PolygonArea
from rfiddesign.optimize.reader_placement.problem import PlacementProblem


def with_read_time(problem: PlacementProblem, speed_mm_per_s: float, read_time_s: float) -> PlacementProblem:
    """The same question for readers that read at once: what they see is eroded along the way, the distance shorter.

    While it reads, the robot drives L = speed x time.  A tag that stays in view for L, and whose read has ended by the
    distance allowed, is one that lies in both of the areas L/2 ahead of and behind the antenna's, at some time at which
    there is L/2 left to drive, and before which L/2 was driven: the area is the intersection of both, the distance
    shorter by L, and the start L/2 ahead, which over all phases makes no difference.

    Parameters
    ----------
    problem : what is asked; its motions must be "forward" alone.
    speed_mm_per_s : of the robot [mm/s].
    read_time_s : for which a tag must be in view [s].

    Raises
    ------
    ValueError : if the antenna drives past every tag too fast, or there are other motions.
    """
    way = require.positive("speed_mm_per_s", speed_mm_per_s) * require.not_negative("read_time_s", read_time_s)
    if problem.motions != ("forward",):
        raise ValueError(f"motions = {list(problem.motions)}: must be forward alone if reads take time")
    if way == 0:
        return problem
    outline = problem.antenna.area.outline()
    ahead, behind = (shapely.affinity.translate(outline, side * way / 2) for side in (1, -1))
    seen = shapely.intersection(ahead, behind)
    if not seen.area > 0:
        raise ValueError(f"speed_mm_per_s = {speed_mm_per_s:g}: {way:.4g} mm are driven during a read, too far")
    if not problem.distance_mm > way:
        raise ValueError(f"distance_mm = {problem.distance_mm:g}: must exceed the {way:.4g} mm driven during a read")
    corners = tuple(map(tuple, shapely.get_coordinates(seen)[:-1].tolist()))
    antenna = replace(problem.antenna, area=PolygonArea(corners), rssi_radii_mm=(), sphere=None)
    return replace(problem, antenna=antenna, distance_mm=problem.distance_mm - way)
