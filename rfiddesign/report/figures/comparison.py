"""Prices of the answers to a study's variants, by group and condition."""

import textwrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import blended_transform_factory

from rfiddesign.report.figures.scales import set_scale
from rfiddesign.report.figures.style import CYCLE, GREY, MARKERS, new_figure, styled
from rfiddesign.report.words import count, shortened
from rfiddesign.results.comparison import Comparison, VariantAnswer

#: Letters of a group's name in a line beside the axis, and lines of it at most.
LABEL_WIDTH, LABEL_LINES = 18, 3
LEGEND_WIDTH = 44
#: Prices closer together than this ratio would look alike if rounded for the axis.
FULL_BELOW_RATIO, FULL_TICKS = 1.1, 4
# Heights [in] of a line of a label, of a marker's lane, and of title and axis of a panel.
LINE_IN, LANE_IN, PANEL_IN = 0.16, 0.16, 0.72


@styled
def comparison_figure(comparison: Comparison, fleets: list[int]) -> Figure:
    """Draw the price of each group, a marker per condition and a panel per fleet; each with a lane of its own.

    Open marks have cheaper designs without a verdict; where nothing is certified, words stand in place of a mark.
    """
    conditions = comparison.conditions
    labels = [_label(group) for group in comparison.groups]
    heights = [max(LINE_IN * (1 + label.count("\n")), LANE_IN * len(conditions)) + 0.1 for label in labels]
    legend = _legend_entries(comparison, fleets)
    n_columns = 1 if any(len(words) > LEGEND_WIDTH // 2 for _, words in legend) else 2
    legend_in = 0.19 * -(-len(legend) // n_columns) + 0.1 if legend else 0.0
    figure = new_figure(len(fleets) * (sum(heights) + PANEL_IN) + legend_in)
    panels = figure.subplots(len(fleets), 1, squeeze=False)[:, 0]
    for axes, n_robots in zip(panels, fleets, strict=True):
        _draw_panel(axes, comparison, n_robots, heights)
        axes.set_yticks(_centres(heights), labels)
    if legend:
        marks, words = zip(*legend, strict=True)
        figure.legend(marks, words, loc="outside lower center", ncols=n_columns, columnspacing=1.2, handletextpad=0.4)
    return figure


def _draw_panel(axes: Axes, comparison: Comparison, n_robots: int, heights: list[float]) -> None:
    conditions = comparison.conditions
    prices, currencies = [], []
    for group, centre, height in zip(comparison.groups, _centres(heights), heights, strict=True):
        lane = (height - 0.1) / len(conditions)
        for i, condition in enumerate(conditions):
            variant = comparison.variant(group, condition)
            answer = None if variant is None else variant.answer(n_robots)
            if answer is None:
                continue
            y = centre + lane * (i - (len(conditions) - 1) / 2)
            currencies.append(answer.currency)
            if answer.winner is not None:
                prices.append(answer.winner.cost_cents / 100)
                axes.plot(prices[-1], y, **_look(i, answer))
            else:
                _write_why(axes, y, i, answer)
    for edge in range(1, len(heights)):
        axes.axhline(sum(heights[:edge]), color="#e5e7eb", lw=0.7)
    axes.set_ylim(sum(heights), 0)
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    if prices:
        set_scale(axes.xaxis, min(prices), max(prices), is_money=True)
        if max(prices) < FULL_BELOW_RATIO * min(prices):
            axes.xaxis.set_major_locator(MaxNLocator(FULL_TICKS - 1))
            axes.xaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
    else:
        axes.set_xticks([])
    axes.set_title(count(n_robots, "robot"), loc="left", fontweight="bold")
    axes.set_xlabel(f"cheapest certified price [{'/'.join(dict.fromkeys(currencies))}]")


def _write_why(axes: Axes, y: float, i: int, answer: VariantAnswer) -> None:
    """Say at the left edge of a lane why it has no mark; it is the only thing in its lane."""
    words = "none: all refuted" if answer.claim == "none holds" else "undecided"
    at_edge = blended_transform_factory(axes.transAxes, axes.transData)
    axes.plot(0.02, y, transform=at_edge, **_look(i, answer), clip_on=False)
    axes.text(0.045, y, words, transform=at_edge, va="center_baseline", fontsize=8.5, color=GREY)


def _look(i: int, answer: VariantAnswer | None = None) -> dict[str, object]:
    """The mark of condition number i: a cross without a winner, open if cheaper designs are undecided."""
    colour, marker = CYCLE[i % len(CYCLE)], MARKERS[(i + i // len(MARKERS)) % len(MARKERS)]
    look = {"ls": "none", "color": colour, "mec": colour, "ms": 6.5, "zorder": 3}
    if answer is not None and answer.winner is None:
        return look | {"marker": "x", "ms": 5}
    is_open = answer is not None and answer.n_undecided > 0
    return look | {"marker": marker, "mfc": "white" if is_open else colour}


def _legend_entries(comparison: Comparison, fleets: list[int]) -> list[tuple[object, str]]:
    """Marks with their words; nothing to tell of a single condition without a name."""
    conditions = comparison.conditions
    entries = []
    if conditions != [""]:
        entries = [
            (Line2D([], [], **_look(i)), shortened(condition or "(no condition)", LEGEND_WIDTH))
            for i, condition in enumerate(conditions)
        ]
    answers = [answer for variant in comparison.variants for n in fleets if (answer := variant.answer(n)) is not None]
    if any(answer.winner is not None and answer.n_undecided for answer in answers):
        mark = Line2D([], [], ls="none", marker="o", mfc="white", mec=GREY, ms=6.5)
        entries.append((mark, "open: cheaper designs undecided"))
    return entries


def _label(group: str) -> str:
    """A group's name in a few short lines."""
    lines = textwrap.wrap(group, LABEL_WIDTH) or [group]
    return "\n".join(lines if len(lines) <= LABEL_LINES else [*lines[: LABEL_LINES - 1], f"{lines[LABEL_LINES - 1]}…"])


def _centres(heights: list[float]) -> list[float]:
    return [sum(heights[:i]) + height / 2 for i, height in enumerate(heights)]
