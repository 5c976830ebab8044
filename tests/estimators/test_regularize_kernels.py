"""Liu-West regularization: what it keeps of a belief, against numpy in double precision."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.estimators import _mcl_kernels as mcl_kernels
from rfiddesign.estimators import _particle_kernels as particle_kernels
from rfiddesign.estimators import _regularize_kernels as kernels
from rfiddesign.estimators.verbs import moments_of
from rfiddesign.geometry import between, compose
from rfiddesign.numerics._math_kernels import binary_angle
from tests.estimators.clouds import KEY, drawn_of, poses_of, width_of

PROPERTY = settings(max_examples=100, deadline=None, derandomize=True)
seeds = st.integers(0, 2**32 - 1)
STILL = (0.0, 0.0, 0.0)
WAY = (14.0, -6.0, 0.15)
RULES = np.array([*[0.0] * 6, 0.2, 40.0**2, 0.0, 0.0])


def covariance_of(rng, n_flat=0):
    """A covariance (3, 3) [mm, mm, rad] with correlations; without width along `n_flat` directions."""
    root = rng.normal(0, 1, (3, 3)) * [[6.0], [9.0], [0.05]]
    root[:, :n_flat] = 0.0
    return root @ root.T


def particles_about(mean, covariance, n, seed=1):
    """x, y (float32) and binary headings of draws from a Gaussian, with just these moments."""
    white = np.random.Generator(np.random.PCG64(seed)).normal(0, 1, (n, 3))
    white -= white.mean(axis=0)
    white = white @ np.linalg.inv(np.linalg.cholesky(np.cov(white.T, bias=True))).T
    poses = mean + white @ np.linalg.cholesky(covariance).T
    return *poses[:, :2].T.astype(np.float32), np.array([binary_angle(h) for h in poses[:, 2]], np.int32)


def about_of(mean, covariance, due=0.0):
    about = np.zeros((1, kernels.N_ABOUT))
    about[0, :10], about[0, kernels.DUE] = moments_of(mean, covariance), due
    return about


def by_six(covariance):
    """The six numbers of a covariance as the kernels order them."""
    return tuple(covariance[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]])


def of_six(xx, xy, yy, xh, yh, hh):
    return np.array([[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]])


def apart(particles, increment, root, about, step=0):
    """Poses (n, 3) after the step."""
    n = particles[0].size
    drawn, headings = drawn_of(*particles)
    cloud = np.empty((particle_kernels.N_FIELDS, width_of(n)), np.float32)
    kernels.predict_apart(KEY, step, increment, root, about, drawn, headings, cloud)
    particle_kernels.store(cloud, drawn, headings)
    return poses_of(drawn[0, :n], drawn[1, :n], headings[:n])


def moved(particles, increment, variances, about, step=0):
    """Poses (n, 3) after the step of the filter, whatever is due."""
    n = particles[0].size
    drawn, headings = drawn_of(*particles)
    cloud = np.empty((particle_kernels.N_FIELDS, width_of(n)), np.float32)
    noise = np.column_stack([variances, np.zeros((3, 2))])
    mcl_kernels.move(KEY, step, np.array([increment]), 0, noise, True, drawn, headings, cloud, about)
    particle_kernels.store(cloud, drawn, headings)
    return poses_of(drawn[0, :n], drawn[1, :n], headings[:n])


# The formulas


@PROPERTY
@given(seed=seeds, n_flat=st.integers(0, 3))
def test_the_root_times_itself_is_the_covariance(seed, n_flat):
    """Also where it has no width in some direction, or in any."""
    covariance = covariance_of(np.random.Generator(np.random.PCG64(seed)), n_flat)
    a, b, c, d, e, f = kernels.root_of(by_six(covariance))
    root = np.array([[a, 0, 0], [b, c, 0], [d, e, f]])
    scale = np.sqrt(np.diag(covariance)) + 1e-12
    assert np.abs((root @ root.T - covariance) / np.outer(scale, scale)).max() < 1e-4


@PROPERTY
@given(seed=seeds, heading=st.floats(-10, 10), factor=st.floats(0, 1))
def test_the_covariance_of_a_step_is_that_of_the_chain_rule(seed, heading, factor):
    """In the robot's axes before the step: F R' P R F' + Q, and turned back in the map's."""
    rng = np.random.Generator(np.random.PCG64(seed))
    covariance, variances = covariance_of(rng), rng.uniform(0, 1, 3)
    mean = np.array([100.0, -50.0, heading])
    s, c = math.sin(heading), math.cos(heading)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    F = np.array([[1, 0, -WAY[1]], [0, 1, WAY[0]], [0, 0, 1.0]])
    about = about_of(mean, covariance)
    found = of_six(*kernels.covariance_ahead(about, factor, WAY, tuple(variances)))
    ahead = F @ R.T @ covariance @ R @ F.T
    assert found == pytest.approx(factor * ahead + np.diag(variances), abs=1e-9)
    kernels.move_moments(about, WAY, tuple(variances))
    assert between(compose(mean, np.array(WAY)), about[0, :3]) == pytest.approx(np.zeros(3), abs=1e-9)
    assert of_six(*about[0, 3:9]) == pytest.approx(R @ (ahead + np.diag(variances)) @ R.T, abs=1e-9)


# What becomes of particles


@PROPERTY
@given(seed=seeds, due=st.floats(0, 0.9), n=st.sampled_from([2, 16, 501]), heading=st.floats(-3.2, 3.2))
def test_without_noise_every_particle_keeps_its_place_but_nearer_to_the_mean(seed, due, n, heading):
    """x - m becomes a (x - m), a = sqrt(1 - h^2), of the heading also across the turn's end; then the step."""
    rng = np.random.Generator(np.random.PCG64(seed))
    mean, shrunk = np.array([300.0, -200.0, heading]), math.sqrt(1 - due)
    offsets = rng.normal(0, 1, (n, 3)) * [20.0, 20.0, 0.2]
    x, y = (mean[:2, None] + offsets[:, :2].T).astype(np.float32)
    binary = np.array([binary_angle(heading + turn) for turn in offsets[:, 2]], np.int32)
    found = apart((x, y, binary), WAY, (0.0,) * 6, about_of(mean, np.eye(3), due))
    expected = compose(mean + shrunk * offsets, np.array(WAY))
    assert np.abs((found - expected)[:, :2]).max() < 2e-3
    assert np.abs(between(expected, found)[:, 2]).max() < 1e-6


