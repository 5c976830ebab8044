"""One whole run in compiled code: what the robot records, its filter, its errors, and whether to go on."""

import numpy as np

from rfiddesign._metrics_kernels import has_certainly_failed
from rfiddesign.estimators._mcl_kernels import track
from rfiddesign.numerics._compile_kernels import kernel
from rfiddesign.simulation._recording_kernels import pose_errors, record_odometry, record_reads


@kernel
def listen(key, poses, first, last, dt, rig, tags, nominal, log, read_row):
    """Record the reads of steps first..last-1 into a log, see `Recording.log`; `read_row` (r,) is scratch."""
    _, robot, world, field, lattice = rig
    _, read_start, read_antenna, read_tags, read_age, read_rssi, _ = log
    nominal_x, nominal_y = nominal
    out = (read_start, read_antenna, read_row, read_age, read_rssi)
    n_reads = record_reads(key, poses, first, last, dt, robot, world, field, tags, lattice, out)
    for k in range(n_reads):
        read_tags[k, 0], read_tags[k, 1] = nominal_x[read_row[k]], nominal_y[read_row[k]]


@kernel
def assess(poses, first, last, timing, limits, errors):
    """Measure the errors of the estimates after steps first..last-1 and tell whether the run has certainly failed."""
    estimates, position, heading = errors
    dt, _, first_scored = timing
    of_heading, kinds, limit_values, within = limits
    pose_errors(poses, estimates, first + 1, last + 1, position, heading)
    n = poses.shape[0] - 1
    return last < n and has_certainly_failed(
        position[1 : last + 1], heading[1 : last + 1], dt, first_scored, n, of_heading, kinds, limit_values, within
    )


@kernel
def begin(key, poses, rig, n_look, dt):
    """A log with the run's odometry and room for the reads of `n_look` steps, and as much room for rows."""
    n = poses.shape[0] - 1
    odometry = np.empty((n, 3))
    record_odometry(key, poses, rig[0], odometry)
    room = min(n_look, n) * rig[1][0].shape[0] * rig[2][-1]
    log = (
        odometry,
        np.empty(n + 1, np.int64),
        np.empty(room, np.int32),
        np.empty((room, 2)),
        np.empty(room),
        np.empty(room, np.int32),
        dt,
    )
    return log, np.empty(room, np.int32)


@kernel
def run_mcl(key, poses, rig, tags, nominal, model, known, arrays, timing, limits, errors):
    """Drive along the true poses with a particle filter until the end or until the run has certainly failed.

    Parameters
    ----------
    key, poses : stream of the run, and (n_steps + 1, 3) where the robot is.
    rig : (wheels of `record_odometry`, then `robot`, `world`, `field` and `lattice` of `record_reads`).
    tags : as in `record_reads`; nominal : (x, y) arrays of where the map has them.
    model, known, arrays : as in `_mcl_kernels.track`.
    timing : (dt, steps between two looks at whether the run has failed, first step that counts).
    limits : (of_heading, kinds, limits, within) of `has_certainly_failed`.
    errors : (estimates (n_steps + 1, N_ESTIMATE), position (n_steps + 1,), heading (n_steps + 1,)) to be filled; row t
        is of pose t.

    Returns the number of steps taken.
    """
    dt, n_look, _ = timing
    n = poses.shape[0] - 1
    log, rows = begin(key, poses, rig, n_look, dt)
    done = 0
    while done < n:
        last = min(done + n_look, n)
        listen(key, poses, done, last, dt, rig, tags, nominal, log, rows)
        track(key, done, last, log, model, known, arrays, errors[0])
        has_failed = assess(poses, done, last, timing, limits, errors)
        done = last
        if has_failed:
            break
    return done
