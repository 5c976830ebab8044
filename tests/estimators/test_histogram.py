"""The histogram filter is exact: it equals sums, convolutions and very many particles."""

import math

import numpy as np
import pytest
from scipy.signal import fftconvolve
from scipy.special import ndtr

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators import histogram, registry, verbs
from rfiddesign.estimators._histogram_diffusion_kernels import lattice_directions
from rfiddesign.estimators.histogram import Histogram
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.estimators.start import KnownStart, UncertainStart, UnknownStart
from rfiddesign.floor import build_tag_map, rectangle_floor
from rfiddesign.geometry import Disc, Rectangle, compose, listed, make_layout, make_pattern
from rfiddesign.models.motion import MecanumMotion, OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.recording import Reads, Recording
from rfiddesign.models.robot import Robot
from rfiddesign.simulation import Scenario, World
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of, true_poses

DT = 0.05
STILL = OmnidirectionalMotion(0.0, 0.0, 0.0)
CENTRED = listed([(0.0, 0.0, 0.0)])


def driven(odometry):
    """A recording without a read."""
    n = len(odometry)
    return Recording(
        DT, np.zeros((n + 1, 3)), np.ascontiguousarray(odometry, float), np.zeros(n + 1, np.int64),
        np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros((0, 2)), np.zeros(0),
    )  # fmt: skip


def tracked(settings, robot, start, recording, tags=None):
    """Estimates (n + 1, N_ESTIMATE) over a recording, and the last belief."""
    ready = registry.build(settings, robot, recording.dt_s)
    state = registry.init(ready, start, 3)
    estimates = np.empty((recording.n_steps + 1, verbs.N_ESTIMATE))
    estimates[0] = state.moments
    return estimates, verbs.track(ready, state, recording, recording.n_steps, estimates, tags)


def rotation(angle):
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


@pytest.mark.parametrize("sideways", [25.0, 10.0, 0.0])
def test_without_reads_mean_and_covariance_are_those_of_the_noise_over_200_steps(sideways):
    motion, increment, n = OmnidirectionalMotion(25.0, sideways, 0.0), np.array([5.0, 1.0, 0.02]), 200
    _, state = tracked(
        Histogram(motion, n_headings=9), Robot(CENTRED, Disc(30.0)), KnownStart((100.0, 200.0, 0.5)),
        driven(np.tile(increment, (n, 1))),
    )  # fmt: skip
    mean, covariance = np.array([100.0, 200.0]), np.zeros((2, 2))
    for step in range(n):
        turned = rotation(0.5 + 0.02 * step)
        mean = mean + turned @ increment[:2]
        covariance += turned @ np.diag([25.0 * DT, sideways * DT]) ** 2 @ turned.T
    found = verbs.estimate(state)
    assert found.pose[:2] == pytest.approx(mean, abs=0.05)
    # What has no noise sideways gets a fiftieth of that ahead: thinner covariances need steps across many cells.
    tolerance = (0.002 if sideways > 0 else 0.03) * covariance.trace()
    assert found.covariance[:2, :2] == pytest.approx(covariance, abs=tolerance)
    assert histogram.share_lost(state) < 1e-4


def test_position_and_heading_are_correlated_as_in_100_000_drawn_drives():
    motion, n, m = OmnidirectionalMotion(20.0, 30.0, 0.1), 150, 100_000
    increments = np.tile([8.0, 0.0, 0.004], (n, 1))
    estimates, _ = tracked(
        Histogram(motion), Robot(CENTRED, Disc(30.0)), KnownStart((0.0, 0.0, 0.3)), driven(increments)
    )
    rng = np.random.default_rng(1)
    poses = np.tile([0.0, 0.0, 0.3], (m, 1))
    for increment in increments:
        poses = compose(poses, increment + rng.normal(size=(m, 3)) * [20.0 * DT, 30.0 * DT, 0.1 * DT])
    exact = np.cov(poses.T)
    _, _, _, xx, xy, yy, xh, yh, hh, _ = estimates[-1]
    found = np.array([[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]])
    scale = np.sqrt(np.outer(np.diag(exact), np.diag(exact)))
    assert (np.abs(found - exact) < 0.015 * scale).all()
    assert estimates[-1, :3] == pytest.approx(poses.mean(axis=0), abs=0.02 * math.sqrt(exact[1, 1]))


