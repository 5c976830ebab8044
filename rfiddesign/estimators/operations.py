"""What an estimator computes, by formula: floating-point operations per step of the robot.

Every estimator's module offers `flops_per_step(ready, load)`, counted by hand from the formulas of its kernels.
Additions, multiplications, divisions and square roots count one each, a fused multiply-add two; comparisons, integers,
random bits and memory count nothing.  Branches are counted as they are taken as a rule: read the sums as "about".
"""

import math
from dataclasses import dataclass

import numpy as np

from rfiddesign.models.reads import Schedule
from rfiddesign.models.recording import Recording

# Of `_math_kernels`: sine and cosine of float32 and of float64, exponential, logarithm, arctangent; of
# `_noise_kernels`: a normal number.
SIN_COS_32, SIN_COS_64, EXP_32, LOG_32, ATAN2_64, NORMAL_32 = 19, 34, 12, 16, 56, 28
# `_evidence_kernels.antenna_then` with the division by the step before it.
ANTENNA_THEN = 2 * SIN_COS_64 + 19
# `_motion_kernels.step_variances`.
STEP_VARIANCES = 16


@dataclass(frozen=True)
class Load:
    """What a robot had to take in on a drive, as means over its steps.

    Parameters
    ----------
    reads : reads per step.
    read_share : share of the steps with at least one read.
    polls : polls per step.
    silent_polls : polls per step that read nothing.
    tags_per_mm2 : density of the tags on the floor [1/mm2].
    spread_mm : standard deviation per axis of the position, as the estimator has it in the median step [mm].
    """

    reads: float
    read_share: float
    polls: float
    silent_polls: float
    tags_per_mm2: float = 0.0
    spread_mm: float = 0.0


def load_of(
    recording: Recording, schedule: Schedule, *, tags_per_mm2: float = 0.0, spread_mm: float = 0.0
) -> Load:  # fmt: skip
    """The load of a recording by antennas that poll on a schedule."""
    n = recording.n_steps
    per_step = np.diff(recording.read_start)
    antennas = int(recording.read_antenna.max(initial=-1)) + 1
    # An antenna that read several tags polled once.
    heard = np.unique(np.repeat(np.arange(n), per_step) * antennas + recording.read_antenna).size
    polls = len(schedule.slots) / schedule.period
    return Load(
        recording.n_reads / n,
        float(np.count_nonzero(per_step)) / n,
        polls,
        max(polls - heard / n, 0.0),
        tags_per_mm2,
        spread_mm,
    )


def tags_within(load: Load, distance_mm: float) -> float:
    """Tags that lie within a distance of a place, on average."""
    return load.tags_per_mm2 * math.pi * distance_mm**2
