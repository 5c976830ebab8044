"""A study whose robots drive along routes: its section, its space, and a search from question to page."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import shapely

from rfiddesign.errors import StudyError
from rfiddesign.geometry import OnRoutesPattern, PlacedPattern, PlannedPattern
from rfiddesign.optimize.tag_placement import choose_tags
from rfiddesign.report.contents import read_contents
from rfiddesign.report.page import write_report
from rfiddesign.results.folder import read_record
from rfiddesign.results.routes import RoutesRecord
from rfiddesign.simulation import NetworkDrive, Routes, Simulator
from rfiddesign.study import load_study, run_study
from rfiddesign.study.candidates import find_candidates
from rfiddesign.study.commands import check_study
from rfiddesign.study.load import floor_of, scenario_of, space_of
from rfiddesign.study.route_placement import placement_rules
from rfiddesign.study.routes import network_of, strip_of

STUDY = Path(__file__).parents[1] / "routes-study"


@pytest.fixture
def folder(tmp_path):
    """The tiny study on routes, free to be changed."""
    return shutil.copytree(STUDY, tmp_path / STUDY.name)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Results of the tiny study on routes, drawn; not to be changed."""
    out = tmp_path_factory.mktemp("routes") / "out"
    run_study(load_study(STUDY), out, 2, lambda stage: None)
    write_report(out)
    return out


@pytest.fixture(scope="module")
def candidates():
    study = load_study(STUDY)
    floor = floor_of(study)
    with Simulator(scenario_of(study, floor), study.file.seed, 2) as simulator:
        return find_candidates(study, floor, simulator, lambda stage: None)


def changed(folder, old, new):
    path = folder / "study.toml"
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return folder


def test_robots_drive_the_routes_unless_the_study_says_otherwise(folder):
    study = load_study(folder)
    routes = scenario_of(study, floor_of(study)).routes
    assert isinstance(routes, NetworkDrive)
    assert (routes.lateral_mm, routes.yaw_rad) == (50.0, pytest.approx(np.radians(3.0)))
    assert len(routes.network.stations_mm) == 3
    changed(folder, "duration_s = 5.0", 'duration_s = 5.0\ndrive = "floor"')
    changed(folder, '"square-on-routes", "routes"]', '"random"]')
    study = load_study(folder)
    assert isinstance(scenario_of(study, floor_of(study)).routes, Routes)


def test_the_space_holds_patterns_on_the_floor_and_on_routes(folder):
    study = load_study(folder)
    kinds = [type(pattern) for pattern in space_of(study, floor_of(study)).patterns]
    assert kinds[2:] == [OnRoutesPattern, OnRoutesPattern, PlannedPattern, PlannedPattern]
    assert check_study(study)["space"]["n_combinations"] == 12


def test_candidates_have_their_tags_placed_and_pay_for_what_is_tagged(candidates):
    study = load_study(STUDY)
    floor = floor_of(study)
    swath_m2 = network_of(study.file, study.path, floor).swath.area / 1e6
    strip = strip_of(study.file, study.path, floor)
    assert len(candidates.by_number) == 12
    for found in candidates.by_number.values():
        pattern = found.design.pattern
        is_whole = pattern.name == "square"
        assert found.tagged_m2 == pytest.approx(floor.area_m2 if is_whole else swath_m2)
        tags = pattern.lay(floor.drivable)
        assert found.n_tags == len(tags)
        if not is_whole:
            assert shapely.covers(strip.swath.buffer(1e-6), shapely.points(tags)).all()
        if isinstance(pattern, PlacedPattern):
            rules = placement_rules(study.file, found.design, pattern.distance_mm)
            robot = (found.design.layout, found.design.antenna.area)
            expected = choose_tags(strip.routes_mm, *robot, rules, strip.swath, study.file.seed)
            np.testing.assert_array_equal(pattern.points_mm, expected)


def test_tags_for_longer_distances_are_fewer_and_hang_on_the_layout(candidates):
    n_tags = {
        (found.design.layout.name, found.design.pattern.distance_mm): found.n_tags
        for found in candidates.by_number.values()
        if isinstance(found.design.pattern, PlacedPattern)
    }
    assert len(n_tags) == 4
    for layout in ("cross-8", "pair"):
        assert n_tags[layout, 300.0] < n_tags[layout, 150.0]
    assert n_tags["cross-8", 150.0] < n_tags["pair", 150.0]


def test_the_study_ends_in_an_answer_beside_that_of_the_other_kind(done):
    result = json.loads((done / "result.json").read_text())
    routes = read_record(done / "routes.json", RoutesRecord)
    answer, other = routes.cheapest
    winner = result["answers"][0]["winner"]
    assert (answer.is_answer, other.is_answer) == (True, False)
    assert answer.is_whole_floor != other.is_whole_floor
    assert (answer.winner.design, answer.winner.cost_cents) == (winner["design"], winner["cost_cents"])
    assert answer.winner.verdict == other.winner.verdict == "certified"
    assert other.winner.cost_cents >= answer.winner.cost_cents
    assert answer.n_candidates + other.n_candidates == 12
    assert routes.network.n_stations == 3
    edges = [shapely.LineString(edge.points_mm).length for edge in routes.network.edges]
    assert sum(edges) == pytest.approx(1e3 * routes.network.length_m)


