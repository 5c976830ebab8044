"""Tables of a report as text cells."""

import re
from dataclasses import dataclass
from decimal import Decimal

from rfiddesign.optimize.space import ANY_LAYOUT
from rfiddesign.report.contents import Answer, Contents
from rfiddesign.report.words import count, grouped, in_unit, metric_value, percent, plotted_metric
from rfiddesign.results.study_result import AnswerRecord, CostLineRecord, DecisionRecord, StudyResult
from rfiddesign.units import money

TWO_TAGS = "a reader that must see one tag at a time may see two"

AREA_NAMES = {
    "chosen": "as chosen",
    "occupied": "occupied from probability",
    "free": "free below probability",
    "unknown_half_width_grey": "width of the unknown grey ±",
    "speck_pixels": "specks dropped, pixels up to",
    "footprint_radius_mm": "footprint radius [mm]",
}


@dataclass(frozen=True)
class Table:
    """A table of text cells.

    Parameters
    ----------
    headers : names of the columns.
    rows : cells, as many in each row as there are headers.
    numeric : columns that hold numbers, by index: set to the right.
    total : a last row that sums the others, or None.
    """

    headers: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: tuple[int, ...] = ()
    total: tuple[str, ...] | None = None


def cost_table(answer: AnswerRecord) -> Table:
    """What an answer buys, line by line."""
    rows = tuple(
        (
            line.item, quantity_words(line), _price(line.unit_price, answer.currency),
            money(line.amount_cents, answer.currency), line.source,
        )
        for line in answer.cost_lines
    )  # fmt: skip
    total = money(sum(line.amount_cents for line in answer.cost_lines), answer.currency)
    return Table(("Item", "Quantity", "Unit price", "Amount", "Source"), rows, (1, 2, 3), ("Total", "", "", total, ""))


def quantity_words(line: CostLineRecord) -> str:
    """The quantity of a line with its unit, as "12,600 pcs"; a single piece is just 1."""
    unit = {"piece": "" if Decimal(line.quantity) == 1 else "pcs", "m2": "m²"}.get(line.unit, line.unit)
    return f"{grouped(line.quantity)} {unit}".rstrip()


def group_totals(answer: AnswerRecord) -> dict[str, int]:
    """Cents by group of cost lines, in the order of the lines."""
    totals: dict[str, int] = {}
    for line in answer.cost_lines:
        totals[line.group] = totals.get(line.group, 0) + line.amount_cents
    return totals


def comparison_table(contents: Contents) -> Table:
    """The answers side by side, one column per fleet."""
    answers = contents.answers
    rows = [
        ("Price", *(_winner_cell(a, lambda a: money(a.record.winner.cost_cents, a.record.currency)) for a in answers))
    ]
    rows.append(("Price per robot", *(_winner_cell(a, _price_per_robot) for a in answers)))
    designs = {
        "Readers per robot": lambda d: f"{d.n_readers}",
        "Layout": lambda d: d.layout,
        "Antenna": lambda d: f"{d.antenna} mm",
        "Tag pattern": lambda d: d.pattern,
        "Tags per m²": lambda d: f"{d.tags_per_m2:g}",
        "Tags": lambda d: f"{d.n_tags:,}",
    }
    if contents.result.is_estimator_open:
        designs["Estimator"] = lambda d: d.estimator
    for name, value in designs.items():
        rows.append((name, *(_winner_cell(a, lambda a, v=value: v(contents.design(a.record.winner))) for a in answers)))
    for group in dict.fromkeys(group for answer in answers for group in group_totals(answer.record)):
        rows.append(
            (f"Cost {group.replace('m2', 'm²')}", *(_winner_cell(a, lambda a, g=group: _share(a, g)) for a in answers))
        )
    rows.append(("Drives passed", *(_winner_cell(a, lambda a: passed(a.record.winner)) for a in answers)))
    headers = ("", *(count(answer.record.n_robots, "robot") for answer in answers))
    return Table(headers, tuple(rows), tuple(range(1, len(headers))))


