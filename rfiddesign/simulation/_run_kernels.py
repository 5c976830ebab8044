"""One whole run in compiled code: what the robot records, its filter, its errors, and whether to go on."""

import numpy as np

from rfiddesign._metrics_kernels import has_certainly_failed
from rfiddesign.estimators._mcl_kernels import track
from rfiddesign.numerics._compile_kernels import kernel
from rfiddesign.simulation._recording_kernels import pose_errors, record_odometry, record_reads


@kernel
def run_mcl(key, poses, rig, tags, nominal, model, particles, timing, limits, errors):
    """Drive along the true poses with Monte-Carlo localization until the end or until the run has certainly failed.

    Parameters
    ----------
    key, poses : stream of the run, and (n_steps + 1, 3) where the robot is.
    rig : (deviations (3,) of the odometry, then `robot`, `world`, `field` and `lattice` of `record_reads`).
    tags : as in `record_reads`; nominal : (x, y) arrays of where the map has them.
    model : as in `track`.
    particles : (n_particles, drawn, headings, cloud), see `_particle_kernels`.
    timing : (dt, steps between two looks at whether the run has failed, first step that counts).
    limits : (of_heading, kinds, limits, within) of `has_certainly_failed`.
    errors : (estimates (n_steps + 1, N_ESTIMATE), position (n_steps + 1,), heading (n_steps + 1,)) to be filled; row t
        is of pose t.

    Returns the number of steps taken.
    """
    deviations, robot, world, field, lattice = rig
    nominal_x, nominal_y = nominal
    n_particles, drawn, headings, cloud = particles
    dt, n_look, first_scored = timing
    of_heading, kinds, limit_values, within = limits
    estimates, position, heading = errors
    n = poses.shape[0] - 1
    odometry = np.empty((n, 3))
    record_odometry(key, poses, deviations, odometry)
    room = min(n_look, n) * robot[0].shape[0]
    read_start = np.empty(n + 1, np.int64)
    read_antenna, read_row = np.empty(room, np.int32), np.empty(room, np.int32)
    read_age, read_tags = np.empty(room), np.empty((room, 2))
    log = (odometry, read_start, read_antenna, read_tags, read_age, dt)
    done = 0
    while done < n:
        last = min(done + n_look, n)
        out = (read_start, read_antenna, read_row, read_age)
        n_reads = record_reads(key, poses, done, last, dt, robot, world, field, tags, lattice, out)
        for k in range(n_reads):
            read_tags[k, 0], read_tags[k, 1] = nominal_x[read_row[k]], nominal_y[read_row[k]]
        track(key, done, last, n_particles, log, model, cloud, drawn, headings, estimates)
        pose_errors(poses, estimates, done + 1, last + 1, position, heading)
        done = last
        if done < n and has_certainly_failed(
            position[1 : done + 1], heading[1 : done + 1], dt, first_scored, n, of_heading, kinds, limit_values, within
        ):
            break
    return done
