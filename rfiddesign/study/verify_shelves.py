"""Derive the verdicts on floor and shelf designs anew from the runs in a study's folder; and name what differs."""

from rfiddesign.errors import StudyError
from rfiddesign.metrics import RunMetrics
from rfiddesign.optimize import battery, judge
from rfiddesign.results import folder as files
from rfiddesign.results.shelves import Shelves
from rfiddesign.study.held import Held
from rfiddesign.study.shelves import FLOOR, SHELVES, family_plan
from rfiddesign.study.shelves_document import runs_digest
from rfiddesign.study.storage import RunTable


def look_at_shelves(held: Held) -> tuple[int, list[str]]:
    """Whether the winners of both families are certified by the stored runs, and these are those that decided.

    Raises
    ------
    StudyError : if the record or the runs of shelf designs are missing or not what they should be.
    """
    record = files.read_record(held.folder / files.SHELVES, Shelves)
    if not (held.folder / files.SHELF_RUNS).is_file():
        raise StudyError("is missing", file=held.folder / files.SHELF_RUNS)
    with RunTable(held.folder / files.SHELF_RUNS) as table:
        of_shelves = {number: runs for (_, number), runs in table.runs().items()}
    of_floor = {number: rows[0] for number, rows in held.runs.items()}
    stored = {FLOOR: of_floor, SHELVES: of_shelves}
    faults = _missing(record, stored)
    if faults:
        return len(record.tested), faults
    decided = [(t.family, t.number, stored[t.family][t.number][: t.n_runs]) for t in record.tested]
    if runs_digest(decided) != record.runs_sha256:
        faults.append(f"{files.SHELVES}: a run that decided is not what it was: its hash differs")
    n_designs = {FLOOR: record.n_floor_designs, SHELVES: record.n_shelf_designs}
    for answer in record.answers:
        if answer.winner is None:
            continue
        tests = battery(family_plan(held.file, held.plan, answer.family, n_designs[answer.family]))
        runs = stored[answer.family][answer.winner][: answer.n_runs]
        found = judge(tests, held.criteria.scaled(answer.factor).scores([runs]))
        told = ("certified", answer.n_runs, answer.n_passed)
        if (found.verdict, found.n_runs, found.n_passed) != told:
            faults.append(
                f"{files.SHELVES}: {answer.family}, {answer.n_robots} robots, limits x {answer.factor:g}: the winner is"
                f" certified on {answer.n_passed} of {answer.n_runs} runs; its runs say {found.verdict} on"
                f" {found.n_passed} of {found.n_runs}"
            )
        if sum(line.amount_cents for line in answer.cost_lines) != answer.cost_cents:
            faults.append(f"{files.SHELVES}: {answer.family}, {answer.n_robots} robots: lines do not sum to the price")
    return len(record.tested) + len(record.answers), faults


def _missing(record: Shelves, stored: dict[str, dict[int, list[RunMetrics]]]) -> list[str]:
    faults = []
    for tested in record.tested:
        n_stored = len(stored[tested.family].get(tested.number, []))
        if n_stored < tested.n_runs:
            faults.append(
                f"{files.SHELVES}: {tested.family} design {tested.number} was decided on {tested.n_runs} runs,"
                f" {n_stored} are stored"
            )
    return faults
