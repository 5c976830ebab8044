"""The particle filter whose likelihood is the field: the exact posterior of reads and of no reads."""

import math

import numpy as np
import pytest

from rfiddesign.estimators import particle_filter
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.estimators.start import UncertainStart, UnknownStart
from rfiddesign.floor import build_tag_map
from rfiddesign.geometry import compose, listed
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.recording import Reads
from tests.estimators.field_filter import CENTRED, DT, KEY, LAYOUT, RADIUS, built, key_of, particles_of, read_by

SOFTNESS, P = 3.0, 0.95


# The exact posterior


def inside(depth):
    """Chance to be within a border blurred by a cubic with the variance of `SOFTNESS`."""
    t = np.clip(depth / (2 * math.sqrt(5) * SOFTNESS) + 0.5, 0, 1)
    return t * t * (3 - 2 * t)


def log_evidence(poses, layout, tags, read):
    """Log probability (n,) of one step's polls at poses (n, 3); `read` (antenna, tag) pairs, one tag per antenna."""
    log, tag_of = np.zeros(len(poses)), dict(read)
    for a, antenna in enumerate(layout.poses_mm):
        places = compose(poses, antenna)[:, :2]
        for k in [tag_of[a]] if a in tag_of else range(len(tags)):
            field = P * inside(RADIUS - np.hypot(*(places - tags[k]).T))
            log += np.log(np.maximum(field, 1e-3)) if a in tag_of else np.log1p(-field)
    return log


def exact_means(start, n, increments, layout, tags, reads):
    """Mean pose after each step by quadrature over starts about a Gaussian's middle; no motion noise."""
    sigmas = np.sqrt(np.diag(start.covariance))
    axes = [np.linspace(-4.5, 4.5, k) for k in n]
    offsets = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    poses, log, means = np.array(start.pose) + offsets * sigmas, -0.5 * (offsets**2).sum(axis=1), []
    for increment, read in zip(increments, reads, strict=True):
        poses = compose(poses, increment)
        log += log_evidence(poses, layout, tags, read)
        weights = np.exp(log - log.max())
        turn = np.angle(np.sum(weights * np.exp(1j * poses[:, 2])))
        means.append([*np.average(poses[:, :2], axis=0, weights=weights), turn])
    return np.array(means)


def filter_means(start, increments, layout, tags, reads, n=20, n_particles=50_000):
    """Estimates (n, n_steps, 3) of repetitions of the filter."""
    ready = built(layout, softness_mm=SOFTNESS, read_probability=P, reinitialize=False, n_particles=n_particles)
    means, tag_map = np.empty((n, len(reads), 3)), build_tag_map(tags)
    for repetition in range(n):
        state = particle_filter.init(ready, start, key_of(repetition))
        for t, (increment, read) in enumerate(zip(increments, reads, strict=True)):
            state = particle_filter.predict(ready, state, increment)
            told = Reads(np.array([a for a, _ in read], int), tags[[k for _, k in read]])
            state = particle_filter.update(ready, state, told, tag_map)
            means[repetition, t] = particle_filter.estimate(state).pose
    return means


@pytest.mark.parametrize(
    ("layout", "sigmas", "n_grid", "tags"),
    [
        # An antenna in the centre sees no heading; two on arms do.
        (CENTRED, (10.0, 10.0, 0.0), (300, 300, 1), [[28.0, 14.0], [-30.0, -24.0], [60.0, 35.0]]),
        (LAYOUT, (10.0, 10.0, 0.07), (60, 60, 60), [[170.0, 30.0], [165.0, -40.0], [0.0, -165.0], [45.0, -190.0]]),
    ],
    ids=["place", "pose"],
)
@pytest.mark.parametrize("reads", [([], [], []), ([], [(0, 0)], []), ([(0, 1)], [], [])], ids=["none", "0", "1"])
def test_polls_with_and_without_reads_give_the_exact_posterior(layout, sigmas, n_grid, tags, reads):
    """Within 3 standard errors of 20 repetitions and a hair, after every step."""
    start, tags = UncertainStart((0.0, 0.0, 0.0), np.diag(np.square(sigmas)).tolist()), np.array(tags)
    increments = np.array([[0.0, 0.0, 0.0], [15.0, 0.0, 0.02], [10.0, 10.0, -0.03]])
    means = filter_means(start, increments, layout, tags, reads)
    exact = exact_means(start, n_grid, increments, layout, tags, reads)
    standard_error = means.std(axis=0, ddof=1) / math.sqrt(len(means))
    assert (standard_error < [0.2, 0.2, 1e-3]).all()
    assert (np.abs(means.mean(axis=0) - exact) < 3 * standard_error + [0.05, 0.05, 3e-4]).all()
    # Nothing read is not nothing learned.
    dead_reckoning = np.array(start.pose)
    for increment in increments:
        dead_reckoning = compose(dead_reckoning, increment)
    assert np.hypot(*(exact[-1] - dead_reckoning)[:2]) > 1.0


