"""What the antennas see of the tags, by the robot's place."""

import math

import matplotlib
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from rfiddesign.geometry import DetectionArea, transform_points
from rfiddesign.report.figures.place import Window, inside, window_about
from rfiddesign.report.figures.robot import antenna_poses, detection_area
from rfiddesign.report.figures.style import BLACK, BLUE, new_figure, plain_map, styled
from rfiddesign.report.words import percent
from rfiddesign.results.study_result import ChosenDesign, CoverageRecord

HEADINGS_DEG = (0.0, 20.0)
#: Antenna centres looked at per map, so that 96 readers take no longer than 8.
MAX_CENTRES = 400_000
MAX_GRID = 161
MAX_COLOURS = 8


@styled
def coverage_figure(
    chosen: ChosenDesign, coverage: CoverageRecord, tags_mm: NDArray[np.float64], place_mm: tuple[float, float]
) -> Figure:
    """Draw how many readers see a tag by the robot's place, at two headings, over the shares of k-coverage.

    Parameters
    ----------
    chosen : the design.
    coverage : what its antennas see over all places and headings.
    tags_mm : tags (n, 2) [mm] of the floor.
    place_mm : about where on the floor the maps are drawn.
    """
    figure = new_figure(4.5)
    grid = figure.add_gridspec(3, 2, height_ratios=[2.0, 0.12, 1.0])
    x, y = nearest_tag(tags_mm, place_mm)
    window = map_window(chosen, (x, y))
    counts = [readers_in_view(chosen, tags_mm, window, math.radians(heading)) for heading in HEADINGS_DEG]
    most = max(int(count.max()) for count in counts)
    colours, norm, ticks = _count_colours(most)
    tags = inside(tags_mm, window)
    for i, (heading, count) in enumerate(zip(HEADINGS_DEG, counts, strict=True)):
        axes = figure.add_subplot(grid[0, i])
        plain_map(axes)
        image = axes.imshow(
            count,
            origin="lower",
            cmap=colours,
            norm=norm,
            interpolation="nearest",
            extent=(window.x_min - x, window.x_max - x, window.y_min - y, window.y_max - y),
        )
        axes.scatter(*(tags - (x, y)).T, s=18, marker="s", c="white", edgecolors=BLACK, linewidths=0.7)
        axes.set_title(f"heading {heading:g}°")
        axes.set_xlabel("x from a tag [mm]")
        if i == 0:
            axes.set_ylabel("robot's y [mm]")
        else:
            axes.tick_params(labelleft=False)
    bar = figure.colorbar(image, cax=figure.add_subplot(grid[1, :]), orientation="horizontal", ticks=ticks)
    bar.set_label("readers that see a tag")
    _draw_shares(figure.add_subplot(grid[2, :]), coverage)
    return figure


def nearest_tag(tags_mm: NDArray[np.float64], place_mm: tuple[float, float]) -> tuple[float, float]:
    """The tag (x, y) [mm] nearest to a place, or the place itself where there are no tags."""
    if not tags_mm.size:
        return place_mm
    x, y = tags_mm[np.hypot(*(tags_mm - place_mm).T).argmin()]
    return float(x), float(y)


def map_window(chosen: ChosenDesign, place_mm: tuple[float, float]) -> Window:
    """One cell of the tags' lattice, or its bounding box; without a lattice, about nine tags' worth of floor."""
    if chosen.lattice_basis_mm is None:
        half = 1.5e3 / math.sqrt(chosen.tags_per_m2)
        return window_about(*place_mm, half, half)
    (ax, ay), (bx, by) = chosen.lattice_basis_mm
    return window_about(*place_mm, max(abs(ax), abs(bx), abs(ax + bx)) / 2, max(abs(ay), abs(by), abs(ay + by)) / 2)


def readers_in_view(
    chosen: ChosenDesign, tags_mm: NDArray[np.float64], window: Window, heading: float
) -> NDArray[np.int64]:
    """Number of readers that see at least one tag, by the robot's place in a window: a grid, rows by rising y."""
    poses = antenna_poses(chosen)
    area = detection_area(chosen)
    n = int(np.clip(math.sqrt(MAX_CENTRES / max(len(poses), 1)), 40, MAX_GRID))
    x = np.linspace(window.x_min, window.x_max, n + 1)[:-1] + (window.x_max - window.x_min) / (2 * n)
    y = np.linspace(window.y_min, window.y_max, n + 1)[:-1] + (window.y_max - window.y_min) / (2 * n)
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    centres = transform_points(np.array([0.0, 0.0, heading]), poses[:, :2])
    margin = np.hypot(*poses[:, :2].T).max(initial=0.0) + area.reach_mm
    near = inside(
        tags_mm, Window(window.x_min - margin, window.y_min - margin, window.x_max + margin, window.y_max + margin)
    )
    seen = [
        _sees_a_tag(area, places + centre, heading + yaw, near)
        for centre, yaw in zip(centres, poses[:, 2], strict=True)
    ]
    return np.sum(seen, axis=0).reshape(n, n)


def _sees_a_tag(
    area: DetectionArea, centres: NDArray[np.float64], yaw: float, tags: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Which antennas at `centres` (m, 2), turned by `yaw`, have at least one of the tags (n, 2) in view."""
    seen = np.zeros(len(centres), bool)
    if not tags.size:
        return seen
    tree = cKDTree(tags)
    n_near = min(len(tags), 16)
    while True:
        distances, index = tree.query(centres, k=n_near, distance_upper_bound=area.reach_mm)
        distances, index = distances.reshape(len(centres), -1), index.reshape(len(centres), -1)
        is_near = np.isfinite(distances)
        offsets = tags[np.where(is_near, index, 0)] - centres[:, None, :]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        local = np.stack(
            [cosine * offsets[..., 0] + sine * offsets[..., 1], cosine * offsets[..., 1] - sine * offsets[..., 0]],
            axis=-1,
        )
        seen |= (area.contains(local) & is_near).any(axis=1)
        # Antennas that saw nothing among as many tags as were asked for may see one farther off.
        if n_near == len(tags) or not (~seen & is_near[:, -1]).any():
            return seen
        n_near = min(2 * n_near, len(tags))


def _count_colours(most: int) -> tuple[ListedColormap, BoundaryNorm, list[int]]:
    """Colours for counts 0..most: one for each, or steps where there would be too many."""
    step = max(1, math.ceil((most + 1) / MAX_COLOURS))
    edges = np.arange(0, most + step + 1, step) - 0.5
    n = len(edges) - 1
    colours = ListedColormap(matplotlib.colormaps["cividis"](np.linspace(0, 1, max(n, 2)))[:n])
    return colours, BoundaryNorm(edges, n), [int(edge + 0.5 + (step - 1) // 2) for edge in edges[:-1]]


def _draw_shares(axes, coverage: CoverageRecord) -> None:
    shares = [100 * share for share in coverage.k_coverage]
    names = [f"≥ {k} reader{'s' if k > 1 else ''}" for k in range(1, len(shares) + 1)]
    bars = axes.barh(names, shares, color=BLUE, height=0.62)
    axes.bar_label(bars, [percent(share) for share in coverage.k_coverage], padding=3)
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.set_xlim(0, 118)
    axes.set_xticks([0, 25, 50, 75, 100])
    axes.set_xlabel("share of places and headings [%]")
