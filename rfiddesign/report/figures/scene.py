"""A scene of UHF tags: what stands in it, a drive, and how many tags a robot can expect to read."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray
from shapely import affinity
from shapely.geometry.base import BaseGeometry

from rfiddesign.floor.scene import Scene
from rfiddesign.report.figures.robot import geometry_path
from rfiddesign.report.figures.style import BLUE, FLOOR, GREY, VERMILLION, WIDTH_IN, new_figure, plain_map, styled

_WALL, _SHELF = "#c9ced6", "#4b5563"


@styled
def scene_figure(
    scene: Scene,
    drive_mm: NDArray[np.float64] | None = None,
    reads: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]] | None = None,
    words: str = "tags expected in a snapshot",
) -> Figure:
    """Draw a scene with its tags that are not buried.

    Parameters
    ----------
    scene : the scene.
    drive_mm : places (n, 2) of a drive [mm].
    reads : x (n_x,) and y (n_y,) of cells [mm] and the tags expected there (n_y, n_x), nan outside, as
        `models.reads_over_floor` computes them.
    words : what `reads` are, for the colour bar.
    """
    shown = [scene.floor.drivable, *(obstacle.outline for obstacle in scene.obstacles)]
    bounds = np.array([outline.bounds for outline in shown]) / 1e3
    width, height = bounds[:, 2].max() - bounds[:, 0].min(), bounds[:, 3].max() - bounds[:, 1].min()
    plan_in = float(np.clip((WIDTH_IN - 0.6) * height / max(width, 1e-9), 0.8, 4.6))
    figure = new_figure(plan_in + 1.0 + (0.6 if reads is not None else 0.0))
    axes = figure.subplots()
    plain_map(axes)
    _fill(axes, scene.floor.drivable, FLOOR, 1)
    if reads is not None:
        x, y, values = reads
        image = axes.pcolormesh(x / 1e3, y / 1e3, values, cmap="cividis", vmin=0.0, rasterized=True, zorder=2)
        bar = figure.colorbar(image, ax=axes, orientation="horizontal", aspect=45, pad=0.02)
        bar.set_label(words)
    for obstacle in scene.obstacles:
        _fill(axes, obstacle.outline, _SHELF if obstacle.material == "shelf" else _WALL, 3)
    if drive_mm is not None:
        line = axes.plot(*(drive_mm.T / 1e3), c=BLUE if reads is None else "white", lw=0.7, zorder=4, label="a drive")
        if reads is not None:
            # An outline lets a white line be seen in the legend too.
            line[0].set_path_effects([withStroke(linewidth=1.5, foreground=GREY)])
    tags = scene.tags.positions[~scene.is_buried()] / 1e3
    size = float(np.clip(2500.0 / max(len(tags), 1), 0.3, 7.0))
    axes.scatter(*tags.T, s=size, c=VERMILLION, linewidths=0, zorder=5, label=f"{len(tags):,} tags")
    axes.autoscale_view()
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    legend = axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2, handlelength=1.4)
    for handle in legend.legend_handles:
        if hasattr(handle, "set_sizes"):
            handle.set_sizes([9.0])
    return figure


def _fill(axes: Axes, outline: BaseGeometry, colour: str, order: int) -> None:
    outline_m = affinity.scale(outline, 1e-3, 1e-3, origin=(0, 0))
    axes.add_patch(PathPatch(geometry_path(outline_m), fc=colour, ec=GREY, lw=0.5, zorder=order))
