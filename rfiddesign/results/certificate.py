"""A certificate as data (`certificate.json`): all that is needed to derive an answer anew from the runs beside it."""

from typing import Any, Literal

from rfiddesign.results.study_result import AssumedRecord, DecisionRecord, Record, TestRecord


class BoundaryRecord(Record):
    """The test of one share as integer tables, as far as runs were consumed.

    Of the first n runs, `refute_at[n]` passes or fewer refute (-1: none do), `certify_at[n]` or more certify.
    """

    criterion: int
    refute_at: list[int]
    certify_at: list[int]


class CandidateRecord(Record):
    """A candidate with what its price is counted from."""

    number: int
    name: str
    n_readers: int
    antenna: str
    n_tags: int
    tagged_m2: float


class RunsRecord(Record):
    """The consumed runs of a design: how many, and a hash of all that they measured, in every scenario."""

    design: int
    n_runs: int
    sha256: str


class CertifiedAnswer(Record):
    """What was concluded for one fleet.

    `cost_cents` has the price of every candidate, in their order. `strictly` are the decisions at the evidence that it
    takes to count out designs assumed to be weaker.
    """

    n_robots: int
    cost_cents: list[int]
    claim: str
    winner: int | None
    lower_bound: int | None
    runners_up: list[int]
    decisions: list[DecisionRecord]
    assumed: list[AssumedRecord]
    strictly: list[DecisionRecord]


class Certificate(Record):
    """The test as declared, the candidates, their prices and runs, and what follows.

    `hashes` are those of the parts that the study's hash is made of. A criterion is refuted or certified once the
    evidence reaches its threshold; `strict_threshold` is the one of refutations that count others out. `files` has the
    hash of each file beside the answers that is the same on every machine.
    """

    format: Literal[2] = 2
    version: str
    study: str
    seed: int
    study_hash: str
    hashes: dict[str, str]
    prices: dict[str, Any]
    test: TestRecord
    refute_threshold: float
    certify_threshold: float
    strict_threshold: float | None
    boundaries: list[BoundaryRecord]
    candidates: list[CandidateRecord]
    runs: list[RunsRecord]
    files: dict[str, str]
    answers: list[CertifiedAnswer]
