"""The certificate of an answer in words that a buyer understands: what is promised, how surely, and what is not."""

from rfiddesign.report.contents import Answer, Contents
from rfiddesign.report.words import candidates, count, percent
from rfiddesign.results.study_result import StudyResult, TestRecord
from rfiddesign.units import money

#: What a claim of the search says beside that the winner is certified, for the first screen.
SHORT_CLAIMS = {
    "cheapest": "Every cheaper candidate was refuted.",
    "cheapest within tolerance": "Nothing that costs less than the lower bound holds.",
    "certified, cheaper undecided": "Some cheaper candidates stayed undecided.",
    "certified, stopped by budget": "The search was stopped before every cheaper candidate was decided.",
    "none certified": "Some candidates stayed undecided.",
    "none holds": "Every candidate was refuted.",
    "stopped by budget": "The search ended before any design was certified.",
}


def headline(answer: Answer, test: TestRecord, *, is_named: bool = False) -> str:
    """The claim of an answer in a sentence or two."""
    record = answer.record
    claim = SHORT_CLAIMS.get(record.claim, _sentence(record.claim_words))
    if is_named:
        claim += " Candidates are those that an exploration named before the first of these drives."
    if record.winner is None:
        return claim
    share, chance = percent(test.fail_probability), percent(test.alpha_certify, 2)
    return f"Passes more than {share} of drives; the chance that this is wrong is at most {chance}. {claim}"


def how_tested(contents: Contents) -> tuple[str, ...]:
    """What was tried, for all fleets."""
    result = contents.result
    sentences = [
        f"{candidates(result.space.n_candidates, result)} {_were(result)}. For each fleet they were tried from the"
        f" cheapest upwards, each on as many simulated drives as it took to decide, at most {result.test.max_runs:,}.",
        "Each drive has its own route, speed, noise and, where the study says so, start. All of them follow from the"
        f" seed {result.seed}: whoever repeats the study gets the same drives and the same answer.",
    ]
    sentences += _criteria_sentence(result.test)
    for answer in contents.answers:
        record = answer.record
        verdicts = [decision.verdict for decision in record.decisions]
        sentences.append(
            f"{count(record.n_robots, 'robot')}: {candidates(len(verdicts), result)} tested on"
            f" {count(record.n_runs_used, 'drive')} in all; {verdicts.count('certified'):,} certified,"
            f" {verdicts.count('refuted'):,} refuted, {verdicts.count('undecided'):,} undecided."
        )
        if record.winner is not None:
            winner = record.winner
            sentences[-1] += (
                f" The cheapest certified one passed {winner.n_passed:,} of its {count(winner.n_runs, 'drive')}"
                f" ({percent(winner.n_passed / winner.n_runs)})."
            )
    return tuple(sentences)


def _criteria_sentence(test: TestRecord) -> tuple[str, ...]:
    """What is asked where it is more than one share of drives."""
    if len(test.criteria) < 2:
        return ()
    asked = "; ".join(f"{criterion.words} (more than {percent(criterion.fail)})" if criterion.kind == "share"
                      else criterion.words for criterion in test.criteria)  # fmt: skip
    return (f"A design must keep all of: {asked}.",)


def _were(result: StudyResult) -> str:
    return "were named by an exploration and could be tested" if result.space.is_named else "could be tested"


def promised(contents: Contents, answer: Answer) -> tuple[str, ...]:
    """What may be relied on for one fleet, each sentence with the chance that it is wrong."""
    test, record = contents.result.test, answer.record
    sentences = []
    if record.winner is not None:
        estimator = contents.chosen_estimator(record.winner)
        which = "the design" if estimator is None else f"the design with {estimator}"
        sentences.append(
            f"In more than {percent(test.fail_probability)} of drives like those simulated {which} keeps every"
            f" limit. The chance that this statement is wrong is at most {percent(test.alpha_certify, 2)}, already"
            f" shared out among all {candidates(test.n_designs, contents.result)} that might have been certified."
        )
    bound = record.lower_bound
    hold, chance = percent(test.hold_probability), percent(test.alpha_refute, 2)
    if bound is None:
        sentences.append(
            f"No design that was a candidate keeps the limits in {hold} or more of drives. The chance that this"
            f" statement is wrong is at most {chance}."
        )
    else:
        price = money(bound.cost_cents, record.currency)
        whose = (
            "the price of this answer" if record.winner and bound.design == record.winner.design else "the lower bound"
        )
        sentences.append(
            f"No candidate cheaper than {price}, {whose}, keeps the limits in {hold} or more of drives. The chance"
            f" that this statement is wrong is at most {chance}."
        )
    if record.winner is not None:
        both = percent(test.alpha_certify + test.alpha_refute, 2)
        sentences.append(f"The chance that either of the two statements is wrong is at most {both}.")
    return tuple(sentences)


def not_promised(contents: Contents) -> tuple[str, ...]:
    """What must not be read into any of the certificates."""
    test, space = contents.result.test, contents.result.space
    low, high = percent(test.fail_probability), percent(test.hold_probability)
    sentences = [
        "The building itself. The drives were simulated, with the models and the assumptions listed below. Metal under"
        " the floor, other robots or worn tags are in the promise only if they are among the assumptions.",
        f"That a certified design passes {high} of drives. Between {low} and {high} lies a zone in which the test may"
        " go either way: a cheaper design in it may have been refuted, and a certified one may lie in it.",
    ]
    for answer in contents.answers:
        record = answer.record
        if record.n_untested:
            untested = candidates(record.n_untested, contents.result, "cheaper ")
            sentences.append(
                f"That nothing cheaper would do for {count(record.n_robots, 'robot')}: the search was stopped before"
                f" {untested} had been tried."
            )
        if record.assumed:
            assumptions = "; ".join(test.assumptions)
            sentences.append(
                f"That what the study assumes is true ({assumptions}): for that reason alone"
                f" {candidates(len(record.assumed), contents.result)} for {count(record.n_robots, 'robot')} were not"
                f" tried. If it is true, this adds at most {percent(test.alpha_refute, 2)} to the chance that the"
                " statement on cheaper designs is wrong."
            )
        if answer.record.undecided:
            undecided = candidates(len(answer.record.undecided), contents.result, "cheaper ")
            sentences.append(
                f"That nothing cheaper would do for {count(answer.record.n_robots, 'robot')}:"
                f" {undecided} came to no verdict within the"
                f" {test.max_runs:,} drives allowed, and may or may not hold."
            )
    n_screened = sum(screen.n_removed for screen in space.screens)
    if n_screened:
        sentences.append(
            f"Anything about the {candidates(n_screened, contents.result)} that a rule declared beforehand removed"
            " untested, or about designs outside the space."
        )
    else:
        sentences.append("Anything about designs outside the space that was searched.")
    sentences.append(
        "That all statements hold at once: each size of fleet, and each line of the table of other limits, has its own"
        " chance of error."
    )
    sentences.append(
        "That prices hold, or that no dearer design is better. Chances are meant over repeated studies with fresh"
        " seeds; they do not depend on when the search stopped."
    )
    return tuple(sentences)


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:].rstrip('.')}."