def neighbour_table(contents: Contents, answer: Answer) -> Table:
    """The winner among its neighbours: next best, lower bound and cheaper designs without a verdict."""
    record = answer.record
    entries = [("cheapest certified", record.winner)] if record.winner else []
    entries += [("next best", decision) for decision in record.runners_up]
    entries += [("undecided", decision) for decision in record.undecided]
    open_designs = {decision.design for _, decision in entries}
    if record.lower_bound is not None and record.lower_bound.design not in open_designs:
        entries.append(("lower bound", record.lower_bound))
    metric = plotted_metric(contents.result.requirement)
    rows = []
    for role, decision in sorted(entries, key=lambda entry: entry[1].cost_cents):
        design = contents.design(decision)
        is_bound = record.lower_bound is not None and decision.design == record.lower_bound.design
        role = f"{role} (lower bound)" if is_bound and role == "undecided" else role
        rows.append(
            (role, design.name, money(decision.cost_cents, record.currency), passed(decision),
             error_words(contents, decision, metric))
        )  # fmt: skip
    return Table(("", "Design", "Price", "Drives passed", "Error"), tuple(rows), (2, 3, 4))


def error_words(contents: Contents, decision: DecisionRecord, metric: str) -> str:
    """Mean of an error metric over a design's runs; marked where runs were stopped before their end."""
    design = contents.design(decision)
    if metric not in design.metrics:
        return "–"
    value = metric_value(metric, design.metrics[metric].mean)
    return f"{value} (some drives cut short)" if design.n_complete < design.n_runs else value


def front_table(result: StudyResult) -> Table:
    """The cheapest price by limit, one column per fleet."""
    factors = sorted({1.0} | {front.factor for answer in result.answers for front in answer.fronts})
    rows = []
    for factor in factors:
        cells = [_front_cell(result, answer, front_decision(answer, factor)) for answer in result.answers]
        limits = ", ".join(metric_value(limit.metric, limit.limit * factor) for limit in result.requirement.limits)
        rows.append((f"× {factor:g}", limits, *cells))
    headers = ("Limits", "that is", *(count(answer.n_robots, "robot") for answer in result.answers))
    return Table(headers, tuple(rows), tuple(range(2, len(headers))))


def front_decision(answer: AnswerRecord, factor: float) -> DecisionRecord | None:
    """The cheapest design at limits times a factor, certified or estimated; the answer itself at 1."""
    if factor == 1.0:
        return answer.winner
    return next((front.decision for front in answer.fronts if front.factor == factor), None)


def front_words(answer: AnswerRecord, decision: DecisionRecord | None) -> str:
    """A price at other limits; what is not certified says so, with the drives passed."""
    if decision is None:
        return "none among those tested"
    price = money(decision.cost_cents, answer.currency)
    return price if decision.verdict == "certified" else f"{price} (estimate: {passed(decision)})"


def _front_cell(result: StudyResult, answer: AnswerRecord, decision: DecisionRecord | None) -> str:
    words = front_words(answer, decision)
    if decision is None or not result.is_estimator_open:
        return words
    estimator = next(design.estimator for design in result.designs if design.number == decision.design)
    return f"{words}, {estimator}"


def area_table(result: StudyResult) -> Table:
    """How the floor's area moves with the thresholds of its map."""
    floor = result.floor
    rows = []
    chosen_m2 = next((row.area_m2 for row in floor.sensitivity if row.name == "chosen"), floor.area_m2)
    for row in floor.sensitivity:
        name = AREA_NAMES.get(row.name, row.name.replace("_", " "))
        name = name if row.value is None else f"{name} {row.value:g}"
        change = row.area_m2 / chosen_m2 - 1
        rows.append((name, f"{row.area_m2:,.0f} m²", f"{100 * change:+.1f} %", f"{row.navigable_m2:,.0f} m²"))
    return Table(("If the map is read with", "Area to tag", "Change", "Robot's centre"), tuple(rows), (1, 2, 3))


