"""Tags on the plan of the floor."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle
from numpy.typing import NDArray
from shapely import affinity
from shapely.geometry.base import BaseGeometry

from rfiddesign.report.figures.place import Window, inside, window_about
from rfiddesign.report.figures.robot import draw_robot, geometry_path
from rfiddesign.report.figures.style import BLACK, FLOOR, GREY, VERMILLION, new_figure, plain_map, styled
from rfiddesign.results.study_result import ChosenDesign

#: Half width and half height of the close-up [m].
CLOSE_UP_M = (1.5, 0.95)
#: More tags than these in the close-up are drawn as pixels.
MAX_VECTOR_TAGS = 3000


@styled
def tags_figure(
    drivable: BaseGeometry, tags_mm: NDArray[np.float64], chosen: ChosenDesign, place_mm: tuple[float, float]
) -> Figure:
    """Draw the floor with all tags (n, 2) [mm], and a close-up about a place with the robot to scale."""
    min_x, min_y, max_x, max_y = (bound / 1e3 for bound in drivable.bounds)
    plan_height = float(np.clip(3.4 * (max_y - min_y) / max(max_x - min_x, 1e-9), 1.2, 4.6))
    figure = new_figure(plan_height + 3.3)
    plan, close_up = figure.subplots(2, 1, height_ratios=[plan_height, 2.4])
    x, y = place_mm[0] / 1e3, place_mm[1] / 1e3
    window = window_about(x, y, *CLOSE_UP_M)
    floor_m = affinity.scale(drivable, 1e-3, 1e-3, origin=(0, 0))
    _draw_floor(plan, floor_m)
    tags_m = tags_mm / 1e3
    size = float(np.clip(2500.0 / max(len(tags_m), 1), 0.02, 6.0))
    plan.scatter(*tags_m.T, s=size, c=VERMILLION, linewidths=0, rasterized=True, zorder=2)
    _frame(plan, window)
    plan.set_title(f"{len(tags_m):,} tags; the frame is the close-up below", loc="left")
    _draw_floor(close_up, floor_m)
    near = inside(tags_m, window)
    size = float(np.clip(4000.0 / max(len(near), 1), 1.0, 12.0))
    is_heavy = len(near) > MAX_VECTOR_TAGS
    close_up.scatter(*near.T, s=size, marker="s", c=VERMILLION, linewidths=0, rasterized=is_heavy, zorder=2)
    draw_robot(close_up, chosen, (x, y), scale=1e-3)
    close_up.set_xlim(window.x_min, window.x_max)
    close_up.set_ylim(window.y_min, window.y_max)
    close_up.set_title("close-up with a robot to scale", loc="left")
    for axes in (plan, close_up):
        axes.set_xlabel("x [m]")
        axes.set_ylabel("y [m]")
    return figure


def _draw_floor(axes: Axes, floor_m: BaseGeometry) -> None:
    plain_map(axes)
    axes.add_patch(PathPatch(geometry_path(floor_m), fc=FLOOR, ec=GREY, lw=0.6, zorder=1))
    axes.autoscale_view()


def _frame(axes: Axes, window: Window) -> None:
    width, height = window.x_max - window.x_min, window.y_max - window.y_min
    axes.add_patch(Rectangle((window.x_min, window.y_min), width, height, fc="none", ec=BLACK, lw=1.6, zorder=3))
