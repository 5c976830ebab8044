"""The antennas under the robot."""

import math

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rfiddesign.report.figures.place import inside, window_about
from rfiddesign.report.figures.robot import TAG, antenna_poses, draw_robot
from rfiddesign.report.figures.style import BLACK, WIDTH_IN, new_figure, plain_map, styled
from rfiddesign.results.study_result import ChosenDesign

#: Antennas closer than this [pt] are not all numbered.
NUMBER_PITCH_PT = 14.0
NUMBER_EVERY = 5


@styled
def layout_figure(chosen: ChosenDesign, tags_mm: NDArray[np.float64]) -> Figure:
    """Draw footprint, housings, detection areas and numbered antennas, over tags (n, 2) [mm] in the robot's frame."""
    figure = new_figure(4.6)
    axes = figure.subplots()
    plain_map(axes)
    poses = antenna_poses(chosen)
    reach = np.hypot(*poses[:, :2].T).max(initial=0.0) + math.hypot(*chosen.antenna_housing_mm) / 2
    half = 1.16 * max(chosen.footprint_radius_mm, reach)
    tags = inside(tags_mm, window_about(0.0, 0.0, 0.97 * half, 0.97 * half))
    if tags.size:
        axes.scatter(*tags.T, s=16, label="tag", **TAG)
    draw_robot(axes, chosen)
    _draw_forward(axes, chosen.footprint_radius_mm)
    _draw_numbers(axes, poses, points_per_mm=0.8 * WIDTH_IN * 72 / (2 * half))
    axes.set_xlim(-half, half)
    axes.set_ylim(-half, half)
    axes.set_xlabel("x, forward [mm]")
    axes.set_ylabel("y, left [mm]")
    figure.legend(loc="outside lower center", ncols=2, columnspacing=1.2, handletextpad=0.5)
    return figure


def _draw_forward(axes: Axes, radius: float) -> None:
    axes.annotate(
        "",
        (1.14 * radius, 0),
        (1.01 * radius, 0),
        zorder=6,
        arrowprops={"arrowstyle": "-|>", "color": BLACK, "lw": 2.4, "mutation_scale": 14, "shrinkA": 0, "shrinkB": 0},
    )


def _draw_numbers(axes: Axes, poses: NDArray[np.float64], points_per_mm: float) -> None:
    """Number antennas from 1, in the order of design.json; where they are too close, every fifth."""
    offsets = poses[:, None, :2] - poses[None, :, :2]
    distances = np.hypot(offsets[..., 0], offsets[..., 1]) + np.diag(np.full(len(poses), np.inf))
    is_crowded = distances.min(initial=np.inf) * points_per_mm < NUMBER_PITCH_PT
    for number, (x, y, _) in enumerate(poses, start=1):
        if not is_crowded or number == 1 or number % NUMBER_EVERY == 0:
            outline = [patheffects.withStroke(linewidth=2.2, foreground="white")]
            axes.text(x, y, str(number), ha="center", va="center", fontsize=8.5, zorder=7, path_effects=outline)
