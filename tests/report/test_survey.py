"""Surveys on a page: tables and figures say what the record holds, whatever is in it."""

import pytest

from rfiddesign.report.figures.style import in_style
from rfiddesign.report.figures.survey import errors_figure, places_figure, residuals_figure
from rfiddesign.report.survey import MAPS, survey_part, survey_pictures
from rfiddesign.results.folder import read_record, write_record
from rfiddesign.results.study_result import CostLineRecord, MeanRecord
from rfiddesign.results.survey import (
    DenserFloor,
    Mistakes,
    SampleTag,
    SurveyedFloor,
    SurveyedMap,
    SurveyRecord,
    TagErrors,
)

EVIL = '<script>alert("x")</script>'


def mean(value: float) -> MeanRecord:
    return MeanRecord(mean=value, stderr=0.25)


def a_map(name: str, error: float, sigma: float | None) -> SurveyedMap:
    return SurveyedMap(
        name=name, sigma_mm=sigma, n_tags=98, position_mean_mm=mean(error), position_p95_mm=mean(2 * error),
        pass_share=mean(0.9),
    )  # fmt: skip


def a_tag(i: int, j: int) -> SampleTag:
    return SampleTag(
        id=5 * i + j, status="found", nominal_mm=(200.0 * i, 200.0 * j), surveyed_mm=(200.0 * i + 12, 200.0 * j - 5),
        true_mm=(200.0 * i + 10, 200.0 * j - 7), covariance_mm2=(30.0, 5.0, 20.0),
    )  # fmt: skip


DENSER = DenserFloor(tags_per_m2=49.0, n_tags=130, extra_cents=46800, position_mean_mm=mean(13.0), reaches=False)


def errors(radial: float) -> TagErrors:
    return TagErrors(per_axis_rms_mm=radial / 2**0.5, radial_rms_mm=radial, radial_mean_mm=0.9 * radial)


def a_floor(**changes) -> SurveyedFloor:
    found = Mistakes(n_true=3, n_found=2, n_missed=1, n_false=0)
    fields = {
        "installation_error_mm": 20.0, "is_recorded": False, "n_tags": 100, "n_read": 90, "n_unseen": 8,
        "reads_per_tag": 64.0, "visits_per_tag": 16.0, "mean_correction_mm": 24.0, "sigma_mm": 5.3, "laid_mm": 19.0,
        "scatter_mm": 8.0, "n_unknown": 3, "is_as_declared": True,
        "before": errors(28.0), "after": errors(7.0), "calibration": 1.7,
        "distances_before_mm": [10.0 + k for k in range(30)], "distances_after_mm": [0.3 * k for k in range(30)],
        "sample": [a_tag(i, j) for i in range(5) for j in range(5)], "dead": list(range(60)), "swapped": [(4, 9)],
        "misplaced": [], "dead_counts": found, "swapped_counts": found, "early_dead": None, "early_swapped": found,
        "maps": [a_map("nominal", 16.0, 20.0), a_map("checked", 15.0, 20.0), a_map("surveyed", 8.0, 5.3),
                 a_map("true", 6.0, 0.0)],
        "gain_mm": mean(7.0),
        "denser": [DENSER],
        "cheapest_denser": None, "advice": "pays", "reasons": [f"It saves a lot. {EVIL}"],
    }  # fmt: skip
    return SurveyedFloor(**(fields | changes))


def a_record(*floors: SurveyedFloor) -> SurveyRecord:
    line = CostLineRecord(group="survey", item="driving", quantity="4.3", unit="h", unit_price="45", amount_cents=19350,
                          source=EVIL)  # fmt: skip
    return SurveyRecord(
        version="0", study_hash="0", currency="EUR", n_robots=10, design=EVIL, estimator="pmg", tags_per_m2=36.0,
        passes=10, directions="crossing", lane_pitch_mm=100.0, speed_mm_per_s=300.0, pose_error_mm=20.0,
        heading_error_deg=0.3, correlation_s=10.0, n_runs=60, least_gain=0.05, hours=4.3, driven_m=3980.0, n_lanes=636,
        cost_lines=[line], cost_cents=19350, floors=list(floors),
    )  # fmt: skip


RECORDED = a_floor(
    is_recorded=True, before=None, after=None, calibration=None, distances_before_mm=[], distances_after_mm=[],
    dead_counts=Mistakes(n_true=None, n_found=2, n_missed=None, n_false=None), denser=[],
    swapped_counts=Mistakes(n_true=None, n_found=1, n_missed=None, n_false=None), early_swapped=None,
    sample=[tag.model_copy(update={"true_mm": None}) for tag in a_floor().sample], advice="makes it worse",
)  # fmt: skip