def one_poll(ready, tags, reads=None, sigma=9.0, n_steps=0):
    """Particles about the origin after a poll, `n_steps` of nothing before it."""
    start = UncertainStart((0.0, 0.0, 0.0), np.diag([sigma**2, sigma**2, 0.0]).tolist())
    state = particle_filter.init(ready, start, KEY)
    for _ in range(n_steps):
        state = particle_filter.update(ready, particle_filter.predict(ready, state, np.zeros(3)), Reads())
    state = particle_filter.predict(ready, state, np.zeros(3))
    return state, particle_filter.update(ready, state, reads or Reads(), build_tag_map(np.array(tags, float)))


def share_within(ready, state, tag, radius):
    return np.mean(np.hypot(*(particles_of(ready, state)[:, :2] - tag).T) < radius)


def test_the_belief_leaves_places_from_where_an_unread_tag_would_have_been_read():
    """Of the particles with it in the field about 1 - p stay; with the switch off all do."""
    tag, settings = (20.0, 0.0), {"softness_mm": 0.0, "read_probability": P, "n_particles": 20_000}
    for learns in (True, False):
        ready = built(CENTRED, learns_from_nothing=learns, **settings)
        before, after = one_poll(ready, [tag])
        inside = share_within(ready, before, tag, RADIUS)
        expected = inside * (1 - P) / (inside * (1 - P) + 1 - inside) if learns else inside
        assert share_within(ready, after, tag, RADIUS) == pytest.approx(expected, abs=0.02)
        assert inside > 0.5


def test_an_antenna_that_reads_one_tag_says_nothing_of_another_in_its_field():
    """Unless its reader answers with all: then the other was not in the field."""
    tags, settings = [(10.0, 0.0), (40.0, 0.0)], {"softness_mm": 0.0, "read_probability": P, "n_particles": 20_000}
    shares = {}
    for answers in ("one", "all"):
        ready = built(CENTRED, reads=ReadModel(answers=answers), **settings)
        before, after = one_poll(ready, tags, read_by(0, tags[0]))
        near_read = np.hypot(*(particles_of(ready, before)[:, :2] - tags[0]).T) < RADIUS
        near_other = np.hypot(*(particles_of(ready, before)[:, :2] - tags[1]).T) < RADIUS
        both, alone = np.mean(near_read & near_other), np.mean(near_read & ~near_other)
        left = 1.0 if answers == "one" else 1 - P
        expected = both * left / (both * left + alone)
        shares[answers] = share_within(ready, after, tags[1], RADIUS)
        assert shares[answers] == pytest.approx(expected, abs=0.02)
    assert shares["one"] > 5 * shares["all"]


@pytest.mark.parametrize("poll_s", [2 * DT, 3 * DT])
def test_an_antenna_that_has_not_polled_says_nothing(poll_s):
    """A multiplexer of slow polls: only in the first step of each period is no read a sign of no tag."""
    ready = built(CENTRED, reads=ReadModel(polling="multiplexed", poll_s=poll_s), n_particles=2000)
    period = round(poll_s / DT)
    for n_steps in range(2 * period):
        before, after = one_poll(ready, [(20.0, 0.0)], n_steps=n_steps)
        is_same = np.array_equal(particles_of(ready, before), particles_of(ready, after))
        assert is_same == (n_steps % period != 0)


