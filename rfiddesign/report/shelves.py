"""Floor against shelves on a page: its figures, who is cheaper when, what it promises, and its table."""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass

from rfiddesign.report.album import Picture
from rfiddesign.report.contents import Contents
from rfiddesign.report.extra import Extra
from rfiddesign.report.figures.shelves import families_figure, hall_figure
from rfiddesign.report.tables import Table, quantity_words
from rfiddesign.report.words import count, joined, limit_words, percent
from rfiddesign.results.folder import SHELVES, SHELVES_CSV, read_record
from rfiddesign.results.shelves import FamilyAnswer, Shelves
from rfiddesign.results.spreadsheet import exact_amount, plain_cell
from rfiddesign.units import money

NAMES = {"floor": "tags in the floor", "shelves": "tags on shelves"}
CSV_HEADER = (
    "family", "robots", "limits_factor", "claim", "design", "currency", "price", "lower_bound", "undecided_cheaper",
    "drives_passed", "drives",
)  # fmt: skip
#: Ends a verdict that designs without one might turn.
UNSURE = " *"
#: Topics of the figures.
CURVES, HALL = "shelves", "shelves-hall"


@dataclass(frozen=True)
class Bill:
    """What an answer buys: whose it is, and its lines."""

    title: str
    table: Table


@dataclass(frozen=True)
class ShelvesPart:
    """What the page says of both families."""

    hall: str
    cheaper: Table
    said: tuple[str, ...]
    designs: Table
    bills: tuple[Bill, ...]
    promised: tuple[str, ...]
    rests_on: tuple[str, ...]


def shelves_section(contents: Contents) -> Extra | None:
    """Floor against shelves of a result folder; None if its study has no shelves."""
    if not (contents.folder / SHELVES).exists():
        return None
    shelves = read_record(contents.folder / SHELVES, Shelves)
    return Extra(
        key="shelves",
        title="Floor or shelf",
        template="shelves.html.jinja",
        part=shelves_part(shelves),
        pictures=tuple(shelves_pictures(shelves)),
        files=((SHELVES_CSV, shelves_csv(shelves)),),
    )


def shelves_pictures(shelves: Shelves) -> Iterator[Picture]:
    """The figures of both families."""
    for n_robots in shelves.robots:
        caption = (
            f"{count(n_robots, 'robot')}: large marks are the cheapest certified designs at each limit, small ones"
            " designs that were tested, at the mean error of their drives."
        )
        yield Picture(CURVES, f"floor-or-shelf-{n_robots}", caption, families_figure(shelves, n_robots))
    yield Picture(HALL, "shelves-hall", "The hall and its rows of shelves.", hall_figure(shelves))


def shelves_part(shelves: Shelves) -> ShelvesPart:
    """What the page says."""
    hall = shelves.hall
    return ShelvesPart(
        hall=f"{hall.length_mm / 1e3:g} x {hall.width_mm / 1e3:g} m with {count(len(hall.rows_mm), 'row')} of shelves,"
        f" {hall.area_m2:,.0f} m² to drive on",
        cheaper=cheaper_table(shelves),
        said=said(shelves),
        designs=design_table(shelves),
        bills=tuple(_bills(shelves)),
        promised=promised(shelves),
        rests_on=rests_on(shelves),
    )


def cheaper_table(shelves: Shelves) -> Table:
    """For each limit and fleet what both families cost, and by how much which is cheaper."""
    rows = []
    for factor in shelves.factors:
        for n_robots in shelves.robots:
            floor, other = (shelves.answer(family, n_robots, factor) for family in ("floor", "shelves"))
            words = joined([limit_words(limit) for limit in floor.limits])
            rows.append(
                (words, f"{n_robots:,}", _price(shelves, floor), _price(shelves, other), verdict(shelves, floor, other))
            )
    return Table(
        ("A drive passes if", "Robots", "Tags in the floor", "Tags on shelves", "Cheaper"), tuple(rows), (1, 2, 3)
    )


def verdict(shelves: Shelves, floor: FamilyAnswer, other: FamilyAnswer) -> str:
    """Which of two answers is cheaper, as far as they tell."""
    if floor.cost_cents is None and other.cost_cents is None:
        return "neither certified"
    if floor.cost_cents is None or other.cost_cents is None:
        won, lost = (floor, other) if other.cost_cents is None else (other, floor)
        if lost.lower_bound_cents is None:
            return f"{NAMES[won.family]}; the others were all refuted"
        is_surely = lost.lower_bound_cents >= won.cost_cents
        return NAMES[won.family] + ("" if is_surely else ", of those certified")
    if floor.cost_cents == other.cost_cents:
        return "equal"
    won, lost = (floor, other) if floor.cost_cents < other.cost_cents else (other, floor)
    saved = money(lost.cost_cents - won.cost_cents, shelves.currency)
    is_surely = lost.lower_bound_cents is not None and lost.lower_bound_cents >= won.cost_cents
    return f"{NAMES[won.family]}, by {saved}" + ("" if is_surely else UNSURE)


