"""Drives and reads for the tests of the grid filter."""

import numpy as np

from rfiddesign.estimators import markov
from rfiddesign.estimators.markov import Markov
from rfiddesign.estimators.start import UncertainStart
from rfiddesign.estimators.verbs import N_ESTIMATE
from rfiddesign.geometry import Disc, compose, listed
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.recording import Recording
from rfiddesign.models.robot import Robot

DT = 0.05
SINGLE = Robot(listed([(0.0, 0.0, 0.0)]), Disc(100.0))
NO_NOISE = OmnidirectionalMotion(0.0, 0.0, 0.0)
OWN = 100.0 / 12


def a_recording(rng, poses, odometry, antennas, sigma, share=1.0, age=0.0, pitch=None, radius=100.0):
    """Reads of tags about the true places of antennas: Gaussian as in eq. 10, or of a lattice's tags within a disc."""
    start, antenna, tags = [0], [], []
    for pose in poses[1:]:
        places = compose(pose, antennas)[:, :2]
        if pitch is None:
            reading = np.flatnonzero(rng.random(len(antennas)) < share)
            found = places + rng.normal(0.0, sigma, places.shape)
        else:
            found = np.round(places / pitch) * pitch
            reading = np.flatnonzero(np.hypot(*(places - found).T) < radius)
        antenna.extend(reading)
        tags.extend(found[reading])
        start.append(len(antenna))
    n = len(antenna)
    return Recording(
        DT, poses, odometry, np.array(start, np.int64), np.array(antenna, np.int32), np.zeros(n, np.int32),
        np.array(tags, float).reshape(-1, 2), np.full(n, age),
    )  # fmt: skip


def a_drive(rng, n_steps, motion, start=(0.0, 0.0, 0.0), forward=10.0, sideways=0.0):
    """True poses of a bent way, and what a noisy odometry says of it."""
    bends = 0.02 * np.sin(np.arange(n_steps) / 60.0)
    odometry = np.column_stack([np.full(n_steps, forward), np.full(n_steps, sideways), bends])
    rates = motion.noise(DT)
    way = np.hypot(odometry[:, 0], odometry[:, 1])
    variances = rates[:, 0] + np.outer(way, rates[:, 1]) + np.outer(np.abs(bends), rates[:, 2])
    poses = [np.array(start, float)]
    for increment in odometry + rng.normal(size=(n_steps, 3)) * np.sqrt(variances):
        poses.append(compose(poses[-1], increment))
    return np.array(poses), odometry


def tracked(ready, start, recording, stops=()):
    state, rows = markov.init(ready, start, 1), np.empty((recording.n_steps + 1, N_ESTIMATE))
    rows[0] = state.moments
    for stop in (*stops, recording.n_steps):
        state = markov.track(ready, state, recording, stop, rows)
    return state, rows


def drawn(start_covariance, **settings):
    """A filter and its Gaussian belief about the origin; the motion is without noise."""
    ready = markov.build(Markov(motion=NO_NOISE, **settings), SINGLE, DT)
    return ready, markov.init(ready, UncertainStart((0.0, 0.0, 0.0), start_covariance), 1)
