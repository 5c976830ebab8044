"""Search for the cheapest design that holds, with a stated chance of error."""

from rfiddesign.optimize.certify import (
    Boundaries,
    Decision,
    OperatingCharacteristic,
    TestPlan,
    Verdict,
    boundaries,
    decide,
    error_probabilities,
    expected_runs,
    operating_characteristic,
)
from rfiddesign.optimize.cheapest import (
    CLAIMS,
    Claim,
    SearchResult,
    cheapest_certified,
    next_best,
)
from rfiddesign.optimize.screen import Screen, expected_reads, screen_by_reads
from rfiddesign.optimize.space import Candidate, Space, Unbuildable, unbuildable
from rfiddesign.optimize.walk import Outcomes, Progress

__all__ = [
    "CLAIMS",
    "Boundaries",
    "Candidate",
    "Claim",
    "Decision",
    "OperatingCharacteristic",
    "Outcomes",
    "Progress",
    "Screen",
    "SearchResult",
    "Space",
    "TestPlan",
    "Unbuildable",
    "Verdict",
    "boundaries",
    "cheapest_certified",
    "decide",
    "error_probabilities",
    "expected_reads",
    "expected_runs",
    "next_best",
    "operating_characteristic",
    "screen_by_reads",
    "unbuildable",
]