def test_one_worker_writes_what_two_do(done, tmp_path):
    out = tmp_path / "out"
    run_study(load_study(STUDY), out, 1, lambda stage: None)
    for name in ("result.json", "routes.json", "tags.csv", "certificate.json"):
        assert (out / name).read_bytes() == (done / name).read_bytes()


def test_the_tags_of_the_answer_lie_on_the_strip_alone(done):
    study = load_study(STUDY)
    tags = read_contents(done).answers[0].tags_mm
    swath = network_of(study.file, study.path, floor_of(study)).swath
    assert len(tags) == json.loads((done / "design.json").read_text())["n_tags"]
    # Written to a tenth of a millimetre.
    assert shapely.covers(swath.buffer(0.1), shapely.points(tags)).all()


def test_the_page_has_a_section_on_routes_with_a_plan(done):
    page = (done / "report.html").read_text()
    assert '<section id="routes">' in page
    assert "between 3 stations" in page
    assert 'id="figure-routes-robots-1"' in page
    assert (done / "figures" / "routes-robots-1.svg").stat().st_size > 10_000


@pytest.mark.usefixtures("without_pictures")
def test_a_placed_design_is_bounded_and_checked(folder, tmp_path):
    """With tags to be placed alone, the answer has a placement whose numbers agree with each other."""
    changed(folder, '["square", "square-on-routes", "routes"]', '["routes"]')
    changed(folder, '["cross-8", "pair"]', '["cross-8"]')
    changed(folder, "[150.0, 300.0]", "[200.0]")
    out = tmp_path / "out"
    result = run_study(load_study(folder), out, 2, lambda stage: None)
    routes = read_record(out / "routes.json", RoutesRecord)
    (placement,) = routes.placements
    design = next(each for each in result.designs if each.number == result.answers[0].winner.design)
    assert placement.n_tags == design.n_tags
    assert 0 < placement.lower_bound <= placement.n_tags
    assert placement.gap == pytest.approx(1 - placement.lower_bound / placement.n_tags)
    assert placement.min_cover >= 2
    assert placement.n_tags_in_lines is None or placement.n_tags_in_lines >= placement.lower_bound
    if placement.n_unserved == 0:
        # One step of the check beside the promise.
        assert placement.drive.planned_spare_mm <= 200.0 + 8.0
    write_report(out)
    assert "tags placed for cross-8" in (out / "report.html").read_text()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("stations_m = [[0.6, 0.6], [5.4, 0.6], [3.0, 4.4]]", "", "routes: needs exactly one of stations"),
        ("stations_m = [[0.6, 0.6], [5.4, 0.6], [3.0, 4.4]]", "stations = 1", "routes.stations: "),
        ("[5.4, 0.6]", "[9.0, 0.6]", r"routes.stations_m: stations\[1\] is \(9000, 600\)"),
        ("[150.0, 300.0]", "[40.0]", "must be above delta_mm"),
        ("[150.0, 300.0]", "[150.0, 150.0]", "must not name a distance twice"),
        ("search_rounds = 2000", "search_runs = 2000", "unknown key; did you mean search_rounds"),
        ("duration_s = 5.0", 'duration_s = 5.0\ndrive = "floor"', 'space.pattern "square-on-routes" needs robots'),
        ('"square-on-routes"', '"striped-on-routes"', "space.pattern"),
    ],
)
def test_a_section_at_fault_is_named(folder, old, new, words):
    changed(folder, old, new)
    with pytest.raises(StudyError, match=words):
        check_study(load_study(folder))


def test_routes_that_no_section_describes_are_refused(folder):
    text = (folder / "study.toml").read_text()
    begin, end = text.index("[routes]"), text.index("[space]")
    (folder / "study.toml").write_text(text[:begin] + text[end:])
    with pytest.raises(StudyError, match=r'space.pattern "square-on-routes" needs robots that drive along'):
        load_study(folder)
    changed(folder, '["square", "square-on-routes", "routes"]', '["square"]')
    changed(folder, "duration_s = 5.0", 'duration_s = 5.0\ndrive = "routes"')
    with pytest.raises(StudyError, match=r"needs a section \[routes\]"):
        load_study(folder)


def test_antennas_that_no_tag_can_serve_are_unbuildable(folder):
    """A margin that leaves nothing of the antenna's area."""
    changed(folder, "search_rounds = 2000", "search_rounds = 2000\nmargin_mm = 500.0")
    study = load_study(folder)
    floor = floor_of(study)
    with Simulator(scenario_of(study, floor), study.file.seed, 1) as simulator:
        found = find_candidates(study, floor, simulator, lambda stage: None)
    assert len(found.by_number) == 8
    assert {fault.layout_name for fault in found.unbuildable} == {"cross-8", "pair"}
    assert all("margin_mm = 500" in fault.reason for fault in found.unbuildable)
