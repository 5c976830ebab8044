"""--set KEY=VALUE: short names, dotted paths and values as people type them."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rfiddesign.errors import StudyError
from rfiddesign.study.overrides import apply_overrides, parse_value, settable_keys


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("true", True), ("on", True), ("Yes", True), ("false", False), ("OFF", False), ("no", False),
        ("100", 100), ("6.25", 6.25), ("1e3", 1000.0), ("-3", -3), ("inf", float("inf")),
        ("cross-8", "cross-8"), ("60x60", "60x60"), ('"60x60"', "60x60"), ("", ""), ("a b", "a b"),
        ("[1, 2]", [1, 2]), ('["square"]', ["square"]), ("{a = 1}", {"a": 1}),
        ("9" * 5000, "9" * 5000), ("[" * 50_000, "[" * 50_000), ("1\nb = 2", 1),
    ],
)  # fmt: skip
def test_values_are_toml_or_words_for_true_and_false_or_text(text, value):
    assert parse_value(text) == value


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("layout=cross-8", {"design": {"layout": "cross-8"}}),
        ("antenna=60x60", {"design": {"antenna": "60x60"}}),
        ("pattern=triangular", {"design": {"pattern": "triangular"}}),
        ("tags_per_m2=100", {"design": {"tags_per_m2": 100}}),
        ("pitch_mm=250", {"design": {"pitch_mm": 250}}),
        ("likelihood=gaussian", {"mcl": {"likelihood": "gaussian"}}),
        ("reinitialize=off", {"mcl": {"reinitialize": False}}),
        ("n_particles = 60", {"mcl": {"n_particles": 60}}),
        ("start=unknown", {"scenario": {"start": "unknown"}}),
        ("seed=3", {"seed": 3}),
        ("mcl.odometry.noise_mm_per_s=3", {"mcl": {"odometry": {"noise_mm_per_s": 3}}}),
        ("world.odometry.noise_mm_per_s=3", {"world": {"odometry": {"noise_mm_per_s": 3}}}),
        ("space.tags_per_m2=[1.0]", {"space": {"tags_per_m2": [1.0]}}),
        ("title=a = b", {"title": "a = b"}),
        ("turn_rate_deg_per_s=30", {"scenario": {"turn_rate_deg_per_s": 30}}),
        ("dead_share=0.1", {"world": {"dead_share": 0.1}}),
        ("max_runs=99", {"search": {"max_runs": 99}}),
        ("survey.passes=4", {"survey": {"passes": 4}}),
        ("shelves.max_runs=99", {"shelves": {"max_runs": 99}}),
    ],
)
def test_short_names_and_dotted_paths(setting, expected):
    assert apply_overrides({}, (setting,)) == expected


def test_a_short_name_of_a_variable_means_the_design_at_hand_not_the_space():
    names = settable_keys()
    for name in ("layout", "antenna", "pattern", "tags_per_m2", "pitch_mm"):
        assert names[name] == f"design.{name}"
    assert names["space.layout"] == "space.layout"
    assert "noise_mm_per_s" not in names  # world or mcl?


@pytest.mark.parametrize(
    ("settings_", "expected"),
    [
        (("n_particles=60",), {"mcl": {"n_particles": 60}}),
        (
            ("n_particles=60", "estimator=particle_filter"),
            {"estimator": "particle_filter", "particle_filter": {"n_particles": 60}},
        ),
        ((" estimator = particle_filter", "reinitialize=off"), {"particle_filter": {"reinitialize": False}}),
        (("estimator=quantized_ekf", "uses_rssi=off"), {"ekf": {"uses_rssi": False}}),
        (("estimator=histogram", "uses_rssi=off", "cell_mm=4"), {"histogram": {"uses_rssi": False, "cell_mm": 4}}),
        (("estimator=markov", "cell_mm=4", "sigma_per_radius=1"), {"markov": {"cell_mm": 4, "sigma_per_radius": 1}}),
        (("estimator=trigonometric", "is_age_compensated=no"), {"geometric": {"is_age_compensated": False}}),
        # A key that one estimator alone has is its own, whichever is chosen.
        (
            ("estimator=markov", "likelihood=gaussian", "patience=2"),
            {"mcl": {"likelihood": "gaussian"}, "ekf": {"patience": 2}},
        ),
        # What is true comes before what a filter believes.
        (("estimator=particle_filter", "read_probability=0.5"), {"world": {"read_probability": 0.5}}),
        (
            ("read_probability=0.5", "poll_s=1", "scale_x=0.1"),
            {"world": {"read_probability": 0.5, "poll_s": 1, "faults": {"scale_x": 0.1}}},
        ),
        # The last choice counts.
        (("estimator=markov", "estimator=mcl", "sigma_per_radius=1"), {"mcl": {"sigma_per_radius": 1}}),
    ],
)
def test_a_name_that_several_estimators_have_means_the_chosen_one_s(settings_, expected):
    found = apply_overrides({}, settings_)
    assert {key: value for key, value in found.items() if key != "estimator" or "estimator" in expected} == expected


def test_the_estimator_of_the_file_is_the_chosen_one_unless_it_is_set():
    data = {"estimator": "particle_filter"}
    assert apply_overrides(data, ("n_particles=60",))["particle_filter"] == {"n_particles": 60}
    assert apply_overrides(data, ("n_particles=60", "estimator=mcl"))["mcl"] == {"n_particles": 60}
    # What is no estimator is left for the check.
    for wrong in (3, "kalman", ["mcl"]):
        assert apply_overrides({"estimator": wrong}, ("n_particles=60",)) == {
            "estimator": wrong,
            "mcl": {"n_particles": 60},
        }


@pytest.mark.parametrize("setting", ["cell_mm=3", "uses_rssi=on", "softness_mm=3", "window_s=3", "model=mecanum"])
def test_a_name_of_estimators_that_are_not_chosen_is_unknown_if_there_are_several(setting):
    with pytest.raises(StudyError, match=f"--set: {setting.partition('=')[0]}: unknown key; allowed: "):
        apply_overrides({}, (setting,))


def test_setting_one_density_drops_the_other():
    both = {"design": {"tags_per_m2": 16.0, "layout": "x"}}
    assert apply_overrides(both, ("pitch_mm=250",)) == {"design": {"pitch_mm": 250, "layout": "x"}}
    assert apply_overrides({"design": {"pitch_mm": 99.0}}, ("tags_per_m2=4",)) == {"design": {"tags_per_m2": 4}}
    assert apply_overrides({}, ("tags_per_m2=4", "pitch_mm=250")) == {"design": {"pitch_mm": 250}}


def test_the_file_s_data_stay_as_they_were_and_the_last_setting_counts():
    data = {"design": {"layout": "a"}}
    assert apply_overrides(data, ("layout=b", "layout=c")) == {"design": {"layout": "c"}}
    assert data == {"design": {"layout": "a"}}


def test_a_value_where_the_file_should_have_a_table_is_left_for_the_check():
    assert apply_overrides({"design": 3}, ("layout=b",)) == {"design": 3}
    assert apply_overrides({"mcl": {"odometry": 3}}, ("mcl.odometry.noise_mm_per_s=1",)) == {"mcl": {"odometry": 3}}


@pytest.mark.parametrize(
    ("setting", "line"),
    [
        ("layout", "--set: found 'layout', must be KEY=VALUE"),
        ("", "--set: found '', must be KEY=VALUE"),
        ("layot=cross-8", "--set: layot: unknown key; allowed: "),
        ("floor=3", "--set: floor: unknown key; allowed: "),
        ("design.pitch_cm=3", "--set: design.pitch_cm: unknown key; allowed: "),
        ("noise_mm_per_s=3", "--set: noise_mm_per_s: unknown key; allowed: "),
        ("=3", "--set: unknown key; allowed: "),
    ],
)
def test_what_cannot_be_set_is_one_line(setting, line):
    with pytest.raises(StudyError) as caught:
        apply_overrides({}, (setting,))
    assert str(caught.value).startswith(line)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.sampled_from(sorted(settable_keys())), st.text())
@example("seed", "0x" + "f" * 5000)
def test_any_text_is_some_value(name, text):
    apply_overrides({}, (f"{name}={text}",))
