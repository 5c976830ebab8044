"""The answers to the variants of a study side by side: what `comparison.json` holds, and its page is drawn from.

As in `result.json` nothing here depends on when, where or with how many workers the variants ran.
"""

from collections.abc import Iterable
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from rfiddesign.results.study_result import Record, RequirementRecord, TestRecord

#: A folder of a variant is one name, so that it lies within that of the comparison.
FOLDER = r"^[^/\\\x00-\x1f.][^/\\\x00-\x1f]*$"


class WinnerRecord(Record):
    """The cheapest certified design of a variant for one fleet."""

    name: str
    estimator: str | None
    layout: str
    antenna: str
    pattern: str
    tags_per_m2: float
    n_readers: int
    n_tags: int
    cost_cents: int
    n_runs: int
    n_passed: int


class SavingRecord(Record):
    """What an answer costs less than that of the base group in the same condition; negative if it costs more."""

    cents: int
    share: float


class VariantAnswer(Record):
    """The answer of a variant for one fleet; `n_undecided` cheaper designs came to no verdict."""

    n_robots: int
    currency: str
    claim: str
    claim_words: str
    winner: WinnerRecord | None
    lower_bound_cents: int | None
    n_undecided: int
    n_runs_used: int
    saving: SavingRecord | None


class VariantRecord(Record):
    """A variant, what it sets (values as text), and its answers; `folder` holds its results within the comparison's.

    `n_runs` counts the runs that were looked at for any of its fleets.
    """

    name: str
    group: str
    condition: str
    folder: str = Field(pattern=FOLDER)
    settings: dict[str, str]
    seed: int
    prices: str
    requirement: RequirementRecord
    test: TestRecord
    study_hash: str
    n_runs: int
    answers: list[VariantAnswer]

    def answer(self, n_robots: int) -> VariantAnswer | None:
        """The answer for a fleet, None if the variant has none of that size."""
        return next((answer for answer in self.answers if answer.n_robots == n_robots), None)


class Comparison(Record):
    """All variants of a study; savings are counted against the group `base`."""

    format: Literal[1] = 1
    version: str
    study: str
    title: str
    base: str
    variants: list[VariantRecord] = Field(min_length=1)

    @property
    def groups(self) -> list[str]:
        """Groups in the order of the file."""
        return _distinct(variant.group for variant in self.variants)

    @property
    def conditions(self) -> list[str]:
        """Conditions in the order of the file."""
        return _distinct(variant.condition for variant in self.variants)

    @property
    def fleets(self) -> list[int]:
        """Sizes of fleets that any variant has an answer for, in the order of the file."""
        return _distinct(answer.n_robots for variant in self.variants for answer in variant.answers)

    def variant(self, group: str, condition: str) -> VariantRecord | None:
        """The variant of a group and condition, None if there is none."""
        return next((one for one in self.variants if (one.group, one.condition) == (group, condition)), None)


class SessionRecord(BaseModel):
    """What a comparison shows of a variant's `provenance.json`: its last session."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    wall_s: float
    workers: int
    runs_simulated: int
    runs_stored_before: int


def saving(answer: VariantAnswer, base: VariantAnswer | None) -> SavingRecord | None:
    """What an answer saves against the base's; None unless both are certified and priced in the same currency."""
    if base is None or base.winner is None or answer.winner is None or base.currency != answer.currency:
        return None
    cents = base.winner.cost_cents - answer.winner.cost_cents
    return SavingRecord(cents=cents, share=round(cents / max(base.winner.cost_cents, 1), 9))


def _distinct(values: Iterable) -> list:
    return list(dict.fromkeys(values))
