"""A survey says where tags lie as well as it claims, finds what was mixed up or is dead, and raises no alarm else."""

from dataclasses import replace

import numpy as np
import pytest

from rfiddesign.catalog import antenna
from rfiddesign.design import Design
from rfiddesign.estimators.tag_mapping.soft_grid import ReferenceDrift
from rfiddesign.estimators.tag_mapping.survey import DEAD, FOUND, MISPLACED, SWAPPED, UNSEEN, survey_tags
from rfiddesign.floor import rectangle_floor
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.robot import Robot
from rfiddesign.simulation.as_built import LaidFloor, LayingFaults, lay_floor
from rfiddesign.simulation.scenario import World
from rfiddesign.simulation.survey_drive import SurveyPlan, SurveyRobot, drive_lanes, drive_survey

CROSS = make_layout({"kind": "cross", "name": "cross-4", "readers_per_arm": 1, "first_mm": 210.0})
FLOOR = rectangle_floor(1800.0, 1600.0, 250.0)
READS = ReadModel(read_probability=0.98, polling="staggered")
REFERENCE = ReferenceDrift(20.0, 0.005, 10.0)


def design_of(layout=CROSS, tags_per_m2=25.0):
    return Design(layout, antenna("60x60"), make_pattern("square", tags_per_m2=tags_per_m2))


def surveyed(faults, seed=1, reference=REFERENCE, **plan):
    """A laid floor and its survey, by a robot with four antennas."""
    design = design_of()
    laid = lay_floor(design.pattern.lay(FLOOR.drivable), faults, seed)
    robot = SurveyRobot(design, World(reads=READS), reference)
    log = drive_survey(robot, FLOOR, laid, SurveyPlan(**plan), seed).log
    return laid, survey_tags(log, Robot.of(design, READS), laid.nominal_mm, max(faults.error_mm, 0.5), reference)


def errors_of(laid, found):
    """Errors (n, 2) of the tags that were read, and what was said of them (n, 2, 2)."""
    return (found.mean_mm - laid.true_mm)[found.is_read], found.covariance_mm2[found.is_read]


@pytest.fixture(scope="module")
def ten_passes():
    """Six floors laid to 20 mm, each surveyed in ten passes with 20 mm of pose error."""
    return [surveyed(LayingFaults(20.0), seed) for seed in range(6)]


def test_ten_passes_leave_less_than_16_mm(ten_passes):
    errors = np.concatenate([errors_of(*one)[0] for one in ten_passes])
    assert np.sqrt((errors**2).mean()) < 8.0
    assert np.sqrt((errors**2).sum(axis=1).mean()) < 16.0


def test_covariances_are_as_large_as_errors(ten_passes):
    """Normalized squared errors have mean 2 if covariances are right.

    Tags near each other share shifts of the reference, so that the mean of a floor scatters: six floors here.
    """
    squares = []
    for one in ten_passes:
        errors, covariances = errors_of(*one)
        squares.append(np.einsum("ni,nij,nj->n", errors, np.linalg.inv(covariances), errors))
    assert 1.2 < np.concatenate(squares).mean() < 2.4
    assert 0.85 < np.mean(np.concatenate(squares) < 5.99) <= 1.0


def test_a_survey_that_takes_correlated_passes_for_independent_ones_claims_too_much():
    """The reference's error lasts for the whole survey; who believes that it is new every second is wrong."""
    design, lasting, brief = design_of(), ReferenceDrift(20.0, 0.0, 3000.0), ReferenceDrift(20.0, 0.0, 1.0)
    ratios = {lasting: [], brief: []}
    for seed in range(4):
        laid = lay_floor(design.pattern.lay(FLOOR.drivable), LayingFaults(20.0), seed)
        robot = SurveyRobot(design, World(reads=READS), lasting)
        log = drive_survey(robot, FLOOR, laid, SurveyPlan(passes=4), seed).log
        for believed in ratios:
            found = survey_tags(log, Robot.of(design, READS), laid.nominal_mm, 20.0, believed)
            errors, covariances = errors_of(laid, found)
            ratios[believed].append(np.einsum("ni,nij,nj->n", errors, np.linalg.inv(covariances), errors).mean())
    assert np.mean(ratios[brief]) > 2.0 * np.mean(ratios[lasting])
    assert np.mean(ratios[brief]) > 5.0


def test_the_residual_falls_with_the_square_root_of_passes():
    """Where errors of the reference are new at each pass and the prior hardly helps."""
    residual = {}
    for passes in (3, 12):
        reference = ReferenceDrift(20.0, 0.0, 3.0)
        errors = [errors_of(*surveyed(LayingFaults(40.0), seed, reference, passes=passes))[0] for seed in range(2)]
        residual[passes] = np.sqrt(np.mean(np.concatenate(errors) ** 2))
    assert 1.6 < residual[3] / residual[12] < 2.5


