"""What an exploration tried and named, which variables matter, and fronts of several objectives."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rfiddesign.report.figures.scales import set_scale
from rfiddesign.report.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILLION,
    WHITE_BOX,
    new_figure,
    no_data,
    styled,
)
from rfiddesign.report.words import shortened

#: Letters of a variable's name that fit beside a bar.
_NAME_LENGTH = 16


@dataclass(frozen=True)
class TriedDesigns:
    """Trials of an exploration as arrays (n,), and prices of what was named and certified.

    Parameters
    ----------
    cost : prices in whole units of the currency.
    score : margin that most runs keep, at most 1 if the design seems to hold.
    is_stopped, is_named : whether it was stopped early; whether it became a candidate.
    neighbour_cost : prices of the candidates that were not tried.
    certified_cost : price of the certified design, None without one.
    currency : the currency.
    """

    cost: NDArray[np.float64]
    score: NDArray[np.float64]
    is_stopped: NDArray[np.bool_]
    is_named: NDArray[np.bool_]
    neighbour_cost: NDArray[np.float64]
    certified_cost: float | None
    currency: str


@styled
def exploration_figure(tried: TriedDesigns) -> Figure:
    """Draw cost against the margin of each trial, the candidates among them, and the certified price."""
    figure = new_figure(4.6)
    if not tried.cost.size:
        return no_data(figure, "No design that was tried can be built.")
    axes = figure.subplots()
    for chosen, look, words in (
        (tried.is_stopped, {"marker": "x", "c": GREY, "s": 12, "lw": 0.7}, "stopped early"),
        (~tried.is_stopped, {"marker": "o", "c": SKY, "s": 12, "edgecolors": "none"}, "tried with all runs"),
        (tried.is_named, {"marker": "o", "facecolors": "none", "edgecolors": BLUE, "s": 30, "lw": 0.8}, "candidate"),
    ):
        if chosen.any():
            axes.scatter(tried.cost[chosen], tried.score[chosen], label=words, zorder=3, **look)
    low, high = min(tried.score.min(), 0.9), max(tried.score.max(), 1.1)
    costs = np.concatenate([tried.cost, tried.neighbour_cost])
    set_scale(axes.xaxis, costs.min(), costs.max(), is_money=True)
    set_scale(axes.yaxis, low, high)
    if tried.neighbour_cost.size:
        axes.plot(
            tried.neighbour_cost, np.full(tried.neighbour_cost.size, 0.015), "|", color=ORANGE, ms=7, mew=0.8,
            transform=axes.get_xaxis_transform(), label="candidate beside a trial, not tried", clip_on=False,
        )  # fmt: skip
    axes.axhline(1.0, color=BLACK, lw=1.2, ls="--", zorder=1)
    axes.annotate(
        "limits", (1, 1.0), (-4, 3), xycoords=("axes fraction", "data"), textcoords="offset points", ha="right",
        bbox=WHITE_BOX,
    )  # fmt: skip
    if tried.certified_cost is not None:
        axes.axvline(tried.certified_cost, color=GREEN, lw=1.5, zorder=2, label="price of the certified design")
    axes.set_xlabel(f"cost [{tried.currency}]")
    axes.set_ylabel("error over its limit,\nestimated for most drives")
    figure.legend(loc="outside lower left", ncols=1, handletextpad=0.4, borderaxespad=0.2)
    return figure


@styled
def importance_figure(shares: dict[str, dict[str, float]]) -> Figure:
    """Draw bars of each variable's importance, by name of the evaluator, the first evaluator's largest on top."""
    names = list(next(iter(shares.values()), {}))
    figure = new_figure(0.9 + 0.27 * max(len(names), 3))
    if not names:
        return no_data(figure, "There was no variable.")
    axes = figure.subplots()
    places, height = np.arange(len(names)), 0.8 / len(shares)
    for i, (evaluator, found) in enumerate(shares.items()):
        values = [100 * found.get(name, 0.0) for name in names]
        colour = (BLUE, ORANGE, GREEN)[i % 3]
        axes.barh(places + (i - (len(shares) - 1) / 2) * height, values, height, color=colour, label=evaluator)
    axes.set_yticks(places, [shortened(name, _NAME_LENGTH) for name in names])
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.set_xlabel("importance for the error [%]")
    if len(shares) > 1:
        figure.legend(loc="outside lower left", ncols=len(shares))
    return figure


@styled
def interaction_figure(names: list[str], shares: dict[tuple[str, str], float]) -> Figure:
    """Draw a map of what pairs of variables explain together beyond each alone, in per cent of the variance."""
    figure = new_figure(1.1 + 0.33 * max(len(names), 3))
    if not shares:
        return no_data(figure, "There are too few trials to tell what acts together.")
    axes = figure.subplots()
    n = len(names)
    table = np.full((n, n), np.nan)
    for (first, second), share in shares.items():
        i, j = sorted((names.index(first), names.index(second)))
        table[j, i] = 100 * share
    shown = table[1:, :-1]
    most = max(float(np.nanmax(shown)), 1.0)
    axes.imshow(shown, cmap="Blues", vmin=0.0, vmax=most, aspect="auto")
    for i, j in np.argwhere(~np.isnan(shown)):
        value = shown[i, j]
        colour = "white" if value > 0.6 * most else "black"
        axes.text(j, i, f"{value:.1f}" if value >= 0.05 else "0", ha="center", va="center", color=colour, fontsize=8)
    axes.set_xticks(range(n - 1), [shortened(name, _NAME_LENGTH) for name in names[:-1]], rotation=40, ha="right")
    axes.set_yticks(range(n - 1), [shortened(name, _NAME_LENGTH) for name in names[1:]])
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.set_title("interaction [% of the variance]", loc="left")
    return figure


@dataclass(frozen=True)
class FrontPoints:
    """What was measured for a front, as arrays.

    Parameters
    ----------
    labels : axis labels of the objectives, (k,).
    values, stderr : objectives and their standard errors, (n, k).
    chance : chance of each to be on the front, (n,).
    is_on : whether it is, by the means, (n,).
    knee : index of the knee.
    is_money : which objectives are prices, (k,).
    """

    labels: tuple[str, ...]
    values: NDArray[np.float64]
    stderr: NDArray[np.float64]
    chance: NDArray[np.float64]
    is_on: NDArray[np.bool_]
    knee: int
    is_money: tuple[bool, ...]


@styled
def pareto_figure(points: FrontPoints) -> Figure:
    """Draw the first objective against each of the others, with bars of twice the standard error and the knee."""
    n_panels = len(points.labels) - 1
    figure = new_figure(1.0 + 1.9 * n_panels)
    panels = figure.subplots(n_panels, 1, sharex=True, squeeze=False)[:, 0]
    for panel, i in zip(panels, range(1, len(points.labels)), strict=True):
        _draw_panel(panel, points, i)
    values = points.values[:, 0]
    set_scale(panels[-1].xaxis, values.min(), values.max(), is_money=points.is_money[0])
    panels[-1].set_xlabel(points.labels[0])
    handles, words = panels[0].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower left", ncols=1, handletextpad=0.4, borderaxespad=0.2)
    return figure


def _draw_panel(axes: Axes, points: FrontPoints, i: int) -> None:
    x, y = points.values[:, 0], points.values[:, i]
    axes.errorbar(
        x, y, xerr=2 * points.stderr[:, 0], yerr=2 * points.stderr[:, i], fmt="none", ecolor=GREY, elinewidth=0.8,
        zorder=2,
    )  # fmt: skip
    sure = points.is_on & (points.chance >= 0.95)
    for chosen, look, words in (
        (~points.is_on, {"marker": "x", "c": GREY, "s": 18, "lw": 0.9}, "dominated once measured"),
        (points.is_on & ~sure, {"marker": "o", "c": SKY, "s": 22, "edgecolors": BLUE, "lw": 0.6}, "on the front"),
        (
            sure,
            {"marker": "o", "c": BLUE, "s": 22, "edgecolors": "none"},
            "on the front in 95 % of redrawn runs or more",
        ),
    ):
        if chosen.any():
            axes.scatter(x[chosen], y[chosen], label=words, zorder=3, **look)
    knee = points.knee
    axes.scatter(
        x[knee], y[knee], s=110, facecolors="none", edgecolors=VERMILLION, linewidths=1.6, zorder=4, label="knee"
    )
    bars = 2 * points.stderr[:, i]
    # Bars that reach 0 would force an axis without decades.
    ends = y - bars
    low = min(y.min(), ends[ends > 0].min(initial=y.min()))
    set_scale(axes.yaxis, low, (y + bars).max(), is_money=points.is_money[i])
    axes.set_ylabel(points.labels[i])