POSE, COVARIANCE = (
    np.array([500.0, 300.0, 0.4]),
    np.array([[900.0, 200.0, 1.0], [200.0, 700.0, -1.5], [1.0, -1.5, 0.01]]),
)
MOUNTED = listed([(150.0, -80.0, 0.3)])


def in_field(area, u, v, softness):
    return ndtr(-area.signed_distance(np.stack([u, v], axis=-1)) / softness)


def exact_posterior(chance_of, cell_mm=3.0, cell_rad=0.01):
    """Mean and covariance by a sum over poses; `chance_of(u, v)` of a tag at (u, v) from the antenna."""
    tag = compose(compose(POSE, MOUNTED.poses_mm[0]), np.array([18.0, 9.0, 0.0]))[:2]
    offsets = np.stack(
        np.meshgrid(
            *(np.arange(-n, n + 1) * step for n, step in ((45, cell_mm), (45, cell_mm), (45, cell_rad))), indexing="ij"
        ),
        -1,
    ).reshape(-1, 3)
    weights = np.exp(-0.5 * np.einsum("ni,ij,nj->n", offsets, np.linalg.inv(COVARIANCE), offsets))
    poses = POSE + offsets
    places = compose(poses, MOUNTED.poses_mm[0])
    c, s = np.cos(places[:, 2]), np.sin(places[:, 2])
    dx, dy = tag[0] - places[:, 0], tag[1] - places[:, 1]
    weights *= chance_of(c * dx + s * dy, c * dy - s * dx)
    mean = np.average(poses, axis=0, weights=weights)
    return tag, mean, np.cov(poses.T, aweights=weights, ddof=0)


