"""--json: one JSON object on standard output and nothing else."""

import json

import pytest

from rfiddesign.results.study_result import StudyResult

CROSS_8 = ("--set", "layout=cross-8", "--set", "antenna=60x60", "--set", "pattern=square")


def object_of(answer) -> dict:
    """The one object on standard output; json.loads refuses anything before or after it."""
    assert answer.status == 0, answer.err
    found = json.loads(answer.out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert isinstance(found, dict)
    return found


def test_check_tells_floor_and_space(cli, tiny):
    found = object_of(cli("check", tiny, "--json"))
    assert found["floor"]["area_m2"] == 30.0
    assert found["space"] == {"n_combinations": 24, "n_unbuildable": 0, "n_buildable": 24, "unbuildable": []}
    assert found["fleet"] == [1, 40]
    assert found["requirement"] == {"position_p95_mm": 13.0, "converged_within_s": None}


def test_check_of_a_map_tells_how_its_area_moves(cli, tiny, grey_map):
    grey_map(254)
    rows = object_of(cli("check", tiny, "--json"))["floor"]["sensitivity"]
    assert len(rows) > 3
    assert {"name", "value", "area_m2", "navigable_m2"} == set(rows[0])


def test_coverage_names_antennas_reads_and_blind_headings(cli, tiny):
    found = object_of(cli("coverage", tiny, *CROSS_8, "--set", "tags_per_m2=100", "--json"))
    assert sorted(found["antennas_mm"]) == sorted(
        [x, y, 0.0] for r in (150, 250) for x, y in ((r, 0), (-r, 0), (0, r), (0, -r))
    )
    assert found["k_coverage"] == sorted(found["k_coverage"], reverse=True)
    assert len(found["k_coverage"]) == 3
    # No two tags share a view: reads are readers x area x density.
    assert found["expected_reads"] == pytest.approx(8 * 3.141592653589793 * 900 * 1e-4, rel=1e-6)
    assert found["two_tags_share"] == 0
    assert set(found["blind_distance_mm"]) >= {"0", "45"}
    assert all(distance >= 0 for distance in found["blind_distance_mm"].values())


@pytest.mark.parametrize(("pitch_mm", "is_aliased"), [(150, False), (200, True), (250, True), (300, True)])
def test_the_cross_of_eight_is_aliased_along_the_rows_at_200_250_and_300_mm_and_not_at_150(
    cli, tiny, pitch_mm, is_aliased
):
    found = object_of(cli("coverage", tiny, *CROSS_8, "--set", f"pitch_mm={pitch_mm}", "--json"))
    assert (0.0 in found["aliased_headings_deg"]) == is_aliased
    assert bool(found["aliased_headings_deg"]) == is_aliased
    assert len(found["warnings"]) >= len(found["aliased_headings_deg"])


def test_evaluate_tells_means_with_their_errors(cli, tiny):
    found = object_of(cli("evaluate", tiny, *CROSS_8, "--set", "tags_per_m2=64", "--runs", "6", "--json"))
    assert set(found["metrics"]) >= {
        "position_mean_mm", "position_rms_mm", "position_p95_mm", "position_max_mm", "heading_mean_rad",
        "converged_share", "pass_share",
    }  # fmt: skip
    for name, value in found["metrics"].items():
        assert set(value) == {"mean", "stderr"}, name
    metrics = {name: value["mean"] for name, value in found["metrics"].items()}
    assert metrics["position_mean_mm"] <= metrics["position_rms_mm"] <= metrics["position_max_mm"]
    assert (found["runs"], found["steps"], found["n_particles"]) == (6, 600, 60)
    assert found["wall_s"] > 0
    # 60 particles, each of which takes some 200 operations without a read.
    assert 60 * 150 < found["flops_per_step"] < 60 * 400
    assert 0 < found["us_per_step"] < 1e4
    assert set(found["price_cents_by_robots"]) == {"1", "40"}
    assert found["price_cents_by_robots"]["40"] > found["price_cents_by_robots"]["1"]


def test_evaluate_repeats_itself_whatever_the_workers_and_follows_the_seed(cli, tiny):
    def metrics(*arguments) -> dict:
        return object_of(cli("evaluate", tiny, "--runs", "4", "--json", *arguments))["metrics"]

    first = metrics("--workers", "1")
    assert metrics("--workers", "2") == first
    assert metrics("--seed", "7") == first
    assert metrics("--seed", "8") != first


def test_evaluate_of_a_single_run_has_no_error_of_the_mean(cli, tiny):
    found = object_of(cli("evaluate", tiny, "--runs", "1", "--json"))
    assert found["metrics"]["position_mean_mm"]["stderr"] is None


def test_check_says_which_patterns_are_too_dense_for_a_reader(cli, tiny):
    """Of 16, 64 and 225 tags/m2 the last lie 67 mm apart: 80 x 80 mm antennas see two at once, and 60 x 60 do not."""
    found = object_of(
        cli("check", tiny, "--set", "reader=goetting-hg-g-98830", "--set", "space.pattern=['square']", "--json")
    )
    (fault,) = found["space"]["unbuildable"]
    assert (fault["layout"], fault["antenna"]) == ("any layout", "80x80")
    assert fault["reason"] == (
        "reader goetting-hg-g-98830 must never see two tags at once; antenna 80x80 sees tags up to 80 mm apart,"
        " those of pattern square with 225 tags/m2 lie 66.67 mm apart"
    )
    assert (found["space"]["n_combinations"], found["space"]["n_unbuildable"]) == (12, 2)


def test_check_tells_people_once_per_antenna_that_patterns_are_too_dense(cli, tiny):
    answer = cli("check", tiny, "--set", "reader=goetting-hg-g-98830", "--set", "space.tags_per_m2=[4.0, 225.0, 400.0]")
    lines = [line.strip() for line in answer.out.splitlines() if "any layout" in line]
    reason = "reader goetting-hg-g-98830 must never see two tags at once"
    # Square ones of 400, and of 225 for the larger antenna; random ones of 225 and 400.
    assert lines == [
        f"{antenna} with any layout: {reason}; {n} patterns are too dense for that"
        for antenna, n in (("60x60", 3), ("80x80", 4))
    ]


def test_evaluate_tells_how_far_the_filter_is_from_the_exact_one(cli, tiny):
    arguments = ("evaluate", tiny, *CROSS_8, "--runs", "2", "--gap", "--set", "duration_s=2.0")
    found = object_of(cli(*arguments, "--json"))
    gap = found["optimality_gap"]
    assert set(gap) == {"reference_position_mean_mm", "ratio"}
    reference, ratio = gap["reference_position_mean_mm"], gap["ratio"]
    assert 0 < reference["mean"] < 20
    assert ratio["mean"] == pytest.approx(found["metrics"]["position_mean_mm"]["mean"] / reference["mean"])
    assert ratio["stderr"] >= 0
    assert reference["stderr"] >= 0
    assert "optimality_gap" not in object_of(cli("evaluate", tiny, "--runs", "1", "--json"))
    answer = cli(*arguments)
    (line,) = [line for line in answer.out.splitlines() if "optimality gap" in line]
    assert line.startswith(f"  optimality gap: {ratio['mean']:.3g} +- ")
    assert line.endswith(f" times the {reference['mean']:.3g} mm of the exact filter")


def test_the_exact_filter_has_no_gap(cli, tiny):
    found = object_of(
        cli(
            "evaluate",
            tiny,
            "--runs",
            "1",
            "--gap",
            "--set",
            "duration_s=1.0",
            "--set",
            "estimator=histogram",
            "--json",
        )
    )
    assert found["optimality_gap"]["ratio"] == {"mean": 1.0, "stderr": None}


@pytest.mark.parametrize("command", ["check", "coverage", "evaluate"])
def test_without_json_people_get_text_and_no_object(cli, tiny, command):
    answer = cli(command, tiny, *(("--runs", "2") if command == "evaluate" else ()))
    assert answer.status == 0
    assert answer.out
    with pytest.raises(json.JSONDecodeError):
        json.loads(answer.out)


@pytest.mark.usefixtures("without_pictures")
def test_run_with_another_estimator_names_it_in_its_assumptions(cli, tiny, finished, tmp_path):
    out = tmp_path / "out"
    found = object_of(cli("run", tiny, "--out", out, "--workers", "2", "--json", "--set", "estimator=quantized_ekf"))
    saved = StudyResult.model_validate_json((out / "result.json").read_bytes())
    assumptions = {row.what: row for row in saved.assumptions}
    assert assumptions["estimator"].value == "quantized extended Kalman filter"
    assert assumptions["estimator"].source == "rssi_kalman_navifloor, eqs. 5-7"
    assert assumptions["settings of the estimator"].value == "uses_rssi yes, pushes_out no, patience 3"
    assert "quantized extended Kalman filter" in (out / "report.html").read_text()
    assert found["study_hash"] != StudyResult.model_validate_json((finished / "result.json").read_bytes()).study_hash


def test_run_and_report(cli, tiny, edit, tmp_path):
    out = tmp_path / "out"
    edit("[1, 40]", "[40]")
    found = object_of(cli("run", tiny, "--out", out, "--workers", "2", "--json"))
    page = found.pop("report")
    assert StudyResult.model_validate(found) == StudyResult.model_validate_json((out / "result.json").read_bytes())
    assert page == str(out / "report.html")
    for name in ("report.html", "cost.csv", "design.json", "tags.csv", "result.json"):
        assert (out / name).stat().st_size > 0, name
    drawn = (out / "report.html").read_bytes()
    (out / "report.html").unlink()
    answer = cli("report", out)
    assert (answer.status, answer.out) == (0, f"{page}\n")
    assert (out / "report.html").read_bytes() == drawn
