"""From a study's files to records: defaults, names, units, and one line for whatever is wrong."""

import json
import math
import tempfile
import tomllib
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.errors import StudyError
from rfiddesign.study import check_study, load_study
from rfiddesign.study.estimators import estimators_of
from rfiddesign.study.load import design_of, floor_of, reader_of, scenario_of, space_of

TINY = Path(__file__).parents[1] / "tiny-study"
STUDIES = Path(__file__).parents[2] / "studies"
TEXT = (TINY / "study.toml").read_text()


def test_a_study_is_named_by_its_folder_or_its_file(tiny):
    assert load_study(tiny).file == load_study(tiny / "study.toml").file
    assert load_study(str(tiny)).name == "tiny-study"


@pytest.mark.parametrize("name", ["as-built-survey", "floor-or-shelf"])
def test_studies_of_surveys_and_shelves_can_be_loaded(name):
    assert load_study(STUDIES / name).name == name


def test_what_the_file_does_not_say_has_the_documented_defaults(tiny):
    file = load_study(tiny).file
    assert file.prices == "prices.toml"
    assert (file.scenario.start, file.scenario.dt_s, file.scenario.aligned_share) == ("known", 0.05, 0.5)
    assert (file.mcl.likelihood, file.mcl.reinitialize) == ("combination", True)
    assert (file.world.read_probability, file.world.installation_error_mm) == (1.0, 0.0)
    assert file.search.next_best == 1
    assert design_of(load_study(tiny)).name == "cross-8, 60x60, square, 100 tags/m2"


def test_prices_are_exact_with_their_sources(tiny):
    prices = load_study(tiny).prices
    assert prices.currency == "EUR"
    assert prices.survey_per_m2.amount == Decimal("1.205")
    assert prices.reader.source == "offer"
    assert dict(prices.antennas)["80x80"].amount == 10
    assert [(channels, price.amount) for channels, price in prices.controllers] == [(4, 55), (8, 95)]


def test_angles_are_degrees_in_the_file_and_radians_in_the_requirement(tiny, edit):
    edit("position_p95_mm = 13.0", "heading_p95_deg = 3.0\nconverged_within_s = 2.0")
    requirement = load_study(tiny).requirement
    assert requirement.limits == (("heading_p95_rad", math.radians(3.0)),)
    assert requirement.converged_within_s == 2.0


def test_the_space_is_every_combination_in_the_order_of_the_file(tiny):
    names = [design.name for design in space_of(load_study(tiny)).designs()]
    assert len(names) == 2 * 2 * 2 * 3
    assert names[0] == "cross-8, 60x60, square, 16 tags/m2"
    assert names[4] == "cross-8, 60x60, random, 64 tags/m2"
    assert names[12] == "pair, 60x60, square, 16 tags/m2"


def test_errors_count_from_the_time_to_converge_if_the_start_is_unknown(tiny, edit):
    edit("position_p95_mm = 13.0", "position_p95_mm = 13.0\nconverged_within_s = 2.0")
    for setting, settle_s in (("start=known", 0.0), ("start=unknown", 2.0), ("settle_s=1.5", 1.5)):
        study = load_study(tiny, (setting,))
        assert scenario_of(study, floor_of(study)).settle_s == settle_s


def test_the_filter_believes_the_true_noise_unless_told_otherwise(tiny):
    study = load_study(tiny, ("world.odometry.noise_mm_per_s=99.0",))
    scenario = scenario_of(study, floor_of(study))
    assert scenario.estimator.motion == scenario.world.motion
    study = load_study(tiny, ("world.odometry.noise_mm_per_s=99.0", "mcl.odometry.noise_mm_per_s=1.0"))
    scenario = scenario_of(study, floor_of(study))
    assert scenario.estimator.motion != scenario.world.motion