RECTANGLE = Rectangle(90.0, 40.0)
EVIDENCE = {
    "read": (Disc(30.0), (), -1, lambda u, v: np.maximum(0.9 * in_field(Disc(30.0), u, v, 2.0), 1e-3)),
    "rectangle": (RECTANGLE, (), -1, lambda u, v: np.maximum(0.9 * in_field(RECTANGLE, u, v, 2.0), 1e-3)),
    "nothing": (Disc(30.0), (), None, lambda u, v: 1.0 - 0.9 * in_field(Disc(30.0), u, v, 2.0)),
    "nothing, rectangle": (RECTANGLE, (), None, lambda u, v: 1.0 - 0.9 * in_field(RECTANGLE, u, v, 2.0)),
    "ring": (
        Disc(30.0), (30.0, 20.0), 0,
        lambda u, v: np.maximum(0.9 * (in_field(Disc(30.0), u, v, 2.0) - in_field(Disc(20.0), u, v, 2.0)), 1e-3),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", EVIDENCE)
def test_the_posterior_of_one_poll_is_that_of_a_sum_over_poses(name):
    area, radii, rssi, chance = EVIDENCE[name]
    tag, mean, covariance = exact_posterior(chance)
    ready = histogram.build(
        Histogram(STILL, softness_mm=2.0, read_probability=0.9, n_cells=121, n_headings=61),
        Robot(MOUNTED, area, radii),
        DT,
    )
    state = histogram.init(ready, UncertainStart(tuple(POSE), tuple(map(tuple, COVARIANCE))), 1)
    state = histogram.predict(ready, state, np.zeros(3))
    if rssi is None:
        reads, tags = Reads(), build_tag_map(tag[None])
    else:
        reads, tags = Reads(np.array([0]), tag[None], np.array([rssi])), None
    found = histogram.estimate(histogram.update(ready, state, reads, tags))
    deviations = np.sqrt(np.diag(covariance))
    assert (np.abs(found.pose - mean) < 0.01 * deviations).all()
    assert (np.abs(found.covariance - covariance) < 0.015 * np.outer(deviations, deviations)).all()


def test_at_one_heading_it_equals_convolutions_on_a_fine_grid():
    """Steps of noise and reads of two antennas, as a Bayes filter of 1 mm cells."""
    heading, sigma, half = 0.5, 12.0, 110
    antennas = np.array([[150.0, 0.0, 0.0], [0.0, -200.0, 0.0]])
    increments = np.array([[40.0, 10.0], [35.0, -20.0], [50.0, 0.0], [20.0, 30.0]])
    offsets = [[(0, (12.0, -20.0))], [(0, (21.0, 4.0)), (1, (-15.0, 12.0))], [], [(1, (5.0, 25.0))]]
    axis = np.arange(-half, half + 1, dtype=float)
    kernel = np.exp(-(axis**2) / (2 * sigma**2))
    kernel = np.outer(kernel, kernel) / kernel.sum() ** 2
    density = np.zeros((axis.size, axis.size))
    density[half, half] = 1.0
    motion = OmnidirectionalMotion(sigma / DT, sigma / DT, 0.0)
    robot = Robot(listed(antennas), Disc(30.0))
    ready = histogram.build(Histogram(motion, n_headings=1, learns_from_nothing=False), robot, DT)
    state, centre = histogram.init(ready, KnownStart((1000.0, 500.0, heading)), 1), np.array([1000.0, 500.0])
    for increment, of_step in zip(increments, offsets, strict=True):
        centre = centre + rotation(heading) @ increment
        density = np.maximum(fftconvolve(density, kernel, mode="same"), 0.0)
        tags = []
        for number, offset in of_step:
            tags.append(centre + rotation(heading) @ antennas[number, :2] + offset)
            inside = ndtr((30.0 - np.hypot(axis[:, None] - offset[0], axis[None, :] - offset[1])) / 1.0)
            density = density * np.maximum(0.98 * inside, 1e-3)
        density /= density.sum()
        state = histogram.predict(ready, state, np.array([*increment, 0.0]))
        state = histogram.update(
            ready, state, Reads(np.array([a for a, _ in of_step], int), np.array(tags).reshape(-1, 2))
        )
        found = histogram.estimate(state)
        in_x, in_y = density.sum(axis=1), density.sum(axis=0)
        mean = np.array([axis @ in_x, axis @ in_y])
        variances = np.array([axis**2 @ in_x, axis**2 @ in_y]) - mean**2
        assert found.pose[:2] - centre == pytest.approx(mean, abs=0.15)
        assert np.diag(found.covariance)[:2] == pytest.approx(variances, rel=0.02)


FLOOR = rectangle_floor(6_000, 5_000, footprint_radius_mm=320)
CROSS = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=100))
NAVIFLOOR = Design(CENTRED, antenna("navifloor"), make_pattern("square", pitch_mm=250))
# Narrower than a start may be: from 40 mm and 10 degrees 100,000 particles err by 0.94 of what the cells do, by 0.90
# without what was not read (4 drives of 8 s).
OF_NAVIFLOOR = np.diag([20.0**2, 20.0**2, math.radians(4.0) ** 2])


def simulated(design, motion, run, duration_s, reads):
    """A recording, the start that the filter is told, and the tags."""
    scenario = Scenario(FLOOR, world=World(motion=motion, reads=reads), duration_s=duration_s)
    tags, poses = build_tag_map(design.pattern.lay(FLOOR.drivable)), true_poses(scenario, 5, run)
    recording = record(design, tags, poses, scenario.dt_s, scenario.world, key_of(5, run))
    if design is CROSS:
        return recording, KnownStart(tuple(poses[0])), tags
    pose = np.random.default_rng(run).multivariate_normal(poses[0], OF_NAVIFLOOR)
    return recording, UncertainStart(tuple(pose), tuple(map(tuple, OF_NAVIFLOOR))), tags


def compared(design, motion, settings, n_runs, duration_s):
    """Mean position error of each estimator, and estimates by run and estimator."""
    reads = ReadModel(0.98, "staggered")
    robot, errors, estimates = Robot.of(design, reads), np.zeros(len(settings)), []
    for run in range(n_runs):
        recording, start, tags = simulated(design, motion, run, duration_s, reads)
        estimates.append([tracked(each, robot, start, recording, tags)[0] for each in settings])
        truth = recording.true_poses
        errors += [np.hypot(*(found[1:, :2] - truth[1:, :2]).T).mean() / n_runs for found in estimates[-1]]
    return errors, np.array(estimates)


