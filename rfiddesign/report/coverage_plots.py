"""Plots of coverage for notebooks: robots and floors, coverage against tag density, and the aliasing trap."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.ticker import FixedLocator, MultipleLocator, NullLocator
from numpy.typing import ArrayLike, NDArray

from rfiddesign.geometry import Coverage, HeadingDrive
from rfiddesign.geometry.travel import free_lanes
from rfiddesign.report.figures import style
from rfiddesign.report.figures.scales import log_ticks
from rfiddesign.report.figures.style import BLACK, BLUE, FLOOR, GREY, ORANGE, VERMILLION, plain_map, styled

#: Width of these figures [in]: a notebook's column.
WIDTH_IN = 9.0
#: Densities and pitches [mm] that get a tick.
DENSITY_TICKS = (1, 2, 4, 9, 16, 25, 50, 100, 200, 400, 1000)
PITCH_TICKS = (30, 50, 70, 100, 150, 250, 500, 1000)
#: Distances to the next read shorter than this [mm] are drawn as this on their logarithmic scale.
SHORTEST_MM = 1.0
#: Steps of colour for the share of lanes that are never read [%]; none at all is white.
BLIND_STEPS = (1e-9, 5, 10, 20, 30, 40, 100)
BLIND_COLOURS = ("#f6e2c9", "#efc48c", ORANGE, VERMILLION, "#97400a", "#4f1f04")
UNBUILDABLE, BLIND_LANE = "#c3c8d0", "#f3c9ac"
PAPERS_CROSS = {"marker": "P", "ms": 9, "color": BLACK, "mec": "white"}


@dataclass(frozen=True)
class Quantity:
    """A number of a `Coverage` and the words for its axis; a share is shown in percent from 0 to 100."""

    words: str
    of: Callable[[Coverage], float]
    is_share: bool = True


QUANTITIES = {
    "one_reader": Quantity("≥ 1 reader sees a tag [% of places]", lambda seen: 100 * seen.k_coverage[0]),
    "two_readers": Quantity("≥ 2 readers see a tag [% of places]", lambda seen: 100 * seen.k_coverage[1]),
    "three_readers": Quantity("≥ 3 readers see a tag [% of places]", lambda seen: 100 * seen.k_coverage[2]),
    "reads": Quantity("reads per poll, mean", lambda seen: seen.expected_reads, is_share=False),
    "two_tags": Quantity("an antenna sees ≥ 2 tags [% of places]", lambda seen: 100 * seen.two_tags_share),
}


@styled
def robots_plot(
    robots: Mapping[str, tuple[NDArray[np.object_], NDArray[np.object_]]], footprint_radius_mm: float
) -> Figure:
    """Draw robots from above, side by side.

    Parameters
    ----------
    robots : by title, the outlines of the antennas' housings and of what they see of the floor (shapely polygons, mm),
        as `rfiddesign.geometry.antenna_outlines` returns them.
    footprint_radius_mm : radius of the robot's outline [mm].
    """
    figure, panels = _figure(len(robots), height_in=2.7, sharey=True)
    for axes, (title, (housings, seen)) in zip(panels, robots.items(), strict=True):
        plain_map(axes)
        axes.set_title(title)
        axes.add_patch(Circle((0, 0), footprint_radius_mm, fc=FLOOR, ec=GREY, lw=0.8))
        for outlines, look in ((housings, {"fc": "white", "ec": BLACK, "lw": 0.6}), (seen, {"fc": BLUE, "lw": 0})):
            corners = [shapely.get_coordinates(outline) for outline in outlines]
            axes.add_patch(PathPatch(Path.make_compound_path(*(Path(ring, closed=True) for ring in corners)), **look))
        half = 1.08 * max(footprint_radius_mm, np.abs(shapely.total_bounds(housings)).max())
        axes.set(xlim=(-half, half), ylim=(-half, half), xlabel="x, forward [mm]")
        axes.xaxis.set_major_locator(FixedLocator([-200, 0, 200]))
        axes.yaxis.set_major_locator(FixedLocator([-200, 0, 200]))
    panels[0].set_ylabel("y, left [mm]")
    figure.legend(
        handles=[
            Patch(fc="white", ec=BLACK, lw=0.6, label="housing of an antenna"),
            Patch(fc=BLUE, label="what it sees of the floor"),
            Patch(fc=FLOOR, ec=GREY, label=f"robot, {footprint_radius_mm:g} mm radius"),
        ],
        loc="outside lower center",
        ncols=3,
    )
    return _finished(figure)


@styled
def floors_plot(floors: Mapping[str, NDArray[np.float64]], region: shapely.Polygon) -> Figure:
    """Draw the tags (n, 2) [mm] that several floors, by title, have in a rectangular region [mm]."""
    x_min, y_min, x_max, y_max = region.bounds
    figure, panels = _figure(len(floors), height_in=2.6, sharey=True)
    for axes, (title, tags) in zip(panels, floors.items(), strict=True):
        plain_map(axes)
        axes.set_facecolor(FLOOR)
        axes.scatter(*np.reshape(tags, (-1, 2)).T, s=9, marker="s", c=BLACK)
        axes.set(xlim=(x_min, x_max), ylim=(y_min, y_max), xlabel="x [mm]", title=title)
    panels[0].set_ylabel("y [mm]")
    return _finished(figure)


@styled
def density_plot(
    tags_per_m2: Sequence[float],
    coverages: Mapping[str, Sequence[Coverage]],
    quantities: Sequence[str] = ("one_reader", "two_readers", "reads"),
) -> Figure:
    """Draw coverage against tag density, one panel for each of the `QUANTITIES` asked for.

    Parameters
    ----------
    tags_per_m2 : densities (n,).
    coverages : by name of the curve, the coverage at each density.

    Raises
    ------
    ValueError : if a quantity is unknown or a curve does not have one coverage per density.
    """
    for name, curve in coverages.items():
        if len(curve) != len(tags_per_m2):
            raise ValueError(f"coverages, {name!r}: {len(curve)} values, must be {len(tags_per_m2)}, one per density")
    unknown = [name for name in quantities if name not in QUANTITIES]
    if unknown:
        raise ValueError(f"quantities = {unknown[0]!r}: must be one of {', '.join(QUANTITIES)}")
    figure, panels = _figure(len(quantities), height_in=3.9)
    for axes, quantity in zip(panels, (QUANTITIES[name] for name in quantities), strict=True):
        for i, (name, curve) in enumerate(coverages.items()):
            values = [quantity.of(seen) for seen in curve]
            axes.plot(tags_per_m2, values, marker=_marker(i), ms=4, label=name, **_look(i))
        axes.set(xscale="log", xlabel="tags per m²", ylabel=quantity.words)
        _set_ticks(axes.xaxis, DENSITY_TICKS, tags_per_m2)
        if quantity.is_share:
            axes.set_ylim(-3, 103)
        else:
            axes.set_yscale("log")
            _set_ticks(axes.yaxis, log_ticks(*axes.get_ylim()))
        pitches = axes.secondary_xaxis("top")
        pitches.set_xlabel("pitch of a square lattice [mm]", color=GREY)
        _set_ticks(pitches.xaxis, [1e6 / pitch**2 for pitch in PITCH_TICKS], tags_per_m2)
        pitches.xaxis.set_major_formatter(lambda density, _: f"{1000 / np.sqrt(density):.0f}")
        pitches.tick_params(labelcolor=GREY)
    _legend_below(figure, panels[0])
    return _finished(figure)


@styled
def heading_plot(headings_deg: Sequence[float], shares: Mapping[str, NDArray[np.float64]]) -> Figure:
    """Draw by heading the shares (n,) of places, from 0 to 1, at which at least one reader sees a tag."""
    figure, (axes,) = _figure(1, height_in=3.4)
    for i, (name, share) in enumerate(shares.items()):
        axes.plot(headings_deg, 100 * np.asarray(share), label=name, **_look(i))
    _heading_axis(axes, headings_deg)
    axes.set(ylim=(-3, 103), ylabel=QUANTITIES["one_reader"].words)
    _legend_below(figure, axes)
    return _finished(figure)


@styled
def drives_plot(drives: Mapping[str, Sequence[HeadingDrive]], *, limit_mm: float = 500.0) -> Figure:
    """Draw by heading the distance to the next read that 95 % of all places stay below, and a limit on it [mm].

    Headings along rows of tags are marked.
    """
    figure, (axes,) = _figure(1, height_in=3.8)
    for i, (name, curve) in enumerate(drives.items()):
        ordered = sorted(curve, key=lambda drive: drive.heading_deg)
        along = [at for at, drive in enumerate(ordered) if drive.is_aligned]
        headings, distances = [d.heading_deg for d in ordered], [max(d.p95_mm, SHORTEST_MM) for d in ordered]
        axes.plot(headings, distances, marker=_marker(i), markevery=along, ms=6, mec="white", label=name, **_look(i))
    axes.axhline(limit_mm, color=BLACK, lw=1.0, ls=(0, (1, 2)))
    axes.annotate(f"{limit_mm:g} mm", (1, limit_mm), (4, 0), ("axes fraction", "data"), "offset points", va="center")
    _heading_axis(axes, [drive.heading_deg for curve in drives.values() for drive in curve])
    axes.set(yscale="log", ylabel="95 % read a tag within [mm]")
    _set_ticks(axes.yaxis, log_ticks(*axes.get_ylim()))
    mark = Line2D([], [], ls="none", marker="o", color=GREY, mec="white", ms=6, label="marks: along rows of tags")
    figure.legend(handles=[*axes.get_legend_handles_labels()[0], mark], loc="outside lower center", ncols=5)
    return _finished(figure)


@styled
def lanes_plot(robots: Mapping[str, tuple[NDArray[np.float64], float]]) -> Figure:
    """Draw which antenna reads a row of tags, by the robot's place between two rows, and the lanes none reads.

    Parameters
    ----------
    robots : by title, the swaths (n, 2) [mm] of the antennas across the course, as `rfiddesign.geometry.travel` has
        them, and the distance between rows of tags [mm].
    """
    widths = [spacing for _, spacing in robots.values()]
    figure, panels = _figure(len(robots), height_in=2.9, sharey=True, width_ratios=widths)
    for axes, (title, (swaths, spacing)) in zip(panels, robots.items(), strict=True):
        never = free_lanes(swaths, spacing).sum() / spacing
        axes.set_facecolor(BLIND_LANE)
        axes.grid(False)
        # An antenna to the left reads a row when the robot is to the right of it; bars wrap around at the next row.
        starts = np.mod(-swaths[:, 1], spacing)
        bars = [
            (start - wrap, width, number)
            for number, (start, width) in enumerate(zip(starts, np.ptp(swaths, axis=1), strict=True), start=1)
            for wrap in ((0.0, spacing) if start + width > spacing else (0.0,))
        ]
        for start, width, _ in bars:
            axes.axvspan(start, start + width, color="white", lw=0, zorder=0.5)
        for start, width, number in bars:
            axes.add_patch(Rectangle((start, number - 0.35), width, 0.7, fc=BLUE, lw=0, zorder=2))
        axes.set(xlim=(0, spacing), ylim=(len(swaths) + 0.6, 0.4), title=f"{title}\n{never:.0%} never read")
        axes.xaxis.set_major_locator(MultipleLocator(50))
    figure.supxlabel("robot's centre from a row of tags, up to the next row [mm]", fontsize=9)
    panels[0].set_ylabel("antenna")
    panels[0].yaxis.set_major_locator(FixedLocator(np.arange(1, max(len(s) for s, _ in robots.values()) + 1)))
    handles = [Patch(fc=BLUE, label="antenna reads the row"), Patch(fc=BLIND_LANE, label="lane that none reads")]
    figure.legend(handles=handles, loc="outside upper center", ncols=2)
    return _finished(figure)


@styled
def spacing_plot(
    inner_mm: Sequence[float],
    outer_mm: Sequence[float],
    blind_shares: Mapping[str, NDArray[np.float64]],
    marked_mm: tuple[float, float] | None = None,
) -> Figure:
    """Draw as maps the share of lanes never read, by where the inner and the outer antennas of a cross sit.

    Parameters
    ----------
    inner_mm, outer_mm : distances (n,) and (m,) from the robot's centre [mm], evenly spaced.
    blind_shares : by title, shares (m, n) from 0 to 1; nan where it cannot be built.
    marked_mm : inner and outer distance [mm] to mark, that of the paper.
    """
    figure, panels = _figure(len(blind_shares), height_in=4.2, sharey=True)
    colours, norm = (
        ListedColormap(BLIND_COLOURS, bad=UNBUILDABLE, under="white"),
        BoundaryNorm(BLIND_STEPS, len(BLIND_COLOURS)),
    )
    half_x, half_y = (inner_mm[1] - inner_mm[0]) / 2, (outer_mm[1] - outer_mm[0]) / 2
    extent = (inner_mm[0] - half_x, inner_mm[-1] + half_x, outer_mm[0] - half_y, outer_mm[-1] + half_y)
    for axes, (title, shares) in zip(panels, blind_shares.items(), strict=True):
        axes.grid(False)
        image = axes.imshow(100 * shares, origin="lower", extent=extent, cmap=colours, norm=norm, aspect="equal")
        axes.set(title=title, xlabel="inner antennas at [mm]")
        if marked_mm is not None:
            axes.plot(*marked_mm, ls="none", **PAPERS_CROSS)
    panels[0].set_ylabel("outer antennas at [mm]")
    bar = figure.colorbar(image, ax=panels, location="bottom", ticks=BLIND_STEPS, aspect=50, spacing="uniform")
    bar.ax.set_xticklabels([f"{step:.0f}" for step in BLIND_STEPS])
    bar.set_label("lanes never read, along the rows where they are most [%]")
    handles = [Patch(fc="white", ec=GREY, label="every lane is read"), Patch(fc=UNBUILDABLE, label="antennas overlap")]
    if marked_mm is not None:
        handles.append(Line2D([], [], ls="none", label="the paper's cross", **PAPERS_CROSS))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return _finished(figure)


def _figure(n_panels: int, *, height_in: float, **options: object) -> tuple[Figure, NDArray[np.object_]]:
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    return figure, figure.subplots(1, n_panels, squeeze=False, **options)[0]


def _finished(figure: Figure) -> Figure:
    """Lay the figure out while the style holds: ticks made later would follow the notebook's own settings."""
    figure.draw_without_rendering()
    return figure


def _look(i: int) -> dict[str, str]:
    return {"color": style.CYCLE[i % len(style.CYCLE)], "ls": style.LINE_STYLES[i % len(style.LINE_STYLES)]}


def _legend_below(figure: Figure, axes: Axes) -> None:
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)


def _marker(i: int) -> str:
    return style.MARKERS[i % len(style.MARKERS)]


def _set_ticks(axis: Axis, places: Sequence[float], values: ArrayLike | None = None) -> None:
    """Set these ticks, or those of them within the range of `values`, with plain numbers on a logarithmic axis."""
    low, high = (-np.inf, np.inf) if values is None else (np.min(values) * 0.99, np.max(values) * 1.01)
    axis.set_major_locator(FixedLocator([place for place in places if low <= place <= high]))
    axis.set_major_formatter(lambda value, _: f"{value:,.6g}")
    axis.set_minor_locator(NullLocator())


def _heading_axis(axes: Axes, headings_deg: Sequence[float]) -> None:
    low, high = min(headings_deg), max(headings_deg)
    margin = 0.01 * (high - low)
    axes.set(xlim=(low - margin, high + margin), xlabel="heading against the tags' lattice [°]")
    axes.xaxis.set_major_locator(MultipleLocator(15))
