"""Routes, stations and tags on the plan of the floor."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from numpy.typing import NDArray
from shapely import affinity
from shapely.geometry.base import BaseGeometry

from rfiddesign.report.figures.place import inside, window_about
from rfiddesign.report.figures.robot import draw_robot, geometry_path
from rfiddesign.report.figures.style import (
    BLUE,
    FLOOR,
    GREY,
    SKY,
    VERMILLION,
    new_figure,
    plain_map,
    styled,
)
from rfiddesign.results.routes import NetworkRecord
from rfiddesign.results.study_result import ChosenDesign

#: Half width and half height of the close-up [m].
CLOSE_UP_M = (1.6, 1.0)


@styled
def routes_figure(
    drivable: BaseGeometry, network: NetworkRecord, tags_mm: NDArray[np.float64], chosen: ChosenDesign,
    place_mm: tuple[float, float],
) -> Figure:  # fmt: skip
    """Draw routes, numbered stations and tags (n, 2) [mm] on the floor, and a close-up about a place on a route."""
    min_x, min_y, max_x, max_y = (bound / 1e3 for bound in drivable.bounds)
    plan_height = float(np.clip(3.4 * (max_y - min_y) / max(max_x - min_x, 1e-9), 1.2, 4.6))
    figure = new_figure(plan_height + 3.6)
    plan, close_up = figure.subplots(2, 1, height_ratios=[plan_height, 2.4])
    floor_m, tags_m = affinity.scale(drivable, 1e-3, 1e-3, origin=(0, 0)), tags_mm / 1e3
    size = float(np.clip(4000.0 / max(len(tags_m), 1), 0.15, 6.0))
    _draw(plan, floor_m, network, tags_m, size)
    stations = np.array(network.nodes_mm[: network.n_stations]) / 1e3
    plan.scatter(*stations.T, s=34, c=BLUE, edgecolors="white", linewidths=0.8, zorder=5, label="station")
    for number, (x, y) in enumerate(stations.tolist(), start=1):
        plan.annotate(str(number), (x, y), (3.5, 3.0), textcoords="offset points", fontsize=7.5, color=BLUE, zorder=6)
    plan.set_title(
        f"{network.length_m:,.0f} m of routes between {len(stations)} stations, {len(tags_m):,} tags", loc="left"
    )
    x, y = place_mm[0] / 1e3, place_mm[1] / 1e3
    window = window_about(x, y, *CLOSE_UP_M)
    near = inside(tags_m, window)
    _draw(close_up, floor_m, network, near, float(np.clip(4000.0 / max(len(near), 1), 2.0, 14.0)))
    draw_robot(close_up, chosen, (x, y), scale=1e-3)
    close_up.set_xlim(window.x_min, window.x_max)
    close_up.set_ylim(window.y_min, window.y_max)
    close_up.set_title("close-up with a robot to scale, heading along x", loc="left")
    for axes in (plan, close_up):
        axes.set_xlabel("x [m]")
        axes.set_ylabel("y [m]")
    # The legend shows tags as large as the close-up does.
    legend = [*plan.get_legend_handles_labels()[0]]
    legend[1] = close_up.get_legend_handles_labels()[0][1]
    figure.legend(handles=legend, loc="outside lower center", ncols=3, columnspacing=1.2, handletextpad=0.5)
    return figure


def _draw(axes: Axes, floor_m: BaseGeometry, network: NetworkRecord, tags_m: NDArray, size: float) -> None:
    plain_map(axes)
    axes.add_patch(PathPatch(geometry_path(floor_m), fc=FLOOR, ec=GREY, lw=0.6, zorder=1))
    lines = [np.array(edge.points_mm) / 1e3 for edge in network.edges]
    axes.add_collection(LineCollection(lines, colors=SKY, linewidths=2.4, zorder=2, label="route"))
    axes.scatter(*tags_m.T, s=size, marker="s", c=VERMILLION, linewidths=0, rasterized=True, zorder=3, label="tag")
    axes.autoscale_view()
