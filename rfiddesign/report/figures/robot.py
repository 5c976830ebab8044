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
from rfiddesign.report.figures.style import BLACK, GREY, ORANGE, SKY
from rfiddesign.results.study_result import ChosenDesign


def detection_area(chosen: ChosenDesign) -> DetectionArea:
    """What the design's antenna sees: as in the catalog, or what lies under its housing if it is not there."""
    known = antennas().get(chosen.antenna)
    return known.area if known is not None else Rectangle(*chosen.antenna_housing_mm)


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


def draw_robot(axes: Axes, chosen: ChosenDesign, x: float = 0.0, y: float = 0.0, *, is_labelled: bool = True) -> None:
    """Draw footprint, detection areas and housings of a robot at x, y [mm], heading along x."""
    poses = antenna_poses(chosen)
    area = geometry_path(detection_area(chosen).outline())
    length, width = chosen.antenna_housing_mm
    housing = geometry_path(shapely.box(-length / 2, -width / 2, length / 2, width / 2))
    axes.add_patch(
        Circle((x, y), chosen.footprint_radius_mm, fc="none", ec=BLACK, lw=1.3, zorder=4,
               label="robot" if is_labelled else None)
    )  # fmt: skip
    for i, pose in enumerate(poses):
        for path, look in ((housing, HOUSING), (area, AREA)):
            placed = Path(transform_points(pose, path.vertices) + (x, y), path.codes)
            label = look["label"] if is_labelled and i == 0 else None
            axes.add_patch(PathPatch(placed, **{**look, "label": label}))


HOUSING = {"fc": "none", "ec": GREY, "lw": 0.9, "zorder": 5, "label": "antenna housing"}
AREA = {"fc": (*(int(SKY[i : i + 2], 16) / 255 for i in (1, 3, 5)), 0.55), "ec": "none", "zorder": 3, "label": "detection area"}
TAG = {"marker": "s", "color": ORANGE, "edgecolors": BLACK, "linewidths": 0.4}
