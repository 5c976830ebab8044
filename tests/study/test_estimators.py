"""From a study's words to the estimator on its robots, and to what is true of their odometry and readers."""

import math
from dataclasses import replace
from typing import get_args

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.estimators import registry
from rfiddesign.models.motion import DifferentialMotion, MecanumMotion, OdometryFaults, OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.robot import Robot
from rfiddesign.study import evaluate_study, load_study
from rfiddesign.study.assumptions import ESTIMATOR_WORDS, assumptions
from rfiddesign.study.config import StudyFile
from rfiddesign.study.estimator_config import SECTIONS, EstimatorName
from rfiddesign.study.estimators import ESTIMATORS, estimators_of, motion_of, reference_of
from rfiddesign.study.load import design_of, floor_of, scenario_of
from rfiddesign.study.world_config import ODOMETRY_KEYS, OdometrySection

NAMES = get_args(EstimatorName)


def scenario_with(tiny, *settings):
    study = load_study(tiny, settings)
    return scenario_of(study, floor_of(study))


def settings_with(tiny, *settings):
    """The estimator's settings."""
    return scenario_with(tiny, *settings).estimator


def assumed(tiny, *settings):
    return {row.what: row for row in assumptions(load_study(tiny, settings))}


# Estimators


def test_every_list_of_estimators_names_the_same():
    assert set(NAMES) == set(ESTIMATORS) == set(SECTIONS) == set(ESTIMATOR_WORDS)
    assert set(SECTIONS.values()) <= set(StudyFile.model_fields)


@pytest.mark.parametrize("name", NAMES)
def test_every_estimator_is_built_for_a_robot_and_named_in_the_assumptions(tiny, name):
    study = load_study(tiny, (f"estimator={name}",))
    settings = estimators_of(study.file, study.file.world, 300.0)[study.file.estimator]
    ready = registry.build(settings, Robot.of(design_of(study), ReadModel()), 0.05)
    assert ready.n_antennas == 8
    assert settings.motion == OmnidirectionalMotion()
    rows = assumed(tiny, f"estimator={name}")
    words, source = ESTIMATOR_WORDS[name]
    assert rows["estimator"].value.startswith(words)
    assert rows["estimator"].source == source


@pytest.mark.parametrize("name", NAMES)
def test_every_estimator_localizes_the_tiny_study_s_robots(tiny, name):
    study = load_study(tiny, (f"estimator={name}", "duration_s=3.0"))
    found = evaluate_study(study, 2, 2, lambda n_done: None)
    assert found["estimator"] == name
    assert all(math.isfinite(value["mean"]) for value in found["metrics"].values())
    assert found["n_particles"] == {"mcl": 60, "particle_filter": 500}.get(name, 0)
    # Dead reckoning for 3 s from a known start, and place and heading from reads of 100 tags/m2 alone.
    assert found["metrics"]["position_mean_mm"]["mean"] < 60.0
    assert found["metrics"]["lost_share"]["mean"] < 0.5


@pytest.mark.parametrize(
    ("name", "given", "expected"),
    [
        ("mcl", ("mcl.beta=0.5", "mcl.sigma_per_radius=2.0"), {"n_particles": 60, "reinitialize": True}),
        ("particle_filter", ("uses_rssi=off", "softness_mm=7.0"), {"uses_rssi": False, "softness_mm": 7.0}),
        ("particle_filter", ("is_regularized=off",), {"is_regularized": False, "is_tempered": True}),
        ("particle_filter", ("is_tempered=no",), {"is_regularized": True, "is_tempered": False}),
        ("quantized_ekf", ("read_noise_mm=9.0", "pushes_out=on"), {"kind": "quantized", "read_noise_mm": 9.0}),
        ("constrained_ekf", ("patience=0",), {"kind": "constrained", "patience": 0}),
        ("markov", ("n_cells=51", "corrects_heading=off"), {"n_cells": 51, "corrects_heading": False}),
        ("rigid_fit", ("uses_odometry=no",), {"method": "rigid_fit", "uses_odometry": False}),
        ("weighted_centre", ("window=7",), {"method": "weighted_centre", "window": 7}),
        ("odometry", ("is_age_compensated=off",), {"method": "odometry", "is_age_compensated": False}),
        ("histogram", ("cell_deg=3.0", "n_headings=21"), {"cell_rad": math.radians(3.0), "n_headings": 21}),
    ],
)
def test_the_words_of_its_section_reach_the_estimator(tiny, name, given, expected):
    settings = settings_with(tiny, f"estimator={name}", *given)
    for key, value in expected.items():
        assert getattr(settings, key) == value


@pytest.mark.parametrize("name", ["particle_filter", "histogram"])
def test_a_field_filter_allows_for_the_installation_and_for_missed_reads_unless_told_what_to(tiny, name):
    chosen = f"estimator={name}"
    plain = settings_with(tiny, chosen)
    assert (plain.softness_mm, plain.read_probability) == (1.0, 0.98)
    laid = settings_with(tiny, chosen, "installation_error_mm=4.0", "world.read_probability=0.7")
    assert (laid.softness_mm, laid.read_probability) == (math.hypot(1.0, 4.0), 0.7)
    told = settings_with(tiny, chosen, "installation_error_mm=4.0", "softness_mm=2.0", f"{name}.read_probability=0.9")
    assert (told.softness_mm, told.read_probability) == (2.0, 0.9)
    assert settings_with(tiny, chosen, "world.read_probability=0.0").read_probability == 0.01


