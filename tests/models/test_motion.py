"""Noise of the odometry, and what is wrong with it: as models state it, and found again in what robots record."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from rfiddesign.catalog import Antenna
from rfiddesign.design import Design
from rfiddesign.floor import build_tag_map
from rfiddesign.geometry import Disc, ListedPattern, compose, single
from rfiddesign.models._motion_kernels import step_deviations, step_variances
from rfiddesign.models.motion import DifferentialMotion, MecanumMotion, OdometryFaults, OmnidirectionalMotion
from rfiddesign.simulation.record import record
from rfiddesign.simulation.run import key_of
from rfiddesign.simulation.scenario import World

DT = 0.05
QUIET = OmnidirectionalMotion(0.0, 0.0, 0.0)
NO_TAG = np.array([[1e6, 1e6]])
DESIGN = Design(single(), Antenna("test", (1.0, 1.0), Disc(30.0), "test"), ListedPattern(NO_TAG))
ways = st.floats(-500, 500)
turns = st.floats(-3, 3)
sigmas = st.floats(0, 100)


def recorded(steps, motion=QUIET, key=1, **faults):
    """True and reported increments (n, 3) of a robot that moves by these steps, in its own frame."""
    poses = [np.array([100.0, -50.0, 0.7])]
    for step in np.asarray(steps, float):
        # Headings are not wrapped, as the simulated robot's are not.
        poses.append(np.array([*compose(poses[-1], step)[:2], poses[-1][2] + step[2]]))
    world = World(motion, faults=OdometryFaults(**faults))
    odometry = record(DESIGN, build_tag_map(NO_TAG), np.array(poses), DT, world, key_of(3, key)).odometry
    return np.asarray(steps, float), odometry


def random_steps(n, seed=0):
    return np.random.Generator(np.random.PCG64(seed)).normal(0, [15, 8, 0.1], (n, 3))


def assert_variance(values, variance):
    """A sum of squares within its chi-square band; values without variance are none."""
    if variance == 0:
        assert np.abs(values).max() < 1e-9
        return
    low, high = stats.chi2.ppf([1e-5, 1 - 1e-5], values.size)
    assert low < np.sum(values**2) / variance < high


# What the models state


def test_white_velocity_noise_of_eq_1_scales_with_the_step():
    motion = OmnidirectionalMotion(20.0, 30.0, 0.1)
    for dt_s, deviations in ((0.05, (1.0, 1.5, 0.005)), (0.1, (2.0, 3.0, 0.01))):
        noise = motion.noise(dt_s)
        for step in ((0.0, 0.0, 0.0), (50.0, -20.0, 1.0)):
            assert step_deviations(noise, *step) == pytest.approx(deviations)


@given(x=sigmas, y=sigmas, per_way=st.floats(0, 1), per_turn=st.floats(0, 1), dx=ways, dy=ways, turn=turns)
def test_mecanum_variances_are_in_proportion_to_way_and_turn(x, y, per_way, per_turn, dx, dy, turn):
    noise = MecanumMotion(x, y, per_way, per_turn).noise(DT)
    way_m = math.hypot(dx, dy) / 1000
    expected = (x**2 * way_m, y**2 * way_m, per_way**2 * way_m + per_turn**2 * abs(turn))
    assert step_variances(noise, dx, dy, turn) == pytest.approx(expected, rel=1e-12)


@given(k=sigmas, track=st.floats(50, 2000), d=ways, turn=turns)
def test_differential_variances_are_those_of_two_wheels(k, track, d, turn):
    """Exact for a straight way and a turn on the spot; else at most twice what the wheels' ways make, never less."""
    noise = DifferentialMotion(k, track).noise(DT)

    def of_wheels(way, turn):
        both = k**2 * (abs(way + track * turn / 2) + abs(way - track * turn / 2)) / 1000
        return np.array([both / 4, 0.0, both / track**2])

    for step in ((d, 0.0), (0.0, turn)):
        assert step_variances(noise, step[0], 0.0, step[1]) == pytest.approx(of_wheels(*step), rel=1e-9)
    stated, least = np.array(step_variances(noise, d, 0.0, turn)), of_wheels(d, turn)
    assert (stated >= least * (1 - 1e-9) - 1e-99).all()
    assert (stated <= 2 * least * (1 + 1e-9)).all()
    assert stated[1] == 0.0


