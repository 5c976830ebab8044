"""What a placement promises: few tags, every window served, any one tag may die; and the drive that checks it."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.geometry import Disc, RoundedRectangle, bar, listed, make_layout
from rfiddesign.optimize.tag_placement import PlacementRules, place_tags
from rfiddesign.optimize.tag_placement.drive_check import STEP_MM, drive_check

AREA, BAR, CROSS = Disc(30.0), bar(8, 55.0), make_layout("cross-8")
STRAIGHT = (np.array([[0.0, 0.0], [3000.0, 0.0]]),)
#: A bend, and a fork: two routes end where the first does.
FORK = (
    np.array([[0.0, 0.0], [1200.0, 0.0], [1800.0, 700.0]]),
    np.array([[1800.0, 700.0], [1800.0, 2100.0]]),
    np.array([[3300.0, 900.0], [1800.0, 700.0]]),
)
QUICK = PlacementRules(n_search_rounds=1000)


@pytest.mark.parametrize("n_spare", [0, 1, 2])
def test_a_bar_over_a_straight_route_needs_one_tag_per_window_and_seen_length(n_spare):
    rules = PlacementRules(n_spare=n_spare, n_search_rounds=2000, margin_mm=0.0)
    placement = place_tags(STRAIGHT, BAR, AREA, rules)
    # By hand: windows of 450 mm, and a tag is seen for at most 60 mm; the drive holds ceil((3000 - 510) / 510) gaps.
    fewest = math.floor(3000 / 510) * (1 + n_spare)
    assert fewest <= placement.lower_bound <= placement.n_tags <= fewest + 1 + n_spare
    assert placement.min_cover == 1 + n_spare
    assert placement.n_unserved == 0
    assert placement.n_windows == 60 * 18 - 8 * 18
    assert placement.gap == 1 - placement.lower_bound / placement.n_tags


@pytest.mark.parametrize("layout", [BAR, CROSS])
def test_on_bends_and_forks_a_read_comes_in_time_with_any_one_tag_dead(layout):
    placement = place_tags(FORK, layout, AREA, QUICK)
    assert placement.lower_bound <= placement.n_tags <= placement.n_greedy
    assert placement.min_cover == 2
    assert placement.drive.planned_mm <= 500 + STEP_MM
    assert placement.drive.planned_mm < placement.drive.planned_spare_mm <= 500 + STEP_MM


def test_the_look_at_dead_tags_tells_what_a_drive_without_them_does():
    routes = (np.array([[0.0, 0.0], [800.0, 0.0], [1300.0, 400.0]]),)
    placement = place_tags(routes, CROSS, AREA, QUICK)
    longest = [
        drive_check(routes, CROSS, AREA, np.delete(placement.tags_mm, n, axis=0), QUICK)
        for n in range(placement.n_tags)
    ]
    assert max(without.planned_mm for without in longest) == pytest.approx(placement.drive.planned_spare_mm)
    assert max(without.random_mm for without in longest) == pytest.approx(placement.drive.random_spare_mm)


def test_a_tag_seen_only_where_the_robot_stops_to_turn_is_read():
    # Before it turns the robot has an antenna 200 mm beyond the bend, whichever way it faces.
    ahead, routes = listed([(200.0, 0.0), (-200.0, 0.0)]), (np.array([[0.0, 0.0], [301.0, 0.0], [301.0, 400.0]]),)
    rules = PlacementRules(lateral_mm=0.0, n_laterals=1, yaw_rad=0.0, n_yaws=1)
    for beyond, longest in ((29.5, 400.0), (30.5, 701.0)):
        check = drive_check(routes, ahead, AREA, np.array([[501.0 + beyond, 0.0]]), rules)
        assert check.planned_mm == pytest.approx(longest, abs=STEP_MM)
        assert check.planned_spare_mm == pytest.approx(701.0)


def test_without_a_spare_a_dead_tag_leaves_a_gap():
    placement = place_tags(STRAIGHT, BAR, AREA, PlacementRules(n_spare=0, n_search_rounds=2000))
    assert placement.drive.planned_mm <= 500 + STEP_MM
    assert placement.drive.planned_spare_mm > 600


def test_a_margin_of_half_the_steps_serves_what_lies_between_the_deviations():
    # Steps of 25 mm and 1.5 deg at 250 mm from the centre.
    margin = 12.5 + 250 * math.radians(0.75)
    loose = PlacementRules(n_search_rounds=2000, n_laterals=5, n_yaws=5)
    tight = PlacementRules(n_search_rounds=2000, n_laterals=5, n_yaws=5, margin_mm=margin, across_mm=12.5)
    without = place_tags(STRAIGHT, CROSS, AREA, PlacementRules(n_search_rounds=2000))
    assert without.drive.random_spare_mm > 600
    placement = place_tags(STRAIGHT, CROSS, AREA, tight)
    assert placement.n_unserved == 0
    assert placement.drive.random_spare_mm <= 500 + STEP_MM
    assert placement.n_tags > place_tags(STRAIGHT, CROSS, AREA, loose).n_tags


def test_tags_keep_to_the_allowed_region_and_their_distance():
    allowed = shapely.box(-500, -40, 3500, 300)
    rules = PlacementRules(n_search_rounds=2000, min_tag_distance_mm=100.0)
    placement = place_tags(STRAIGHT, BAR, RoundedRectangle(60.0, 60.0, 20.0), rules, allowed)
    assert shapely.contains_xy(allowed, placement.tags_mm).all()
    apart = np.hypot(*(placement.tags_mm[:, None] - placement.tags_mm[None]).transpose(2, 0, 1))
    assert apart[np.triu_indices(placement.n_tags, 1)].min() >= 100 - 1e-9
    assert placement.drive.planned_spare_mm <= 500 + STEP_MM


def test_windows_without_allowed_places_are_counted_and_told():
    allowed = shapely.box(-500, -300, 1000, 300)
    placement = place_tags(STRAIGHT, BAR, AREA, QUICK, allowed)
    assert placement.n_unserved > 0
    assert len(placement.unserved) > 20
    assert placement.unserved[:, 0].min() > 1000
    assert placement.min_cover == 2
    assert placement.drive.planned_mm > 1900


@pytest.mark.parametrize("is_in_lines", [False, True])
def test_parts_of_a_floor_together_serve_all_of_it(monkeypatch, is_in_lines):
    rules = PlacementRules(n_search_rounds=2000, is_in_lines=is_in_lines)
    whole = place_tags(FORK, BAR, AREA, rules)
    monkeypatch.setattr("rfiddesign.optimize.tag_placement.choose.PART_WINDOWS", 30)
    placement = place_tags(FORK, BAR, AREA, rules)
    assert placement.min_cover >= 2
    assert placement.drive.planned_spare_mm <= 500 + STEP_MM
    assert placement.n_windows == whole.n_windows
    assert max(whole.lower_bound, placement.lower_bound) <= min(whole.n_tags, placement.n_tags)
    assert placement.lower_bound >= 0.8 * whole.lower_bound
    assert placement.n_tags <= 1.2 * whole.n_tags


def test_the_answer_hangs_on_its_arguments_only():
    first, again = (place_tags(FORK, BAR, AREA, QUICK, seed=5) for _ in range(2))
    assert (first.tags_mm == again.tags_mm).all()
    assert first.drive == again.drive


@given(st.floats(0, 2 * math.pi), st.integers(0, 2**32 - 1))
@settings(max_examples=6)
def test_random_bends_are_served(angle, seed):
    rng = np.random.default_rng(seed)
    turns = angle + np.cumsum(rng.uniform(-1.2, 1.2, 5))
    route = np.cumsum(rng.uniform(150, 700, (5, 1)) * np.stack([np.cos(turns), np.sin(turns)], axis=-1), axis=0)
    placement = place_tags((route,), BAR, AREA, PlacementRules(n_search_rounds=500))
    assert placement.min_cover == 2
    assert placement.n_unserved == 0
    assert placement.drive.planned_spare_mm <= 500 + STEP_MM


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"distance_mm": 40.0}, "delta_mm = 50: must be below distance_mm = 40"),
        ({"n_spare": -1}, "n_spare = -1"),
        ({"n_laterals": 0}, "n_laterals = 0"),
        ({"headings_rad": ()}, "headings_rad is empty"),
        ({"margin_mm": 30.0}, "margin_mm = 30: leaves nothing"),
        ({"along_mm": 1e-4}, "along_mm, across_mm = 0.0001, 25"),
        ({"min_tag_distance_mm": 700.0}, "min_tag_distance_mm = 700: leaves"),
    ],
)
def test_rules_that_cannot_be_kept_are_refused(changed, message):
    with pytest.raises(ValueError, match=message):
        place_tags(STRAIGHT, BAR, AREA, PlacementRules(**changed))
