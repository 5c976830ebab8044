"""Estimators in a world as they believe it and in others: paired ratios of their errors, and what an error costs."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator

from rfiddesign.evaluate import ratio_of_means
from rfiddesign.report.figures.scales import log_ticks
from rfiddesign.report.figures.style import CYCLE, GREY, MARKERS, new_figure, styled
from rfiddesign.reproduce.context import Context
from rfiddesign.reproduce.rows import Row
from rfiddesign.reproduce.timing import TIME

# Estimator, the one it is compared with, and the condition.
PAIRS = (
    ("pmg", "reference", "matched"),
    ("pmg", "particle-filter", "matched"),
    ("pmg", "particle-filter", "all"),
    ("reference", "reference-40000", "matched"),
)
TIMED = ("particle-filter", "pmg", ("matched", "all"))
# Whether a filter is told of the delay while all else is wrong, too: the odometry measures ways too long, or too short.
TOLD = ("particle-filter all, delay compensated", "particle-filter all")
TOO_SHORT = {"scale_x": -0.02, "scale_y": -0.02, "drift_rad_per_m": 0.01}
# Shown in figures, in this order; `reference-40000` tells that `reference` has converged, and nothing else.
SHOWN = ("pmg", "particle-filter", "reference", "mcl-combination", "mcl-gaussian", "quantized-ekf", "constrained-ekf")
ERROR, LOST = "position_mean_mm", "lost_share"
# An error says little of a filter that is lost for more than this share of the time.
MUCH_LOST = 0.02
# Panels beside each other; ticks of an axis are at least this share of it apart.
N_BESIDE, TICK_DISTANCE = 2, 0.15


def analyse(context: Context) -> tuple[list[Row], dict[str, Figure]]:
    """Ratios of each table, and the figures of the errors."""
    (grid,) = context.loaded.file.grids
    rows = [row for table in grid.tables for row in (*_ratios(context, table), *_worth_of_being_told(context, table))]
    return rows, {
        "error-by-mismatch": mismatch_figure(context, tuple(grid.tables), tuple(grid.conditions)),
        "error-by-time": time_figure(context, tuple(grid.tables)),
    }


def _ratios(context: Context, table: str) -> list[Row]:
    rows = []
    for ours, other, condition in PAIRS:
        errors = [context.errors[table, f"{name} {condition}"][ERROR] for name in (ours, other)]
        rows.append(_ratio(table, f"{ours} / {other} {condition}", *errors))
    slow, quick, conditions = TIMED
    for condition in conditions:
        times = [float(context.errors[table, f"{name} {condition}"][TIME].mean()) for name in (slow, quick)]
        name = f"{slow} us / {quick} us {condition}"
        rows.append(Row(table, name, "us_ratio", None, times[0] / times[1], None, "1"))
    return rows


def _worth_of_being_told(context: Context, table: str) -> list[Row]:
    """Late reads put the estimate behind; odometry that measures too much puts it ahead, and hides the delay."""
    file = context.loaded.file
    n_runs, too_short = file.quick_runs if context.is_quick else file.runs, []
    for row in TOLD:
        case = context.case(table, row, world__faults=TOO_SHORT)
        too_short.append(context.measure(case, n_runs, f"{table}, {row}, odometry short")[ERROR])
    return [
        _ratio(table, "delay compensated / not, all", *(context.errors[table, row][ERROR] for row in TOLD)),
        _ratio(table, "delay compensated / not, all, odometry short", *too_short),
    ]


def _ratio(table: str, name: str, ours: np.ndarray, other: np.ndarray) -> Row:
    ratio = ratio_of_means(ours, other)
    return Row(table, name, "position_ratio", None, ratio.mean, ratio.stderr, "1")


@styled
def mismatch_figure(context: Context, tables: tuple[str, ...], conditions: tuple[str, ...]) -> Figure:
    """Mean error by what is not as the filters believe, one panel per table."""
    n_down = -(-len(tables) // N_BESIDE)
    figure = new_figure(n_down * (0.45 + 0.17 * len(conditions)) + 0.6)
    panels = figure.subplots(n_down, N_BESIDE, sharey=True, squeeze=False)
    places = np.arange(len(conditions), 0, -1)
    # Beside each other in the order of the legend, where errors are alike.
    shifts = np.linspace(0.32, -0.32, len(SHOWN))
    for axes, table in zip(panels.flat, tables, strict=False):
        everything = []
        for k, (name, shift) in enumerate(zip(SHOWN, shifts, strict=True)):
            for place, condition in zip(places, conditions, strict=True):
                found = context.errors.get((table, f"{name} {condition}"))
                if found is not None:
                    error = float(found[ERROR].mean())
                    _mark(axes, k, error, place + shift, is_lost=found[LOST].mean() > MUCH_LOST)
                    everything.append(error)
        _set_log(axes.xaxis, everything)
        axes.set_title(table, loc="left")
        axes.set_ylim(0.4, len(conditions) + 0.6)
        # Lines between the conditions rather than through their marks.
        axes.set_yticks(places, conditions, fontsize=7.5)
        axes.set_yticks(np.arange(len(conditions) + 1) + 0.5, minor=True)
        axes.grid(visible=False, axis="y", which="major")
        axes.grid(visible=True, axis="y", which="minor")
        axes.tick_params(axis="y", which="both", length=0)
    _finish(figure, panels, tables, "mean position error [mm]", None)
    return figure


@styled
def time_figure(context: Context, tables: tuple[str, ...]) -> Figure:
    """Mean error over computing time in a world as the filters believe it, one panel per table."""
    n_down = -(-len(tables) // N_BESIDE)
    figure = new_figure(1.45 * n_down + 0.8)
    panels = figure.subplots(n_down, N_BESIDE, sharex=True, squeeze=False)
    found = {key: errors for key, errors in context.errors.items() if TIME in errors}
    times = []
    for axes, table in zip(panels.flat, tables, strict=False):
        everything = []
        for k, name in enumerate(SHOWN):
            errors = found[table, f"{name} matched"]
            time, error = float(errors[TIME].mean()), float(errors[ERROR].mean())
            _mark(axes, k, time, error, is_lost=errors[LOST].mean() > MUCH_LOST, size=5.5)
            everything.append(error)
            times.append(time)
        _set_log(axes.yaxis, everything)
        axes.set_title(table, loc="left")
    for axes in panels.flat:
        _set_log(axes.xaxis, times)
    _finish(figure, panels, tables, "time per step [µs]", "mean position error [mm]")
    return figure


def _mark(axes: Axes, k: int, x: float, y: float, *, is_lost: bool, size: float = 3.6) -> None:
    axes.plot(
        x, y, linestyle="none", marker=MARKERS[k], color=CYCLE[k], markersize=size, markeredgewidth=0.9,
        markerfacecolor="white" if is_lost else CYCLE[k], zorder=3 - k / 10,
    )  # fmt: skip


def _set_log(axis: Axis, values: list[float]) -> None:
    """Make an axis logarithmic, as in every panel, with room for the marks of all values."""
    axes, name = axis.axes, axis.axis_name
    low, high = min(values), max(values)
    margin = (high / low) ** 0.08
    (axes.set_xscale if name == "x" else axes.set_yscale)("log")
    (axes.set_xlim if name == "x" else axes.set_ylim)(low / margin, high * margin)
    ticks: list[float] = []
    for tick in log_ticks(low / margin, high * margin):
        if not ticks or tick >= ticks[-1] * (margin**2 * high / low) ** TICK_DISTANCE:
            ticks.append(tick)
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())
    axis.set_major_formatter(lambda value, _: f"{value:g}")


def _finish(figure: Figure, panels: np.ndarray, tables: tuple[str, ...], x: str, y: str | None) -> None:
    """Say what the axes show and what the marks mean; take away panels without a table."""
    for axes in panels.flat[len(tables) :]:
        axes.set_visible(False)
    figure.supxlabel(x, fontsize=9)
    if y is not None:
        figure.supylabel(y, fontsize=9)
    marks = [
        Line2D([], [], linestyle="none", marker=MARKERS[k], color=CYCLE[k], markersize=5, label=name)
        for k, name in enumerate(SHOWN)
    ]
    words = f"open: lost for over {100 * MUCH_LOST:g} %"
    marks.append(
        Line2D([], [], linestyle="none", marker="o", color=GREY, markerfacecolor="white", markersize=5, label=words)
    )  # fmt: skip
    figure.legend(handles=marks, loc="outside upper center", ncols=3, columnspacing=0.8, handletextpad=0.0, fontsize=8)
