"""A study with a survey: the floor of its answer is surveyed, driven over with each map, and advised on."""

import csv
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rfiddesign.cli.survey import survey_lines, survey_of, survey_summary
from rfiddesign.errors import StudyError
from rfiddesign.estimators.tag_mapping.survey import SurveyedTags
from rfiddesign.models.survey_files import write_survey_log
from rfiddesign.report import write_report
from rfiddesign.results.folder import read_record
from rfiddesign.results.study_result import ChosenDesign
from rfiddesign.results.survey import SurveyRecord
from rfiddesign.study import load_study, run_study, verify
from rfiddesign.study import survey as surveys
from rfiddesign.study.survey import put_right_mm

TINY = Path(__file__).parents[1] / "tiny-study"
SECTION = """
[survey]
installation_errors_mm = [25.0, 3.0]
passes = 4
lane_pitch_mm = 100.0
dead_share = 0.02
swapped_pairs = 1
runs = 12
denser_tags_per_m2 = [64.0, 225.0]
[survey.prices]
per_hour = 40.0
per_m = 0.01
fixed = 25.0
source = "assumption"
"""
# Between a number and its unit on a page.
NARROW = "\u00a0"


def with_survey(folder, section=SECTION):
    """The tiny study with a survey, a filter that is told how good its map is, and readers that may fail."""
    text = (folder / "study.toml").read_text().replace("seed = 7", 'seed = 7\nestimator = "pmg"')
    text = text.replace("tags_per_m2 = [16.0, 64.0, 225.0]", "tags_per_m2 = [36.0, 64.0]")
    text = text.replace("rectangle_m = [6.0, 5.0]", "rectangle_m = [3.0, 2.4]")
    (folder / "study.toml").write_text(text + "[world]\nread_probability = 0.98\n" + section)
    return folder


@pytest.fixture(scope="module")
def study_folder(tmp_path_factory):
    return with_survey(shutil.copytree(TINY, tmp_path_factory.mktemp("survey") / "tiny"))


@pytest.fixture(scope="module")
def surveyed(study_folder, tmp_path_factory):
    """Results of the tiny study with a survey."""
    out = tmp_path_factory.mktemp("surveyed") / "out"
    run_study(load_study(study_folder), out, 1, lambda stage: None)
    return out


@pytest.fixture(scope="module")
def record(surveyed) -> SurveyRecord:
    return read_record(surveyed / "survey.json", SurveyRecord)


def test_the_survey_is_of_the_chosen_design(surveyed, record):
    chosen = read_record(surveyed / "design.json", ChosenDesign)
    assert (record.design, record.n_robots) == (chosen.name, chosen.n_robots)
    assert [floor.installation_error_mm for floor in record.floors] == [25.0, 3.0]
    assert all(floor.n_tags == chosen.n_tags for floor in record.floors)


def test_a_survey_of_a_badly_laid_floor_helps_and_says_how_well_it_knows(record):
    floor = record.floors[0]
    assert floor.before.per_axis_rms_mm == pytest.approx(25.0, rel=0.1)
    assert floor.after.radial_rms_mm < 0.6 * floor.before.radial_rms_mm
    assert 1.0 < floor.calibration < 3.0
    mean = {one.name: one.position_mean_mm.mean for one in floor.maps}
    assert mean["true"] < mean["surveyed"] < mean["checked"]
    assert floor.gain_mm.mean == pytest.approx(mean["checked"] - mean["surveyed"])
    assert floor.sigma_mm == floor.map("surveyed").sigma_mm < 25.0


def test_advice_follows_from_gain_and_prices(record):
    for floor in record.floors:
        gain, checked = floor.gain_mm, floor.map("checked").position_mean_mm.mean
        reaching = [denser for denser in floor.denser if denser.reaches]
        assert len(reaching) <= 1
        if gain.mean < -2 * gain.stderr:
            expected = "makes it worse"
        elif gain.mean <= 2 * gain.stderr or gain.mean < record.least_gain * checked:
            expected = "does not pay"
        else:
            is_cheaper = not reaching or record.cost_cents < reaching[0].extra_cents
            expected = "pays" if is_cheaper else "does not pay"
        assert floor.advice == expected
        assert floor.reasons
        goal = floor.map("surveyed").position_mean_mm.mean
        assert all(denser.reaches == (denser.position_mean_mm.mean <= goal) for denser in floor.denser)
    assert record.floors[0].advice == "pays"