@pytest.mark.slow
@pytest.mark.parametrize("learns_from_nothing", [True, False])
@pytest.mark.parametrize("is_cross", [True, False], ids=["cross-8", "navifloor"])
def test_100_000_particles_come_to_the_same(is_cross, learns_from_nothing):
    design, motion = (CROSS, OmnidirectionalMotion()) if is_cross else (NAVIFLOOR, MecanumMotion())
    particles = ParticleFilter(
        motion, 100_000, uses_rssi=True, learns_from_nothing=learns_from_nothing, softness_mm=1.0, reinitialize=False
    )
    both = (Histogram(motion, learns_from_nothing=learns_from_nothing), particles)
    errors, estimates = compared(design, motion, both, 2, 5.0)
    assert 1 / 1.1 < errors[1] / errors[0] < 1.1
    apart = np.hypot(*(estimates[:, 0, :, :2] - estimates[:, 1, :, :2]).transpose(2, 0, 1))
    deviation = np.sqrt(estimates[:, 0, :, 3] + estimates[:, 0, :, 5])
    # Both differ from the truth by a deviation, from each other by far less.
    assert math.sqrt((apart**2).mean()) < 0.2 * math.sqrt((deviation**2).mean())
    turned = np.angle(np.exp(1j * (estimates[:, 0, :, 2] - estimates[:, 1, :, 2])))
    assert math.sqrt((turned**2).mean()) < 0.2 * math.sqrt(estimates[:, 0, :, 8].mean())


@pytest.mark.slow
def test_smaller_cells_change_little():
    motion = MecanumMotion()
    both = (Histogram(motion), Histogram(motion, n_cells=131, n_headings=61))
    errors, estimates = compared(NAVIFLOOR, motion, both, 2, 4.0)
    assert errors[0] == pytest.approx(errors[1], rel=0.02)
    apart = np.hypot(*(estimates[:, 0, :, :2] - estimates[:, 1, :, :2]).transpose(2, 0, 1))
    deviation = np.sqrt(estimates[:, 1, :, 3] + estimates[:, 1, :, 5])
    assert math.sqrt((apart**2).mean()) < 0.1 * math.sqrt((deviation**2).mean())


@pytest.mark.slow
def test_20_000_particles_and_500_are_within_a_tenth_of_the_exact_filter_and_no_better():
    """Measured: 1.002 and 1.010."""
    motion = OmnidirectionalMotion()
    settings = [Histogram(motion)]
    settings += [ParticleFilter(motion, n, softness_mm=1.0, reinitialize=False) for n in (20_000, 500)]
    errors, _ = compared(CROSS, motion, settings, 3, 8.0)
    assert (errors[1:] / errors[0] < 1.1).all()
    assert errors[2] / errors[0] > 0.98


def test_told_nothing_it_waits_for_two_tags_and_then_knows_where_it_is():
    reads = ReadModel(1.0)
    recording, _, tags = simulated(CROSS, OmnidirectionalMotion(), 1, 10.0, reads)
    estimates, _ = tracked(
        Histogram(n_cells=61), Robot.of(CROSS, reads), UnknownStart((0.0, 0.0, 6000.0, 5000.0)), recording, tags
    )
    assert estimates[0, :3] == pytest.approx([3000.0, 2500.0, 0.0])
    assert estimates[0, 8] == pytest.approx(math.pi**2 / 3)
    assert np.hypot(*(estimates[-1, :2] - recording.true_poses[-1, :2])) < 20.0


def test_put_elsewhere_it_finds_itself_again():
    reads = ReadModel(1.0)
    recording, _, tags = simulated(CROSS, OmnidirectionalMotion(), 1, 15.0, reads)
    wrong = KnownStart(tuple(recording.true_poses[0] + [1537.0, 941.0, 1.0]))
    estimates, _ = tracked(Histogram(n_cells=61), Robot.of(CROSS, reads), wrong, recording, tags)
    assert np.hypot(*(estimates[-1, :2] - recording.true_poses[-1, :2])) < 20.0