@pytest.mark.parametrize("name", ["quantized_ekf", "constrained_ekf"])
def test_a_kalman_filter_allows_for_the_installation(tiny, name):
    assert settings_with(tiny, f"estimator={name}").read_noise_mm == 3.0
    assert settings_with(tiny, f"estimator={name}", "installation_error_mm=4.0").read_noise_mm == 5.0


@pytest.mark.parametrize("name", NAMES)
def test_a_filter_may_believe_another_odometry_than_is_true(tiny, name):
    section = SECTIONS[name]
    settings = settings_with(
        tiny, f"estimator={name}", f"{section}.odometry.model=mecanum", f"{section}.odometry.noise_mm_per_sqrt_m=9.0"
    )
    assert settings.motion == MecanumMotion(9.0, 9.0)
    rows = assumed(tiny, f"estimator={name}", f"{section}.odometry.noise_mm_per_s=9.0")
    assert rows["odometry noise (believed)"].value.startswith("9 mm/s")
    assert rows["odometry noise (true)"].value.startswith("25 mm/s")


def test_the_exact_reference_believes_what_is_true(tiny):
    study = load_study(tiny, ("histogram.odometry.noise_mm_per_s=99.0", "cell_deg=2.0", "histogram.cell_mm=8.0"))
    reference = reference_of(study.file, study.file.world, 300.0)
    assert reference.motion == OmnidirectionalMotion()
    assert (reference.cell_mm, reference.cell_rad) == (8.0, math.radians(2.0))


# Odometry


@pytest.mark.parametrize(
    ("section", "motion"),
    [
        (OdometrySection(), OmnidirectionalMotion()),
        (OdometrySection(noise_mm_per_s=3.0, noise_rad_per_s=0.2), OmnidirectionalMotion(3.0, 3.0, 0.2)),
        (OdometrySection(model="mecanum"), MecanumMotion()),
        (OdometrySection(model="mecanum", noise_mm_per_sqrt_m=5.0), MecanumMotion(5.0, 5.0)),
        (
            OdometrySection(
                model="mecanum", noise_mm_per_sqrt_m=5.0, noise_sideways_mm_per_sqrt_m=8.0, noise_rad_per_sqrt_m=0.1,
                noise_rad_per_sqrt_rad=0.2,
            ),
            MecanumMotion(5.0, 8.0, 0.1, 0.2),
        ),
        (OdometrySection(model="differential"), DifferentialMotion()),
        (
            OdometrySection(model="differential", wheel_noise_mm_per_sqrt_m=4.0, track_mm=300.0),
            DifferentialMotion(4.0, 300.0),
        ),
    ],
)  # fmt: skip
def test_each_model_of_the_odometry_takes_its_own_noises(section, motion):
    assert motion_of(section) == motion


@pytest.mark.parametrize("model", ODOMETRY_KEYS)
@pytest.mark.parametrize("place", ["world.odometry", "ekf.odometry", "mcl.odometry"])
def test_a_noise_of_another_model_is_refused_in_one_line(tiny, model, place):
    foreign = [key for other, keys in ODOMETRY_KEYS.items() if other != model for key in keys]
    for key in foreign:
        with pytest.raises(StudyError) as caught:
            load_study(tiny, (f"{place}.model={model}", f"{place}.{key}=20.0"))
        line = str(caught.value)
        allowed = ", ".join(ODOMETRY_KEYS[model])
        assert line.endswith(f"study.toml: {place}: {key} has no meaning for model {model!r}, only {allowed}")
        assert "\n" not in line
    for key in ODOMETRY_KEYS[model]:
        load_study(tiny, (f"{place}.model={model}", f"{place}.{key}=20.0"))


def test_the_odometry_s_model_and_source_are_told(tiny):
    rows = assumed(tiny, "world.odometry.model=differential", "world.odometry.track_mm=350.0")
    assert rows["odometry noise (true)"].value == "10 mm per sqrt(m) of each wheel, track 350 mm"
    assert "Siegwart" in rows["odometry noise (true)"].source
    assert rows["odometry noise (true)"].source.endswith("study file")
    assert assumed(tiny)["odometry noise (true)"].source.startswith("hf_multireader_mcl, eq. 1; size: calibrated")
    mecanum = assumed(tiny, "world.odometry.model=mecanum")["odometry noise (true)"]
    assert mecanum.value.startswith("12 mm ahead, 12 mm sideways and 0.0087 rad per sqrt(m)")
    assert mecanum.source.startswith("rssi_kalman_navifloor")


# Faults and reads