def test_a_robot_that_stands_has_no_noise_of_way_and_turn():
    for motion in (MecanumMotion(), DifferentialMotion()):
        assert step_variances(motion.noise(DT), 0.0, 0.0, 0.0) == (0.0, 0.0, 0.0)


def test_noise_of_a_long_step_stays_below_half_a_turn():
    noise = MecanumMotion(noise_heading_rad_per_sqrt_m=10.0).noise(DT)
    assert step_deviations(noise, 1e4, 0.0, 0.0)[2] == 0.49


# What robots record

MOTIONS = [
    MecanumMotion(10.0, 25.0, 0.02, 0.05),
    DifferentialMotion(12.0, 350.0),
    OmnidirectionalMotion(20.0, 30.0, 0.1),
]


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: type(motion).__name__)
def test_recorded_noise_has_the_variances_of_its_model(motion):
    kinds = [(20.0, 0.0, 0.0), (0.0, 0.0, 0.3), (80.0, 0.0, 0.0), (-30.0, 0.0, -0.2), (0.0, 40.0, 0.0)]
    n = 4000
    true, reported = recorded(np.repeat(kinds, n, axis=0), motion)
    for k, kind in enumerate(kinds):
        noise = (reported - true)[k * n : (k + 1) * n]
        for axis, variance in enumerate(step_variances(motion.noise(DT), *kind)):
            assert_variance(noise[:, axis], variance)


def test_recorded_differential_noise_has_none_sideways():
    true, reported = recorded(random_steps(2000), DifferentialMotion())
    assert np.abs(reported - true)[:, 1].max() < 1e-9
    assert np.abs(reported - true)[:, [0, 2]].min(axis=0).max() > 0


def test_noise_of_a_step_is_the_same_however_the_model_shapes_it():
    """One draw per step and axis: paired comparison between motion models, and between faults and none."""
    steps = random_steps(500)
    draws = []
    for motion in MOTIONS:
        true, reported = recorded(steps, motion)
        deviations = np.array([step_deviations(motion.noise(DT), *step) for step in steps])
        draws.append((reported - true)[:, [0, 2]] / deviations[:, [0, 2]])
    assert draws[0] == pytest.approx(draws[1], abs=1e-6)
    assert draws[0] == pytest.approx(draws[2], abs=1e-6)
    with_faults = recorded(steps, MOTIONS[0], scale_x=0.1, slips_per_m=20.0, slip_mm=30.0)[1]
    faults_alone = recorded(steps, scale_x=0.1, slips_per_m=20.0, slip_mm=30.0)[1] - recorded(steps)[1]
    assert with_faults - recorded(steps, MOTIONS[0])[1] == pytest.approx(faults_alone, abs=1e-9)


# Faults


@given(scale_x=st.floats(-0.5, 0.5), scale_y=st.floats(-0.5, 0.5), drift=st.floats(-10, 10), seed=st.integers(0, 99))
def test_scale_errors_and_drift_are_found_again_in_every_step(scale_x, scale_y, drift, seed):
    true, reported = recorded(random_steps(20, seed), scale_x=scale_x, scale_y=scale_y, drift_rad_per_m=drift)
    assert reported[:, 0] == pytest.approx((1 + scale_x) * true[:, 0], abs=1e-9)
    assert reported[:, 1] == pytest.approx((1 + scale_y) * true[:, 1], abs=1e-9)
    way_m = np.hypot(*true[:, :2].T) / 1000
    assert reported[:, 2] - true[:, 2] == pytest.approx(drift * way_m, abs=1e-9)


def test_a_drift_turns_the_reported_route():
    """10 m straight on with 0.12 degrees per metre: the odometry thinks that it has turned by 1.2 degrees."""
    _, reported = recorded([(50.0, 0.0, 0.0)] * 200, drift_rad_per_m=math.radians(0.12))
    end = np.zeros(3)
    for step in reported:
        end = compose(end, step)
    assert math.degrees(end[2]) == pytest.approx(1.2)
    assert end[1] == pytest.approx(10_000 * math.radians(1.2) / 2, rel=0.02)