def test_passes_along_one_line_tell_nothing_across_it():
    """One antenna over a row of tags: a tag to the left looks like one to the right; crossing lanes tell."""
    design = design_of(make_layout({"kind": "single", "name": "single"}))
    nominal = np.column_stack([np.arange(30) * 100.0, np.zeros(30)])
    laid = lay_floor(nominal, LayingFaults(20.0), 3)
    robot = SurveyRobot(design, World(reads=READS), REFERENCE)
    along = [np.array([[-200.0, 0.0], [3100.0, 0.0]])[:: (-1) ** k] for k in range(10)]
    across = [np.array([[x, -150.0], [x, 150.0]])[:: (-1) ** k] for k in range(5) for x in nominal[:, 0]]
    residual = {}
    for name, lanes in (("along", along), ("crossing", along[:5] + across)):
        drive = drive_lanes(robot, lanes, np.zeros(len(lanes), np.int64), laid, SurveyPlan(), 3)
        found = survey_tags(drive.log, Robot.of(design, READS), nominal, 20.0, REFERENCE)
        before, after = ((places - laid.true_mm)[found.is_read] for places in (nominal, found.mean_mm))
        residual[name] = np.sqrt((after**2).mean(axis=0) / (before**2).mean(axis=0))
    assert residual["along"][0] < 0.6
    assert residual["along"][1] > 0.85
    assert residual["crossing"][1] < 0.6


def test_a_clean_floor_raises_no_alarm(ten_passes):
    for _, found in ten_passes:
        assert set(found.status.tolist()) <= {FOUND, UNSEEN}
        assert found.n_unknown == 0
        assert found.swapped_pairs() == []


@pytest.mark.parametrize("error_mm", [5.0, 20.0])
def test_dead_and_swapped_tags_are_found(error_mm):
    """Among the tags that the robot passes over: two dead, two neighbours swapped, and two far from each other."""
    design = design_of()
    nominal = design.pattern.lay(FLOOR.drivable)
    inner = np.flatnonzero(np.abs(nominal - [900.0, 800.0]).max(axis=1) < 450.0)
    partner, is_dead = np.full(len(nominal), -1), np.zeros(len(nominal), bool)
    pairs = [(int(inner[0]), int(inner[1])), (int(inner[5]), int(inner[-1]))]
    for i, j in pairs:
        partner[i], partner[j] = j, i
    dead = inner[[7, 9]]
    is_dead[dead] = True
    errors = lay_floor(nominal, LayingFaults(error_mm), 4).true_mm - nominal
    laid = LaidFloor(nominal, np.where((partner >= 0)[:, None], nominal[partner], nominal) + errors, is_dead, partner)
    log = drive_survey(SurveyRobot(design, World(reads=READS), REFERENCE), FLOOR, laid, SurveyPlan(), 4).log
    found = survey_tags(log, Robot.of(design, READS), nominal, error_mm, REFERENCE)
    assert found.swapped_pairs() == pairs
    assert np.flatnonzero(found.status == DEAD).tolist() == dead.tolist()
    assert np.flatnonzero(found.status == SWAPPED).tolist() == sorted(i for pair in pairs for i in pair)
    assert np.hypot(*(found.mean_mm - laid.true_mm)[partner >= 0].T).max() < 40.0
    kept, places = found.map_mm
    assert set(range(len(nominal))) - set(kept.tolist()) == set(dead.tolist())
    assert np.array_equal(places, found.mean_mm[kept])
    assert np.array_equal(found.mapped.over(nominal)[found.is_read], found.mean_mm[found.is_read])
    assert set(found.mapped.tag_id.tolist()).isdisjoint(dead.tolist())


def test_a_tag_swapped_with_one_at_the_wall_is_not_taken_for_dead():
    """It lies where the robot hardly comes, and the other one in its stead: nobody read it, which is no wonder."""
    design = design_of()
    nominal = design.pattern.lay(FLOOR.drivable)
    middle, corner = (int(np.argmin(np.hypot(*(nominal - place).T))) for place in ([900.0, 800.0], [0.0, 0.0]))
    partner = np.full(len(nominal), -1)
    partner[[middle, corner]] = corner, middle
    laid = LaidFloor(
        nominal, np.where((partner >= 0)[:, None], nominal[partner], nominal), np.zeros(len(nominal), bool), partner
    )
    log = drive_survey(SurveyRobot(design, World(reads=READS), REFERENCE), FLOOR, laid, SurveyPlan(), 4).log
    found = survey_tags(log, Robot.of(design, READS), nominal, 5.0, REFERENCE)
    assert (found.status[middle], found.status[corner]) == (UNSEEN, MISPLACED)
    assert found.mean_mm[middle] == pytest.approx(nominal[corner])


