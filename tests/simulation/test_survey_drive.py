"""Survey drives: lanes cover the floor both ways, and the log tells what happened but for the reference's error."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators.tag_mapping.soft_grid import ReferenceDrift
from rfiddesign.floor import floor_from_polygon, rectangle_floor
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.survey_files import read_survey_log, write_survey_log
from rfiddesign.simulation.as_built import LayingFaults, lay_floor
from rfiddesign.simulation.scenario import World
from rfiddesign.simulation.survey_drive import SurveyPlan, SurveyRobot, drive_survey, lanes_of

FLOOR = rectangle_floor(2000.0, 1500.0, 300.0)
DESIGN = Design(make_layout("cross-8"), antenna("60x60"), make_pattern("square", tags_per_m2=36.0))
ROBOT = SurveyRobot(DESIGN, World(reads=ReadModel(polling="staggered")), ReferenceDrift(20.0, 0.01, 5.0))
LAID = lay_floor(DESIGN.pattern.lay(FLOOR.drivable), LayingFaults(10.0, 0.1), 1)


def test_lanes_lie_where_the_robot_may_be_and_every_place_is_near_one_of_each_direction():
    hole = shapely.box(1500.0, 1200.0, 2300.0, 1700.0)
    floor = floor_from_polygon(shapely.box(0, 0, 4000, 3000), [hole], 300.0)
    lanes, passes = lanes_of(floor, SurveyPlan(passes=4, lane_pitch_mm=200.0))
    lines = [shapely.LineString(lane) for lane in lanes]
    assert all(line.within(floor.navigable.buffer(1e-6)) for line in lines)
    places = [shapely.Point(place) for place in np.random.default_rng(1).uniform([300, 300], [3700, 2700], (200, 2))]
    for number in range(4):
        mine = shapely.unary_union([line for line, one in zip(lines, passes, strict=True) if one == number])
        is_flat = [np.ptp(lane[:, 1]) == 0 for lane, one in zip(lanes, passes, strict=True) if one == number]
        assert all(is_flat) == (number % 2 == 0)
        assert all(mine.distance(place) <= 200.0 for place in places if place.within(floor.navigable.buffer(-200)))


def test_lanes_are_driven_to_and_fro_and_shifted_from_pass_to_pass():
    lanes, passes = lanes_of(FLOOR, SurveyPlan(passes=3, lane_pitch_mm=100.0, directions="along x"))
    ways = np.array([lane[1, 0] - lane[0, 0] for lane in lanes])
    for number in range(3):
        mine = ways[passes == number]
        assert np.array_equal(np.sign(mine[1:]), -np.sign(mine[:-1]))
    first = [lanes[int(np.flatnonzero(passes == number)[0])][0, 1] for number in range(3)]
    assert np.diff(first) == pytest.approx([100.0 / 3] * 2)


def test_reads_happen_where_the_robot_was_in_truth():
    drive = drive_survey(ROBOT, FLOOR, LAID, SurveyPlan(passes=2), 1)
    truth = replace(drive.log, poses=drive.true_poses).polls(DESIGN.layout)
    distance = np.hypot(*(truth.antenna_poses[truth.read_poll, :2] - LAID.true_mm[truth.read_tag]).T)
    assert len(distance) > 1000
    # Poses are interpolated between those at the ends of steps, as the robot drove.
    assert distance.max() <= DESIGN.antenna.area.radius_mm + 0.01
    assert not LAID.is_dead[truth.read_tag].any()


@pytest.mark.parametrize("reads", [
    ReadModel(), ReadModel(polling="staggered"), ReadModel(polling="multiplexed", poll_s=0.02),
    ReadModel(polling="multiplexed", poll_s=0.1), ReadModel(answers="all", read_probability=0.9),
], ids=["common", "staggered", "multiplexed", "slow", "all"])  # fmt: skip
def test_every_read_is_of_a_poll_whatever_the_schedule(reads):
    robot = replace(ROBOT, world=World(reads=reads))
    drive = drive_survey(robot, FLOOR, LAID, SurveyPlan(passes=1), 1)
    polls = drive.log.polls(DESIGN.layout)
    schedule = reads.schedule(8, 0.05)
    n_steps = np.bincount(drive.log.stretch) - 1
    expected = sum(np.count_nonzero(np.arange(n) % schedule.period == slot) for n in n_steps for slot in schedule.slots)
    assert len(polls.time_s) == expected
    truth = replace(drive.log, poses=drive.true_poses).polls(DESIGN.layout)
    distance = np.hypot(*(truth.antenna_poses[truth.read_poll, :2] - LAID.true_mm[truth.read_tag]).T)
    assert distance.max() <= DESIGN.antenna.area.radius_mm + 0.01


def test_the_reference_is_off_by_as_much_as_declared_and_for_as_long():
    drive = drive_survey(ROBOT, FLOOR, LAID, SurveyPlan(passes=40), 1)
    errors = drive.log.poses - drive.true_poses
    assert errors[:, :2].std(axis=0) == pytest.approx([20.0, 20.0], rel=0.15)
    assert errors[:, 2].std() == pytest.approx(0.01, rel=0.15)
    assert abs(np.corrcoef(errors[:, 0], errors[:, 1])[0, 1]) < 0.2
    lag = 50  # steps: 2.5 s of one lane
    is_one_lane = drive.log.stretch[lag:] == drive.log.stretch[:-lag]
    ahead, behind = errors[lag:][is_one_lane, 0], errors[:-lag][is_one_lane, 0]
    assert np.corrcoef(ahead, behind)[0, 1] == pytest.approx(math.exp(-2.5 / 5.0), abs=0.12)


def test_the_way_between_lanes_takes_its_time():
    plan = SurveyPlan(passes=2, lane_pitch_mm=200.0, speed_mm_per_s=200.0, turn_rate_rad_per_s=0.5)
    drive = drive_survey(ROBOT, FLOOR, LAID, plan, 1)
    driving = drive.log.driven_mm / 200.0
    n_lanes = len(drive.lane_pass)
    assert drive.duration_s > driving + 0.9 * (n_lanes - 1) * (math.pi / 0.5)
    assert drive.log.driven_mm == pytest.approx(5 * 1400 + 7 * 900, rel=0.25)


def test_the_first_passes_are_a_log_of_their_own():
    drive = drive_survey(ROBOT, FLOOR, LAID, SurveyPlan(passes=3), 1)
    early = drive.first_passes(2)
    assert set(drive.lane_pass[np.unique(early.stretch)]) == {0, 1}
    assert len(early.read_tag) == np.count_nonzero(drive.log.read_time_s <= early.time_s[-1])
    assert drive.first_passes(3).time_s[-1] == drive.log.time_s[-1]


def test_a_simulated_survey_is_written_and_read_as_a_recorded_one(tmp_path):
    log = drive_survey(ROBOT, FLOOR, LAID, SurveyPlan(passes=1), 1).log
    write_survey_log(tmp_path, log)
    again = read_survey_log(tmp_path)
    ours, theirs = log.polls(DESIGN.layout), again.polls(DESIGN.layout)
    assert np.array_equal(ours.read_tag, theirs.read_tag)
    assert np.array_equal(ours.read_poll, theirs.read_poll)
    assert theirs.antenna_poses == pytest.approx(ours.antenna_poses, abs=2e-3)


def test_the_same_seed_drives_the_same_survey():
    one, other = (drive_survey(ROBOT, FLOOR, LAID, SurveyPlan(passes=1), 5).log for _ in range(2))
    assert all(np.array_equal(a, b) for a, b in zip(one.arrays, other.arrays, strict=True))


@pytest.mark.parametrize(
    ("change", "told"),
    [({"passes": 0}, "passes"), ({"lane_pitch_mm": 1.0}, "lane_pitch_mm"), ({"directions": "up"}, "directions"),
     ({"speed_mm_per_s": 0.0}, "speed_mm_per_s"), ({"dt_s": 1.5}, "dt_s")],
)  # fmt: skip
def test_a_plan_out_of_bounds_is_refused(change, told):
    with pytest.raises(ValueError, match=told):
        SurveyPlan(**change)


@pytest.mark.parametrize(
    ("change", "told"), [({"speed_mm_per_s": 1.0}, "5,000,000"), ({"lane_pitch_mm": 10.0}, "100,000")]
)
def test_a_survey_that_takes_too_long_is_refused_before_it_is_driven(change, told):
    with pytest.raises(ValueError, match=f"at most {told} are allowed"):
        drive_survey(ROBOT, FLOOR, LAID, SurveyPlan(passes=1000, **change), 1)