def antenna_table(answer: Answer) -> Table:
    """Where each antenna is bolted."""
    rows = tuple(
        (f"{i}", f"{pose.x_mm:.1f}", f"{pose.y_mm:.1f}", f"{in_unit('yaw_rad', pose.yaw_rad)[0]:.1f}")
        for i, pose in enumerate(answer.chosen.antennas, start=1)
    )
    return Table(("Antenna", "x [mm]", "y [mm]", "yaw [°]"), rows, (0, 1, 2, 3))


def screen_table(result: StudyResult) -> Table:
    """What became of the combinations of the space before the first run."""
    space = result.space
    with_estimator = " and estimators" if result.is_estimator_open else ""
    rows = [(f"combinations of all variables{with_estimator}", f"{space.n_combinations:,}")]
    kinds = ["antennas overlap or stick out of the robot"]
    if any(fault.layout == ANY_LAYOUT for fault in space.unbuildable):
        kinds.append(TWO_TAGS)
    rows.append((f"cannot be built: {', or '.join(kinds)}", f"−{space.n_unbuildable:,}"))
    for screen in space.screens:
        rows.append((f"screened out untested ({screen.kind}): {screen.rule}", f"−{screen.n_removed:,}"))
    return Table(("Designs", "Number"), tuple(rows), (1,), ("candidates of the search", f"{space.n_candidates:,}"))


def unbuildable_table(result: StudyResult) -> Table:
    """What cannot be built, by reason and antenna: layouts that do not take it, patterns too dense for its reader."""
    groups: dict[tuple[str, str], list[str]] = {}
    for fault in result.space.unbuildable:
        is_pattern = fault.layout == ANY_LAYOUT
        kind, which = (TWO_TAGS, _pattern_of(fault.reason)) if is_pattern else (_kind_of(fault.reason), fault.layout)
        groups.setdefault((kind, fault.antenna), []).append(which)
    rows = tuple(
        (kind, f"{antenna} mm", count(len(names), "pattern" if kind == TWO_TAGS else "layout"), ", ".join(names))
        for (kind, antenna), names in sorted(groups.items())
    )
    return Table(("Reason", "Antenna", "How many", "Which"), rows, (2,))


def assumption_table(result: StudyResult) -> Table:
    """What the answer rests on."""
    rows = tuple((item.what, item.value, item.source) for item in result.assumptions)
    return Table(("Assumption", "Value", "Source"), rows)


def passed(decision: DecisionRecord) -> str:
    """Passed drives of a decision, as "137 of 140"."""
    return f"{decision.n_passed:,} of {decision.n_runs:,}"


def _kind_of(reason: str) -> str:
    kinds = [
        kind for word, kind in (("overlap", "overlap"), ("sticks out", "stick out of the robot")) if word in reason
    ]
    return f"antennas {' and '.join(kinds)}" if kinds else reason


def _pattern_of(reason: str) -> str:
    """The pattern that a reason names, as "square 100 tags/m²"; the whole reason if it names none."""
    found = re.search(r"pattern (.+) with (\S+) tags/m2", reason)
    return f"{found[1]} {found[2]} tags/m²" if found else reason


def _winner_cell(answer: Answer, words) -> str:
    return "–" if answer.record.winner is None else words(answer)


def _price_per_robot(answer: Answer) -> str:
    record = answer.record
    return money(round(record.winner.cost_cents / record.n_robots), record.currency)


def _share(answer: Answer, group: str) -> str:
    cents = group_totals(answer.record).get(group, 0)
    return f"{money(cents, answer.record.currency)} ({percent(cents / max(answer.record.winner.cost_cents, 1), 0)})"


def _price(text: str, currency: str) -> str:
    amount = Decimal(text)
    digits = max(2, -int(amount.normalize().as_tuple().exponent))
    return f"{currency} {amount:,.{digits}f}"
