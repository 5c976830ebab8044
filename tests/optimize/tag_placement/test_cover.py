"""The cover matrix against driving each window by small steps, and its reductions against brute force."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from rfiddesign.geometry import Disc, Rectangle, RoundedRectangle, bar, listed, make_layout
from rfiddesign.optimize.tag_placement.cover import (
    Cover,
    cover_of,
    half_width,
    left_to_serve,
    sight_of,
    without_dominated,
)
from rfiddesign.optimize.tag_placement.places import tag_places
from rfiddesign.optimize.tag_placement.rules import PlacementRules
from rfiddesign.optimize.tag_placement.windows import windows_along

BEND = (np.array([[0.0, 0.0], [700.0, 0.0], [1100.0, 500.0]]),)
TURNED = listed([(60.0, 40.0, 0.5), (-30.0, -90.0, 1.2)])
RULES = PlacementRules(n_spare=0, margin_mm=2.0, along_mm=40.0, across_mm=40.0)


def along(road, distance):
    reached = np.cumsum([0.0, *np.hypot(*np.diff(road, axis=0).T)])
    leg = min(int(np.searchsorted(reached, distance, side="right")) - 1, len(road) - 2)
    direction = math.atan2(*(road[leg + 1] - road[leg])[::-1])
    return road[leg] + (distance - reached[leg]) * np.array([math.cos(direction), math.sin(direction)]), direction


def depth_seen(layout, area, road, begin, length, deviation, places, step=1.0):
    """How deep (n,) in any antenna's area each place comes to lie as the robot drives a window."""
    heading, lateral, yaw = deviation
    deepest = np.full(len(places), -np.inf)
    for distance in np.append(np.arange(begin, begin + length, step), begin + length):
        centre, direction = along(road, distance)
        centre = centre + lateral * np.array([-math.sin(direction), math.cos(direction)])
        facing = direction + heading + yaw
        for x, y, turn in layout.poses:
            c, s = math.cos(facing), math.sin(facing)
            antenna = centre + np.array([c * x - s * y, s * x + c * y])
            c, s = math.cos(facing + turn), math.sin(facing + turn)
            deepest = np.maximum(deepest, -area.signed_distance((places - antenna) @ np.array([[c, -s], [s, c]])))
    return deepest


@pytest.mark.parametrize(
    ("layout", "area"),
    [
        (make_layout("cross-8"), Disc(30.0)),
        (bar(3, 55.0), Disc(30.0)),
        (TURNED, Rectangle(120.0, 50.0)),
        (TURNED, RoundedRectangle(120.0, 90.0, 30.0)),
    ],
)
def test_places_serve_the_windows_along_which_they_are_seen(layout, area):
    windows, sight = windows_along(BEND, 50.0, 450.0), sight_of(layout, area, RULES)
    places = tag_places(BEND, half_width(sight), 40.0, 40.0)
    cover = cover_of(windows, cKDTree(places), sight, 1)
    rows = {tuple(cover.number[row]) for row in np.split(cover.rows.indices, cover.rows.indptr[1:-1])}
    assert len(rows) == cover.rows.shape[0]
    wanted = set()
    for w in range(1, windows.n_windows, 5):
        for heading, lateral, yaw in itertools.product((0, math.pi), (-50.0, 50.0), RULES.yaws_rad[2:]):
            deviation = (heading, lateral, yaw)
            depth = depth_seen(layout, area, BEND[0], windows.begins[w], 450.0, deviation, places)
            sure, possible = np.flatnonzero(depth > 2.3), set(np.flatnonzero(depth > 1.0).tolist())
            # Between the two depths the steps of the drive and the corners left out of outlines decide.
            assert any(set(sure.tolist()) <= set(row) <= possible for row in rows), (w, heading, lateral, yaw)
            wanted.add(tuple(sure))
    assert len(wanted) >= 8