@pytest.mark.parametrize("heading", [0.4, 3.13])
def test_mean_and_covariance_are_kept_though_every_particle_moves(heading):
    """Within 4.5 standard errors of what 200,000 particles may tell; shrinking alone would lose a fifth of it."""
    n, mean, covariance = 200_000, np.array([900.0, 400.0, heading]), covariance_of(np.random.default_rng(2))
    about = about_of(mean, covariance, due=0.2)
    root = kernels.root_of(kernels.covariance_ahead(about, 0.2, STILL, STILL))
    particles = particles_about(mean, covariance, n)
    found = apart(particles, STILL, root, about)
    offsets = np.column_stack([found[:, :2] - mean[:2], np.angle(np.exp(1j * (found[:, 2] - heading)))])
    scale = np.sqrt(np.diag(covariance))
    assert np.abs(offsets.mean(axis=0) / scale).max() < 4.5 / math.sqrt(n)
    apart_by = (np.cov(offsets.T) - covariance) / np.outer(scale, scale)
    # The headings' spread of about 0.1 turns each particle's noise a little off the mean's axes.
    assert np.abs(apart_by).max() < 4.5 * math.sqrt(2 / n) + 0.2 * covariance[2, 2]
    assert np.abs(found[:, :2] - poses_of(*particles)[:, :2]).max(axis=1).min() > 1e-4


def test_a_step_with_the_kernel_spreads_particles_as_one_without_it():
    """The two noises in one draw: mean and covariance after the motion are those of the plain step."""
    n, mean, covariance = 200_000, np.array([900.0, 400.0, 0.7]), covariance_of(np.random.default_rng(3))
    particles, variances = particles_about(mean, covariance, n), (4.0, 1.0, 4e-4)
    plain, with_kernel = (moved(particles, WAY, variances, about_of(mean, covariance, due)) for due in (0.0, 0.2))
    scale = plain.std(axis=0)
    assert np.abs((with_kernel - plain).mean(axis=0) / scale).max() < 6 / math.sqrt(n)
    change = (np.cov(with_kernel.T) - np.cov(plain.T)) / np.outer(scale, scale)
    assert np.abs(change).max() < 6 * math.sqrt(2 / n) + 0.2 * covariance[2, 2]
    # It is not the plain step.
    assert np.abs(with_kernel - plain).max(axis=0)[0] > 1.0


def test_where_nothing_is_due_the_step_is_the_plain_one_to_the_last_bit():
    mean, covariance = np.array([900.0, 400.0, 0.7]), covariance_of(np.random.default_rng(4))
    particles = particles_about(mean, covariance, 501)
    drawn, headings = drawn_of(*particles)
    cloud = np.empty((particle_kernels.N_FIELDS, width_of(501)), np.float32)
    noise = np.column_stack([(4.0, 1.0, 4e-4), np.zeros((3, 2))])
    mcl_kernels.predict(KEY, 5, np.array([WAY]), 0, noise, drawn, headings, cloud)
    particle_kernels.store(cloud, drawn, headings)
    expected = poses_of(drawn[0, :501], drawn[1, :501], headings[:501])
    assert np.array_equal(moved(particles, WAY, (4.0, 1.0, 4e-4), about_of(mean, covariance), 5), expected)


# When it is due


@pytest.mark.parametrize(
    ("deviation", "spread", "effective", "due"),
    [
        (5.0, 0.1, 100.0, 0.2 * 0.8), (5.0, 0.1, 500.0, 0.0), (5.0, 0.1, 1.0, 0.2 * 499 / 500),
        (30.0, 0.1, 100.0, 0.0), (5.0, 0.31, 100.0, 0.0), (28.0, 0.29, 250.0, 0.1),
    ],
)  # fmt: skip
def test_the_kernel_is_for_one_heap_of_particles_and_by_how_many_were_lost(deviation, spread, effective, due):
    """Bandwidth h^2 (1 - ESS / M) with headings within 0.3 rad and a position within the reach of 40 mm."""
    moments = moments_of(np.zeros(3), np.diag([deviation**2, deviation**2, spread**2]), effective)[None]
    assert kernels.bandwidth_due(moments, 0, 500, RULES) == pytest.approx(due)


def test_a_step_that_turns_too_vaguely_is_made_without_the_kernel():
    """Noise of three normals must stay below half a turn; a step of 0.4 rad noise is the plain one."""
    mean, covariance = np.zeros(3), covariance_of(np.random.default_rng(6))
    particles = particles_about(mean, covariance, 48)
    due, none = (moved(particles, WAY, (1.0, 1.0, 0.16), about_of(mean, covariance, h)) for h in (0.2, 0.0))
    assert np.array_equal(due, none)
