"""Measure what the estimators of some cases compute per step, so that the ratios between them are fair."""

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace

from rfiddesign.reproduce.cases import Case
from rfiddesign.simulation.monte_carlo import Job, Simulator

#: The metric of a row that asks for it.
TIME = "us_per_step"
N_ROUNDS = 3
# With few rounds, only the beginning of the drive is timed [s].
N_QUICK_ROUNDS, QUICK_S = 1, 2.0


def us_per_step(
    cases: dict[str, Case], seed: int, on_time: Callable[[], None], *, is_quick: bool = False
) -> dict[str, float]:
    """Time of a step of each case's estimator on this machine, one thread [us]: the least of several rounds.

    A round takes every case in turn, so that what else keeps the machine busy meets them alike.
    """
    best = dict.fromkeys(cases, math.inf)
    with ExitStack() as stack:
        simulators = {}
        for name, case in cases.items():
            scenario = case.scenario
            if is_quick:
                scenario = replace(scenario, duration_s=min(scenario.duration_s, QUICK_S), settle_s=0.0)
            simulators[name] = stack.enter_context(Simulator(scenario, seed, 1))
        for _ in range(N_QUICK_ROUNDS if is_quick else N_ROUNDS):
            for name, case in cases.items():
                best[name] = min(best[name], simulators[name].computing_time(Job(case.design, 0)).us_per_step)
                on_time()
    return best