def test_what_a_layout_sees_forward_and_backward_alike_is_listed_once():
    rules = PlacementRules()
    assert len(sight_of(make_layout("cross-8"), Disc(30.0), rules).offsets) == 9
    assert len(sight_of(TURNED, Disc(30.0), rules).offsets) == 18
    # A quarter turn shows a cross the same, though not an oblong antenna on it.
    sideways = PlacementRules(headings_rad=(0.0, math.pi / 2))
    assert len(sight_of(make_layout("cross-8"), Disc(30.0), sideways).offsets) == 9
    assert len(sight_of(make_layout("cross-8"), Rectangle(60.0, 40.0), sideways).offsets) == 18
    assert sight_of(make_layout("cross-8"), Rectangle(60.0, 40.0), rules).n_alike.tolist() == [2] * 9


def test_windows_that_no_place_serves_are_counted_before_those_alike_are_made_one():
    sight = sight_of(bar(1, 10.0), Disc(20.0), RULES)
    route = (np.array([[0.0, 0.0], [3000.0, 0.0]]),)
    windows = windows_along(route, 50.0, 450.0)
    allowed = shapely.box(-1000, -1000, 1500, 1000)
    places = tag_places(route, half_width(sight), 25.0, 25.0, allowed)
    cover = cover_of(windows, cKDTree(places), sight, 1)
    assert cover.n_windows == windows.n_windows * 18
    begins = cover.unserved[:, 0] - 225
    beyond = windows.begins[windows.begins > 1500 + 20]
    # A window that begins farther than an antenna reaches beyond the last allowed place sees none.
    assert set(beyond.round(3)) <= set(begins.round(3))
    # Those that begin within an antenna's reach of the last place are unserved in some deviations alone.
    assert 18 * len(beyond) <= cover.n_unserved <= 18 * np.count_nonzero(windows.begins >= 1500 - 20)
    assert begins.min() > 1450
    assert cover.rows.shape[0] < cover.n_windows - cover.n_unserved


def fewest(matrix, n_cover):
    n_places = matrix.shape[1]
    for size in range(n_places + 1):
        for chosen in itertools.combinations(range(n_places), size):
            if (matrix[:, chosen].sum(axis=1) >= n_cover).all():
                return size
    return None


@given(st.integers(0, 2**32 - 1), st.integers(1, 3))
@settings(max_examples=60, deadline=None)
def test_without_dominated_places_as_few_suffice(seed, n_cover):
    rng = np.random.default_rng(seed)
    matrix = rng.random((5, 9)) < rng.uniform(0.2, 0.8)
    matrix = matrix[matrix.sum(axis=1) >= n_cover].astype(np.int8)
    rows = csr_array(matrix)
    need = np.full(len(matrix), n_cover, np.int32)
    cover = Cover(rows, rows.T.tocsr(), need, np.arange(9), 0, 0, np.empty((0, 3)))
    smaller = without_dominated(cover)
    assert smaller.rows.shape == (len(matrix), len(smaller.number))
    assert (smaller.rows.toarray() == matrix[:, smaller.number]).all()
    assert (smaller.columns.toarray() == smaller.rows.toarray().T).all()
    assert fewest(smaller.rows.toarray(), n_cover) == fewest(matrix, n_cover)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_what_is_left_beside_laid_tags_completes_them(seed):
    rng = np.random.default_rng(seed)
    matrix = (rng.random((6, 9)) < 0.6).astype(np.int8)
    matrix = matrix[matrix.sum(axis=1) >= 2]
    rows = csr_array(matrix)
    need = np.full(len(matrix), 2, np.int32)
    is_laid = rng.random(9) < 0.3
    rest = left_to_serve(Cover(rows, rows.T.tocsr(), need, np.arange(9), 0, 0, np.empty((0, 3))), is_laid)
    assert not is_laid[rest.number].any()
    assert len(rest.number) == 9 - is_laid.sum()
    for _ in range(20):
        more = rng.random(len(rest.number)) < 0.5
        chosen = is_laid.copy()
        chosen[rest.number[more]] = True
        assert (rest.rows.toarray() @ more >= rest.need).all() == (matrix @ chosen >= 2).all()
