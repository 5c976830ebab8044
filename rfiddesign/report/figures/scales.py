"""Axes of money and of quantities that span decades."""

import math

from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter, NullLocator

from rfiddesign.report.words import short_money

#: An axis is logarithmic where its values span more than this ratio.
LOG_FROM_RATIO = 3.0
MAX_TICKS = 6


def set_scale(axis: Axis, low: float, high: float, *, is_money: bool = False) -> None:
    """Show low to high [>= 0] with a margin: logarithmic where they span decades, ticks of 1, 2 and 5."""
    words = short_money if is_money else (lambda value: f"{value:,.6g}")
    bounds = axis.axes.set_xlim if axis.axis_name == "x" else axis.axes.set_ylim
    if low > 0 and high / low > LOG_FROM_RATIO:
        margin = (high / low) ** 0.06
        low, high = low / margin, high * margin
        _set_log(axis)
        bounds(low, high)
        axis.set_major_locator(FixedLocator(log_ticks(low, high)))
        axis.set_minor_locator(NullLocator())
        axis.set_minor_formatter(NullFormatter())
    else:
        margin = 0.06 * (high - low) or 0.1 * abs(high) or 1.0
        bounds(max(0.0, low - margin), high + margin)
        axis.set_major_locator(MaxNLocator(MAX_TICKS - 1))
    axis.set_major_formatter(FuncFormatter(lambda value, _: words(value)))


def log_ticks(low: float, high: float) -> list[float]:
    """Round values from low to high [> 0]: the finest of a few series that gives at most six."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    best: list[float] = []
    for steps in (
        (1,),
        (1, 3),
        (1, 2, 5),
        (1, 1.5, 2, 3, 5, 7),
        (1, 1.2, 1.4, 1.6, 1.8, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 9),
    ):
        ticks = [step * 10.0**decade for decade in decades for step in steps if low <= step * 10.0**decade <= high]
        if len(ticks) > MAX_TICKS and len(best) >= 2:
            return best
        best = ticks
    return best


def _set_log(axis: Axis) -> None:
    (axis.axes.set_xscale if axis.axis_name == "x" else axis.axes.set_yscale)("log")
