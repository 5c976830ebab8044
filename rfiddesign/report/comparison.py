"""The page of a comparison: what each variant of a study costs, drawn from the folder of the comparison alone."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rfiddesign.errors import StudyError
from rfiddesign.report.album import Picture
from rfiddesign.report.comparison_table import comparison_csv
from rfiddesign.report.comparison_words import (
    compared,
    design_words,
    duration_words,
    open_words,
    saving_words,
    seconds,
    settings_words,
)
from rfiddesign.report.figures import comparison_figure
from rfiddesign.report.markup import drawn_into, filled, style
from rfiddesign.report.words import count, requirement_words
from rfiddesign.results.comparison import Comparison, SessionRecord, VariantRecord
from rfiddesign.results.folder import COMPARISON, COMPARISON_CSV, FIGURES, PROVENANCE, REPORT, read_record, write_text
from rfiddesign.units import money

TEMPLATE = "comparison.html.jinja"
STYLE_SHEETS = ("page.css", "comparison.css")
#: Rows of groups in one figure: more fleets than fit get figures of their own.
FIGURE_ROWS = 40


@dataclass(frozen=True)
class Cell:
    """What a variant answers for one fleet; `kind` is "best", "won", "open", "none" or "missing"."""

    kind: str
    price: str
    design: str
    saving: str
    report: str


@dataclass(frozen=True)
class Row:
    """A group, with a cell for each condition."""

    group: str
    is_base: bool
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class FleetPart:
    """What the page says of one fleet."""

    key: str
    fleet: str
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class VariantPart:
    """A variant in the list of all."""

    name: str
    group: str
    condition: str
    settings: str
    n_runs: str
    duration: str
    report: str


def write_comparison(folder: Path) -> Path:
    """Draw a comparison: report.html, its figures as PNG and SVG, and comparison.csv; reports of variants stay.

    Returns
    -------
    Path of the page.

    Raises
    ------
    StudyError : if a file of the folder is missing or not what it should be, or the folder cannot be written to.
    """
    comparison = read_record(folder / COMPARISON, Comparison)
    _check_unique(comparison, folder / COMPARISON)
    sessions = {variant.name: read_session(folder / variant.folder) for variant in comparison.variants}
    try:
        (folder / FIGURES).mkdir(exist_ok=True)
        drawn = {"prices": [drawn_into(folder / FIGURES, picture) for picture in _pictures(comparison)]}
        write_text(folder / COMPARISON_CSV, comparison_csv(comparison, sessions))
        page = filled(
            TEMPLATE,
            style=style(*STYLE_SHEETS),
            comparison=comparison,
            requirement=_requirement(comparison),
            conditions=[_condition(comparison, name) for name in comparison.conditions],
            fleets=[_fleet_part(comparison, n_robots) for n_robots in comparison.fleets],
            drawn=drawn,
            compared=compared(comparison),
            variants=[_variant_part(variant, sessions[variant.name]) for variant in comparison.variants],
            total=_total(comparison, sessions),
        )
        write_text(folder / REPORT, page)
    except OSError as error:
        raise StudyError(f"cannot be written: {error.strerror}", file=error.filename or folder) from None
    return folder / REPORT


def read_session(folder: Path) -> SessionRecord | None:
    """The last session of a variant, None if its folder has none."""
    path = folder / PROVENANCE
    return read_record(path, SessionRecord) if path.exists() else None


def _pictures(comparison: Comparison) -> Iterator[Picture]:
    fleets, n_each = comparison.fleets, max(1, FIGURE_ROWS // len(comparison.groups))
    for i in range(0, len(fleets), n_each):
        name = "prices" if i == 0 else f"prices-{i // n_each + 1}"
        caption = "Price of the cheapest certified design, by group" + (
            " and condition." if len(comparison.conditions) > 1 else "."
        )
        yield Picture("prices", name, caption, comparison_figure(comparison, fleets[i : i + n_each]))


def _fleet_part(comparison: Comparison, n_robots: int) -> FleetPart:
    cheapest = {condition: _cheapest(comparison, condition, n_robots) for condition in comparison.conditions}
    rows = tuple(
        Row(
            group,
            group == comparison.base,
            tuple(
                _cell(comparison, comparison.variant(group, condition), n_robots, cheapest[condition])
                for condition in comparison.conditions
            ),
        )
        for group in comparison.groups
    )
    return FleetPart(f"robots-{n_robots}", count(n_robots, "robot"), rows)


def _cell(comparison: Comparison, variant: VariantRecord | None, n_robots: int, cheapest: int | None) -> Cell:
    answer = None if variant is None else variant.answer(n_robots)
    if variant is None or answer is None:
        return Cell("missing", "–", "", "", "")
    report = f"{variant.folder}/{REPORT}"
    if answer.winner is None:
        kind = "none" if answer.claim == "none holds" else "open"
        return Cell(kind, open_words(answer, variant), "", "", report)
    kind = "best" if answer.winner.cost_cents == cheapest else "won"
    design = design_words(comparison, variant, answer)
    return Cell(kind, money(answer.winner.cost_cents, answer.currency), design, saving_words(answer), report)


def _cheapest(comparison: Comparison, condition: str, n_robots: int) -> int | None:
    """The lowest price of a column, None where all that have one cost the same, or currencies differ."""
    answers = [
        answer
        for variant in comparison.variants
        if variant.condition == condition
        and (answer := variant.answer(n_robots)) is not None
        and answer.winner is not None
    ]
    prices = {answer.winner.cost_cents for answer in answers}
    is_comparable = len(prices) > 1 and len({answer.currency for answer in answers}) == 1
    return min(prices) if is_comparable else None


def _condition(comparison: Comparison, name: str) -> str:
    if name:
        return name
    return "Cheapest certified design" if len(comparison.conditions) == 1 else "(no condition)"


def _variant_part(variant: VariantRecord, session: SessionRecord | None) -> VariantPart:
    return VariantPart(
        name=variant.name,
        group=variant.group,
        condition=variant.condition or "–",
        settings=settings_words(variant),
        n_runs=f"{variant.n_runs:,}",
        duration=duration_words(session),
        report=f"{variant.folder}/{REPORT}",
    )


def _requirement(comparison: Comparison) -> str:
    different = {requirement_words(variant.requirement) for variant in comparison.variants}
    return different.pop() if len(different) == 1 else "The variants have different limits: see the report of each."


def _total(comparison: Comparison, sessions: dict[str, SessionRecord | None]) -> tuple[str, str]:
    n_runs = sum(variant.n_runs for variant in comparison.variants)
    known = [session for session in sessions.values() if session is not None]
    return f"{n_runs:,}", seconds(sum(session.wall_s for session in known)) if known else "–"


def _check_unique(comparison: Comparison, path: Path) -> None:
    for what in ("name", "folder"):
        found = [getattr(variant, what) for variant in comparison.variants]
        if len(set(found)) < len(found):
            raise StudyError(f"has two variants of the same {what}", file=path, key="variants")