@pytest.mark.parametrize("way", [5.0, 40.0])
def test_slips_come_at_their_rate_per_metre_and_never_shorten_the_reported_way(way):
    n, rate, slip_mm, slip_rad = 40_000, 2.0, 15.0, 0.05
    angles = np.random.Generator(np.random.PCG64(1)).uniform(-np.pi, np.pi, n)
    steps = np.column_stack([way * np.cos(angles), way * np.sin(angles), np.full(n, 0.01)])
    true, reported = recorded(steps, slips_per_m=rate, slip_mm=slip_mm, slip_rad=slip_rad)
    excess = np.hypot(*reported[:, :2].T) - way
    assert excess.min() > -1e-9
    is_slip = excess > 1e-6
    chance = rate * way / 1000
    assert abs(is_slip.sum() - n * chance) < 4.5 * math.sqrt(n * chance * (1 - chance))
    assert_variance(excess[is_slip], slip_mm**2)
    assert_variance((reported - true)[is_slip, 2], slip_rad**2)
    assert np.abs(reported - true)[~is_slip].max() < 1e-9
    # Ahead: the reported way has the direction of the true one.
    across = true[:, 0] * reported[:, 1] - true[:, 1] * reported[:, 0]
    assert np.abs(across).max() < 1e-6
    assert abs(np.corrcoef(excess[is_slip], (reported - true)[is_slip, 2])[0, 1]) < 4.5 / math.sqrt(is_slip.sum())


def test_slips_of_a_way_are_as_many_whatever_its_steps():
    """10 m in steps of 1 mm or 20 mm: the rate is one of the way, not of time."""
    counts = []
    for way in (1.0, 20.0):
        steps = np.tile([way, 0.0, 0.0], (round(100_000 / way), 1))
        true, reported = recorded(steps, slips_per_m=5.0, slip_mm=10.0)
        counts.append(np.count_nonzero(reported[:, 0] - true[:, 0] > 1e-6))
    for count in counts:
        assert abs(count - 500) < 4.5 * math.sqrt(500)


def test_a_robot_that_stands_or_turns_on_the_spot_does_not_slip():
    _, reported = recorded([(0.0, 0.0, 0.1)] * 2000, slips_per_m=1000.0, slip_mm=50.0, slip_rad=0.5)
    assert np.abs(reported - [0.0, 0.0, 0.1]).max() < 1e-9


# Bounds

NEGATIVE_OR_WILD = [-1.0, math.nan, math.inf]


@pytest.mark.parametrize(
    ("make", "name"),
    [(model, name) for model in (OmnidirectionalMotion, MecanumMotion) for name in model.__dataclass_fields__]
    + [(DifferentialMotion, "wheel_noise_mm_per_sqrt_m")]
    + [(OdometryFaults, name) for name in ("slips_per_m", "slip_mm", "slip_rad")],
)
@pytest.mark.parametrize("value", NEGATIVE_OR_WILD)
def test_noise_and_slips_are_finite_and_not_negative(make, name, value):
    with pytest.raises(ValueError, match=rf"^{name} is {value}, must be at least 0 and at most"):
        make(**{name: value})


@pytest.mark.parametrize(
    ("make", "name", "value", "bound"),
    [
        (DifferentialMotion, "track_mm", 5.0, "10"),
        (DifferentialMotion, "track_mm", math.nan, "10"),
        (OdometryFaults, "scale_x", -0.6, "-0.5"),
        (OdometryFaults, "scale_y", 0.6, "0.5"),
        (OdometryFaults, "drift_rad_per_m", 11.0, "10"),
        (OdometryFaults, "slip_rad", 4.0, "3.14"),
        (OdometryFaults, "slips_per_m", 1e4, "1000"),
    ],
)
def test_a_bad_argument_is_named_with_its_value_and_bound(make, name, value, bound):
    with pytest.raises(ValueError, match=rf"^{name} is {value}, must be .*{bound}"):
        make(**{name: value})
