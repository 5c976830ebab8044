"""Derive the answer of a finished study anew from what its folder holds: runs, prices, test; and name what differs.

Nothing is believed that can be computed: tables follow from the test's parameters, verdicts from the stored runs,
prices from the price list, and the claim from both. Files beside these (tags, plan, regimes, shelves, survey, routes,
placements, exploration) are held against their hashes in the certificate. What is not looked at: which designs an
assumption counts as weaker, and whether the runs are what the program would simulate; `rfiddesign verify --rerun` tries
the answer on fresh seeds, see :mod:`rfiddesign.study.rerun`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from rfiddesign.cost import Equipment, Site, cost_of
from rfiddesign.optimize import Decision, TestPlan, battery, conclude, judge
from rfiddesign.results import folder as files
from rfiddesign.results.certificate import CertifiedAnswer
from rfiddesign.results.spreadsheet import cost_csv
from rfiddesign.results.study_result import AnswerRecord, ChosenDesign, DecisionRecord, StudyResult
from rfiddesign.study.certificate import boundary_records, file_hashes, runs_hash
from rfiddesign.study.document import cost_line_records
from rfiddesign.study.held import Held, read_held
from rfiddesign.study.pipeline import hash_of, joined_hash
from rfiddesign.study.verify_shelves import look_at_shelves


@dataclass(frozen=True)
class Check:
    """One thing looked at: what, how much of it, and what was found to be wrong."""

    what: str
    n_looked_at: int
    faults: tuple[str, ...]


def verify(folder: Path) -> tuple[Check, ...]:
    """Look at everything that the answer in a folder follows from.

    Raises
    ------
    StudyError : if a file is missing or not what it should be.
    """
    held = read_held(folder)
    looks: tuple[tuple[str, Callable[[Held], tuple[int, list[str]]]], ...] = (
        ("study, prices and test are those that were declared", _look_at_question),
        ("tables of the test follow from its parameters", _look_at_tables),
        ("stored runs are those that were certified", _look_at_runs),
        ("verdicts follow from the runs", _look_at_verdicts),
        ("prices follow from the price list", _look_at_prices),
        ("claims follow from verdicts and prices", _look_at_claims),
        ("chosen designs are those of the answers", _look_at_designs),
        ("files beside the answers are those that were written", _look_at_files),
    )
    if held.file.shelves is not None:
        looks += (("answers of floor and shelf designs follow from their runs", look_at_shelves),)
    return tuple(Check(what, n, tuple(faults)) for what, look in looks for n, faults in (look(held),))


def _look_at_question(held: Held) -> tuple[int, list[str]]:
    certificate, faults = held.certificate, []
    for name, content in (("study", held.file.model_dump_json()), ("prices", repr(held.prices))):
        if certificate.hashes.get(name) != hash_of(content):
            where = f"{files.STUDY}: study" if name == "study" else f"{files.CERTIFICATE}: prices"
            faults.append(f"{where} is not what was certified: its hash differs")
    found = {
        f"{files.CERTIFICATE}: hashes": joined_hash(certificate.hashes),
        f"{files.RESULT}: study_hash": held.result.study_hash,
        f"{files.STUDY}: hash": held.study_hash,
    }
    faults += [f"{where} is {digest}, not {certificate.study_hash}" for where, digest in found.items()
               if digest != certificate.study_hash]  # fmt: skip
    plan, test = held.plan, certificate.test
    declared = {
        "hold_probability": plan.hold_probability, "fail_probability": plan.fail_probability,
        "alpha_refute": plan.alpha_refute, "alpha_certify": plan.alpha_certify, "n_designs": plan.n_designs,
        "max_runs": plan.max_runs, "cost_tolerance": held.file.search.cost_tolerance,
    }  # fmt: skip
    for name, value in declared.items():
        for where, record in ((files.CERTIFICATE, test), (files.RESULT, held.result.test)):
            if getattr(record, name) != value:
                faults.append(f"{where}: test.{name} is {getattr(record, name)}, the study declares {value}")
    if test.criteria != held.result.test.criteria or len(test.criteria) != len(plan.all_criteria):
        faults.append(f"{files.RESULT}: test.criteria are not those of the certificate")
    for i, (said, criterion) in enumerate(zip(test.criteria, plan.all_criteria, strict=False)):
        if (said.words, said.hold, said.fail) != (criterion.name, criterion.hold, criterion.fail):
            faults.append(f"{files.CERTIFICATE}: test.criteria.{i} is not what the study declares")
    return len(found) + 2 * len(declared) + len(test.criteria), faults


def _look_at_tables(held: Held) -> tuple[int, list[str]]:
    certificate, plan, faults = held.certificate, held.plan, []
    for name in ("refute_threshold", "certify_threshold"):
        if getattr(certificate, name) != getattr(plan, name):
            faults.append(f"{files.CERTIFICATE}: {name} is {getattr(certificate, name)}, must be {getattr(plan, name)}")
    strict = _strict_plan(held)
    if certificate.strict_threshold != (None if strict is None else strict.refute_threshold):
        faults.append(f"{files.CERTIFICATE}: strict_threshold is no whole multiple of refute_threshold")
    n_longest = max((record.n_runs for record in certificate.runs), default=0)
    expected = boundary_records(plan, n_longest)
    if len(expected) != len(certificate.boundaries):
        faults.append(f"{files.CERTIFICATE}: boundaries has {len(certificate.boundaries)} tables, not {len(expected)}")
    for said, true in zip(certificate.boundaries, expected, strict=False):
        for name in ("refute_at", "certify_at"):
            if getattr(said, name) != getattr(true, name):
                faults.append(f"{files.CERTIFICATE}: boundaries.{said.criterion}.{name} does not follow from the test")
    return 3 + 2 * len(expected), faults


def _look_at_runs(held: Held) -> tuple[int, list[str]]:
    faults, n_runs = [], 0
    for record in held.certificate.runs:
        rows = held.runs.get(record.design, ())
        n_stored = min((len(row) for row in rows), default=0)
        n_runs += record.n_runs
        if record.n_runs and n_stored < record.n_runs:
            faults.append(f"{files.RUNS}: design {record.design} has {n_stored} runs, {record.n_runs} were certified")
        elif record.n_runs and runs_hash([row[: record.n_runs] for row in rows]) != record.sha256:
            faults.append(f"{files.RUNS}: a run of design {record.design} is not what was certified: its hash differs")
    n_said = {design.number: design.n_runs for design in held.result.designs}
    for record in held.certificate.runs:
        if n_said.get(record.design) != record.n_runs:
            faults.append(
                f"{files.RESULT}: designs: {n_said.get(record.design)} runs of design {record.design},"
                f" {record.n_runs} were certified"
            )
    return n_runs, faults


def _look_at_verdicts(held: Held) -> tuple[int, list[str]]:
    faults, n_looked_at, tests, strict = [], 0, battery(held.plan), _strict_plan(held)
    stricter = tests if strict is None else battery(strict)
    for answer in held.certificate.answers:
        said = _said(held.result, answer)
        if said is not None and said.decisions != answer.decisions:
            faults.append(f"{files.RESULT}: decisions for {answer.n_robots} robots are not those of the certificate")
        if said is not None and said.assumed != answer.assumed:
            faults.append(f"{files.RESULT}: assumed for {answer.n_robots} robots are not those of the certificate")
        if said is not None and [each.design for each in said.runners_up] != answer.runners_up:
            faults.append(f"{files.RESULT}: runners_up for {answer.n_robots} robots are not those of the certificate")
        judged = [*((tests, each) for each in answer.decisions), *((stricter, each) for each in answer.strictly)]
        for judges, decision in judged:
            n_looked_at += 1
            rows = held.runs.get(decision.design, ())
            if min((len(row) for row in rows), default=0) < decision.n_runs:
                continue  # said of the runs already
            found = judge(judges, held.criteria.scores([row[: decision.n_runs] for row in rows]))
            if (found.verdict, found.n_runs, found.n_passed) != _verdict(decision):
                faults.append(
                    f"{files.CERTIFICATE}: design {decision.design} is {_in_words(*_verdict(decision))}; its runs say"
                    f" {_in_words(found.verdict, found.n_runs, found.n_passed)}"
                )
    return n_looked_at, faults


def _look_at_prices(held: Held) -> tuple[int, list[str]]:
    certificate, faults, n_looked_at = held.certificate, [], 0
    for answer in certificate.answers:
        whose = f"for {answer.n_robots} robots"
        price: dict[int, int] = {}
        for found, said_cents in zip(certificate.candidates, answer.cost_cents, strict=False):
            n_looked_at += 1
            equipment = Equipment(found.n_readers, found.antenna, found.n_tags)
            try:
                cost = cost_of(equipment, Site(answer.n_robots, found.tagged_m2), held.prices)
            except ValueError as error:
                faults.append(f"{files.CERTIFICATE}: {error}")
                continue
            price[found.number] = cost.total_cents
            if cost.total_cents != said_cents:
                faults.append(
                    f"{files.CERTIFICATE}: design {found.number} costs {said_cents} cents {whose}; the price list says"
                    f" {cost.total_cents}"
                )
            said = _said(held.result, answer)
            if found.number == answer.winner and said is not None and said.cost_lines != cost_line_records(cost):
                faults.append(f"{files.RESULT}: cost_lines {whose} do not follow from the price list")
        if len(answer.cost_cents) != len(certificate.candidates):
            faults.append(f"{files.CERTIFICATE}: cost_cents {whose} has not one price for each candidate")
        said = _said(held.result, answer)
        told = [] if said is None else [said.winner, said.lower_bound, *said.decisions, *said.runners_up]
        for where, decisions in ((files.CERTIFICATE, answer.decisions), (files.RESULT, told)):
            faults += [
                f"{where}: design {decision.design} costs {decision.cost_cents} cents {whose}; the price list says"
                f" {price.get(decision.design)}"
                for decision in decisions
                if decision is not None and decision.cost_cents != price.get(decision.design)
            ]
    return n_looked_at, faults


def _look_at_claims(held: Held) -> tuple[int, list[str]]:
    certificate, faults = held.certificate, []
    place = {found.number: i for i, found in enumerate(certificate.candidates)}
    limits = (held.file.search.cost_tolerance, held.plan.max_runs)
    for answer in certificate.answers:
        whose, said = f"for {answer.n_robots} robots", _said(held.result, answer)
        named = [answer.winner, *(each.design for each in answer.decisions), *(each.design for each in answer.assumed)]
        if said is None or any(number is not None and number not in place for number in named):
            faults.append(f"{files.CERTIFICATE}: the answer {whose} is not about its candidates or not in the result")
            continue
        decisions = {place[each.design]: Decision(*_verdict(each)) for each in answer.decisions}
        strictly = {each.design for each in answer.strictly if each.verdict == "refuted"}
        faults += [
            f"{files.CERTIFICATE}: design {each.design} is counted out {whose} by design {each.follows_from}, which was"
            " not refuted at the evidence that this takes"
            for each in answer.assumed
            if each.follows_from not in strictly
        ]
        assumed = {place[each.design]: place.get(each.follows_from, -1) for each in answer.assumed}
        winner = None if answer.winner is None else place[answer.winner]
        if winner is not None and decisions.get(winner, Decision("undecided", 0, 0)).verdict != "certified":
            faults.append(f"{files.CERTIFICATE}: the winner {whose} was not certified")
        found = conclude(answer.cost_cents, decisions, assumed, limits, winner)
        bound = None if found.lower_bound is None else certificate.candidates[found.lower_bound].number
        expected = (found.claim, answer.winner, bound, found.n_untested)
        for where, told in (
            (files.CERTIFICATE, (answer.claim, answer.winner, answer.lower_bound, found.n_untested)),
            (files.RESULT, (said.claim, _number(said.winner), _number(said.lower_bound), said.n_untested)),
        ):
            if told != expected:
                faults.append(f"{where}: says {told} {whose} (claim, winner, lower bound, untested), not {expected}")
    return len(certificate.answers), faults


def _look_at_designs(held: Held) -> tuple[int, list[str]]:
    faults, n_looked_at = [], 0
    for i, said in enumerate(held.result.answers):
        if said.winner is None:
            continue
        n_looked_at += 1
        place = files.answer_folder(held.folder, said.n_robots, is_first=i == 0)
        chosen = files.read_record(place / files.DESIGN, ChosenDesign)
        found = next((each for each in held.certificate.candidates if each.number == said.winner.design), None)
        expected = None if found is None else (found.name, found.n_readers, found.antenna, found.n_tags)
        where = (place / files.DESIGN).relative_to(held.folder)
        if (chosen.name, len(chosen.antennas), chosen.antenna, chosen.n_tags) != expected:
            faults.append(f"{where}: is not the certified design")
        if chosen.cost_cents != said.winner.cost_cents:
            faults.append(f"{where}: cost_cents is {chosen.cost_cents}, the answer says {said.winner.cost_cents}")
        n_rows = sum(1 for _ in (place / files.TAGS).open("rb")) - 1 if (place / files.TAGS).exists() else 0
        if n_rows != chosen.n_tags:
            faults.append(f"{(place / files.TAGS).relative_to(held.folder)}: has {n_rows} tags, not {chosen.n_tags}")
        estimator = chosen.estimator if held.result.is_estimator_open else None
        # Drawn with the report, which may not have come yet.
        if (place / files.COST).exists() and (place / files.COST).read_text("utf-8") != cost_csv(said, estimator):
            faults.append(f"{(place / files.COST).relative_to(held.folder)}: is not what the answer costs")
    return n_looked_at, faults


def _strict_plan(held: Held) -> TestPlan | None:
    """The test of refutations that count others out, its alpha a whole part of the declared one; None without any."""
    threshold = held.certificate.strict_threshold
    if threshold is None:
        return None
    n_above = max(round(threshold / held.plan.refute_threshold), 1)
    return replace(held.plan, alpha_refute=held.plan.alpha_refute / n_above)


def _look_at_files(held: Held) -> tuple[int, list[str]]:
    certified = held.certificate.files
    found = file_hashes(held.folder, [answer.n_robots for answer in held.result.answers])
    faults = []
    for name in sorted(certified.keys() | found.keys()):
        if name not in found:
            faults.append(f"{name}: is missing")
        elif name not in certified:
            faults.append(f"{name}: was not there when the answers were certified")
        elif found[name] != certified[name]:
            faults.append(f"{name}: is not what was written: its hash differs")
    return len(certified), faults


def _said(result: StudyResult, answer: CertifiedAnswer) -> AnswerRecord | None:
    return next((each for each in result.answers if each.n_robots == answer.n_robots), None)


def _verdict(decision: DecisionRecord) -> tuple[str, int, int]:
    return decision.verdict, decision.n_runs, decision.n_passed


def _in_words(verdict: str, n_runs: int, n_passed: int) -> str:
    return f"{verdict} on {n_passed} of {n_runs} runs"


def _number(decision: DecisionRecord | None) -> int | None:
    return None if decision is None else decision.design
