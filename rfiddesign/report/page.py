"""The report of a study: one page that opens anywhere, drawn from a result folder alone."""

from collections import defaultdict
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from rfiddesign.errors import StudyError
from rfiddesign.report import tables
from rfiddesign.report.album import pictures
from rfiddesign.report.certificate import headline, how_tested, not_promised, promised
from rfiddesign.report.contents import Answer, Contents, read_contents
from rfiddesign.report.exploration import (
    Explored,
    explored_pictures,
    explored_sentences,
    front_parts,
    read_explored,
)
from rfiddesign.report.fleets import fleet_sentences
from rfiddesign.report.markup import Drawn, drawn_into, filled, style
from rfiddesign.report.words import count, percent, requirement_words
from rfiddesign.results.folder import COST, FIGURES, REPORT, write_text
from rfiddesign.units import flops, money

TEMPLATE = "page.html.jinja"
STYLE_SHEET = "page.css"


@dataclass(frozen=True)
class AnswerPart:
    """What the page says of one fleet; everything that hangs on a winner is empty without one."""

    key: str
    fleet: str
    is_won: bool
    price: str
    design: str
    estimator: str
    passed: str
    headline: str
    bound: str
    promised: tuple[str, ...]
    cost: tables.Table | None
    neighbours: tables.Table
    antennas: tables.Table | None
    warnings: tuple[str, ...]
    reads: str


def write_report(folder: Path) -> Path:
    """Draw a result folder: report.html, figures as PNG and SVG, and cost.csv beside each design.

    The same folder gives the same bytes each time.

    Returns
    -------
    Path of the page.

    Raises
    ------
    StudyError : if a file of the folder is missing or not what it should be, or the folder cannot be written to.
    """
    contents = read_contents(folder)
    try:
        (folder / FIGURES).mkdir(exist_ok=True)
        drawn: dict[str, list[Drawn]] = defaultdict(list)
        explored = read_explored(folder)
        for picture in chain(pictures(contents), () if explored is None else explored_pictures(explored, contents)):
            drawn[picture.topic].append(drawn_into(folder / FIGURES, picture))
        for answer in contents.answers:
            if answer.record.winner is not None:
                estimator = contents.chosen_estimator(answer.record.winner)
                tables.write_cost_csv(answer.folder / COST, answer.record, estimator)
        write_text(folder / REPORT, page(contents, drawn, explored))
    except OSError as error:
        raise StudyError(f"cannot be written: {error.strerror}", file=error.filename or folder) from None
    return folder / REPORT


def page(contents: Contents, drawn: dict[str, list[Drawn]], explored: Explored | None = None) -> str:
    """The page as HTML, with the figures of each topic in place, and what was explored, if anything was."""
    result = contents.result
    return filled(
        TEMPLATE,
        tested="a design with one of the estimators" if result.is_estimator_open else "a design",
        style=style(STYLE_SHEET),
        result=result,
        requirement=requirement_words(result.requirement),
        answers=[_answer_part(contents, answer) for answer in contents.answers],
        drawn=drawn,
        comparison=tables.comparison_table(contents) if len(contents.answers) > 1 else None,
        fleet_sentences=fleet_sentences(contents),
        fronts=tables.front_table(result),
        area=tables.area_table(result),
        screens=tables.screen_table(result),
        unbuildable=tables.unbuildable_table(result),
        assumptions=tables.assumption_table(result),
        not_promised=not_promised(contents),
        how_tested=how_tested(contents),
        test=result.test,
        percent=percent,
        explored_sentences=() if explored is None else explored_sentences(explored),
        front_parts=() if explored is None else front_parts(explored),
    )


def _answer_part(contents: Contents, answer: Answer) -> AnswerPart:
    record, test = answer.record, contents.result.test
    winner = record.winner
    bound = ""
    if record.lower_bound is not None and (winner is None or record.lower_bound.design != winner.design):
        bound = f"Whatever holds costs at least {money(record.lower_bound.cost_cents, record.currency)}."
    return AnswerPart(
        key=answer.key,
        fleet=count(record.n_robots, "robot"),
        is_won=winner is not None,
        price=money(winner.cost_cents, record.currency) if winner else "No design certified",
        design=_design_words(contents, answer) if winner else "",
        estimator=_estimator_words(contents, answer),
        passed=f"{tables.passed(winner)} drives passed" if winner else "",
        headline=headline(answer, test),
        bound=bound,
        promised=promised(contents, answer),
        cost=tables.cost_table(record) if winner else None,
        neighbours=tables.neighbour_table(contents, answer),
        antennas=tables.antenna_table(answer) if answer.chosen else None,
        warnings=tuple(record.coverage.warnings) if record.coverage else (),
        reads=_reads_words(answer),
    )


def _design_words(contents: Contents, answer: Answer) -> str:
    design = contents.design(answer.record.winner)
    readers = count(design.n_readers, "reader")
    return (
        f"{design.layout}: {readers} per robot with {design.antenna} mm antennas; {design.n_tags:,} tags,"
        f" {design.pattern}, {design.tags_per_m2:g} per m²"
    )


def _estimator_words(contents: Contents, answer: Answer) -> str:
    """What the design was certified with, and what that computes; nothing where the folder does not say."""
    computing = answer.record.computing
    if computing is None:
        return ""
    what = next((each.words for each in contents.result.estimators if each.name == computing.estimator), "")
    name = f"{computing.estimator} ({what})" if what else computing.estimator
    words = f"Certified with the estimator {name}: {flops(computing.flops_per_step)} per step of {computing.dt_s:g} s"
    if answer.us_per_step is not None:
        words += f"; {answer.us_per_step:.3g} µs on the machine that ran this study"
    return f"{words}."


def _reads_words(answer: Answer) -> str:
    coverage = answer.record.coverage
    if coverage is None:
        return ""
    return (
        f"On average {coverage.expected_reads:.3g} readers see a tag; in {percent(coverage.two_tags_share)} of places"
        f" some antenna has two tags in view ({coverage.method} computation)."
    )
