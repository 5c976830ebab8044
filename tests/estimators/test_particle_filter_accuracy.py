"""How near 500 particles come to the exact filter, and what setting them apart and tempering have to do with it."""

import math

import numpy as np
import pytest

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators import particle_filter
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.estimators.start import KnownStart, UncertainStart
from rfiddesign.estimators.verbs import N_ESTIMATE
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import listed, make_layout, make_pattern
from rfiddesign.models.motion import MecanumMotion, OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.robot import Robot
from rfiddesign.simulation import Scenario
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of, true_poses
from rfiddesign.simulation.scenario import World

FLOOR = rectangle_floor(6_000, 5_000, footprint_radius_mm=320)
READS = ReadModel(0.98, "staggered")
CROSS, CROSS_MOTION = make_layout("cross-8"), OmnidirectionalMotion()
# One antenna that reads in rings of 5 mm, an odometry that adds little noise: the hardest of starts.
NAVIFLOOR = Design(listed([(0.0, 0.0, 0.0)]), antenna("navifloor"), make_pattern("square", pitch_mm=250))
NAVIFLOOR_START = np.diag([20.0**2, 20.0**2, math.radians(4.0) ** 2])
WIDE_START = np.diag([40.0**2, 40.0**2, math.radians(10.0) ** 2])
# The exact filter, see test_histogram: so many particles are as good as its cells.
PLAIN = {"is_regularized": False, "is_tempered": False}
EXACT = {"n_particles": 20_000, **PLAIN}


def mean_errors(design, motion, choices, n_runs=30, start_covariance=None, wrong_by=(0.0, 0.0, 0.0)):
    """Mean position error (n_runs, choices) of drives of 20 s, and that of the last second; the same for all."""
    scenario = Scenario(FLOOR, world=World(motion=motion, reads=READS), duration_s=20.0)
    robot, tags = Robot.of(design, READS), build_tag_map(design.pattern.lay(FLOOR.drivable))
    ready = [
        particle_filter.build(ParticleFilter(motion, softness_mm=1.0, uses_rssi=True, **choice), robot, scenario.dt_s)
        for choice in choices
    ]
    errors, estimates = np.empty((2, n_runs, len(ready))), np.empty((scenario.n_steps + 1, N_ESTIMATE))
    for seed in range(n_runs):
        poses, key = true_poses(scenario, seed, 0), key_of(seed, 0)
        recording, start = record(design, tags, poses, scenario.dt_s, scenario.world, key), poses[0] + wrong_by
        if start_covariance is None:
            told = KnownStart(tuple(start))
        else:
            start = np.random.default_rng(seed).multivariate_normal(start, start_covariance)
            told = UncertainStart(tuple(start), tuple(map(tuple, start_covariance)))
        for j, filter_ in enumerate(ready):
            state = particle_filter.init(filter_, told, key_of(seed, 1))
            particle_filter.track(filter_, state, recording, scenario.n_steps, estimates, tags)
            off = np.hypot(*(estimates[1:, :2] - poses[1:, :2]).T)
            errors[:, seed, j] = off.mean(), off[-20:].mean()
    return errors


@pytest.mark.slow
@pytest.mark.parametrize("tags_per_m2", [100.0, 16.0])
def test_500_particles_track_within_a_tenth_of_the_exact_filter(tags_per_m2):
    """Measured against the histogram over 40 seeds: 1.02 at 100 tags/m2, 1.00 at 16; without all that 0.99, 1.01."""
    design = Design(CROSS, antenna("60x60"), make_pattern("square", tags_per_m2=tags_per_m2))
    exact, ours = mean_errors(design, CROSS_MOTION, [EXACT, {}])[0].mean(axis=0)
    assert ours < 1.1 * exact


@pytest.mark.slow
def test_from_an_uncertain_start_500_particles_keep_up_with_the_exact_filter_which_plain_ones_do_not():
    """Within a fifth, where particles that are only drawn again err by half as much again and more.

    Measured over 40 seeds: 1.04 and 1.89 of what 200,000 particles err.
    """
    choices = [EXACT, {}, {"is_tempered": False}, {"is_regularized": False}, PLAIN]
    exact, ours, regularized, tempered, plain = mean_errors(
        NAVIFLOOR, MecanumMotion(), choices, start_covariance=NAVIFLOOR_START
    )[0].mean(axis=0)
    assert ours < 1.2 * exact
    assert regularized < 0.8 * plain
    assert tempered < 0.8 * plain
    assert plain > 1.5 * exact


@pytest.mark.slow
def test_from_a_wide_start_500_particles_err_half_of_what_plain_ones_do():
    """40 mm and 10 degrees, where a few drives go astray: 1.38 and 2.72 of what 20,000 err over these 60 drives.

    Either remedy alone helps, too: 1.64 without tempering, 1.24 without setting apart.
    """
    many, ours, regularized, tempered, plain = mean_errors(
        NAVIFLOOR, MecanumMotion(), [{"n_particles": 20_000}, {}, {"is_tempered": False}, {"is_regularized": False},
        PLAIN], n_runs=60, start_covariance=WIDE_START,
    )[0].mean(axis=0)  # fmt: skip
    assert ours < 1.6 * many
    assert ours < 0.65 * plain
    assert max(regularized, tempered) < 0.8 * plain


@pytest.mark.slow
def test_twice_the_particles_change_nothing_of_what_20_000_say():
    """They have converged: what the tests above hold others against."""
    design = Design(CROSS, antenna("60x60"), make_pattern("square", tags_per_m2=16.0))
    some, twice = mean_errors(design, CROSS_MOTION, [EXACT, EXACT | {"n_particles": 40_000}])[0].mean(axis=0)
    assert twice == pytest.approx(some, rel=0.02)


def test_a_robot_that_is_put_elsewhere_is_found_again():
    """Half a metre and 57 degrees off, in all of 20 runs: neither shrinking nor tempering holds the particles back."""
    design = Design(CROSS, antenna("60x60"), make_pattern("square", tags_per_m2=100.0))
    at_last = mean_errors(design, CROSS_MOTION, [{}, PLAIN], n_runs=20, wrong_by=(537.0, -341.0, 1.0))[1]
    assert at_last.max() < 40.0
    assert at_last.mean(axis=0)[0] < 1.1 * at_last.mean(axis=0)[1]