def test_a_survey_costs_its_hours_and_its_way(record):
    expected = 40.0 * round(record.hours, 2) + 0.01 * round(record.driven_m, 2) + 25.0
    assert record.cost_cents == pytest.approx(100 * expected, abs=1.0)
    assert sum(line.amount_cents for line in record.cost_lines) == record.cost_cents


def test_the_map_is_written_with_covariances_and_agrees_with_the_record(surveyed, record):
    with (surveyed / "surveyed_tags.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    for floor in record.floors:
        mine = [row for row in rows if float(row["installation_error_mm"]) == floor.installation_error_mm]
        assert len(mine) == floor.n_tags
        assert [int(row["id"]) for row in mine if row["status"] == "dead"] == floor.dead
        errors = [
            [float(row[f"{axis}_mm"]) - float(row[f"true_{axis}_mm"]) for axis in "xy"]
            for row in mine
            if row["status"] in ("found", "swapped")
        ]
        assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(floor.after.per_axis_rms_mm, abs=0.1)
        variances = [float(row[name]) for row in mine for name in ("var_x_mm2", "var_y_mm2") if int(row["reads"])]
        assert np.sqrt(np.mean(variances)) == pytest.approx(floor.sigma_mm, abs=0.05)


def test_the_checked_map_has_tags_at_the_planned_places_where_they_were_found():
    """Tags 0 and 1 were swapped; 2 was found near the place of 3, which nobody read; 4 is at its own."""
    nominal = np.column_stack([100.0 * np.arange(5), np.zeros(5)])
    found = nominal[[1, 0, 3, 3, 4]] + [[8.0, -3.0]] * 5
    status = np.array(["swapped", "swapped", "misplaced", "unseen", "found"])
    surveyed = SurveyedTags(
        nominal, found, np.tile(np.eye(2), (5, 1, 1)), status, np.array([1, 0, -1, -1, -1]), np.array([9, 9, 9, 0, 9]),
        np.array([2, 2, 2, 0, 2]), np.zeros(5), 0, 8.0, 5.0, True,
    )  # fmt: skip
    assert np.array_equal(put_right_mm(surveyed), nominal[[1, 0, 3, 3, 4]])


@pytest.mark.parametrize(
    ("setting", "is_told"), [("estimator='pmg'", True), ("estimator='mcl'", False), ("pmg.softness_mm=4.0", False)]
)
def test_a_filter_is_told_how_good_its_map_is_if_it_can_be(study_folder, setting, is_told):
    study = load_study(study_folder, (setting,))
    candidate = SimpleNamespace(estimator=study.file.estimator)
    assert surveys._Survey(study, study.file.survey, None, None, candidate, None, None).is_told == is_told


def test_dead_and_swapped_tags_are_counted_without_false_alarms(record):
    for floor in record.floors:
        assert floor.dead_counts.n_false == floor.swapped_counts.n_false == 0
        for found in (floor.dead_counts, floor.swapped_counts):
            assert found.n_found + found.n_missed == found.n_true
    assert any(floor.dead_counts.n_found + floor.swapped_counts.n_found > 0 for floor in record.floors)


def test_workers_do_not_change_the_survey(study_folder, surveyed, tmp_path):
    run_study(load_study(study_folder), tmp_path / "out", 2, lambda stage: None)
    for name in ("survey.json", "surveyed_tags.csv"):
        assert (tmp_path / "out" / name).read_bytes() == (surveyed / name).read_bytes()


def test_verify_holds_the_survey_by_its_hash(surveyed, tmp_path):
    folder = shutil.copytree(surveyed, tmp_path / "out")
    assert not any(check.faults for check in verify(folder))
    (folder / "survey.json").write_text((folder / "survey.json").read_text().replace("pays", "does not pay", 1))
    faults = [fault for check in verify(folder) for fault in check.faults]
    assert faults == ["survey.json: is not what was written: its hash differs"]


def test_the_command_line_advises_in_a_line_for_each_floor(surveyed, record):
    lines = survey_lines(survey_of(surveyed))
    for floor in record.floors:
        assert f"  laid to {floor.installation_error_mm:g} mm: {floor.advice}" in lines
    summary = survey_summary(record)
    assert [floor["advice"] for floor in summary["floors"]] == [floor.advice for floor in record.floors]


@pytest.mark.usefixtures("without_pictures")
def test_the_report_shows_the_survey(surveyed, record):
    write_report(surveyed)
    page = (surveyed / "report.html").read_text()
    assert 'id="survey"' in page
    assert 'id="figure-survey-errors"' in page
    assert f"Tags laid to 25{NARROW}mm per axis: the survey pays" in page


def test_a_study_without_a_survey_writes_none(finished):
    assert not (finished / "survey.json").exists()
    assert survey_of(finished) is None


@pytest.fixture
def recorded(study_folder, surveyed, tmp_path):
    """A study with the log of a drive over a floor laid to 25 mm, and where its tags lie."""
    from rfiddesign.simulation.as_built import LayingFaults, lay_floor
    from rfiddesign.simulation.survey_drive import drive_survey

    folder = shutil.copytree(study_folder, tmp_path / "study")
    study = load_study(folder)
    kept = {}

    def keep(*args):
        kept["robot"], kept["floor"], _, kept["plan"], _ = args
        raise StopIteration

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surveys, "drive_survey", keep)
        with pytest.raises(StopIteration):
            run_study(study, tmp_path / "aborted", 1, lambda stage: None)
    nominal = kept["robot"].design.pattern.lay(kept["floor"].drivable)
    laid = lay_floor(nominal, LayingFaults(25.0, 0.02), 99)
    write_survey_log(folder / "log", drive_survey(kept["robot"], kept["floor"], laid, kept["plan"], 99).log)
    text = (folder / "study.toml").read_text().replace("[25.0, 3.0]", "[25.0]\nlog = 'log'")
    (folder / "study.toml").write_text(text)
    return folder, laid


