"""MCL tends to the exact Bayes posterior as its particles grow.

Small problems whose posterior is known without sampling, with reinitialization off and the filter's own likelihood.
Standard errors come from independent repetitions.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.signal import fftconvolve

from rfiddesign.estimators import mcl
from rfiddesign.estimators.start import KnownStart, UnknownStart
from rfiddesign.geometry import Disc, compose, listed
from rfiddesign.models.likelihood import DistanceLikelihood
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.recording import Reads
from rfiddesign.models.robot import Robot
from rfiddesign.numerics._noise_kernels import run_key

LAYOUT = listed([(150.0, 0.0, 0.0), (0.0, -200.0, 0.0)])
ROBOT, DT = Robot(LAYOUT, Disc(30.0)), 1.0
STEP_NOISE_MM = 20.0
HEADING = 0.5
INCREMENTS = np.array([[40.0, 10.0, 0.0], [35.0, -20.0, 0.0], [50.0, 0.0, 0.0], [20.0, 30.0, 0.0]])
ANTENNAS = [np.array([0]), np.array([0, 1]), np.empty(0, int), np.array([1])]
# Where the read tags lie about their antennas, were the robot where its odometry says.
TAG_OFFSETS = [
    np.array([[12.0, -20.0]]),
    np.array([[31.0, 4.0], [-15.0, 22.0]]),
    np.empty((0, 2)),
    np.array([[5, 40.0]]),
]


@dataclass(frozen=True)
class Problem:
    """Steps of a robot whose heading is known: expected positions (n + 1, 2) and read tags by step."""

    centres: np.ndarray
    tags: list[np.ndarray]


def the_problem():
    poses = [np.array([1000.0, 500.0, HEADING])]
    for increment in INCREMENTS:
        poses.append(compose(poses[-1], increment))
    tags = [
        compose(pose, LAYOUT.poses_mm[antenna])[:, :2] + offset
        for pose, antenna, offset in zip(poses[1:], ANTENNAS, TAG_OFFSETS, strict=True)
    ]
    return Problem(np.array(poses)[:, :2], tags)


def mcl_means(likelihood, n_particles, n_repetitions):
    """Estimates (n_repetitions, n_steps, 2) relative to where odometry puts the robot."""
    problem = the_problem()
    motion = OmnidirectionalMotion(STEP_NOISE_MM, STEP_NOISE_MM, 0.0)
    ready = mcl.build(mcl.Mcl(likelihood, motion, n_particles, reinitialize=False), ROBOT, DT)
    out = np.empty((n_repetitions, len(INCREMENTS), 2))
    for repetition in range(n_repetitions):
        key = np.uint64(run_key(np.uint64(77), np.uint64(repetition)))
        state = mcl.init(ready, KnownStart((1000.0, 500.0, HEADING)), key)
        for t, increment in enumerate(INCREMENTS):
            state = mcl.predict(ready, state, increment)
            state = mcl.update(ready, state, Reads(ANTENNAS[t], problem.tags[t]))
            out[repetition, t] = mcl.estimate(state).pose[:2] - problem.centres[t + 1]
    return out


def kalman_means(sigma):
    """The posterior of the Gaussian model is Gaussian: a Kalman filter with R = sigma^2."""
    mean, variance, means = np.zeros(2), 0.0, []
    for offsets in TAG_OFFSETS:
        variance += STEP_NOISE_MM**2
        for offset in offsets:
            gain = variance / (variance + sigma**2)
            mean = mean + gain * (offset - mean)
            variance *= 1 - gain
        means.append(mean)
    return np.array(means)


def histogram_means(weight_of_distance, half=130, parts=8):
    """The posterior on a grid of 1 mm about where odometry puts the robot; weights averaged over each cell."""
    axis = np.arange(-half, half + 1, dtype=float)
    fine = (np.arange((2 * half + 1) * parts) + 0.5) / parts - half - 0.5
    kernel = np.exp(-(axis**2) / (2 * STEP_NOISE_MM**2))
    density, means = np.zeros((axis.size, axis.size)), []
    density[half, half] = 1.0
    for offsets in TAG_OFFSETS:
        density = fftconvolve(density, np.outer(kernel, kernel), mode="same")
        for offset in offsets:
            distance = np.hypot(fine[:, None] - offset[0], fine[None, :] - offset[1])
            weight = weight_of_distance(distance).reshape(axis.size, parts, axis.size, parts).mean(axis=(1, 3))
            density = density * weight
        density = np.maximum(density, 0) / density.sum()
        means.append([axis @ density.sum(axis=1), axis @ density.sum(axis=0)])
    return np.array(means)


def eq_6(sigma, beta):
    def weight(distance):
        return np.where(distance < sigma, 1.0, beta * np.exp(-(distance**2) / (2 * sigma**2)))

    return weight


GAUSSIAN = DistanceLikelihood(kind="gaussian", sigma_per_radius=1.0)
COMBINATION = DistanceLikelihood(kind="combination", sigma_per_radius=1.1, beta=0.3)


def exact_means(likelihood):
    return kalman_means(30.0) if likelihood.kind == "gaussian" else histogram_means(eq_6(33.0, 0.3))


def test_the_histogram_agrees_with_the_kalman_filter_where_both_are_exact():
    assert histogram_means(lambda d: np.exp(-(d**2) / 1800)) == pytest.approx(kalman_means(30.0), abs=0.01)


@pytest.mark.parametrize("likelihood", [GAUSSIAN, COMBINATION], ids=["gaussian", "combination"])
@pytest.mark.slow
def test_100_000_particles_agree_with_the_exact_posterior_within_3_standard_errors(likelihood):
    n = 25
    means = mcl_means(likelihood, 100_000, n)
    error = means.mean(axis=0) - exact_means(likelihood)
    standard_error = means.std(axis=0, ddof=1) / np.sqrt(n)
    assert standard_error.max() < 0.05
    assert (np.abs(error) < 3 * standard_error + 1e-3).all()


@pytest.mark.parametrize("likelihood", [GAUSSIAN, COMBINATION], ids=["gaussian", "combination"])
def test_error_falls_with_the_root_of_the_number_of_particles(likelihood):
    """100 times the particles, a tenth of the error, at every step."""
    exact = exact_means(likelihood)
    few, many = (
        np.sqrt(((mcl_means(likelihood, n, repetitions) - exact) ** 2).mean(axis=(0, 2)))
        for n, repetitions in ((500, 200), (50_000, 60))
    )
    assert (few / many > 7.5).all()
    assert (few / many < 13).all()


def posterior_over_starts(likelihood, tags, path, n_xy=60, n_theta=360):
    """Mean pose at the end of `path` by quadrature over every start in a box of 200 mm and every heading."""
    xy = (np.arange(n_xy) + 0.5) / n_xy * 200.0 - 100.0
    theta = (np.arange(n_theta) + 0.5) / n_theta * 2 * np.pi
    starts = np.stack(np.meshgrid(xy, xy, theta, indexing="ij"), axis=-1).reshape(-1, 3)
    log_weights = np.zeros(len(starts))
    for pose, antenna, tag in zip(path, (0, 1, 0, 1), tags, strict=True):
        place = compose(compose(starts, pose), LAYOUT.poses_mm[antenna])[:, :2]
        log_weights -= ((place - tag) ** 2).sum(axis=1) / (2 * (30.0 * likelihood.sigma_per_radius) ** 2)
    weights = np.exp(log_weights - log_weights.max())
    ends = compose(starts, path[-1])
    position = np.average(ends[:, :2], axis=0, weights=weights)
    return np.array([*position, np.angle(np.sum(weights * np.exp(1j * ends[:, 2])))])


def test_from_an_unknown_pose_the_posterior_over_three_dimensions_is_met():
    """No motion noise, so that the posterior is an integral over starts: x, y and heading."""
    likelihood = DistanceLikelihood(kind="gaussian", sigma_per_radius=2.0)
    increments = np.array([[60.0, 0.0, 0.3], [40.0, 30.0, -0.2], [70.0, 0.0, 0.5], [50.0, -10.0, 0.1]])
    path = [increments[0]]
    for increment in increments[1:]:
        path.append(compose(path[-1], increment))
    truth = compose(np.array([30.0, -20.0, 2.0]), np.array(path))
    antennas = (0, 1, 0, 1)
    offsets = np.array([[10.0, 20.0], [-30.0, 5.0], [20.0, -25.0], [0.0, 30.0]])
    tags = np.array([compose(p, LAYOUT.poses_mm[a])[:2] for p, a in zip(truth, antennas, strict=True)]) + offsets
    exact = posterior_over_starts(likelihood, tags, path)

    n = 25
    settings = mcl.Mcl(likelihood, OmnidirectionalMotion(0.0, 0.0, 0.0), 100_000, reinitialize=False)
    ready = mcl.build(settings, ROBOT, DT)
    estimates = np.empty((n, 3))
    for repetition in range(n):
        key = np.uint64(run_key(np.uint64(78), np.uint64(repetition)))
        state = mcl.init(ready, UnknownStart((-100.0, -100.0, 100.0, 100.0)), key)
        for increment, antenna, tag in zip(increments, antennas, tags, strict=True):
            state = mcl.predict(ready, state, increment)
            state = mcl.update(ready, state, Reads(np.array([antenna]), tag[None]))
        estimates[repetition] = mcl.estimate(state).pose
    turn = np.angle(np.exp(1j * (estimates[:, 2] - exact[2])))
    errors = np.column_stack([estimates[:, :2] - exact[:2], turn])
    standard_error = errors.std(axis=0, ddof=1) / np.sqrt(n)
    assert (standard_error < [0.5, 0.5, 0.005]).all()
    assert (np.abs(errors.mean(axis=0)) < 3 * standard_error).all()