def test_faults_reads_and_their_delays_reach_the_scenario(tiny):
    scenario = scenario_with(
        tiny, "scale_x=0.01", "scale_y=-0.02", "drift_rad_per_m=0.003", "slips_per_m=0.4", "slip_mm=5.0",
        "slip_rad=0.06", "polling=multiplexed", "poll_s=0.02", "read_time_s=0.03", "delay_s=0.04", "answers=all",
        "read_probability=0.9", "installation_error_mm=6.0", "dead_share=0.05", "field_scale=0.9",
    )  # fmt: skip
    assert scenario.world.faults == OdometryFaults(0.01, -0.02, 0.003, 0.4, 5.0, 0.06)
    assert scenario.world.reads == ReadModel(0.9, "multiplexed", 0.02, 0.03, 0.04, "all")
    assert scenario.world.installation_error_mm == 6.0
    assert (scenario.world.dead_share, scenario.world.field_scale) == (0.05, 0.9)
    assert not scenario.is_delay_known


FIELD_FILTERS = ("pmg", "particle_filter", "histogram")


@pytest.mark.parametrize("name", NAMES)
def test_filters_by_the_field_are_told_how_wrong_the_world_may_be_and_no_others(tiny, name):
    """By the size of what is wrong: tolerances of their likelihood, not the truth itself."""
    chosen = f"estimator={name}"
    usual = settings_with(tiny, chosen)
    told = settings_with(tiny, chosen, "dead_share=0.2", "field_scale=0.8")
    if name not in FIELD_FILTERS:
        assert told == usual
        return
    assert told.radius_tolerance == pytest.approx(0.2)
    assert told.read_probability == pytest.approx(0.8 * 0.98, rel=0.03)
    assert replace(told, radius_tolerance=0.0, read_probability=usual.read_probability) == usual


@pytest.mark.parametrize("name", FIELD_FILTERS)
def test_late_reads_blur_the_border_by_the_way_within_the_delay_unless_the_filter_is_told(tiny, name):
    fastest = load_study(tiny).file.scenario.fastest_mm_per_s
    late = ("delay_s=0.02", "installation_error_mm=4")
    softness = math.hypot(1.0, 4.0, 0.02 * fastest)
    assert settings_with(tiny, f"estimator={name}", *late).softness_mm == pytest.approx(softness)
    told = scenario_with(tiny, f"estimator={name}", *late, "is_delay_known=true")
    assert told.estimator.softness_mm == pytest.approx(math.hypot(1.0, 4.0))
    assert told.is_delay_known
    assert settings_with(tiny, f"estimator={name}", *late, "softness_mm=3").softness_mm == 3.0


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("dead_share=1.01", "less than or equal to 1"),
        ("dead_share=-0.1", "greater than or equal to 0"),
        ("dead_share=many", "a valid number"),
        ("dead_share=nan", "a finite number"),
        ("field_scale=0.49", "greater than or equal to 0.5"),
        ("field_scale=2.01", "less than or equal to 2"),
        ("field_scale=inf", "less than or equal to 2"),
        ("field_scale=yes", "a valid number"),
    ],
)
def test_a_share_or_a_size_that_cannot_be_is_refused_in_one_line(tiny, setting, words):
    key, _, value = setting.partition("=")
    with pytest.raises(StudyError) as caught:
        load_study(tiny, (setting,))
    line = str(caught.value)
    assert f"study.toml: world.{key}: " in line
    assert words in line
    assert value.replace("yes", "True") in line
    assert "\n" not in line


def test_faults_and_delays_make_errors_larger(tiny):
    def error(*settings):
        study = load_study(tiny, ("estimator=odometry", *settings))
        return evaluate_study(study, 4, 2, lambda n_done: None)["metrics"]["position_mean_mm"]["mean"]

    assert error("scale_x=0.2", "scale_y=0.2") > 2 * error()


def test_what_is_wrong_with_odometry_and_reads_is_told(tiny):
    rows = assumed(tiny)
    assert rows["systematic faults of the odometry"].value == "none"
    assert (rows["polling"].value, rows["tags in view that answer to a poll"].value) == ("common", "one")
    assert rows["reader"].value == "hf-anticollision"
    assert "ISO 15693" in rows["reader"].source
    rows = assumed(
        tiny, "drift_rad_per_m=0.003", "slips_per_m=2", "polling=multiplexed", "delay_s=0.025", "answers=all"
    )
    assert rows["systematic faults of the odometry"].value == "drift_rad_per_m 0.003, slips_per_m 2"
    assert rows["polling"].value == "multiplexed, 0.01 s per poll"
    assert rows["delay of reads, of which the filter is not told"].value == "0.025 s"
    assert rows["tags in view that answer to a poll"].value == "all"
    dead, size = "tags that never answer, of which the filter is not told", "true size of the detection fields"
    assert not {dead, size} & rows.keys()
    rows = assumed(tiny, "dead_share=0.025", "field_scale=0.9")
    assert rows[dead].value.startswith("2.5 %, drawn anew in every drive")
    assert rows[size].value.startswith("0.9 times the catalogue's")
    told = assumed(tiny, "estimator=markov", "markov.cell_mm=5.0", "corrects_heading=no")
    assert "cell_mm 5, " in told["settings of the estimator"].value
    assert "corrects_heading no" in told["settings of the estimator"].value