def said(shelves: Shelves) -> tuple[str, ...]:
    """Where each family's answers end."""
    sentences = []
    for family, name in NAMES.items():
        mine = [answer for answer in shelves.answers if answer.family == family]
        won = [answer for answer in mine if answer.winner is not None]
        refuted = [answer for answer in mine if answer.lower_bound_cents is None]
        sentence = f"{name[0].upper()}{name[1:]}: certified for {len(won)} of {len(mine)} limits and fleets"
        if refuted:
            sentence += f"; for {len(refuted)} every design tested was refuted"
        sentences.append(sentence + ".")
    return tuple(sentences)


def design_table(shelves: Shelves) -> Table:
    """The certified designs, each once, with the limits and fleets it is the answer for."""
    rows: dict[tuple[str, str], list[str]] = {}
    passed: dict[tuple[str, str], list[str]] = {}
    for answer in shelves.answers:
        if answer.winner is not None:
            key = (NAMES[answer.family], answer.name)
            rows.setdefault(key, []).append(f"{answer.n_robots:,} at x {answer.factor:g}")
            passed.setdefault(key, []).append(f"{answer.n_passed} of {answer.n_runs}")
    body = tuple((*key, ", ".join(where), ", ".join(dict.fromkeys(passed[key]))) for key, where in rows.items())
    return Table(("Family", "Design", "Robots at limits times", "Drives passed"), body)


def promised(shelves: Shelves) -> tuple[str, ...]:
    """What holds, with which chance of error."""
    return (
        f"Every certified design passes more than {percent(shelves.fail_probability)} of all drives at its limit."
        " Within one family, at all limits and for all fleets at once, this is wrong with a chance of at most"
        f" {percent(shelves.alpha_certify)}; in both families together, of at most"
        f" {percent(2 * shelves.alpha_certify)}.",
        "In one answer: no design of its family that is cheaper than it (or, where cheaper designs stayed undecided,"
        f" than its lower bound) passes {percent(shelves.hold_probability)} or more; wrong with a chance of at most"
        f" {percent(shelves.alpha_refute)}.",
        "An asterisk: the dearer family has designs that came to no verdict and are cheaper than the other's answer.",
        f"Tested were {count(shelves.n_floor_designs, 'floor design')} and"
        f" {count(shelves.n_shelf_designs, 'shelf design')}, by the same requirement on the same drives.",
    )


def rests_on(shelves: Shelves) -> tuple[str, ...]:
    """What the comparison takes for granted."""
    minutes = shelves.training_drive_s / 60
    return (
        "Every drive of a shelf design has a hall of its own: its reflections, its training and what changes over night"
        " are drawn anew, as every drive of a floor design has a freshly laid floor.",
        f"One robot trains for the whole fleet, in drives of {minutes:g} minutes, and its antennas stand for those of"
        " the others.",
        "Goods on the shelves stay as they were in training but for the share of reflections that is new every day.",
    )


def shelves_csv(shelves: Shelves) -> str:
    """The answers as CSV; text cannot be taken for a formula."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(CSV_HEADER)
    for answer in shelves.answers:
        price, bound = ("" if cents is None else exact_amount(cents) for cents in _cents(answer))
        row = (
            answer.family, str(answer.n_robots), f"{answer.factor:g}", answer.claim, answer.name, shelves.currency,
            price, bound, str(answer.n_undecided), str(answer.n_passed), str(answer.n_runs),
        )  # fmt: skip
        writer.writerow(plain_cell(cell) for cell in row)
    return text.getvalue()


def _cents(answer: FamilyAnswer) -> tuple[int | None, int | None]:
    return answer.cost_cents, answer.lower_bound_cents


def _price(shelves: Shelves, answer: FamilyAnswer) -> str:
    if answer.cost_cents is not None:
        return money(answer.cost_cents, shelves.currency)
    if answer.lower_bound_cents is None:
        return "all refuted"
    return f"open, from {money(answer.lower_bound_cents, shelves.currency)}"


def _bills(shelves: Shelves) -> Iterator[Bill]:
    """What the answers at the study's own limits buy."""
    for n_robots in shelves.robots:
        for family, name in NAMES.items():
            answer = shelves.answer(family, n_robots, 1.0)
            if answer.cost_cents is None:
                continue
            rows = tuple(
                (line.item, quantity_words(line), money(line.amount_cents, shelves.currency), line.source)
                for line in answer.cost_lines
            )
            total = ("Total", "", money(answer.cost_cents, shelves.currency), "")
            title = f"{count(n_robots, 'robot')}, {name}: {answer.name}"
            yield Bill(title, Table(("Item", "Quantity", "Amount", "Source"), rows, (1, 2), total))