def test_a_tag_that_lies_where_none_should_is_misplaced_and_found_there():
    design = design_of()
    nominal = design.pattern.lay(FLOOR.drivable)
    laid = lay_floor(nominal, LayingFaults(5.0), 2)
    middle = int(np.argmin(np.hypot(*(nominal - [900.0, 800.0]).T)))
    true = laid.true_mm.copy()
    true[middle] += (95.0, -110.0)
    moved = LaidFloor(nominal, true, laid.is_dead, laid.partner)
    log = drive_survey(SurveyRobot(design, World(reads=READS), REFERENCE), FLOOR, moved, SurveyPlan(), 2).log
    found = survey_tags(log, Robot.of(design, READS), nominal, 5.0, REFERENCE)
    assert np.flatnonzero(found.status == MISPLACED).tolist() == [middle]
    assert np.hypot(*(found.mean_mm[middle] - true[middle])) < 25.0


@pytest.mark.parametrize("laid_to", [5.0, 20.0])
def test_a_survey_tells_how_well_a_floor_was_laid_whatever_was_declared(laid_to):
    design = design_of()
    laid = lay_floor(design.pattern.lay(FLOOR.drivable), LayingFaults(laid_to, 0.03, 2), 1)
    log = drive_survey(SurveyRobot(design, World(reads=READS), REFERENCE), FLOOR, laid, SurveyPlan(), 1).log
    for declared in (5.0, 20.0):
        found = survey_tags(log, Robot.of(design, READS), laid.nominal_mm, declared, REFERENCE)
        assert found.laid_mm == pytest.approx(laid_to, rel=0.35)
        assert found.is_as_declared == (declared == laid_to)


def test_a_well_laid_floor_is_not_doubted_for_lying_too_well():
    """Of 0.5 mm nothing is seen in the scatter of reads, which is said too large where the reference is good."""
    _, found = surveyed(LayingFaults(0.5), reference=ReferenceDrift(1.0, 0.001, 10.0), passes=4)
    assert found.is_as_declared
    assert found.laid_mm < 2.0 * found.scatter_mm


def test_a_log_without_a_read_of_a_planned_tag_is_refused():
    design = design_of()
    laid = lay_floor(design.pattern.lay(FLOOR.drivable), LayingFaults(5.0), 2)
    log = drive_survey(SurveyRobot(design, World(reads=READS), REFERENCE), FLOOR, laid, SurveyPlan(passes=1), 2).log
    strangers = replace(log, read_tag=log.read_tag + 1_000_000)
    told = f"log: no read of a planned tag; {len(log.read_tag):,} reads of ids that the plan does not have"
    with pytest.raises(ValueError, match=told):
        survey_tags(strangers, Robot.of(design, READS), laid.nominal_mm, 5.0, REFERENCE)


def test_reads_of_unknown_tags_are_counted_and_left_out():
    design = design_of()
    nominal = design.pattern.lay(FLOOR.drivable)
    laid = lay_floor(nominal, LayingFaults(5.0), 2)
    log = drive_survey(SurveyRobot(design, World(reads=READS), REFERENCE), FLOOR, laid, SurveyPlan(passes=2), 2).log
    known = survey_tags(log, Robot.of(design, READS), nominal[:-10], 5.0, REFERENCE)
    assert known.n_unknown == np.count_nonzero(log.read_tag >= len(nominal) - 10) > 0
    assert len(known.status) == len(nominal) - 10


def test_threads_find_the_same():
    from concurrent.futures import ThreadPoolExecutor

    design = design_of()
    laid = lay_floor(design.pattern.lay(FLOOR.drivable), LayingFaults(20.0, 0.05), 1)
    log = drive_survey(SurveyRobot(design, World(reads=READS), REFERENCE), FLOOR, laid, SurveyPlan(passes=2), 1).log
    robot = Robot.of(design, READS)
    alone = survey_tags(log, robot, laid.nominal_mm, 20.0, REFERENCE)
    with ThreadPoolExecutor(2) as pool:
        shared = survey_tags(log, robot, laid.nominal_mm, 20.0, REFERENCE, pool.map)
    assert np.array_equal(alone.mean_mm, shared.mean_mm)
    assert np.array_equal(alone.status, shared.status)


def test_a_reader_that_never_fails_is_refused():
    design = design_of()
    laid = lay_floor(design.pattern.lay(FLOOR.drivable), LayingFaults(5.0), 1)
    log = drive_survey(SurveyRobot(design, World(reads=READS), REFERENCE), FLOOR, laid, SurveyPlan(passes=1), 1).log
    with pytest.raises(ValueError, match="read_probability is 1"):
        survey_tags(log, Robot.of(design, replace(READS, read_probability=1.0)), laid.nominal_mm, 5.0, REFERENCE)