@pytest.mark.usefixtures("without_pictures")
def test_a_recorded_log_is_surveyed_without_a_truth_to_hold_it_against(recorded, tmp_path):
    folder, laid = recorded
    out = tmp_path / "out"
    run_study(load_study(folder), out, 1, lambda stage: None)
    record = read_record(out / "survey.json", SurveyRecord)
    (floor,) = record.floors
    assert floor.is_recorded
    assert floor.after is None
    assert floor.dead_counts.n_true is None
    assert set(floor.dead) <= set(np.flatnonzero(laid.is_dead).tolist())
    with (out / "surveyed_tags.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["status"] == "found"]
    assert all(row["true_x_mm"] == "" for row in rows)
    places = np.array([[float(row["x_mm"]), float(row["y_mm"])] for row in rows])
    errors = places - laid.true_mm[[int(row["id"]) for row in rows]]
    assert np.sqrt((errors**2).sum(axis=1).mean()) < 0.6 * np.sqrt(2.0) * 25.0
    write_report(out)
    assert "Nobody knows where its tags lie" in (out / "report.html").read_text()
    # Another log is another study.
    reads = folder / "log" / "reads.csv"
    reads.write_text("".join(reads.read_text().splitlines(keepends=True)[:-1]))
    with pytest.raises(StudyError, match="another study"):
        run_study(load_study(folder), out, 1, lambda stage: None)


def test_a_log_that_does_not_fit_the_design_ends_in_one_line(recorded, tmp_path):
    folder, _ = recorded
    schedule = folder / "log" / "schedule.csv"
    schedule.write_text(schedule.read_text() + "8,0.1,0.05\n")
    lines = schedule.read_text().splitlines()
    n = len(lines) - 1
    schedule.write_text(
        "\n".join([lines[0], *(f"{i},{row.split(',', 1)[1]}" for i, row in enumerate(lines[1:]))]) + "\n"
    )
    with pytest.raises(StudyError, match=f"survey: the schedule has {n} antennas"):
        run_study(load_study(folder), tmp_path / "out", 1, lambda stage: None)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ("survey.passes=0", "survey.passes"),
        ("survey.installation_errors_mm=[]", "survey.installation_errors_mm"),
        ("survey.installation_errors_mm=[5.0, 5.0]", "must not name a value twice"),
        ("survey.installation_errors_mm=[0.0]", "survey.installation_errors_mm"),
        ("survey.directions='up'", "survey.directions"),
        ("survey.pose_error_mm=nan", "survey.pose_error_mm"),
        ("survey.prices.per_hour=-1.0", "survey.prices.per_hour"),
        ("survey.log='nowhere'", "must have one value"),
        ("survey.passses=3", "survey.passses: unknown key"),
    ],
)
def test_a_section_at_fault_ends_in_one_line(study_folder, settings, told):
    with pytest.raises(StudyError) as caught:
        load_study(study_folder, (settings,))
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_log_that_is_missing_is_named_before_anything_is_written(study_folder, tmp_path):
    study = load_study(study_folder, ("survey.installation_errors_mm=[5.0]", "survey.log='nowhere'"))
    with pytest.raises(StudyError, match="nowhere"):
        run_study(replace(study), tmp_path / "out", 1, lambda stage: None)
    assert not (tmp_path / "out").exists() or not any((tmp_path / "out").iterdir())
