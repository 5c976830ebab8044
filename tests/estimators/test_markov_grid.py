"""The grid under motion and reads: its moments are those of the Gaussians that they stand for."""

import math

import numpy as np
import pytest

from rfiddesign.estimators import _markov_belief_kernels as kernels
from rfiddesign.estimators import _markov_grid_kernels as grid_kernels
from rfiddesign.estimators import markov
from rfiddesign.estimators.markov import Markov
from rfiddesign.estimators.start import UncertainStart
from rfiddesign.geometry import Disc, PolygonArea, compose, listed
from rfiddesign.models.motion import DifferentialMotion, MecanumMotion, OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.recording import Reads
from rfiddesign.models.robot import Robot
from tests.estimators.markov_drives import DT, NO_NOISE, OWN, SINGLE, a_drive, a_recording, drawn, tracked
from tests.estimators.numpy_markov import NumpyMarkov


@pytest.mark.parametrize("seed", range(12))
def test_a_blur_keeps_all_mass_and_has_the_exact_second_moments(seed):
    rng = np.random.Generator(np.random.PCG64(seed))
    angle, large = rng.uniform(0, math.pi), rng.uniform(0.01, 4.0)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    wanted = turn @ np.diag([large, large * rng.uniform(1 / 50, 1.0)]) @ turn.T
    n = 141
    grids = np.zeros((2, n, n))
    grids[0, n // 2, n // 2] = 1.0
    which, *got = grid_kernels.blur(
        grids, 0, wanted[0, 0], wanted[0, 1], wanted[1, 1], np.empty((3, 3)), np.empty(2 * grid_kernels.MOST_TAPS + 3)
    )
    steps = np.arange(n) - n // 2
    mass = grids[which]
    x, y = np.meshgrid(steps, steps)
    assert mass.min() >= 0.0
    assert mass.sum() == pytest.approx(1.0, abs=1e-13)
    assert abs((mass * x).sum()) < 1e-12
    assert abs((mass * y).sum()) < 1e-12
    moments = [(mass * x * x).sum(), (mass * x * y).sum(), (mass * y * y).sum()]
    assert moments == pytest.approx(wanted[[0, 0, 1], [0, 1, 1]], abs=1e-11)
    assert got == pytest.approx(moments, abs=1e-11)


def test_a_blur_along_a_line_that_no_cells_follow_is_an_eighth_as_wide_as_long_and_throws_no_mass_away():
    angle = 0.47
    line = np.array([math.cos(angle), math.sin(angle)])
    wanted, n = 2.0 * np.outer(line, line), 141
    grids = np.zeros((2, n, n))
    grids[0, n // 2, n // 2] = 1.0
    which, xx, xy, yy = grid_kernels.blur(
        grids, 0, wanted[0, 0], wanted[0, 1], wanted[1, 1], np.empty((3, 3)), np.empty(2 * grid_kernels.MOST_TAPS + 3)
    )
    values = np.linalg.eigvalsh([[xx, xy], [xy, yy]])
    assert values == pytest.approx([2.0 / 64, 2.0])
    rows, columns = np.nonzero(grids[which] > 1e-6)
    assert max(np.abs(rows - n // 2).max(), np.abs(columns - n // 2).max()) < 20


@pytest.mark.parametrize("motion", [OmnidirectionalMotion(60.0, 20.0, 0.05), MecanumMotion(), DifferentialMotion()])
@pytest.mark.parametrize("step", [(7.3, 0.0), (0.0, -6.1), (4.4, 5.5)], ids=["forward", "sideways", "oblique"])
def test_motion_moves_the_mean_exactly_and_spreads_the_grid_as_a_persistent_heading_error_does(motion, step):
    """Against F P F' + Q of the pose, the grid at its last blur; a cell is 100 mm^2."""
    start = np.diag([400.0, 400.0, 0.03**2])
    ready = markov.build(Markov(motion=motion), SINGLE, DT)
    state = markov.init(ready, UncertainStart((12.3, -4.5, 0.7), tuple(map(tuple, start))), 1)
    pose, covariance = np.array([12.3, -4.5, 0.7]), start
    for _ in range(60):
        increment = np.array([*step, 0.01])
        c, s = math.cos(pose[2]), math.sin(pose[2])
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        way = turn @ increment
        moved = np.eye(3)
        moved[:2, 2] = -way[1], way[0]
        rates = motion.noise(DT)
        noise = rates[:, 0] + rates[:, 1] * math.hypot(*step) + rates[:, 2] * 0.01
        covariance = moved @ covariance @ moved.T + turn @ np.diag(noise) @ turn.T
        pose = compose(pose, increment)
        state = markov.update(ready, markov.predict(ready, state, increment), Reads())
    told = markov.estimate(state)
    assert told.pose == pytest.approx(pose, abs=1e-9)
    assert told.covariance == pytest.approx(covariance, rel=1e-6, abs=1e-4)
    numbers = state.arrays[0]
    due = numbers[[kernels.DUE_XX, kernels.DUE_XY, kernels.DUE_XY, kernels.DUE_YY]].reshape(2, 2)
    masses, x, y = markov.grid(ready, state)
    assert (masses.sum(axis=0) @ x, masses.sum(axis=1) @ y) == pytest.approx(pose[:2], abs=1e-9)
    spread = [
        [masses.sum(axis=0) @ (x - pose[0]) ** 2, (y - pose[1]) @ masses @ (x - pose[0])],
        [(y - pose[1]) @ masses @ (x - pose[0]), masses.sum(axis=1) @ (y - pose[1]) ** 2],
    ]
    assert np.array(spread) + due == pytest.approx(covariance[:2, :2], rel=1e-4)


def test_a_robot_that_drives_back_gets_back_what_its_heading_cost():
    """The way out and back is no way: the heading's error moves nothing.  No blur came between."""
    ready, state = drawn(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.05**2)))
    for way in [10.0] * 35 + [-10.0] * 35:
        state = markov.update(ready, markov.predict(ready, state, np.array([way, 0.0, 0.0])), Reads())
    told = markov.estimate(state)
    assert told.pose == pytest.approx(np.zeros(3), abs=1e-9)
    assert told.covariance[:2, :2] == pytest.approx(OWN * np.eye(2))
    assert told.covariance[:2, 2] == pytest.approx(np.zeros(2), abs=1e-12)


@pytest.mark.parametrize("covariance", [((900.0, 200.0), (200.0, 400.0)), ((60.0, 40.0), (40.0, 90.0))])
def test_a_read_is_the_product_of_two_gaussians(covariance):
    """The second belief is narrower than a cell: it is blurred to, not drawn."""
    prior = np.zeros((3, 3))
    prior[:2, :2] = covariance
    ready, state = drawn(tuple(map(tuple, prior)))
    tag = np.array([43.0, -18.0])
    told = markov.estimate(markov.update(ready, state, Reads(np.array([0]), tag[None])))
    gain = prior[:2, :2] @ np.linalg.inv(prior[:2, :2] + 2500.0 * np.eye(2))
    assert told.pose == pytest.approx([*(gain @ tag), 0.0], abs=0.1)
    assert told.covariance[:2, :2] == pytest.approx((np.eye(2) - gain) @ prior[:2, :2], abs=0.8)


def test_an_antenna_off_the_centre_is_where_the_heading_has_it():
    """From the middle of what it sees; a vague heading makes the place vague by its arm."""
    area = PolygonArea(((0.0, -30.0), (90.0, -30.0), (90.0, 30.0), (0.0, 30.0)))
    robot = Robot(listed([(100.0, 50.0, 1.2)]), area)
    wide, heading = 1e6, 0.8
    place = np.array([100 + 45 * math.cos(1.2), 50 + 45 * math.sin(1.2)])
    turn = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
    spread = {}
    for sigma in (0.0, 0.1):
        ready = markov.build(Markov(motion=NO_NOISE, n_cells=201), robot, DT)
        start = UncertainStart((0.0, 0.0, heading), ((wide, 0.0, 0.0), (0.0, wide, 0.0), (0.0, 0.0, sigma**2)))
        tag = turn @ place + (21.0, -13.0)
        told = markov.estimate(markov.update(ready, markov.init(ready, start, 1), Reads(np.array([0]), tag[None])))
        assert told.pose[:2] == pytest.approx([21.0, -13.0], abs=0.2)
        spread[sigma] = told.covariance[0, 0]
    assert spread[0.1] - spread[0.0] == pytest.approx(0.01 * place @ place, rel=0.05)


def test_the_filter_is_its_twin_in_numpy():
    motion, rng = MecanumMotion(40.0, 25.0, 0.03, 0.05), np.random.Generator(np.random.PCG64(8))
    robot = Robot(listed([(60.0, 20.0, 0.0), (-40.0, 0.0, 0.0)]), Disc(60.0), reads=ReadModel(delay_s=0.02))
    settings = Markov(motion=motion, n_cells=81, baseline_mm=150.0)
    poses, odometry = a_drive(rng, 150, motion, sideways=4.0)
    recording = a_recording(rng, poses, odometry, robot.layout.poses_mm, 30.0, share=0.15, age=0.03)
    pose, covariance = np.array([8.0, -6.0, 0.05]), np.array([[120.0, 30, 0.1], [30, 200.0, -0.2], [0.1, -0.2, 0.004]])
    ready = markov.build(settings, robot, DT)
    start = UncertainStart(tuple(pose), tuple(map(tuple, covariance)))
    _, rows = tracked(ready, start, recording)
    twin = NumpyMarkov(ready, pose, covariance)
    for t in range(150):
        reads = slice(recording.read_start[t], recording.read_start[t + 1])
        twin.predict(odometry[t])
        twin.update(
            recording.read_antenna[reads], recording.read_tag_mm[reads], odometry[t], recording.read_age_s[reads]
        )
        assert rows[t + 1, :3] == pytest.approx(twin.pose, abs=1e-4), t
        told = rows[t + 1, [3, 4, 6, 4, 5, 7, 6, 7, 8]].reshape(3, 3)
        assert told == pytest.approx(twin.covariance, rel=1e-4, abs=1e-4), t
    assert recording.n_reads > 30
