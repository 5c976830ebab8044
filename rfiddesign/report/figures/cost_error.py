"""Cost against error of every design that was tested."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import CARETUP
from numpy.typing import NDArray

from rfiddesign.report.figures.scales import LOG_FROM_RATIO, set_scale
from rfiddesign.report.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILLION,
    WHITE_BOX,
    new_figure,
    no_data,
    styled,
)
from rfiddesign.report.words import metric_name

#: Verdict: colour, marker, size. Drawn in this order.
LOOKS = {
    "refuted": (VERMILLION, "x", 20.0),
    "undecided": (ORANGE, "D", 26.0),
    "certified": (GREEN, "o", 34.0),
}
#: A design belongs to the front only if at least this share of its runs was driven to the end.
FRONT_COMPLETE_SHARE = 0.9
#: Arrow from a mark upwards: its error is a lower bound.
UPWARD = {"arrowstyle": "<-", "color": GREY, "lw": 0.9, "shrinkA": 0, "shrinkB": 4, "mutation_scale": 6}


@dataclass(frozen=True)
class TestedDesigns:
    """Designs of one answer as arrays (n,).

    Parameters
    ----------
    cost : prices in whole units of the currency.
    error : mean over runs of the error metric, in the metric's unit for people.
    verdict : "certified", "refuted" or "undecided".
    complete_share : share of the runs that were driven to their end; below 1 `error` is partly that up to a stop.
    """

    __test__ = False

    cost: NDArray[np.float64]
    error: NDArray[np.float64]
    verdict: NDArray[np.str_]
    complete_share: NDArray[np.float64]


@dataclass(frozen=True)
class CostErrorLabels:
    """What is written into the plot: currency, metric with unit, its limit (or None), the winner's place and name."""

    currency: str
    metric: str
    unit: str
    limit: float | None
    winner: tuple[float, float] | None
    winner_name: str


@styled
def cost_error_figure(designs: TestedDesigns, labels: CostErrorLabels) -> Figure:
    """Draw cost against error: verdicts by colour and marker, the front, the limit and the winner.

    Where runs were stopped once they had certainly failed, the error is a lower bound: a triangle or caret points up.
    """
    figure = new_figure(4.4)
    is_drawn = (designs.cost > 0) & (designs.error > 0)
    if not is_drawn.any():
        return no_data(figure, "No design was tested.")
    axes = figure.subplots()
    for verdict in LOOKS:
        _draw_verdict(axes, designs, is_drawn & (designs.verdict == verdict), verdict)
    _draw_front(axes, designs)
    errors = designs.error[is_drawn]
    low, high = errors.min(), errors.max()
    if labels.limit is not None:
        low, high = min(low, labels.limit), max(high, labels.limit)
    if labels.winner is not None:
        low = room_below(low, high, labels.winner[1])
    set_scale(axes.xaxis, designs.cost[is_drawn].min(), designs.cost[is_drawn].max(), is_money=True)
    set_scale(axes.yaxis, low, high * 1.15)
    _draw_limit(axes, labels)
    _name_winner(axes, labels)
    axes.set_xlabel(f"cost [{labels.currency}]")
    axes.set_ylabel(f"{metric_name(labels.metric)}\nmean over drives [{labels.unit.strip()}]")
    figure.legend(loc="outside lower left", ncols=1, handletextpad=0.4, borderaxespad=0.2)
    return figure


def pareto_front(designs: TestedDesigns) -> NDArray[np.int64]:
    """Indices, by rising cost, of the designs of known error than which none that is as cheap has less."""
    known = np.flatnonzero((designs.complete_share >= FRONT_COMPLETE_SHARE) & (designs.error > 0) & (designs.cost > 0))
    order = known[np.lexsort((designs.error[known], designs.cost[known]))]
    best = np.minimum.accumulate(designs.error[order]) if order.size else np.empty(0)
    is_better = np.concatenate([[True], designs.error[order][1:] < best[:-1]]) if order.size else np.empty(0, bool)
    return order[is_better]


def room_below(low: float, high: float, error: float) -> float:
    """The low end of an error axis that leaves a quarter of it below the winner's error for its name."""
    if high > LOG_FROM_RATIO * low:
        return min(low, error / (high / error) ** 0.27)
    return min(low, max(0.0, error - 0.27 * (high - error)))


def _draw_verdict(axes: Axes, designs: TestedDesigns, chosen: NDArray[np.bool_], verdict: str) -> None:
    """Mark designs of one verdict; refuted ones of which drives were cut short are triangles, others get an arrow."""
    colour, marker, size = LOOKS[verdict]
    is_bound = designs.complete_share < 1.0
    if verdict == "refuted":
        known, bound = chosen & ~is_bound, chosen & is_bound
        if known.any():
            axes.scatter(
                designs.cost[known], designs.error[known], s=size, marker=marker, c=colour, lw=1.1, label=verdict
            )
        if bound.any():
            look = {"s": 16.0, "marker": "^", "facecolors": "none", "edgecolors": colour, "linewidths": 0.8}
            words = "refuted, drives cut short: error until then"
            axes.scatter(designs.cost[bound], designs.error[bound], label=words, **look)
        return
    if chosen.any():
        look = {"s": size, "marker": marker, "c": colour, "edgecolors": "white", "linewidths": 0.5, "zorder": 3}
        axes.scatter(designs.cost[chosen], designs.error[chosen], label=verdict, **look)
    for place in zip(designs.cost[chosen & is_bound], designs.error[chosen & is_bound], strict=True):
        axes.annotate("", place, (0, 13), textcoords="offset points", zorder=4, arrowprops=UPWARD)
    if (chosen & is_bound).any():
        axes.plot([], [], ls="none", marker=CARETUP, color=GREY, label=f"{verdict}, some drives cut short")


def _draw_front(axes: Axes, designs: TestedDesigns) -> None:
    front = pareto_front(designs)
    if front.size > 1:
        words = "front: nothing as cheap has less error"
        axes.step(designs.cost[front], designs.error[front], where="post", color=BLUE, lw=1.2, zorder=2, label=words)


def _draw_limit(axes: Axes, labels: CostErrorLabels) -> None:
    """Draw the limit, named where little else is: nothing cheap has a small error."""
    if labels.limit is None:
        return
    axes.axhline(labels.limit, color=BLACK, lw=1.2, ls="--", zorder=1)
    axes.annotate(
        f"limit {labels.limit:g}{labels.unit}",
        (0, labels.limit),
        (4, -3),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        va="top",
        bbox=WHITE_BOX,
    )


def _name_winner(axes: Axes, labels: CostErrorLabels) -> None:
    if labels.winner is None:
        return
    place = labels.winner
    axes.scatter(*place, s=120, facecolors="none", edgecolors=BLACK, linewidths=1.4, zorder=5)
    is_left = axes.transAxes.inverted().transform(axes.transData.transform(place))[0] < 0.5
    axes.annotate(
        labels.winner_name,
        place,
        (10 if is_left else -10, -16),
        textcoords="offset points",
        ha="left" if is_left else "right",
        va="top",
        fontweight="bold",
        zorder=6,
        bbox=WHITE_BOX,
        arrowprops={"arrowstyle": "-", "color": BLACK, "lw": 0.8},
    )
