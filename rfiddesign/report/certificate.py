"""The certificate of an answer in words that a buyer understands: what is promised, how surely, and what is not."""

from dataclasses import dataclass

from rfiddesign.report.contents import Answer, Contents
from rfiddesign.report.words import count, money, percent
from rfiddesign.results.study_result import TestRecord


@dataclass(frozen=True)
class Certificate:
    """Sentences for a buyer.

    Parameters
    ----------
    tested : what was tried.
    promised : what may be relied on, each with the chance that it is wrong.
    not_promised : what must not be read into it.
    """

    tested: tuple[str, ...]
    promised: tuple[str, ...]
    not_promised: tuple[str, ...]


def headline(answer: Answer, test: TestRecord) -> str:
    """The claim of an answer in one short sentence."""
    record = answer.record
    if record.winner is None:
        return f"{_sentence(record.claim_words)}"
    more = f"In more than {percent(test.fail_probability)} of drives the limits are kept"
    if record.claim == "cheapest":
        return f"{more}; every cheaper design tested was refuted."
    return f"{more}; {_lower_first(record.claim_words)}."


def certificate(contents: Contents, answer: Answer) -> Certificate:
    """The certificate of an answer."""
    return Certificate(_tested(contents, answer), _promised(contents, answer), _not_promised(contents, answer))


def _tested(contents: Contents, answer: Answer) -> tuple[str, ...]:
    result, record = contents.result, answer.record
    test, decisions = result.test, record.decisions
    counts = {verdict: sum(d.verdict == verdict for d in decisions) for verdict in ("certified", "refuted", "undecided")}
    sentences = [
        f"{count(result.space.n_candidates, 'design')} could be tested. They were tried from the cheapest upwards, each"
        f" on as many simulated drives as it took to decide, at most {test.max_runs:,}.",
        f"{count(len(decisions), 'design')} came to be tested on {count(record.n_runs_used, 'drive')} in all:"
        f" {counts['certified']:,} certified, {counts['refuted']:,} refuted, {counts['undecided']:,} without a verdict.",
    ]
    if record.winner is not None:
        winner = record.winner
        sentences.append(
            f"The cheapest certified design passed {winner.n_passed:,} of its {count(winner.n_runs, 'drive')}"
            f" ({percent(winner.n_passed / winner.n_runs)})."
        )
    sentences.append(
        "Each drive has its own route, speed, noise and, where the study says so, start. All of them follow from the"
        f" seed {result.seed}: whoever repeats the study gets the same drives and the same answer."
    )
    return tuple(sentences)


def _promised(contents: Contents, answer: Answer) -> tuple[str, ...]:
    test, record = contents.result.test, answer.record
    sentences = []
    if record.winner is not None:
        sentences.append(
            f"In more than {percent(test.fail_probability)} of drives like those simulated the design keeps every"
            f" limit. The chance that this statement is wrong is at most {percent(test.alpha_certify, 2)}, already"
            f" divided over all {count(test.n_designs, 'design')} that might have been certified."
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
        whose = "the price of this answer" if record.winner and bound.design == record.winner.design else "the lower bound"
        sentences.append(
            f"No candidate cheaper than {price}, {whose}, keeps the limits in {hold} or more of drives. The chance"
            f" that this statement is wrong is at most {chance}."
        )
    if record.winner is not None:
        both = percent(test.alpha_certify + test.alpha_refute, 2)
        sentences.append(f"The chance that either of the two statements is wrong is at most {both}.")
    return tuple(sentences)


def _not_promised(contents: Contents, answer: Answer) -> tuple[str, ...]:
    test, record, space = contents.result.test, answer.record, contents.result.space
    low, high = percent(test.fail_probability), percent(test.hold_probability)
    sentences = [
        "The building itself. The drives were simulated, with the models and the assumptions listed below. Metal under"
        " the floor, other robots or worn tags are in the promise only if they are among the assumptions."
    ]
    if record.winner is not None:
        sentences.append(
            f"That the design keeps the limits in {high} of drives. Between {low} and {high} lies a zone in which the"
            f" test may go either way; a cheaper design in that zone may have been refuted, and this one may lie in it."
        )
    if record.undecided:
        sentences.append(
            f"That nothing cheaper would do: {count(len(record.undecided), 'cheaper design')} reached"
            f" {count(test.max_runs, 'drive')} without a verdict and may or may not keep the limits."
        )
    n_screened = sum(screen.n_removed for screen in space.screens)
    if n_screened:
        sentences.append(
            f"Anything about the {count(n_screened, 'design')} that a rule declared beforehand removed untested, or"
            " about designs outside the space."
        )
    else:
        sentences.append("Anything about designs outside the space that was searched.")
    sentences.append(
        "That prices hold, or that no dearer design is better. Chances are meant over repeated studies with fresh"
        " seeds; they do not depend on when the search stopped."
    )
    return tuple(sentences)


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:].rstrip('.')}."


def _lower_first(words: str) -> str:
    return f"{words[:1].lower()}{words[1:].rstrip('.')}"
