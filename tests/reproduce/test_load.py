"""From a reproduction's files to cases: names, defaults, and one line for whatever is wrong."""

import math
from pathlib import Path

import numpy as np
import pytest

from rfiddesign.errors import StudyError
from rfiddesign.estimators.geometric import Geometric
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.reproduce import load_reproduction
from rfiddesign.reproduce.cases import case_of
from rfiddesign.reproduce.context import Context
from rfiddesign.simulation.fixed_route import FixedRoute
from rfiddesign.simulation.scenario import Routes

OURS, ODOMETRY = "rows (table 1, MCL)", "rows (table 1, odometry)"
DENSITY = "tags_per_m2 = 100.0"
STUDY_FAULTS = {
    "unknown key": ("seed = 3", "sead = 3", "sead: unknown key; did you mean seed? allowed: analysis, "),
    "unknown key of a case": (DENSITY, "tags_per_m3 = 1.0", f"{OURS}: tags_per_m3: unknown key; did you mean"),
    "unknown key of a row": ('"route.speed_mm_per_s"', '"route.sped"', f"{ODOMETRY}: route.sped: unknown key"),
    "wrong type": ("[3.0, 3.0]", "3.0", f"{OURS}: floor_m: found 3.0; input should be a valid list"),
    "no density": (DENSITY, "", f"{OURS}: needs exactly one of tags_per_m2 and pitch_mm"),
    "below no table": (
        '"route.speed_mm_per_s"',
        '"tags_per_m2.x"',
        f"{ODOMETRY}: tags_per_m2.x is set below a value that is no table",
    ),
    "no such layout": (
        DENSITY,
        f'{DENSITY}\nlayout = "corss-8"',
        f"{OURS}: layout is 'corss-8', must be one of single",
    ),
    "no such antenna": (DENSITY, f'{DENSITY}\nantenna = "1x1"', f"{OURS}: antenna is '1x1', must be one of 30x30"),
    "no such estimator": ('"odometry", "r', '"odometer", "r', f"{ODOMETRY}: estimator: found 'odometer'; input"),
    "a route without corners": ('kind = "polyline"', 'kind = "circle"', "waypoints_mm belongs to a route of kind poly"),
    "an endless drive": (
        'kind = "polyline"\nwaypoints_mm = [[1000.0, 1000.0], [1400.0, 1000.0]]',
        'kind = "random"',
        f"{OURS}: duration_s is missing: random routes have no end",
    ),
    "nothing counts": (DENSITY, f"{DENSITY}\nsettle_s = 2.0", f"{OURS}: settle_s is 2.0, must be at least 0 and at"),
    "a row twice": ('row = "odometry"', 'row = "MCL"', "rows names (table 1, MCL) twice"),
    "a row without a name": ('row = "MCL"', "", "rows.0.row: is missing"),
    "no analysis of that name": ("seed = 3", 'seed = 3\nanalysis = "all"', "analysis: found 'all'; input should be"),
    "no such kind": ("seed = 3", 'seed = 3\nkind = "moon"', "kind: found 'moon', must be one of floor"),
    "no kind at all": ("seed = 3", "seed = 3\nkind = [1]", "kind: found [1], must be one of floor"),
    "not TOML": ("seed = 3", "seed = = 3", "is not TOML: Invalid value (at line 4, column 8)"),
}


@pytest.mark.parametrize(("old", "new", "words"), STUDY_FAULTS.values(), ids=STUDY_FAULTS)
def test_a_faulty_study_is_one_line_that_names_file_and_row(write, old, new, words):
    folder = write(old, new)
    with pytest.raises(StudyError) as caught:
        load_reproduction(str(folder))
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith(f"{folder / 'study.toml'}: ")
    assert words in line


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("at_least = 0.0\nat_most = 100.0", "", "claims.0: needs at_least or at_most"),
        ("at_most = 100.0", "at_most = nan", "claims.0.at_most: found nan; input should be a finite number"),
        ("x_mm = 1.25", "x_mm = inf", "published.table 1.MCL.x_mm: found inf; input should be a finite number"),
        ("x_mm = 1.25", 'x_mm = "1.25"', "published.table 1.MCL.x_mm: found '1.25'"),
        ("at_most = 100.0", "at_mots = 100.0", "claims.0.at_mots: unknown key; did you mean at_most?"),
    ],
)
def test_faulty_expectations_are_one_line(write, old, new, words):
    folder = write(old, new, "expected.toml")
    with pytest.raises(StudyError) as caught:
        load_reproduction(str(folder))
    assert str(caught.value).startswith(f"{folder / 'expected.toml'}: {words}")
    assert "\n" not in str(caught.value)


def test_a_study_without_rows_belongs_to_run(tiny):
    with pytest.raises(StudyError, match=r"is no reproduction \(it has no rows\); use `rfiddesign run`"):
        load_reproduction(str(tiny))


def test_a_name_is_a_path_or_a_folder_of_studies(write, tmp_path, monkeypatch):
    folder = write()
    assert load_reproduction(str(folder)).name == load_reproduction(str(folder / "study.toml")).name == "tiny"
    monkeypatch.chdir(tmp_path)
    assert load_reproduction("tiny").file == load_reproduction(str(folder)).file
    (tmp_path / "studies").mkdir()
    folder.rename(tmp_path / "studies" / "tiny")
    assert load_reproduction("tiny").path == Path("studies/tiny/study.toml")
    # Beside the package, whatever the working folder.
    assert load_reproduction("markov-smart-floor").file.analysis == "smart_floor"


