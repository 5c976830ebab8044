"""Search for the cheapest design that holds, with a stated chance of error."""

from rfiddesign.optimize.assume import ASSUMPTIONS, Assumption, Weaker, weaker_designs
from rfiddesign.optimize.certify import Decision, TestPlan, Verdict, boundaries, decide
from rfiddesign.optimize.cheapest import cheapest_certified, next_best
from rfiddesign.optimize.conclude import CLAIMS, Claim, SearchResult, conclude
from rfiddesign.optimize.criteria import Criterion, MeanCriterion, ShareCriterion
from rfiddesign.optimize.judge import Battery, battery, judge
from rfiddesign.optimize.operating_characteristic import (
    OperatingCharacteristic,
    error_probabilities,
    expected_runs,
    operating_characteristic,
)
from rfiddesign.optimize.screen import Screen, expected_reads, screen_by_reads
from rfiddesign.optimize.share_test import Boundaries
from rfiddesign.optimize.space import Space, Unbuildable, unbuildable
from rfiddesign.optimize.walk import Outcomes, Progress, SearchRules

__all__ = [
    "ASSUMPTIONS",
    "CLAIMS",
    "Assumption",
    "Battery",
    "Boundaries",
    "Claim",
    "Criterion",
    "Decision",
    "MeanCriterion",
    "OperatingCharacteristic",
    "Outcomes",
    "Progress",
    "Screen",
    "SearchResult",
    "SearchRules",
    "ShareCriterion",
    "Space",
    "TestPlan",
    "Unbuildable",
    "Verdict",
    "Weaker",
    "battery",
    "boundaries",
    "cheapest_certified",
    "conclude",
    "decide",
    "error_probabilities",
    "expected_reads",
    "expected_runs",
    "judge",
    "next_best",
    "operating_characteristic",
    "screen_by_reads",
    "unbuildable",
    "weaker_designs",
]