def test_settings_reach_design_and_filter(tiny):
    settings_ = (
        "layout=pair", "antenna=80x80", "pattern=triangular", "pitch_mm=200", "likelihood=gaussian",
        "reinitialize=off", "n_particles=33", "start=unknown",
    )  # fmt: skip
    study = load_study(tiny, settings_)
    design, estimator = design_of(study), estimators_of(study.file, study.file.world, 300.0)[study.file.estimator]
    assert (design.layout.name, design.antenna.name, design.pattern.name) == ("pair", "80x80", "triangular")
    assert design.pattern.tags_per_m2 == pytest.approx(2e6 / math.sqrt(3) / 200**2)
    assert (estimator.likelihood.kind, estimator.reinitialize, estimator.n_particles) == ("gaussian", False, 33)
    assert scenario_of(study, floor_of(study)).start == "unknown"


def test_a_pitch_in_the_file_gives_way_to_a_density_set(tiny, edit):
    edit("[search]", "[design]\npitch_mm = 250.0\n[search]")
    assert design_of(load_study(tiny)).pattern.tags_per_m2 == pytest.approx(16.0)
    assert design_of(load_study(tiny, ("tags_per_m2=49",))).pattern.tags_per_m2 == pytest.approx(49.0)


def test_a_layout_of_one_s_own_goes_by_its_key(tiny, edit):
    assert load_study(tiny).file.layouts["pair"]["n"] == 2
    edit("n = 2", 'n = 2\nname = "cross-8"')
    with pytest.raises(StudyError, match=r"layouts.pair.name: unknown key; the layout's name is 'pair' already"):
        load_study(tiny)


def test_a_layout_of_one_s_own_does_not_shadow_one_of_the_paper(tiny):
    path = tiny / "study.toml"
    path.write_text(path.read_text() + '\n[layouts.cross-8]\nkind = "single"\n')
    with pytest.raises(StudyError, match=r"layouts\.cross-8: is a layout of hf_multireader_mcl already"):
        load_study(tiny)


def test_an_antenna_of_the_space_needs_a_price_and_one_outside_it_does_not(tiny, edit):
    edit('"80x80" = { price = 10.00, source = "assumption" }', "", file="prices.toml")
    with pytest.raises(StudyError, match=r"prices.toml: per_robot.antenna: has no price for antenna '80x80'"):
        load_study(tiny)
    load_study(tiny, ('space.antenna=["60x60"]', "antenna=80x80"))


def test_the_readers_are_those_of_the_robot(tiny):
    assert reader_of(load_study(tiny)).name == "hf-anticollision"
    study = load_study(tiny, ("reader=goetting-hg-g-98830",))
    assert reader_of(study).sees_one_tag_only
    assert design_of(study).reader == space_of(study).reader == reader_of(study)
    with pytest.raises(StudyError, match=r"study.toml: robot.reader: reader is 'x', must be one of hf-anticollision, "):
        load_study(tiny, ("reader=x",))


NAMES = [
    "cross-8", "bar", "list", "60x60", "square", "random", "unknown", "prices.toml", ".", "/dev/null", "histogram",
    "quantized_ekf", "mecanum", "multiplexed", "all", "goetting-hg-g-98830",
]  # fmt: skip
SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-5, 300),
    st.sampled_from([10**400, 2**63, -(10**30), 1e308, -1e308, 5e-324, 0.0, -0.0, math.inf, math.nan]),
    st.floats(-10, 1e6),
    st.text(max_size=8),
    st.sampled_from(NAMES),
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


NUMBERS = st.one_of(
    st.integers(-1, 20),
    st.floats(1e-6, 1e6),
    st.sampled_from([0.0, 1e-308, 1e-9, 0.5, 1.0, 1e9, 10_000, 100_000, 1_000_000, 2**62]),
)


def toml_of(value: object) -> str:
    """A value as TOML on one line."""
    if isinstance(value, dict):
        inside = ", ".join(f"{json.dumps(key)} = {toml_of(item)}" for key, item in value.items())
        return f"{{{inside}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(toml_of, value))}]"
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else str(value)
    return json.dumps(value) if value is not None else '""'


