"""The particle filter on whole recordings: nonsense does it no harm, and tracking is its steps one by one."""

import numpy as np
import pytest

from rfiddesign.estimators import particle_filter
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.estimators.start import KnownStart, UnknownStart
from rfiddesign.estimators.verbs import N_ESTIMATE
from rfiddesign.floor import build_tag_map
from rfiddesign.geometry import Disc, listed
from rfiddesign.models.motion import DifferentialMotion, MecanumMotion, OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.recording import Reads, Recording
from rfiddesign.models.robot import Robot
from rfiddesign.numerics._noise_kernels import run_key

DT = 0.05
KEY = np.uint64(run_key(np.uint64(81), np.uint64(0)))
RADII = (60.0, 45.0, 30.0)
LAYOUT = listed([(150.0, 0.0, 0.0), (0.0, -200.0, 0.8)])


def built(reads, n_particles, settings):
    robot = Robot(LAYOUT, Disc(RADII[0]), RADII, reads)
    return particle_filter.build(ParticleFilter(n_particles=n_particles, **settings), robot, DT)


def particles_of(ready, state):
    """(M, 3) poses."""
    return np.column_stack([particle_filter.positions(ready, state).T, particle_filter.headings(ready, state)])


def random_log(n, seed, tags, n_antennas=2, is_absurd=True):
    """Steps and reads that fit nothing: any antenna, any tag, also tags that are none, wild RSSI and increments."""
    rng = np.random.Generator(np.random.PCG64(seed))
    counts = rng.poisson(0.7, n)
    r = int(counts.sum())
    places = tags[rng.integers(0, len(tags), r)].copy()
    odometry = rng.normal(0, [10.0, 5.0, 0.1], (n, 3))
    rssi = rng.integers(-1, 3, r)
    if is_absurd:
        is_off = rng.random(r) < 0.02
        places[is_off] = rng.uniform(-4e6, 4e6, (is_off.sum(), 2))
        wild = rng.random(n) < 0.001
        odometry[wild] *= rng.uniform(0, 1e4, (wild.sum(), 1))
        odometry[rng.random(n) < 0.001] = 0.0
        rssi = rng.integers(-5, 60, r)
    return Recording(
        dt_s=DT,
        true_poses=np.zeros((n + 1, 3)),
        odometry=odometry,
        read_start=np.concatenate([[0], np.cumsum(counts)]),
        read_antenna=rng.integers(0, n_antennas, r).astype(np.int32),
        read_tag=np.zeros(r, np.int32),
        read_tag_mm=places,
        read_age_s=rng.uniform(0, DT, r),
        read_rssi=rssi.astype(np.int32),
    )


TAGS_MM = np.random.Generator(np.random.PCG64(5)).uniform(-1000, 1000, (300, 2)).astype(np.float32).astype(float)
SETTINGS = [
    {},
    {"uses_rssi": True, "softness_mm": 0.0, "alpha": 1.0, "motion": MecanumMotion()},
    {"reinitialize": False, "read_probability": 0.999, "motion": DifferentialMotion()},
    {"learns_from_nothing": False, "uses_rssi": True, "motion": OmnidirectionalMotion()},
]


@pytest.mark.parametrize("settings", SETTINGS, ids=lambda s: "-".join(s) or "usual")
def test_100_000_steps_of_nonsense_leave_all_numbers_finite(settings):
    reads = ReadModel(polling="multiplexed", poll_s=DT, answers="all", delay_s=0.07)
    ready = built(reads, 48, settings)
    log = random_log(100_000, 6, TAGS_MM)
    state = particle_filter.init(ready, UnknownStart((-500.0, -500.0, 500.0, 500.0)), KEY)
    estimates = np.empty((100_001, N_ESTIMATE))
    state = particle_filter.track(ready, state, log, 100_000, estimates, build_tag_map(TAGS_MM))
    assert np.isfinite(estimates[1:]).all()
    assert (estimates[1:, [3, 5, 8]] >= 0).all()
    assert (estimates[1:, 9] >= 0.99).all()
    assert (estimates[1:, 9] <= 48.01).all()
    assert np.isfinite(particles_of(ready, state)).all()


@pytest.mark.parametrize("settings", SETTINGS, ids=lambda s: "-".join(s) or "usual")
def test_tracking_a_recording_is_its_steps_one_by_one_bit_for_bit(settings):
    """With every kind of evidence, and stops in between."""
    reads = ReadModel(polling="multiplexed", poll_s=DT, answers="all")
    ready = built(reads, 100, settings)
    log, tags = random_log(150, 7, TAGS_MM, is_absurd=False), build_tag_map(TAGS_MM)
    state = start = particle_filter.init(ready, KnownStart((0.0, 0.0, 0.0)), KEY)
    by_steps = []
    for t in range(150):
        rows = slice(log.read_start[t], log.read_start[t + 1])
        told = Reads(log.read_antenna[rows], log.read_tag_mm[rows], log.read_rssi[rows], log.read_age_s[rows])
        state = particle_filter.update(ready, particle_filter.predict(ready, state, log.odometry[t]), told, tags)
        by_steps.append(state.moments)
    estimates, at_once = np.empty((151, N_ESTIMATE)), start
    for stop in (1, 50, 50, 150):
        at_once = particle_filter.track(ready, at_once, log, stop, estimates, tags)
    assert np.array_equal(estimates[1:], by_steps)
    assert np.array_equal(particles_of(ready, at_once), particles_of(ready, state))
