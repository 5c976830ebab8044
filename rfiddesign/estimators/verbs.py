"""What every estimator offers: `predict`, `update`, `estimate` one step at a time, `track` over a recording.

An estimator's module adds its settings, `build` (settings and a robot make a `Filter`) and `init` (a start makes a
`Belief`), and passes these on.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from rfiddesign.estimators._estimate_kernels import N_ESTIMATE
from rfiddesign.estimators._particle_kernels import aligned_zeros
from rfiddesign.floor import TagMap, build_tag_map
from rfiddesign.models.recording import Reads, Recording


class Kernels(NamedTuple):
    """The compiled parts of an estimator; arrays of the belief are changed in place.

    Fields
    ------
    predict : (key, step, odometry (n, 3), row, model, arrays): move by an increment.
    update : (key, step, log, t, model, tags, arrays, out (n, N_ESTIMATE), row): use the reads of step t of a log (see
        `Recording.log`) and write the estimate.
    track : (key, first, last, log, model, tags, arrays, estimates): both over steps first..last-1; row t + 1 of
        `estimates` receives the estimate after step t.
    """

    predict: Callable
    update: Callable
    track: Callable


@dataclass(frozen=True)
class Filter:
    """An estimator made ready for one robot.

    Parameters
    ----------
    settings : as given.
    dt_s : duration of a step [s].
    n_antennas : antennas on the robot.
    kernels : its compiled parts.
    model : what these take of settings and robot.
    """

    settings: Any
    dt_s: float
    n_antennas: int
    kernels: Kernels
    model: tuple


@dataclass(frozen=True)
class Belief:
    """What an estimator knows between steps.

    Parameters
    ----------
    key : stream of the run (`_noise_kernels.run_key`).
    step : steps taken so far.
    arrays : the belief in the estimator's own form.
    moments : (N_ESTIMATE,) the estimate: x, y, heading; var_x, cov_xy, var_y, cov_x_heading, cov_y_heading,
        var_heading; effective sample size.
    increment : (3,) the odometry since the last update, which tells where an antenna was when it polled.
    """

    key: np.uint64
    step: int
    arrays: tuple
    moments: np.ndarray
    increment: np.ndarray


@dataclass(frozen=True)
class Estimate:
    """Mean pose (3,) and covariance (3, 3) of a belief [mm, mm, rad], and its effective sample size.

    Of an estimator without particles the sample size is 1.
    """

    pose: np.ndarray
    covariance: np.ndarray
    effective_sample_size: float


def belief(key: int, arrays: tuple, moments: np.ndarray) -> Belief:
    """The belief before the first step."""
    return Belief(np.uint64(key), 0, arrays, moments, np.zeros(3))


def moments_of(pose: np.ndarray, covariance: np.ndarray, sample_size: float = 1.0) -> np.ndarray:
    """An estimate in the columns of `Belief.moments`, from a pose (3,) and its covariance (3, 3)."""
    covariance = np.asarray(covariance, float)
    return np.array([*pose, *covariance[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]], sample_size])


def predict(ready: Filter, state: Belief, increment: np.ndarray) -> Belief:
    """Move the belief by an odometry increment (3,) in the robot's frame [mm, mm, rad]."""
    odometry, arrays = np.array(increment, float).reshape(1, 3), workspace(state)
    ready.kernels.predict(state.key, state.step, odometry, 0, ready.model, arrays)
    return replace(state, arrays=arrays, increment=odometry[0])


def update(ready: Filter, state: Belief, reads: Reads, tags: TagMap | None = None) -> Belief:
    """Use one step's reads and end the step.

    Parameters
    ----------
    reads : what was read.
    tags : the map of all tags, for estimators that learn from polls without a read.
    """
    log, arrays, moments = reads.log(state.increment, ready.dt_s), workspace(state), np.empty((1, N_ESTIMATE))
    ready.kernels.update(state.key, state.step, log, 0, ready.model, known(tags), arrays, moments, 0)
    return replace(state, step=state.step + 1, arrays=arrays, moments=moments[0], increment=np.zeros(3))


def estimate(state: Belief) -> Estimate:
    """Mean, covariance and effective sample size of the belief."""
    xx, xy, yy, xh, yh, hh = state.moments[3:9]
    covariance = np.array([[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]])
    return Estimate(state.moments[:3].copy(), covariance, float(state.moments[9]))


def track(
    ready: Filter, state: Belief, recording: Recording, last: int, estimates: np.ndarray, tags: TagMap | None = None
) -> Belief:
    """Run the estimator over a recording from its state's step up to step `last`, in compiled code.

    Row t + 1 of `estimates` (n_steps + 1, N_ESTIMATE) receives the estimate after step t.

    Raises
    ------
    ValueError : if `last` is not a step of the recording, `estimates` has another shape, or an antenna is not on the
        robot.
    """
    if not state.step <= last <= recording.n_steps:
        raise ValueError(f"last is {last!r}, must be from {state.step} to {recording.n_steps}, the recording's end")
    if estimates.ndim != 2 or estimates.shape[0] <= last or estimates.shape[1] != N_ESTIMATE:
        raise ValueError(f"estimates has shape {estimates.shape}, must have more than {last} rows of {N_ESTIMATE}")
    if recording.read_antenna.max(initial=-1) >= ready.n_antennas or recording.read_antenna.min(initial=0) < 0:
        raise ValueError(f"read_antenna has an index outside 0 to {ready.n_antennas - 1}, the robot's antennas")
    arrays = workspace(state)
    ready.kernels.track(state.key, state.step, last, recording.log, ready.model, known(tags), arrays, estimates)
    moments = estimates[last].copy() if last > state.step else state.moments
    return replace(state, step=last, arrays=arrays, moments=moments)


def workspace(state: Belief) -> tuple:
    """Copies of a belief's arrays, for compiled code to change."""
    return tuple(_copy(part) if isinstance(part, np.ndarray) else part for part in state.arrays)


def known(tags: TagMap | None) -> tuple:
    """A map as compiled estimators take it: where the plan has the tags, and the cells that they lie in.

    (nominal_x, nominal_y, cell_start, 1 / cell_mm, origin_x, origin_y, n_x, n_y); without a map there are no tags.
    """
    if tags is None:
        none = np.empty(0, np.float32)
        return none, none, np.zeros(2, np.int32), 1.0, 0.0, 0.0, 1, 1
    if tags.nominal_x is not tags.installed_x:
        tags = _as_planned(tags)
    return (
        tags.nominal_x, tags.nominal_y, tags.cell_start, 1.0 / tags.cell_mm, float(tags.origin_mm[0]),
        float(tags.origin_mm[1]), tags.n_x, tags.n_y,
    )  # fmt: skip


@lru_cache(maxsize=4)
def _as_planned(tags: TagMap) -> TagMap:
    """A map with its cells by where the plan has the tags: those of `tags` go by where these lie in truth."""
    order = np.argsort(tags.tag_id)
    return build_tag_map(np.column_stack([tags.nominal_x, tags.nominal_y])[order])


def _copy(array: np.ndarray) -> np.ndarray:
    copy = aligned_zeros(array.shape, array.dtype)
    copy[...] = array
    return copy
