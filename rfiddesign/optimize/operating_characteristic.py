"""What the test of one share does to a design whose runs pass with a known probability: exact, not simulated."""

from dataclasses import dataclass

import numpy as np

from rfiddesign.optimize.certify import TestPlan, boundaries


@dataclass(frozen=True)
class OperatingCharacteristic:
    """What the test does to one design whose runs pass with a known probability (exact, not simulated)."""

    pass_probability: float
    certified: float
    refuted: float
    undecided: float
    expected_runs: float


def operating_characteristic(plan: TestPlan, pass_probability: float) -> OperatingCharacteristic:
    """Chances of the three verdicts and the expected runs of one design.

    Exact, by dynamic programming over (runs, passes).

    Raises
    ------
    ValueError : a pass probability outside [0, 1].
    """
    p = pass_probability
    if not 0 <= p <= 1:
        raise ValueError(f"pass_probability must lie in [0, 1], found {p}")
    table = boundaries(plan)
    still_open = np.zeros(plan.max_runs + 2)  # [passes]: chance to have that many and no verdict yet
    still_open[0] = 1.0
    refuted = certified = expected_runs = 0.0
    for n in range(1, plan.max_runs + 1):
        still_open[1 : n + 1] = still_open[1 : n + 1] * (1 - p) + still_open[:n] * p
        still_open[0] *= 1 - p
        low, high = table.refute_at[n] + 1, table.certify_at[n]
        now_refuted, now_certified = still_open[:low].sum(), still_open[high : n + 1].sum()
        still_open[:low] = 0.0
        still_open[high : n + 1] = 0.0
        refuted += now_refuted
        certified += now_certified
        expected_runs += n * (now_refuted + now_certified)
    undecided = still_open.sum()
    expected_runs += plan.max_runs * undecided
    return OperatingCharacteristic(p, float(certified), float(refuted), float(undecided), float(expected_runs))


def expected_runs(plan: TestPlan, pass_probability: float) -> float:
    """Expected runs until the verdict on one design, the cap included (exact)."""
    return operating_characteristic(plan, pass_probability).expected_runs


def error_probabilities(plan: TestPlan) -> tuple[float, float]:
    """Exact chances that ONE design is wrongly refuted (at p = p0) and wrongly certified (at p = p1).

    Each is the worst case of its kind: more passes refute later and certify sooner.
    The first is to be held against alpha_refute, the second against alpha_certify / n_designs.
    """
    at_hold = operating_characteristic(plan, plan.hold_probability)
    at_fail = operating_characteristic(plan, plan.fail_probability)
    return at_hold.refuted, at_fail.certified
