"""What an estimator computes while a robot drives: counted by formula, and measured on this machine."""

import math
import time
from dataclasses import dataclass

import numpy as np

from rfiddesign.estimators import registry
from rfiddesign.estimators.operations import load_of
from rfiddesign.estimators.verbs import N_ESTIMATE, known, workspace
from rfiddesign.floor import TagMap
from rfiddesign.simulation.record import record_with
from rfiddesign.simulation.run import PreparedDesign, start_of
from rfiddesign.simulation.scenario import Scenario

# Steps that load the compiled code; then repetitions until there are enough, or enough time was spent on them.
_WARM_UP_STEPS = 5
_REPETITIONS, _ENOUGH_S = 7, 0.3


@dataclass(frozen=True)
class ComputingTime:
    """What an estimator computes per step of the robot.

    Parameters
    ----------
    us_per_step : time of a step on this machine, one thread [us].
    flops_per_step : floating-point operations of a step, about; it depends on the run and not on the machine.
    """

    us_per_step: float
    flops_per_step: float


def measure(
    prepared: PreparedDesign, scenario: Scenario, tags: TagMap, poses: np.ndarray, key: np.uint64
) -> ComputingTime:
    """Let an estimator track a recording of the drive along `poses` (n_steps + 1, 3), and again; the quickest counts.

    An estimator that is to start from two tags looks for them itself here.
    """
    ready, n = prepared.ready, scenario.n_steps
    recording = record_with(prepared.rig, tags, poses, scenario.dt_s, key)
    state = registry.init(ready, start_of(scenario, poses), key)
    log, tags_known = recording.log, known(tags)
    estimates = np.empty((n + 1, N_ESTIMATE))
    ready.kernels.track(key, 0, min(n, _WARM_UP_STEPS), log, ready.model, tags_known, workspace(state), estimates)
    best, spent = math.inf, 0.0
    for _ in range(_REPETITIONS):
        arrays = workspace(state)
        begin = time.perf_counter()
        ready.kernels.track(key, 0, n, log, ready.model, tags_known, arrays, estimates)
        taken = time.perf_counter() - begin
        best, spent = min(best, taken), spent + taken
        if spent > _ENOUGH_S:
            break
    schedule = prepared.robot.reads.schedule(ready.n_antennas, scenario.dt_s)
    load = load_of(
        recording,
        schedule,
        tags_per_mm2=tags.n_tags / (1e6 * scenario.floor.area_m2),
        spread_mm=float(np.median(np.sqrt(0.5 * (estimates[1:, 3] + estimates[1:, 5])))),
    )
    return ComputingTime(1e6 * best / n, registry.flops_per_step(ready, load))
