"""Cost against error of every design that was tested."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rfiddesign.report.figures.scales import set_scale
from rfiddesign.report.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILLION, new_figure, no_data, styled
from rfiddesign.report.words import metric_name

#: Verdict: colour, marker, size. Drawn in this order.
LOOKS = {
    "refuted": (VERMILLION, "x", 20.0),
    "undecided": (ORANGE, "D", 26.0),
    "certified": (GREEN, "o", 34.0),
}
#: A design belongs to the front only if at least this share of its runs was driven to the end.
FRONT_COMPLETE_SHARE = 0.9


@dataclass(frozen=True)
class TestedDesigns:
    """Designs of one answer as arrays (n,).

    Parameters
    ----------
    cost : prices in whole units of the currency.
    error : mean over runs of the error metric, in the metric's unit for people.
    verdict : "certified", "refuted" or "undecided".
    complete_share : share of the runs that were driven to their end; below 1 the error is at least `error`.
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
    is_bound = designs.complete_share < 1.0
    for verdict, (colour, marker, size) in LOOKS.items():
        is_verdict = is_drawn & (designs.verdict == verdict)
        _draw_verdict(axes, designs, is_verdict & ~is_bound, (colour, marker, size), verdict)
        if verdict == "refuted":
            words = "refuted, drives cut short: at least this error"
            _draw_verdict(axes, designs, is_verdict & is_bound, (colour, "^", 16.0), words)
        else:
            _draw_verdict(axes, designs, is_verdict & is_bound, (colour, marker, size), verdict, is_again=(is_verdict & ~is_bound).any())
            _draw_carets(axes, designs, is_verdict & is_bound)
    front = pareto_front(designs)
    if front.size > 1:
        axes.step(designs.cost[front], designs.error[front], where="post", color=BLUE, lw=1.2, zorder=2, label="front: nothing cheaper has less error")
    errors = designs.error[is_drawn]
    low, high = errors.min(), errors.max()
    if labels.limit is not None:
        axes.axhline(labels.limit, color=BLACK, lw=1.2, ls="--", zorder=1)
        low, high = min(low, labels.limit), max(high, labels.limit)
    set_scale(axes.xaxis, designs.cost[is_drawn].min(), designs.cost[is_drawn].max(), is_money=True)
    set_scale(axes.yaxis, low, high * 1.15)
    if labels.limit is not None:
        axes.annotate(f"limit {labels.limit:g}{labels.unit}", (1, labels.limit), (-2, 3), xycoords=("axes fraction", "data"), textcoords="offset points", ha="right", va="bottom", bbox=WHITE_BOX)
    if labels.winner is not None:
        _name_winner(axes, labels)
    axes.set_xlabel(f"cost [{labels.currency}]")
    axes.set_ylabel(f"{metric_name(labels.metric)}\nmean over drives [{labels.unit.strip()}]")
    figure.legend(*_unique_legend(axes), loc="outside lower left", ncols=1, handletextpad=0.4, borderaxespad=0.2)
    return figure


WHITE_BOX = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.8}


def pareto_front(designs: TestedDesigns) -> NDArray[np.int64]:
    """Indices, by rising cost, of the designs of known error than which none that is as cheap has less."""
    known = np.flatnonzero((designs.complete_share >= FRONT_COMPLETE_SHARE) & (designs.error > 0) & (designs.cost > 0))
    order = known[np.lexsort((designs.error[known], designs.cost[known]))]
    best = np.minimum.accumulate(designs.error[order]) if order.size else np.empty(0)
    is_better = np.concatenate([[True], designs.error[order][1:] < best[:-1]]) if order.size else np.empty(0, bool)
    return order[is_better]


def _draw_verdict(axes: Axes, designs: TestedDesigns, chosen: NDArray, look: tuple, label: str, *, is_again: bool = False) -> None:
    if not chosen.any():
        return
    colour, marker, size = look
    is_open = marker == "^"
    axes.scatter(
        designs.cost[chosen], designs.error[chosen], s=size, marker=marker, zorder=3,
        c="none" if is_open else colour, edgecolors=colour if is_open else ("white" if marker != "x" else None),
        linewidths=0.8 if is_open else (1.1 if marker == "x" else 0.5), label=None if is_again else label,
    )  # fmt: skip


def _draw_carets(axes: Axes, designs: TestedDesigns, chosen: NDArray) -> None:
    for cost, error in zip(designs.cost[chosen], designs.error[chosen], strict=True):
        axes.annotate("", (cost, error), (0, 13), xycoords="data", textcoords="offset points", zorder=4,
                      arrowprops={"arrowstyle": "<-", "color": GREY, "lw": 0.9, "shrinkA": 0, "shrinkB": 4, "mutation_scale": 6})  # fmt: skip


def _name_winner(axes: Axes, labels: CostErrorLabels) -> None:
    cost, error = labels.winner
    axes.scatter([cost], [error], s=120, facecolors="none", edgecolors=BLACK, linewidths=1.4, zorder=5)
    is_left = axes.transAxes.inverted().transform(axes.transData.transform((cost, error)))[0] < 0.5
    axes.annotate(
        labels.winner_name, (cost, error), (10 if is_left else -10, -16), textcoords="offset points", zorder=6,
        ha="left" if is_left else "right", va="top", fontweight="bold", bbox=WHITE_BOX,
        arrowprops={"arrowstyle": "-", "color": BLACK, "lw": 0.8},
    )  # fmt: skip


def _unique_legend(axes: Axes) -> tuple[list, list]:
    handles, labels = axes.get_legend_handles_labels()
    by_label = dict(zip(labels, handles, strict=True))
    return list(by_label.values()), list(by_label)
