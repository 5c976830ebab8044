"""Readers that the program placed, under the robot."""

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path

from rfiddesign.catalog import antennas
from rfiddesign.geometry import Rectangle, transform_points
from rfiddesign.geometry.lattice import Lattice
from rfiddesign.report.figures.robot import AREA, HOUSING, TAG, geometry_path
from rfiddesign.report.figures.style import BLACK, SKY, new_figure, plain_map, styled
from rfiddesign.results.placements import PlacementRecord


@styled
def placement_figure(record: PlacementRecord) -> Figure:
    """Draw the footprint, the antennas, the tags of one phase, and the swaths of antennas that drive forward."""
    figure = new_figure(4.4)
    axes = figure.subplots()
    plain_map(axes)
    radius = record.footprint_radius_mm
    half = 1.3 * radius
    tags = Lattice(record.basis_mm).points_in((-half, -half, half, half))
    axes.scatter(*tags.T, s=16, label="tag, one place of the robot", **TAG)
    axes.add_patch(Circle((0, 0), radius, fc="none", ec=BLACK, lw=1.3, zorder=4, label="robot"))
    _draw_antennas(axes, record, half)
    axes.annotate(
        "", (1.2 * radius, 0), (1.02 * radius, 0), zorder=6,
        arrowprops={"arrowstyle": "-|>", "color": BLACK, "lw": 2.4, "mutation_scale": 14, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    axes.set_xlim(-half, half)
    axes.set_ylim(-half, half)
    axes.set_xlabel("x, forward [mm]")
    axes.set_ylabel("y, left [mm]")
    figure.legend(loc="outside lower center", ncols=2, columnspacing=1.2, handletextpad=0.5)
    return figure


def _draw_antennas(axes: Axes, record: PlacementRecord, half: float) -> None:
    length, width = record.antenna_housing_mm
    known = antennas().get(record.antenna)
    area = (known.area if known is not None else Rectangle(length, width)).outline()
    _, bottom, _, top = area.bounds
    housing = geometry_path(shapely.box(-length / 2, -width / 2, length / 2, width / 2))
    for i, pose in enumerate(record.antennas):
        label = "swath, driving forward" if i == 0 else None
        axes.fill_between(
            [-half, half], pose.y_mm + bottom, pose.y_mm + top, color=SKY, alpha=0.18, lw=0, zorder=1, label=label
        )
        for path, look, name in ((housing, HOUSING, "antenna housing"), (geometry_path(area), AREA, "detection area")):
            place = np.array([pose.x_mm, pose.y_mm, pose.yaw_rad])
            placed = Path(transform_points(place, path.vertices), path.codes)
            axes.add_patch(PathPatch(placed, **look, label=name if i == 0 else None))