def test_an_unknown_name_lists_the_known(write, tmp_path, monkeypatch):
    (tmp_path / "studies").mkdir()
    write().rename(tmp_path / "studies" / "tiny")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(StudyError) as caught:
        load_reproduction("tyni")
    line = str(caught.value)
    assert line.startswith("reproduce: found neither tyni/study.toml nor studies/tyni/study.toml; known: ")
    for name in ("tiny", "hf-multireader-mcl", "rssi-kalman-navifloor", "markov-smart-floor", "published-systems"):
        assert name in line


def test_what_is_expected_may_be_missing(write):
    folder = write()
    (folder / "expected.toml").unlink()
    loaded = load_reproduction(str(folder))
    assert (loaded.expected.published, loaded.expected.claims) == ({}, [])


def test_a_case_is_the_base_with_its_own_keys_on_top(write):
    loaded = load_reproduction(str(write()))
    ours, odometry = (case_of(loaded, row) for row in loaded.file.rows)
    assert isinstance(ours.scenario.estimator, Mcl)
    assert ours.scenario.estimator.n_particles == 50
    assert isinstance(odometry.scenario.estimator, Geometric)
    assert ours.scenario.routes == FixedRoute(
        ((1000.0, 1000.0), (1400.0, 1000.0)), 200.0, 0.0, math.radians(60.0), shift_mm=100.0
    )
    # As long as the route takes.
    assert (ours.scenario.duration_s, odometry.scenario.duration_s) == (pytest.approx(2.0), pytest.approx(4.0))
    assert ours.design == odometry.design
    assert ours.design.pattern.tags_per_m2 == pytest.approx(100.0)
    # The base stays as it was.
    assert loaded.file.base["route"]["speed_mm_per_s"] == 200.0
    assert case_of(loaded, loaded.file.rows[0]) == ours


def test_setting_one_density_drops_the_other(write):
    loaded = load_reproduction(str(write('estimator = "odometry"', "pitch_mm = 250.0")))
    assert case_of(loaded, loaded.file.rows[1]).design.pattern.tags_per_m2 == pytest.approx(16.0)


def test_an_analysis_may_change_a_case(write):
    loaded = load_reproduction(str(write()))
    context = Context(loaded, True, 1, (), {}, lambda *_: None)
    case = context.case("table 1", "odometry", route__speed_mm_per_s=50.0, estimator="mcl")
    assert case.scenario.routes.speed_mm_per_s == 50.0
    assert case.scenario.estimator.n_particles == 50
    errors = context.measure(case, 2, "slow")
    assert errors["x_mm"].shape == (2,)


def test_layouts_and_antennas_of_its_own(write):
    own = """
[layouts.pair]
kind = "bar"
n = 2
spacing_mm = 300.0
[antennas.wide]
rectangle_mm = [260.0, 100.0]
source = "assumption"
[antennas.round]
disc_radius_mm = 50.0
source = "assumption"
[base]
layout = "pair"
"""
    loaded = load_reproduction(str(write("[base]\n", own)))
    wide, disc = (
        case_of(loaded, row.model_copy(update={"set": {"antenna": name}}))
        for row, name in zip(loaded.file.rows, ("wide", "round"), strict=True)
    )
    assert wide.design.layout.n_readers == 2
    assert wide.design.antenna.area.area_mm2 == pytest.approx(260.0 * 100.0)
    assert disc.design.antenna.area.area_mm2 == pytest.approx(math.pi * 50.0**2)
    folder = write("[base]\n", own.replace("rectangle_mm = [260.0, 100.0]\n", ""))
    with pytest.raises(StudyError, match=r"antennas.wide: needs exactly one of disc_radius_mm and rectangle_mm"):
        load_reproduction(str(folder))


def test_circles_and_random_routes(write):
    loaded = load_reproduction(str(write()))
    row = loaded.file.rows[0]
    lap = {"kind": "circle", "radius_mm": 400.0, "heading_deg": 0.0, "start_deg": 90.0}
    circle = case_of(loaded, row.model_copy(update={"set": {"route": lap}})).scenario
    corners = np.array(circle.routes.waypoints_mm)
    # About the middle of the floor.
    np.testing.assert_allclose(np.hypot(*(corners - 1500.0).T), 400.0)
    np.testing.assert_allclose(corners[0], (1500.0, 1900.0))
    assert circle.duration_s == pytest.approx(2 * math.pi * 400.0 / 100.0, abs=0.06)
    random = {"kind": "random", "speed_mm_per_s": 250.0}
    scenario = case_of(loaded, row.model_copy(update={"set": {"route": random, "duration_s": 3.0}})).scenario
    assert scenario.routes == Routes((250.0,), 0.5, ("along",), math.radians(60.0))
    held = {**random, "heading_deg": 0.0}
    scenario = case_of(loaded, row.model_copy(update={"set": {"route": held, "duration_s": 3.0}})).scenario
    assert scenario.routes.headings == ("constant",)