def test_the_record_survives_its_file(tmp_path):
    record = a_record(a_floor(), a_floor(installation_error_mm=5.0, advice="does not pay"))
    write_record(tmp_path / "survey.json", record)
    assert read_record(tmp_path / "survey.json", SurveyRecord) == record


def test_every_floor_has_its_advice_its_maps_and_its_denser_floors():
    part = survey_part(a_record(a_floor(), a_floor(installation_error_mm=5.0, advice="does not pay")))
    assert [floor.heading for floor in part.floors] == [
        "Tags laid to 20 mm per axis: the survey pays",
        "Tags laid to 5 mm per axis: the survey does not pay",
    ]
    rows = part.floors[0].maps.rows
    assert [row[0] for row in rows[:4]] == list(MAPS.values())
    assert rows[2][1:] == ("8.00 ± 0.25 mm", "16.00 ± 0.25 mm", "90 %", "5.3 mm")
    assert rows[4][:2] == ("mistakes known, 49 tags per m², EUR 468.00 more", "13.00 ± 0.25 mm")
    found = dict(part.floors[0].found.rows)
    assert found["distance after (the residual), root mean square"] == "7.0 mm"
    assert found["dead tags"] == "2 of 3 found, 0 false alarms"
    assert found["reads of ids that the plan does not have"] == "3"
    assert found["off the plan per axis, as reads have it"] == "19.0 mm"


def test_what_is_hardly_told_or_cannot_be_told_is_not_printed_as_a_number():
    maps = [a_map(name, 9.0, None) for name in ("nominal", "checked", "surveyed", "true")]
    floor = survey_part(a_record(a_floor(laid_mm=15.0, maps=maps))).floors[0]
    assert dict(floor.found.rows)["off the plan per axis, as reads have it"] == "less than 16.0 mm"
    assert {row[-1] for row in floor.maps.rows} == {"–"}


def test_long_lists_of_ids_are_cut_short():
    dead, swapped = survey_part(a_record(a_floor())).floors[0].listed
    assert dead.endswith("39 and 20 more.")
    assert swapped == "Swapped: 4 and 9."


def test_of_a_recorded_log_nothing_is_said_that_nobody_knows():
    part = survey_part(a_record(RECORDED))
    assert "Nobody knows" in part.driven
    assert "right by construction" in part.driven
    assert "taken to be off" in part.reference
    assert part.floors[0].heading.endswith("the survey makes it worse")
    found = dict(part.floors[0].found.rows)
    assert found["dead tags"] == "2 listed"
    assert not any("residual" in name for name in found)
    names = [picture.name for picture in survey_pictures(a_record(RECORDED))]
    assert names == ["survey-errors", "survey-places-20mm"]


def words_of(figure) -> str:
    texts = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    for axes in figure.axes:
        texts += [axes.get_xlabel(), axes.get_ylabel(), axes.get_title(loc="left")]
        texts += [text.get_text() for text in axes.get_legend().get_texts()] if axes.get_legend() else []
    return "\n".join(texts)


def test_figures_name_what_they_show():
    record = a_record(a_floor(), a_floor(installation_error_mm=5.0))
    with in_style():
        assert "surveyed map: root mean square 7.0 mm" in words_of(residuals_figure(record))
        words = words_of(errors_figure(record))
        assert "denser floors" in words
        assert "cost beyond the chosen design's [EUR]" in words
        assert "laid to 5 mm per axis" in words
        assert "95 % ellipse" in words_of(places_figure(record.floors[0]))


@pytest.mark.parametrize("floor", [a_floor(), RECORDED, a_floor(sample=a_floor().sample[:1])])
def test_figures_of_any_floor_can_be_drawn(floor, tmp_path):
    for picture in survey_pictures(a_record(floor)):
        with in_style():
            picture.figure.savefig(tmp_path / "figure.png", dpi=40)
        assert picture.figure.axes
        assert all(axes.has_data() for axes in picture.figure.axes)


def test_ellipses_have_the_shape_of_the_covariances():
    figure = places_figure(a_floor())
    ellipses = figure.axes[0].patches
    assert len(ellipses) == 25
    # The ellipse of 95 % of variances 30 and 20 with covariance 5, whatever the magnification.
    assert ellipses[0].width / ellipses[0].height == pytest.approx((32.07 / 17.93) ** 0.5, rel=1e-3)
