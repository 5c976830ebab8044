"""The cheapest price at tighter and looser limits."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rfiddesign.report.figures.scales import set_scale
from rfiddesign.report.figures.style import BLACK, CYCLE, GREY, LINE_STYLES, MARKERS, new_figure, no_data, styled
from rfiddesign.report.tables import front_decision
from rfiddesign.report.words import count, in_unit, metric_name
from rfiddesign.results.study_result import StudyResult


@styled
def fronts_figure(result: StudyResult) -> Figure:
    """Draw the cheapest price against the limit, one line per fleet.

    Filled marks are certified, open ones estimated from the runs made; crosses where no tested design seems to hold.
    """
    figure = new_figure(3.7)
    limit = result.requirement.limits[0] if result.requirement.limits else None
    factors = sorted({1.0} | {front.factor for answer in result.answers for front in answer.fronts})
    scale, unit = in_unit(limit.metric, limit.limit) if limit else (1.0, "")
    lines = {
        answer.n_robots: [
            (scale * factor, decision.cost_cents / 100, decision.verdict == "certified")
            for factor in factors
            if (decision := front_decision(answer, factor)) is not None and decision.cost_cents > 0
        ]
        for answer in result.answers
    }
    prices = [price for line in lines.values() for _, price, _ in line]
    if not prices:
        return no_data(figure, "No design was certified at any of the limits.")
    axes = figure.subplots()
    for i, (n_robots, line) in enumerate(lines.items()):
        _draw_line(axes, i, line, count(n_robots, "robot"))
    if not all(is_certified for line in lines.values() for _, _, is_certified in line):
        axes.plot([], [], ls="none", marker="o", mfc="white", mec=GREY, label="open: an estimate, not certified")
    set_scale(axes.yaxis, min(prices), max(prices), is_money=True)
    set_scale(axes.xaxis, scale * factors[0], scale * factors[-1])
    axes.set_xticks(
        [scale * factor for factor in factors], [f"{scale * factor:.3g}\n×{factor:g}" for factor in factors]
    )
    for i, (n_robots, line) in enumerate(lines.items()):
        missing = sorted({scale * factor for factor in factors} - {x for x, _, _ in line})
        if missing:
            height = [1 - 0.05 * (i + 1)] * len(missing)
            look = {"ls": "none", "marker": "x", "ms": 7, "mew": 1.6, "color": CYCLE[i % len(CYCLE)]}
            words = f"none found for {n_robots:,}"
            axes.plot(missing, height, transform=axes.get_xaxis_transform(), label=words, **look)
    axes.axvline(scale, color=BLACK, lw=1.0, ls=":")
    axes.annotate("required", (scale, 0), (3, 4), xycoords=("data", "axes fraction"), textcoords="offset points")
    axes.set_xlabel(
        f"limit on the {metric_name(limit.metric)} [{unit.strip()}]\n(the other limits by the same factor)"
        if limit
        else "factor on the limits [1]"
    )
    axes.set_ylabel(f"cheapest price [{result.answers[0].currency}]")
    figure.legend(loc="outside lower center", ncols=2, columnspacing=1.2)
    return figure


def _draw_line(axes: Axes, i: int, line: list[tuple[float, float, bool]], name: str) -> None:
    """Draw limit, price and whether it is certified."""
    if not line:
        return
    colour, marker = CYCLE[i % len(CYCLE)], MARKERS[i % len(MARKERS)]
    limits, costs, _ = zip(*line, strict=True)
    axes.plot(limits, costs, color=colour, marker=marker, ls=LINE_STYLES[i % len(LINE_STYLES)], ms=6, label=name)
    estimates = [(limit, price) for limit, price, is_certified in line if not is_certified]
    if estimates:
        axes.plot(*zip(*estimates, strict=True), color=colour, marker=marker, ls="none", ms=6, mfc="white", zorder=3)