def test_of_multiplexed_antennas_only_the_one_whose_turn_it_is_says_something():
    """Two tags, one in view of each antenna of particles to the right: they die as the antennas poll, one by one."""
    layout = listed([(0.0, 300.0, 0.0), (0.0, -300.0, 0.0)])
    ready = built(
        layout, reads=ReadModel(polling="multiplexed", poll_s=DT), softness_mm=0.0, read_probability=P,
        n_particles=20_000,
    )  # fmt: skip
    for n_steps, silent in ((0, 1), (1, 0)):
        tags = np.array([[20.0, 300.0], [-20.0, -300.0]])
        before, after = one_poll(ready, tags, n_steps=n_steps)
        shares = [
            [share_within(ready, state, tags[a] - layout.poses_mm[a, :2], RADIUS) for a in (0, 1)]
            for state in (before, after)
        ]
        assert shares[1][1 - silent] < 0.3 * shares[0][1 - silent]
        assert shares[1][silent] > shares[0][silent]


@pytest.mark.parametrize("n_particles", [496, 501, 512])
@pytest.mark.parametrize("heading", [0.0, 2.0])
def test_no_read_says_something_from_the_first_step_whatever_the_number_of_particles(n_particles, heading):
    """Numbers in memory that are no particles do not make the belief vague, neither at first nor after a restart."""
    ready = built(CENTRED, n_particles=n_particles, softness_mm=0.0)
    tags = np.array([[20.0, 0.0], [5000.0, 0.0]])
    tag_map, pose = build_tag_map(tags), (0.0, 0.0, heading)
    covariance = np.diag([81.0, 81.0, 0.0]).tolist()
    state = before = particle_filter.init(ready, UncertainStart(pose, covariance), KEY)
    after = particle_filter.update(ready, state, Reads(), tag_map)
    assert share_within(ready, after, tags[0], RADIUS) < 0.5 * share_within(ready, before, tags[0], RADIUS)
    far = np.array([9000.0, 0.0])
    state = before = particle_filter.update(ready, after, read_by(0, far), tag_map)
    assert share_within(ready, before, far, RADIUS + 1) == 1.0


def test_without_a_map_no_read_says_nothing():
    ready = built(CENTRED, n_particles=2000)
    before, after = one_poll(ready, np.empty((0, 2)))
    assert np.array_equal(particles_of(ready, before), particles_of(ready, after))


def test_no_read_says_nothing_where_the_belief_is_too_vague():
    """Particles that turn every way, or lie all over the hall, are left as they are."""
    ready = built(LAYOUT, n_particles=2000)
    tags = build_tag_map(np.random.Generator(np.random.PCG64(1)).uniform(0, 2000, (400, 2)))
    state = particle_filter.predict(
        ready, particle_filter.init(ready, UnknownStart((0.0, 0.0, 2000.0, 2000.0)), KEY), np.zeros(3)
    )
    after = particle_filter.update(ready, state, Reads(), tags)
    assert np.array_equal(particles_of(ready, state), particles_of(ready, after))


# Settings


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"n_particles": 1}, ("n_particles", "1", "2", "1,000,000")),
        ({"alpha": 0.0}, ("alpha", "0.0", "above 0")),
        ({"softness_mm": -1.0}, ("softness_mm", "-1.0", "0")),
        ({"softness_mm": math.nan}, ("softness_mm", "nan")),
        ({"read_probability": 1.0}, ("read_probability", "1.0", "0.999")),
        ({"read_probability": 0.0}, ("read_probability", "0.0", "0.01")),
    ],
)
def test_a_bad_setting_is_named_with_its_value_and_bound(arguments, words):
    with pytest.raises(ValueError, match=words[0]) as error:
        ParticleFilter(**arguments)
    assert all(word in str(error.value) for word in words)


def test_noise_that_could_turn_the_robot_about_within_a_step_is_refused():
    with pytest.raises(ValueError, match=r"noise of the heading.* is 1.0, .*0.49"):
        built(LAYOUT, motion=OmnidirectionalMotion(noise_heading_rad_per_s=20.0))
