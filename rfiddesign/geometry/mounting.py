"""Whether a reader layout can be built: antennas that overlap, or stick out of the robot."""

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign.geometry import se2
from rfiddesign.geometry.layouts import ReaderLayout

#: Housings may touch; deeper than this [mm] they overlap.
TOLERANCE_MM = 1e-6

#: A message names at most this many faults.
MAX_NAMED = 4


def antenna_outlines(layout: ReaderLayout, antenna: shapely.Polygon) -> NDArray[np.object_]:
    """Return the outline (n_readers,) of every antenna's housing under the robot, `antenna` being centred."""
    corners = shapely.get_coordinates(antenna.exterior)
    return shapely.polygons(se2.transform_points(layout.poses_mm[:, None, :], corners))


def check_layout(layout: ReaderLayout, antenna: shapely.Polygon, footprint: BaseGeometry) -> None:
    """Check that the antennas fit under the robot, side by side; touching each other or the rim is allowed.

    Parameters
    ----------
    layout : poses of the antennas in the robot's frame.
    antenna : outline of one antenna's housing [mm], centred on the antenna.
    footprint : where antennas may be mounted [mm], in the robot's frame.

    Raises
    ------
    ValueError : naming the antennas (counted from 1, with x and y) and by how many mm they overlap or stick out.
    """
    outlines = antenna_outlines(layout, antenna)
    protruding = _protruding(outlines, footprint)
    overlaps = _overlaps(layout, outlines)
    n_faults = len(protruding) + len(overlaps)
    if n_faults:
        faults = [_protrusion(layout, outlines, footprint, index) for index in protruding[:MAX_NAMED]] + overlaps
        more = f"; and {n_faults - MAX_NAMED} more" if n_faults > MAX_NAMED else ""
        raise ValueError(f"layout {layout.name}: {'; '.join(faults[:MAX_NAMED])}{more}")


def _protruding(outlines: NDArray, footprint: BaseGeometry) -> NDArray[np.int64]:
    allowed = footprint.buffer(TOLERANCE_MM, join_style="mitre")
    shapely.prepare(allowed)
    return np.flatnonzero(~shapely.covers(allowed, outlines))


def _protrusion(layout: ReaderLayout, outlines: NDArray, footprint: BaseGeometry, index: int) -> str:
    # Close points along the border find how far an edge bulges over a notch of the footprint, too.
    border = shapely.segmentize(outlines[index], 1.0)
    depth = shapely.distance(footprint, shapely.points(shapely.get_coordinates(border))).max()
    return f"antenna {_named(layout, index)} sticks out of the footprint by {depth:.3g} mm"


def _overlaps(layout: ReaderLayout, outlines: NDArray) -> list[str]:
    first, second = shapely.STRtree(outlines).query(outlines, predicate="intersects")
    order = np.lexsort((second, first))
    pairs = np.stack([first, second], axis=-1)[order]
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    depths = _thickness(shapely.intersection(outlines[pairs[:, 0]], outlines[pairs[:, 1]]))
    return [
        f"antennas {_named(layout, one)} and {_named(layout, other)} overlap by {depth:.3g} mm"
        for (one, other), depth in zip(pairs, depths, strict=True)
        if depth > TOLERANCE_MM
    ]


def _thickness(shapes: NDArray) -> NDArray[np.float64]:
    """Shorter side [mm] of the smallest rectangle around each shape: 0 for a line or a point."""
    is_area = shapely.area(shapes) > 0
    thickness = np.zeros(len(shapes))
    corners = shapely.get_coordinates(shapely.oriented_envelope(shapes[is_area])).reshape(-1, 5, 2)
    sides = np.hypot(*np.moveaxis(corners[:, 1:3] - corners[:, 0:2], -1, 0))
    thickness[is_area] = sides.min(axis=-1)
    return thickness


def _named(layout: ReaderLayout, index: int) -> str:
    x, y, _ = layout.poses[index]
    return f"{index + 1} (x = {x:g}, y = {y:g})"