def toml_file(data: dict) -> str:
    """A study file."""
    return "\n".join(f"{json.dumps(key)} = {toml_of(value)}" for key, value in data.items())


def at(data: dict, path: tuple) -> object:
    """What stands at a key path, None if nothing does."""
    for key in path:
        data = data.get(key) if isinstance(data, dict) else None
    return data


def places(data: dict, prefix: tuple = ()) -> list[tuple]:
    """Key paths of all tables and values."""
    found = []
    for key, value in data.items():
        found.append((*prefix, key))
        if isinstance(value, dict):
            found += places(value, (*prefix, key))
    return found


DATA = tomllib.loads(TEXT)
PLACES = [
    *places(DATA),
    ("design", "layout"), ("design", "pattern"), ("design", "pitch_mm"), ("design", "tags_per_m2"),
    ("layouts", "pair", "poses"), ("layouts", "pair", "width"), ("layouts", "pair", "radius_mm"), ("layouts", "own"),
    ("scenario", "dt_s"), ("scenario", "settle_s"), ("scenario", "headings"), ("scenario", "aligned_share"),
    ("world", "polling"), ("world", "odometry"), ("world", "odometry", "model"), ("world", "faults"),
    ("world", "delay_s"), ("world", "answers"), ("world", "poll_s"), ("mcl", "beta"), ("mcl", "odometry"),
    ("estimator",), ("particle_filter",), ("ekf", "patience"), ("ekf", "odometry"), ("markov", "n_cells"),
    ("geometric", "window"), ("histogram", "cell_mm"), ("robot", "reader"),
    ("floor", "map"), ("prices",), ("unknown",),
]  # fmt: skip


def changed(data: dict, path: tuple, value: object) -> dict:
    """A copy with one place changed."""
    key, *rest = path
    inner = data.get(key)
    return data | {key: changed(inner if isinstance(inner, dict) else {}, tuple(rest), value) if rest else value}


def read_all(text: str | bytes) -> None:
    """Load and check a study of that text: a summary, or a StudyError of one line."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "prices.toml").write_bytes((TINY / "prices.toml").read_bytes())
        (folder / "study.toml").write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "replace"))
        try:
            study = load_study(folder)
            check_study(study)
            design_of(study)
        except StudyError as error:
            line = str(error)
        else:
            line = name
    assert "\n" not in line
    assert name in line


def of_like_shape(value: object) -> st.SearchStrategy:
    """Values of the same type that a careless hand might put there."""
    if isinstance(value, list):
        return st.lists(of_like_shape(value[0]), max_size=3)
    return NUMBERS if isinstance(value, int | float) else SCALARS


NUMERIC_PLACES = [path for path in PLACES if isinstance(at(DATA, path), int | float | list)]


@settings(deadline=None, derandomize=True, max_examples=300)
@given(st.data())
def test_numbers_of_any_size_give_a_study_or_one_line_that_names_the_file(data):
    changes = data.draw(st.lists(st.sampled_from(NUMERIC_PLACES), min_size=1, max_size=2))
    study = DATA
    for path in changes:
        study = changed(study, path, data.draw(of_like_shape(at(DATA, path))))
    read_all(toml_file(study))


@settings(deadline=None, derandomize=True, max_examples=300)
@given(st.lists(st.tuples(st.sampled_from(PLACES), VALUES), min_size=1, max_size=3))
def test_whatever_stands_at_a_key_gives_a_study_or_one_line_that_names_the_file(changes):
    data = DATA
    for path, value in changes:
        data = changed(data, path, value)
    read_all(toml_file(data))


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.integers(0, len(TEXT)), st.integers(0, 12), st.binary(max_size=6) | st.sampled_from([b"]", b"[", b"=", b'"']))
def test_a_slip_anywhere_in_the_text_gives_a_study_or_one_line_that_names_the_file(place, n_lost, put):
    content = TEXT.encode()
    read_all(content[:place] + put + content[place + n_lost :])
