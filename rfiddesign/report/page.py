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
from rfiddesign.report.extra import Extra
from rfiddesign.report.extras import extras
from rfiddesign.report.fleets import fleet_sentences
from rfiddesign.report.markup import Drawn, drawn_into, filled, style
from rfiddesign.report.words import count, percent, requirement_words
from rfiddesign.results.folder import COST, FIGURES, REPORT, write_text
from rfiddesign.results.spreadsheet import write_cost_csv
from rfiddesign.results.study_result import AnswerRecord
from rfiddesign.units import flops, money

TEMPLATE = "page.html.jinja"
STYLE_SHEET = "page.css"
STOPPED = "certified, stopped by budget"


@dataclass(frozen=True)
class AnswerPart:
    """What the page says of one fleet; everything that hangs on a winner is empty without one."""

    key: str
    fleet: str
    is_won: bool
    status: str
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
        further = extras(contents)
        for picture in chain(pictures(contents), *(extra.pictures for extra in further)):
            drawn[picture.topic].append(drawn_into(folder / FIGURES, picture))
        for answer in contents.answers:
            if answer.record.winner is not None:
                estimator = contents.chosen_estimator(answer.record.winner)
                write_cost_csv(answer.folder / COST, answer.record, estimator)
        for name, text in chain.from_iterable(extra.files for extra in further):
            write_text(folder / name, text)
        write_text(folder / REPORT, page(contents, drawn, further))
    except OSError as error:
        raise StudyError(f"cannot be written: {error.strerror}", file=error.filename or folder) from None
    return folder / REPORT


def page(contents: Contents, drawn: dict[str, list[Drawn]], further: tuple[Extra, ...] = ()) -> str:
    """The page as HTML, with the figures of each topic in place."""
    result = contents.result
    return filled(
        TEMPLATE,
        tested="a design with one of the estimators" if result.is_estimator_open else "a design",
        style=style(STYLE_SHEET),
        result=result,
        requirement=requirement_words(result.requirement),
        answers=[_answer_part(contents, answer) for answer in contents.answers],
        drawn=drawn,
        extras=further,
        is_on_routes=contents.routes is not None,
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
    )


def _answer_part(contents: Contents, answer: Answer) -> AnswerPart:
    record, test = answer.record, contents.result.test
    winner = record.winner
    bound = ""
    if record.lower_bound is not None and (winner is None or record.lower_bound.design != winner.design):
        bound = f"Whatever holds costs at least {money(record.lower_bound.cost_cents, record.currency)}."
        if record.gap is not None:
            bound += f" The gap to that bound is {percent(record.gap)}."
    return AnswerPart(
        key=answer.key,
        fleet=count(record.n_robots, "robot"),
        is_won=winner is not None,
        status=_status(record),
        price=money(winner.cost_cents, record.currency) if winner else "No design certified",
        design=_design_words(contents, answer) if winner else "",
        estimator=_estimator_words(contents, answer),
        passed=f"{tables.passed(winner)} drives passed" if winner else "",
        headline=headline(answer, test, is_named=contents.result.space.is_named),
        bound=bound,
        promised=promised(contents, answer),
        cost=tables.cost_table(record) if winner else None,
        neighbours=tables.neighbour_table(contents, answer),
        antennas=tables.antenna_table(answer) if answer.chosen else None,
        warnings=tuple(record.coverage.warnings) if record.coverage else (),
        reads=_reads_words(answer),
    )


def _status(record: AnswerRecord) -> str:
    """What the design on show is, after the name of the fleet."""
    if record.winner is None:
        return ""
    return ": cheapest certified so far" if record.claim == STOPPED else ": cheapest certified design"


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
