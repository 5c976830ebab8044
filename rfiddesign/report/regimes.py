"""The map of regimes on a page: its figures, the rule that it comes down to, what it promises, and its table."""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

from rfiddesign.report.album import Picture
from rfiddesign.report.contents import Contents
from rfiddesign.report.extra import Extra
from rfiddesign.report.figures.regimes import price_per_m2_figure, regimes_figure, robots_share_figure
from rfiddesign.report.tables import Table
from rfiddesign.report.words import count, percent
from rfiddesign.results.folder import REGIMES, REGIMES_CSV, read_record
from rfiddesign.results.regimes import RegimeCell, RegimeDesign, Regimes
from rfiddesign.results.spreadsheet import exact_amount, plain_cell
from rfiddesign.units import money

CSV_HEADER = (
    "robots", "area_m2", "robots_per_1000_m2", "claim", "design", "layout", "antenna", "pattern", "tags_per_m2",
    "readers_per_robot", "tags", "currency", "price", "robots_price", "tags_price", "area_price", "project_price",
    "lower_bound", "undecided_cheaper", "drives_passed", "drives",
)  # fmt: skip
#: Topics of the figures.
MAP, SPLIT = "regimes", "regimes-split"


@dataclass(frozen=True)
class Band:
    """A range of robots per 1,000 m2 with one winner, None at the ends of the map.

    Between two winners the range ends where they cost the same; beside cells without a winner at its last own cell.
    """

    low: float | None
    high: float | None
    design: RegimeDesign | None


@dataclass(frozen=True)
class RegimesPart:
    """What the page says of the map."""

    reference: str
    bands: Table
    promised: tuple[str, ...]
    moved_by: tuple[str, ...]
    has_open: bool


def regimes_section(contents: Contents) -> Extra | None:
    """The map of a result folder; None if its study asked for none."""
    if not (contents.folder / REGIMES).exists():
        return None
    regimes = read_record(contents.folder / REGIMES, Regimes)
    return Extra(
        key="regimes",
        title="Fleet or floor",
        template="regimes.html.jinja",
        part=regimes_part(regimes),
        pictures=tuple(regimes_pictures(regimes)),
        files=((REGIMES_CSV, regimes_csv(regimes)),),
    )


def regimes_pictures(regimes: Regimes) -> Iterator[Picture]:
    """The figures of the map."""
    caption = (
        "The cheapest certified design: tags per m² with their pattern (square, triangular, random) and the price in"
        f" {regimes.currency}. On a dashed line two neighbouring answers cost the same."
    )
    yield Picture(MAP, "regimes", caption, regimes_figure(regimes))
    caption = "Share of the price spent on robots [%]."
    yield Picture(SPLIT, "regimes-robots-share", caption, robots_share_figure(regimes))
    caption = f"Price per m² of tagged floor [{regimes.currency}]."
    yield Picture(SPLIT, "regimes-price-per-m2", caption, price_per_m2_figure(regimes))


def regimes_part(regimes: Regimes) -> RegimesPart:
    """What the page says of the map."""
    return RegimesPart(
        reference=f"{regimes.reference_floor}, {regimes.reference_area_m2:,.0f} m²",
        bands=band_table(regimes),
        promised=promised(regimes),
        moved_by=moved_by(),
        has_open=any(cell.claim != "cheapest" for cell in regimes.cells),
    )


def bands(regimes: Regimes) -> list[Band]:
    """The winners by rising robots per m2; of cells with one ratio the largest counts, its rounding is the least."""
    rising = sorted(regimes.cells, key=lambda cell: (cell.robots_per_1000_m2, cell.area_m2))
    largest = {f"{cell.robots_per_1000_m2:.9g}": cell for cell in rising}
    edges = {(edge.below, edge.above): edge.robots_per_1000_m2 for edge in regimes.boundaries}
    runs = [(number, list(cells)) for number, cells in groupby(largest.values(), key=lambda cell: cell.winner)]
    found = []
    for i, (number, cells) in enumerate(runs):
        low = high = None
        if i:
            low = edges.get((runs[i - 1][0], number), cells[0].robots_per_1000_m2)
        if i + 1 < len(runs):
            high = edges.get((number, runs[i + 1][0]), cells[-1].robots_per_1000_m2)
        found.append(Band(low, high, None if number is None else regimes.design(number)))
    return found


def band_table(regimes: Regimes) -> Table:
    """The rule: which design for how many robots per 1,000 m2, and what it costs on a robot and on a m2."""
    rows = [(_range(band), *_design_cells(band.design, regimes.currency)) for band in bands(regimes)]
    headers = (
        "Robots per 1,000 m²", "Cheapest certified", "Readers per robot", "Tags per m²", "Equipping a robot",
        "Equipping a m²",
    )  # fmt: skip
    return Table(headers, tuple(rows), (2, 3, 4, 5))


