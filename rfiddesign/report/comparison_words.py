"""What the page of a comparison says in words: prices, savings, why there is none, and what is compared."""

from rfiddesign.report.words import count, joined, percent
from rfiddesign.results.comparison import Comparison, SessionRecord, VariantAnswer, VariantRecord
from rfiddesign.units import money


def design_words(comparison: Comparison, variant: VariantRecord, answer: VariantAnswer) -> str:
    """What is bought, what of it is open, and why there is no saving."""
    winner = answer.winner
    words = f"{winner.name.replace('tags/m2', 'tags/m²')}; {count(winner.n_readers, 'reader')} per robot"
    if answer.n_undecided:
        words += f"; {count(answer.n_undecided, 'cheaper design')} undecided"
    if answer.saving is None and variant.group != comparison.base:
        words += f"; no saving: {_no_saving(comparison, variant, answer)}"
    return words


def _no_saving(comparison: Comparison, variant: VariantRecord, answer: VariantAnswer) -> str:
    base = comparison.variant(comparison.base, variant.condition)
    other = None if base is None else base.answer(answer.n_robots)
    if other is None:
        return "the base has no such variant"
    return "the base is not certified" if other.winner is None else "the base has another currency"


def open_words(answer: VariantAnswer, variant: VariantRecord) -> str:
    """Why an answer names no design."""
    if answer.claim == "none holds":
        return "none: every design refuted"
    words = (
        "the search ended before any design was certified"
        if answer.claim == "stopped by budget"
        else f"none certified, some without a verdict after {variant.test.max_runs:,} drives"
    )
    bound = answer.lower_bound_cents
    return f"undecided: {words}" + (
        "" if bound is None else f"; whatever holds costs at least {money(bound, answer.currency)}"
    )


def saving_words(answer: VariantAnswer) -> str:
    """What a certified answer saves against the base group, in money and per cent; nothing without a saving."""
    if answer.saving is None:
        return ""
    if answer.saving.cents == 0:
        return "costs the same"
    amount, share = money(abs(answer.saving.cents), answer.currency), percent(abs(answer.saving.share))
    return f"saves {amount} ({share})" if answer.saving.cents > 0 else f"costs {amount} more ({share})"


def settings_words(variant: VariantRecord) -> str:
    """What a variant sets, in a line."""
    return ", ".join(f"{key} = {value}" for key, value in variant.settings.items()) or "nothing: the study itself"


def duration_words(session: SessionRecord | None) -> str:
    """How long the last session of a variant took; and how many drives were simulated before it."""
    if session is None:
        return "–"
    words = seconds(session.wall_s)
    return f"{words} after {count(session.runs_stored_before, 'drive')}" if session.runs_stored_before else words


def seconds(wall_s: float) -> str:
    """A time on one line."""
    return f"{wall_s:,.1f}\u00a0s"


def compared(comparison: Comparison) -> tuple[str, ...]:
    """What is compared with what, and what a saving does not say."""
    return (_seed_words(comparison), _price_list_words(comparison), *_saving_sentences(comparison))


def _seed_words(comparison: Comparison) -> str:
    seeds = list(dict.fromkeys(variant.seed for variant in comparison.variants))
    if len(seeds) == 1:
        return (
            f"All variants have the seed {seeds[0]} and thus the same drives: drive number i has the same route, speed"
            " and random numbers in each, as far as a variant does not itself change floor, scenario, robot or world."
        )
    return (
        f"The variants have different seeds ({joined([str(seed) for seed in seeds])}): their drives differ, and so a"
        " part of any difference in price is chance."
    )


def _price_list_words(comparison: Comparison) -> str:
    lists = list(dict.fromkeys(variant.prices for variant in comparison.variants))
    if len(lists) == 1:
        return f"All prices are of the same price list, {lists[0]}."
    return (
        f"The variants have different price lists ({joined(lists)}): a difference between variants of different lists"
        " is one of the lists, too."
    )


def _saving_sentences(comparison: Comparison) -> tuple[str, ...]:
    sentences = [
        "Each cell names the cheapest certified design of a study of its own, with the claim and the chances of error"
        " of that study's report.",
        f"A saving is the difference of two certified answers: the price of {comparison.base} in the same condition"
        " less that of the cell. Where one of the two is missing, there is none.",
    ]
    tests = list(dict.fromkeys(variant.test.model_dump_json() for variant in comparison.variants))
    if len(tests) == 1:
        test = comparison.variants[0].test
        sentences.append(
            "The chance that an answer was certified although it passes no more than"
            f" {percent(test.fail_probability)} of drives is at most {percent(test.alpha_certify, 2)}; that this"
            f" happened to one of the two of a saving, at most {percent(2 * test.alpha_certify, 2)}."
        )
        sentences.append(
            f"Between {percent(test.fail_probability)} and {percent(test.hold_probability)} of drives the test may go"
            " either way, and with another seed it may: small differences say little."
        )
    else:
        sentences.append("The variants are tested differently: see the report of each.")
    return tuple(sentences)
