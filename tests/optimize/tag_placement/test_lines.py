"""Lines of tags: few rows at one rhythm, which serve a straight road however long, and what they cost."""

import math

import numpy as np
import pytest
import shapely

from rfiddesign.geometry import Disc, bar, make_layout
from rfiddesign.optimize.tag_placement import PlacementRules, place_tags
from rfiddesign.optimize.tag_placement.cover import sight_of
from rfiddesign.optimize.tag_placement.drive_check import STEP_MM, drive_check
from rfiddesign.optimize.tag_placement.lines import line_tags, rhythm

AREA, BAR, CROSS = Disc(30.0), bar(8, 55.0), make_layout("cross-8")
RULES = PlacementRules(n_search_rounds=1000, is_in_lines=True)


@pytest.mark.parametrize("layout", [BAR, CROSS])
def test_lines_alone_serve_a_long_road_in_time_with_any_tag_dead(layout):
    period, places = rhythm(sight_of(layout, AREA, RULES), RULES)
    # Two tags to a window and the length along which a tag is seen.
    assert len(places) / period >= 2 / 510
    assert (places[:, 0] >= 0).all()
    assert (places[:, 0] < period).all()
    road = (np.array([[0.0, 0.0], [10_000.0, 0.0]]),)
    tags = line_tags(road, sight_of(layout, AREA, RULES), RULES, None)
    assert len(tags) == pytest.approx(10_000 * len(places) / period, abs=len(places))
    inner = (np.array([[600.0, 0.0], [9300.0, 0.0]]),)
    assert drive_check(inner, layout, AREA, tags, RULES).planned_spare_mm <= 500 + STEP_MM
    assert len(np.unique(tags[:, 1])) <= len(places)


def test_lines_turn_with_their_leg():
    angle = 0.7
    road = (np.array([[100.0, 50.0], [100 + 5000 * math.cos(angle), 50 + 5000 * math.sin(angle)]]),)
    sight = sight_of(BAR, AREA, RULES)
    straight = line_tags((np.array([[0.0, 0.0], [5000.0, 0.0]]),), sight, RULES, None)
    turned = line_tags(road, sight, RULES, None) - (100.0, 50.0)
    back = turned @ np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    assert back == pytest.approx(straight, abs=1e-6)


@pytest.mark.slow
def test_bends_get_single_tags_besides_and_lines_cost_more():
    routes = (np.array([[0.0, 0.0], [1500.0, 0.0], [1900.0, 300.0], [1900.0, 1800.0]]),)
    free = place_tags(routes, CROSS, AREA, PlacementRules(n_search_rounds=1000))
    placement = place_tags(routes, CROSS, AREA, RULES)
    assert 0 < placement.n_in_lines < placement.n_tags
    assert placement.min_cover >= 2
    assert placement.drive.planned_spare_mm <= 500 + STEP_MM
    assert free.n_in_lines == 0
    assert free.n_tags < placement.n_tags
    assert placement.method == "search"


def test_lines_keep_to_the_allowed_region_and_their_distance():
    routes = tuple(np.array([[0.0, 0.0], end]) for end in ([3000.0, 0.0], [0.0, 3000.0]))
    rules = PlacementRules(is_in_lines=True, min_tag_distance_mm=60.0)
    allowed = shapely.box(-1000, -1000, 2000, 2000)
    tags = line_tags(routes, sight_of(BAR, AREA, rules), rules, allowed)
    assert len(tags) > 10
    assert shapely.contains_xy(allowed, tags).all()
    apart = np.hypot(*(tags[:, None] - tags[None]).transpose(2, 0, 1))
    assert apart[np.triu_indices(len(tags), 1)].min() >= 60 - 1e-6
