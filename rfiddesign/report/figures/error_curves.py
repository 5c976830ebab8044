"""Errors of single drives over time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rfiddesign.report.figures.style import BLACK, CYCLE, LINE_STYLES, WHITE_BOX, new_figure, no_data, styled
from rfiddesign.report.words import STATISTICS, in_unit
from rfiddesign.results.study_result import Limit, RequirementRecord, TraceRecord

#: Errors that span more than this ratio are drawn on a logarithmic axis.
LOG_FROM_RATIO = 30.0


@styled
def error_curves_figure(traces: tuple[TraceRecord, ...], requirement: RequirementRecord) -> Figure:
    """Draw position and heading error of some drives over time, with the limits."""
    figure = new_figure(4.4)
    if not traces:
        return no_data(figure, "No drive was recorded.")
    top, bottom = figure.subplots(2, 1, sharex=True)
    _draw_errors(top, traces, "position", requirement.limits)
    _draw_errors(bottom, traces, "heading", requirement.limits)
    if requirement.converged_within_s is not None:
        for axes in (top, bottom):
            axes.axvline(requirement.converged_within_s, color=BLACK, lw=1.0, ls=":")
        top.annotate(
            "localized by",
            (requirement.converged_within_s, 1),
            (3, -2),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            va="top",
        )
    top.set_ylabel("position error [mm]")
    bottom.set_ylabel("heading error [°]")
    bottom.set_xlabel("time [s]")
    handles, labels = top.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=4, columnspacing=1.0, handlelength=1.6, handletextpad=0.4
    )
    return figure


def _draw_errors(axes: Axes, traces: tuple[TraceRecord, ...], quantity: str, limits: list[Limit]) -> None:
    metric = "position_error_mm" if quantity == "position" else "heading_error_rad"
    unit = in_unit(metric, 1.0)[0]
    everything = []
    for i, trace in enumerate(traces):
        errors = np.asarray(getattr(trace, metric), float) * unit
        everything.append(errors)
        axes.plot(
            trace.time_s,
            errors,
            lw=1.0,
            color=CYCLE[i % len(CYCLE)],
            ls=LINE_STYLES[i // len(CYCLE) % 4],
            label=f"drive {trace.run}",
        )
    own = [limit for limit in limits if limit.metric.startswith(quantity)]
    for limit in own:
        value, symbol = in_unit(limit.metric, limit.limit)
        axes.axhline(value, color=BLACK, lw=1.2, ls="--")
        statistic = STATISTICS.get(limit.metric.split("_")[1], "")
        axes.annotate(
            f"limit {value:.3g}{symbol} on the {statistic}",
            (1, value),
            (-2, 2),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            ha="right",
            va="bottom",
            bbox=WHITE_BOX,
        )
    errors = np.concatenate(everything)
    typical = max(float(np.median(errors)), 1e-9)
    high = max([float(errors.max(initial=0.0)), *(in_unit(limit.metric, limit.limit)[0] for limit in own)])
    if high > LOG_FROM_RATIO * typical:
        axes.set_yscale("log")
        axes.set_ylim(typical / 10, high * 2)
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:,g}")
    else:
        axes.set_ylim(0, high * 1.2)
