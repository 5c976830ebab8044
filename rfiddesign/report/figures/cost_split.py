"""What the price of each fleet's answer is made of."""

from matplotlib import patheffects
from matplotlib.figure import Figure

from rfiddesign.report.figures.style import CYCLE, new_figure, no_data, styled
from rfiddesign.report.tables import group_totals
from rfiddesign.report.words import count, percent, short_money
from rfiddesign.results.study_result import AnswerRecord

#: Shares smaller than this have no room for their number.
LABELLED_FROM = 0.12
OUTLINE = [patheffects.withStroke(linewidth=2.5, foreground="white")]
HATCHES = ("", "//", "..", "xx", "\\\\", "--", "++")


@styled
def cost_split_figure(answers: list[AnswerRecord]) -> Figure:
    """Draw the shares of the price per robot, per tag, per m2 and per project, one bar per fleet with a winner."""
    won = [answer for answer in answers if answer.winner is not None]
    figure = new_figure(1.5 + 0.62 * max(len(won), 1))
    if not won:
        return no_data(figure, "No design was certified.")
    axes = figure.subplots()
    groups = list(dict.fromkeys(group for answer in won for group in group_totals(answer)))
    names = [
        f"{count(answer.n_robots, 'robot')}\n{answer.currency} {short_money(answer.winner.cost_cents / 100)}"
        for answer in won
    ]
    left = [0.0] * len(won)
    for i, group in enumerate(groups):
        shares = [group_totals(answer).get(group, 0) / max(answer.winner.cost_cents, 1) for answer in won]
        bars = axes.barh(
            names,
            [100 * share for share in shares],
            left=left,
            height=0.62,
            color=CYCLE[i % 7],
            edgecolor="white",
            hatch=HATCHES[i % 7],
            label=group.replace("m2", "m²"),
        )
        axes.bar_label(
            bars,
            [percent(share, 0) if share >= LABELLED_FROM else "" for share in shares],
            label_type="center",
            fontweight="bold",
            bbox=None,
            color="black",
            path_effects=OUTLINE,
        )
        left = [start + 100 * share for start, share in zip(left, shares, strict=True)]
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.grid(False, axis="y")
    axes.set_xlabel("share of the price [%]")
    figure.legend(loc="outside lower center", ncols=4, columnspacing=1.0, handlelength=1.3, handletextpad=0.4)
    return figure