@pytest.mark.parametrize("is_adaptive", [True, False])
def test_30_000_random_steps_leave_finite_numbers(is_adaptive):
    rng, n = np.random.default_rng(4), 30_000
    odometry = rng.normal(size=(n, 3)) * [20.0, 20.0, 0.1]
    odometry[rng.integers(n, size=50)] *= 1e4
    counts = rng.integers(0, 4, n) * (rng.random(n) < 0.5)
    read_start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    r = int(read_start[-1])
    tag_mm = rng.integers(0, 30, (r, 2)) * 100.0
    tag_mm[rng.integers(r, size=50)] *= 1e6
    recording = Recording(
        DT, np.zeros((n + 1, 3)), odometry, read_start, rng.integers(0, 8, r).astype(np.int32), np.zeros(r, np.int32),
        tag_mm, rng.random(r) * 0.2, rng.integers(-1, 99, r).astype(np.int32),
    )  # fmt: skip
    tags = build_tag_map(np.stack(np.meshgrid(np.arange(30), np.arange(30)), -1).reshape(-1, 2) * 100.0)
    settings = Histogram(MecanumMotion(), n_cells=9, n_headings=9, is_adaptive=is_adaptive)
    robot = Robot(make_layout("cross-8"), Disc(30.0), (30.0, 20.0), ReadModel(0.9, "multiplexed", answers="all"))
    estimates, state = tracked(settings, robot, KnownStart((1000.0, 1000.0, 0.0)), recording, tags)
    assert np.isfinite(estimates).all()
    assert (estimates[:, [3, 5, 8]] >= 0).all()
    assert histogram.share_lost(state) > 0


def test_step_by_step_it_is_what_it_is_over_a_recording():
    reads = ReadModel(0.9, "staggered", delay_s=0.02, answers="all")
    recording, start, tags = simulated(CROSS, OmnidirectionalMotion(), 0, 3.0, reads)
    settings, robot = Histogram(n_cells=41, n_headings=21), Robot.of(CROSS, reads)
    estimates, _ = tracked(settings, robot, start, recording, tags)
    ready = histogram.build(settings, robot, DT)
    state = histogram.init(ready, start, 3)
    for t in range(recording.n_steps):
        rows = slice(recording.read_start[t], recording.read_start[t + 1])
        state = histogram.predict(ready, state, recording.odometry[t])
        reads_now = Reads(
            recording.read_antenna[rows],
            recording.read_tag_mm[rows],
            recording.read_rssi[rows],
            recording.read_age_s[rows],
        )
        state = histogram.update(ready, state, reads_now, tags)
        assert (state.moments == estimates[t + 1]).all()


def test_a_covariance_is_a_sum_of_variances_along_steps_from_cell_to_cell():
    rng = np.random.default_rng(2)
    for _ in range(200):
        root = rng.normal(size=(2, 2))
        covariance = root @ root.T + 0.05 * np.trace(root @ root.T) * np.eye(2)
        terms = lattice_directions(covariance[0, 0], covariance[0, 1], covariance[1, 1])
        assert all(variance >= 0 for variance, _, _ in terms)
        total = sum(variance * np.outer(step, step) for variance, *step in terms)
        assert total == pytest.approx(covariance, abs=1e-8 * np.trace(covariance))


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"n_cells": 60}, "n_cells"), ({"n_headings": 40}, "n_headings"), ({"cell_mm": 0.0}, "cell_mm"),
        ({"read_probability": 1.0}, "read_probability"), ({"softness_mm": -1.0}, "softness_mm"),
        ({"n_cells": 1001, "n_headings": 41}, "n_cells"), ({"cell_rad": 0.3}, "cell_rad"),
    ],
)  # fmt: skip
def test_settings_out_of_bounds_are_named(changed, name):
    with pytest.raises(ValueError, match=name):
        Histogram(**changed)
