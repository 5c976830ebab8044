"""A robot from above, as it is drawn in several figures."""

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from rfiddesign.catalog import antennas
from rfiddesign.geometry import DetectionArea, Rectangle, transform_points
from rfiddesign.report.figures.style import BLACK, GREY, SKY, VERMILLION
from rfiddesign.results.study_result import ChosenDesign

HOUSING = {"facecolor": "none", "edgecolor": GREY, "linewidth": 0.9, "zorder": 5}
AREA = {"facecolor": SKY + "90", "edgecolor": "none", "zorder": 3}
TAG = {"marker": "s", "color": VERMILLION, "linewidths": 0, "zorder": 4}


def detection_area(chosen: ChosenDesign) -> DetectionArea:
    """What the design's antenna sees: as in the catalog, or what lies under its housing if it is not there."""
    known = antennas().get(chosen.antenna)
    if known is None:
        return Rectangle(*chosen.antenna_housing_mm)
    is_mounted = chosen.antenna_height_mm is not None and known.sphere is not None
    return known.at_height(chosen.antenna_height_mm).area if is_mounted else known.area


def antenna_poses(chosen: ChosenDesign) -> NDArray[np.float64]:
    """Poses of the antennas (n, 3): x [mm], y [mm], yaw [rad]."""
    return np.array([(pose.x_mm, pose.y_mm, pose.yaw_rad) for pose in chosen.antennas], float).reshape(-1, 3)


def geometry_path(geometry: BaseGeometry) -> Path:
    """A polygonal geometry as one path, holes included."""
    points, codes = [], []
    for polygon in shapely.get_parts(geometry):
        for ring in (shapely.orient_polygons(polygon).exterior, *shapely.orient_polygons(polygon).interiors):
            ring_points = shapely.get_coordinates(ring)
            points.append(ring_points)
            codes += [Path.MOVETO, *[Path.LINETO] * (len(ring_points) - 2), Path.CLOSEPOLY]
    return Path(np.concatenate(points), codes)


def draw_robot(
    axes: Axes, chosen: ChosenDesign, place: tuple[float, float] = (0.0, 0.0), *, scale: float = 1.0
) -> None:
    """Draw footprint, detection areas and housings of a robot that heads along x.

    Parameters
    ----------
    place : where the robot stands, in the axes' unit.
    scale : the axes' unit per mm, 1e-3 for axes in metres.
    """
    area = geometry_path(detection_area(chosen).outline())
    length, width = chosen.antenna_housing_mm
    housing = geometry_path(shapely.box(-length / 2, -width / 2, length / 2, width / 2))
    axes.add_patch(
        Circle(place, chosen.footprint_radius_mm * scale, fc="none", ec=BLACK, lw=1.3, zorder=4, label="robot")
    )
    for i, pose in enumerate(antenna_poses(chosen)):
        for path, look, label in ((housing, HOUSING, "antenna housing"), (area, AREA, "detection area")):
            placed = Path(transform_points(pose, path.vertices) * scale + place, path.codes)
            axes.add_patch(PathPatch(placed, **look, label=label if i == 0 else None))
