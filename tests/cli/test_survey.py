"""`rfiddesign run` advises on a survey in words and in JSON, where the study has one."""

import json

import pytest

from rfiddesign.results.folder import read_record, write_record
from rfiddesign.results.study_result import CostLineRecord, MeanRecord, StudyResult
from rfiddesign.results.survey import Mistakes, SampleTag, SurveyedFloor, SurveyedMap, SurveyRecord, TagErrors

MEAN = MeanRecord(mean=9.0, stderr=0.2)
FEW = Mistakes(n_true=3, n_found=2, n_missed=1, n_false=1)
TAG = SampleTag(id=0, status="found", nominal_mm=(0, 0), surveyed_mm=(3, 4), true_mm=(3, 5), covariance_mm2=(9, 0, 9))
MAPS = [
    SurveyedMap(name=name, sigma_mm=5.0, n_tags=9, position_mean_mm=MEAN, position_p95_mm=MEAN, pass_share=MEAN)
    for name in ("nominal", "checked", "surveyed", "true")
]


def floor(error_mm: float, advice: str) -> SurveyedFloor:
    return SurveyedFloor(
        installation_error_mm=error_mm, is_recorded=False, n_tags=9, n_read=8, n_unseen=1, reads_per_tag=5.0,
        visits_per_tag=2.0, mean_correction_mm=6.5, sigma_mm=4.0, laid_mm=7.0, scatter_mm=3.0, n_unknown=0,
        is_as_declared=True, before=TagErrors(per_axis_rms_mm=7.0, radial_rms_mm=9.9, radial_mean_mm=9.0),
        after=TagErrors(per_axis_rms_mm=4.0, radial_rms_mm=5.7, radial_mean_mm=5.0), calibration=2.1,
        distances_before_mm=[9.0], distances_after_mm=[5.0], sample=[TAG], dead=[1], swapped=[(2, 3)], misplaced=[],
        dead_counts=FEW, swapped_counts=FEW, early_dead=None, early_swapped=None, maps=MAPS, gain_mm=MEAN, denser=[],
        cheapest_denser=None, advice=advice, reasons=["For a reason."],
    )  # fmt: skip


@pytest.fixture
def run(cli, tiny, finished, tmp_path, monkeypatch):
    """`rfiddesign run` of a study that was surveyed to these floors already, or was not."""

    def call(floors: list[SurveyedFloor], *arguments: str):
        result = read_record(finished / "result.json", StudyResult)
        out = tmp_path / "out"
        out.mkdir()
        if floors:
            line = CostLineRecord(group="survey", item="driving", quantity="2", unit="h", unit_price="45",
                                  amount_cents=9000, source="assumption")  # fmt: skip
            record = SurveyRecord(
                version="0", study_hash="0", currency="EUR", n_robots=1, design="a design", estimator="pmg",
                tags_per_m2=36.0, passes=10, directions="crossing", lane_pitch_mm=100.0, speed_mm_per_s=300.0,
                pose_error_mm=20.0, heading_error_deg=0.3, correlation_s=10.0, n_runs=9, least_gain=0.05, hours=2.0,
                driven_m=900.0, n_lanes=9, cost_lines=[line], cost_cents=9000, floors=floors,
            )  # fmt: skip
            write_record(out / "survey.json", record)
        monkeypatch.setattr("rfiddesign.study.run_study", lambda *arguments: result)
        monkeypatch.setattr("rfiddesign.report.write_report", lambda folder: folder / "report.html")
        return cli("run", tiny, "--out", out, *arguments)

    return call


def test_each_floor_has_a_line_of_advice_before_the_way_to_the_report(run):
    answer = run([floor(20.0, "pays"), floor(5.0, "does not pay")])
    lines = answer.out.splitlines()
    assert "as-built survey: EUR 90.00, 2.0 h" in lines
    assert lines.index("  laid to 20 mm: pays") < lines.index("  laid to 5 mm: does not pay")
    assert lines.index("  laid to 5 mm: does not pay") < next(i for i, line in enumerate(lines) if "report: " in line)
    assert "residual 4.0 mm per axis, 5.7 mm in distance" in answer.out
    assert "2 of 3 dead tags found, 1 false" in answer.out


def test_json_has_advice_residual_and_errors(run):
    told = json.loads(run([floor(20.0, "pays")], "--json").out)["survey"]
    assert told["cost_cents"] == 9000
    (one,) = told["floors"]
    assert one["advice"] == "pays"
    assert one["after"]["radial_rms_mm"] == 5.7
    assert [each["name"] for each in one["maps"]] == ["nominal", "checked", "surveyed", "true"]


def test_without_a_survey_nothing_is_said_of_one(run):
    answer = run([], "--json")
    assert answer.status == 0
    assert "survey" not in json.loads(answer.out)
