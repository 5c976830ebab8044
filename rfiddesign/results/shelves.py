"""What a study says of floor against shelves: `shelves.json`."""

from typing import Literal

from pydantic import Field

from rfiddesign.results.study_result import CostLineRecord, Limit, MeanRecord, Record

Family = Literal["floor", "shelves"]


class HallRecord(Record):
    """The hall: its size, and the rows of shelves as boxes (low x, low y, high x, high y) [mm]."""

    length_mm: float
    width_mm: float
    rows_mm: list[tuple[float, float, float, float]]
    area_m2: float


class TestedRecord(Record):
    """A design that some search looked at, with the error of its runs in the study's first limited metric.

    `n_complete` of the `n_runs` runs went to their end; `costs_cents` has a price for each fleet.
    """

    __test__ = False

    family: Family
    number: int
    name: str
    n_tags: int
    costs_cents: list[int]
    n_runs: int
    n_complete: int
    error: MeanRecord


class FamilyAnswer(Record):
    """The cheapest certified design of a family for a fleet, at limits `factor` times the study's.

    `n_passed` of `n_runs` are the winner's; `n_undecided` designs cheaper than it came to no verdict.
    """

    family: Family
    n_robots: int
    factor: float
    limits: list[Limit]
    claim: str
    winner: int | None
    name: str
    cost_cents: int | None
    cost_lines: list[CostLineRecord]
    lower_bound_cents: int | None
    n_undecided: int
    n_runs: int
    n_passed: int
    n_runs_used: int


class Shelves(Record):
    """Both families side by side.

    Each of the two is tested by itself, with `alpha_refute` for each answer and `alpha_certify` for all answers of the
    family: at all limits and for all fleets.  `n_designs` counts designs times limits, as certification is divided.
    """

    format: Literal[1] = 1
    version: str
    study_hash: str
    currency: str
    metric: str
    hall: HallRecord
    robots: list[int] = Field(min_length=1)
    factors: list[float] = Field(min_length=1)
    hold_probability: float
    fail_probability: float
    alpha_refute: float
    alpha_certify: float
    n_floor_designs: int
    n_shelf_designs: int
    training_drive_s: float
    answers: list[FamilyAnswer]
    tested: list[TestedRecord]
    runs_sha256: str

    def answer(self, family: Family, n_robots: int, factor: float) -> FamilyAnswer:
        """The answer of a family for a fleet at a limit."""
        asked = (family, n_robots, factor)
        return next(each for each in self.answers if (each.family, each.n_robots, each.factor) == asked)