def promised(regimes: Regimes) -> tuple[str, ...]:
    """What holds of the whole map at once, with which chance of error."""
    n_cells, n_mixes = len(regimes.cells), regimes.n_mixes
    at_once = min(1.0, n_mixes * regimes.alpha_refute)
    won = [cell for cell in regimes.cells if cell.winner is not None]
    answered = f"{len(won)} of {n_cells} cells have a certified design"
    tolerance = money(regimes.tolerance_cents, regimes.currency)
    sentences = [
        f"{answered}. Every one of these designs passes more than {percent(regimes.fail_probability)} of all drives;"
        f" the chance that this is wrong anywhere on the map is at most {percent(regimes.alpha_certify)}.",
        f"In one cell: no design of the {regimes.n_designs:,} tested ones that is cheaper than the answer (or, where"
        f" cheaper designs stayed undecided, than the lower bound) passes {percent(regimes.hold_probability)} or more;"
        f" wrong with a chance of at most {percent(regimes.alpha_refute)}, and so in at most that share of the cells on"
        " average.",
    ]
    if at_once < 1.0:
        sentences.append(
            f"In all cells at once, to within {tolerance} (rounding to whole tags and cents): wrong anywhere with a"
            f" chance of at most {percent(at_once)}, since prices are in one order wherever robots per m² are the same,"
            f" and the cells have {count(n_mixes, 'such ratio')}."
        )
    sentences.append(
        f"{regimes.n_runs:,} drives decided all cells together;"
        f" had each been searched alone, {sum(cell.n_runs_used for cell in regimes.cells):,} would have been driven."
    )
    return tuple(sentences)


def moved_by() -> tuple[str, ...]:
    """What moves the boundaries, and what the map does not say."""
    return (
        "Only the ratio of robots to floor decides: the boundaries run along lines of one ratio. Each moves in"
        " proportion to the price of a laid tag (tags 10 % cheaper: at 10 % fewer robots per m²) and against that of"
        " what a robot carries; covering, survey and project do not move it as long as every m² is tagged.",
        "Drives were simulated on the reference floor alone. Other areas take its tags per m² and stand for more or"
        " less floor of the same kind.",
        "A boundary is where two answers cost the same; a design that was not certified may lie between them.",
    )


def regimes_csv(regimes: Regimes) -> str:
    """The cells as CSV, one row each; text cannot be taken for a formula."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(CSV_HEADER)
    for cell in regimes.cells:
        cells = _csv_cells(regimes, cell)
        writer.writerow(plain_cell(cells.get(name, "")) for name in CSV_HEADER)
    return text.getvalue()


def _csv_cells(regimes: Regimes, cell: RegimeCell) -> dict[str, str]:
    cells = {
        "robots": str(cell.n_robots),
        "area_m2": f"{cell.area_m2:.2f}",
        "robots_per_1000_m2": f"{cell.robots_per_1000_m2:.6g}",
        "claim": cell.claim,
        "currency": regimes.currency,
        "undecided_cheaper": str(cell.n_undecided),
    }
    if cell.lower_bound_cents is not None:
        cells["lower_bound"] = exact_amount(cell.lower_bound_cents)
    if cell.winner is None:
        return cells
    design = regimes.design(cell.winner)
    return cells | {
        "design": design.name,
        "layout": design.layout,
        "antenna": design.antenna,
        "pattern": design.pattern,
        "tags_per_m2": f"{design.tags_per_m2:g}",
        "readers_per_robot": str(design.n_readers),
        "tags": str(cell.n_tags),
        "price": exact_amount(cell.cost_cents),
        "robots_price": exact_amount(cell.robots_cents),
        "tags_price": exact_amount(cell.tags_cents),
        "area_price": exact_amount(cell.area_cents),
        "project_price": exact_amount(cell.project_cents),
        "drives_passed": str(cell.n_passed),
        "drives": str(cell.n_runs),
    }


def _range(band: Band) -> str:
    if band.low is None and band.high is None:
        return "all of the map"
    if band.low is None:
        return f"up to {band.high:.3g}"
    return f"{band.low:.3g} to {band.high:.3g}" if band.high is not None else f"from {band.low:.3g}"


def _design_cells(design: RegimeDesign | None, currency: str) -> tuple[str, ...]:
    if design is None:
        return ("none certified", "–", "–", "–", "–")
    per_robot, per_m2 = (money(round(100 * amount), currency) for amount in (design.per_robot, design.per_m2))
    return (design.name, f"{design.n_readers}", f"{design.tags_per_m2:g}", per_robot, per_m2)
