"""Numbers and names as a buyer reads them: money, metrics with units, requirements."""

import math
from decimal import Decimal

from rfiddesign.results.study_result import Limit, RequirementRecord, StudyResult

#: Statistic of a metric in words.
STATISTICS = {"mean": "mean", "rms": "root mean square", "p95": "95th percentile", "max": "maximum"}


def short_money(amount: float) -> str:
    """An amount rounded for an axis, as "12.5k"."""
    for size, suffix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if amount >= size:
            return f"{amount / size:.3g}{suffix}"
    return f"{amount:.3g}"


def grouped(text: str) -> str:
    """An exact decimal with thousands separators, without trailing zeros after the point."""
    number = Decimal(text)
    if number == number.to_integral_value():
        return f"{number.to_integral_value():,f}"
    return f"{number.normalize():,f}"


def shortened(text: str, length: int) -> str:
    """The text, cut to a length [>= 1] with an ellipsis if it is longer."""
    return text if len(text) <= length else f"{text[: length - 1].rstrip()}…"


def count(n: int, noun: str) -> str:
    """A count with its noun, as "1 robot", "1,000 robots"."""
    return f"{n:,} {noun}" + ("" if n == 1 else "s")


def candidates(n: int, result: StudyResult, which: str = "") -> str:
    """A count of what was to be tested: designs, or pairs with an estimator where the study leaves that open."""
    if result.is_estimator_open:
        return f"{count(n, f'{which}pair')} of design and estimator"
    return count(n, f"{which}design")


def percent(share: float, digits: int = 1) -> str:
    """A share as a percentage, as "2.5 %"."""
    text = f"{100 * share:.{digits}f}"
    return f"{text.rstrip('0').rstrip('.') if '.' in text else text} %"


def metric_name(metric: str) -> str:
    """A metric in words, as "95th percentile of the position error"."""
    if metric == "lost_share":
        return "share of time lost"
    quantity, _, rest = metric.partition("_")
    statistic = rest.partition("_")[0]
    return f"{STATISTICS.get(statistic, statistic)} of the {quantity} error"


def in_unit(metric: str, value: float) -> tuple[float, str]:
    """A metric's value in the unit people think in, and that unit: mm, degrees, per cent."""
    if metric.endswith("_rad"):
        return math.degrees(value), "°"
    if metric.endswith("_share"):
        return 100 * value, " %"
    return value, " mm"


def metric_value(metric: str, value: float) -> str:
    """A metric's value with its unit, as "12.5 mm" or "2°"."""
    number, unit = in_unit(metric, value)
    digits = f"{number:.0f}" if abs(number) >= 100 else f"{number:.3g}"
    return f"{digits}{unit}"


def limit_words(limit: Limit) -> str:
    """A limit in words, as "the position error is at most 20 mm (95th percentile)"."""
    value = metric_value(limit.metric, limit.limit)
    if limit.metric == "lost_share":
        return f"it is lost for at most {value} of the time"
    quantity, _, rest = limit.metric.partition("_")
    statistic = STATISTICS.get(rest.partition("_")[0])
    return f"the {quantity} error is at most {value}" + (f" ({statistic})" if statistic else "")


def requirement_words(requirement: RequirementRecord) -> str:
    """What a drive must keep to pass, as one sentence."""
    parts = [limit_words(limit) for limit in requirement.limits]
    if requirement.converged_within_s is not None:
        parts.append(f"the robot is localized within {requirement.converged_within_s:g} s")
    return f"A drive passes if {joined(parts)}."


def joined(parts: list[str]) -> str:
    """Parts as an enumeration, as "a, b and c"."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def plotted_metric(requirement: RequirementRecord) -> str:
    """The position error that designs are compared by: the 95th percentile, or what the requirement limits instead."""
    limited = [limit.metric for limit in requirement.limits if limit.metric.startswith("position_")]
    if not limited or "position_p95_mm" in limited:
        return "position_p95_mm"
    return limited[0]


def limit_of(requirement: RequirementRecord, metric: str) -> float | None:
    """The limit on a metric, None if it has none."""
    return next((limit.limit for limit in requirement.limits if limit.metric == metric), None)
