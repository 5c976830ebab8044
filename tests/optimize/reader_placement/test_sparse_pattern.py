"""The sparsest rows for large antennas, and readers that take time."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.catalog import Antenna, antenna
from rfiddesign.geometry import Disc, Rectangle, blind_distances, make_pattern, single
from rfiddesign.optimize.reader_placement import Drive, PlacementProblem, sparsest_patterns
from rfiddesign.optimize.reader_placement.motion import sweeps
from rfiddesign.optimize.reader_placement.read_time import with_read_time

BASE = make_pattern("square", pitch_mm=230.0)


STEP = 0.25


def marched(area, tags, way_mm, distance_mm):
    """What is driven until the first tag has been in view for `way_mm` without a break; inf beyond the distance.

    Parameters
    ----------
    tags : (n, 2) ahead and to the left of the antenna [mm].
    """
    driven = np.arange(0.0, distance_mm + STEP, STEP)
    first = math.inf
    for seen in area.contains(tags[:, None] - np.stack([driven, np.zeros_like(driven)], axis=-1)):
        # A convex area sees a tag once: its view begins with the first place that has it.
        (places,) = np.nonzero(seen)
        if len(places) and driven[places[-1]] - driven[places[0]] >= way_mm:
            first = min(first, driven[places[0]] + way_mm)
    return first


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from([Disc(60.0), Rectangle(180.0, 90.0)]),
    st.tuples(st.floats(0, 230), st.floats(0, 230), st.floats(0, 1.5)),
    st.floats(10.0, 60.0),
)
def test_a_read_ends_where_a_tag_has_been_in_view_for_its_time(area, pose, way_mm):
    asked = PlacementProblem(Antenna("test", (60.0, 60.0), area, "test"), BASE, 400.0, 320.0)
    slow = with_read_time(asked, 200.0, way_mm / 200.0)
    (sweep,) = sweeps(slow)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    start = np.array([[pose[0] + cos * way_mm / 2, pose[1] + sin * way_mm / 2, pose[2]]])
    found = sweep.first_reads(start, slow.basis, np.zeros((1, 2)))[0, 0] * sweep.distance + way_mm
    tags = asked.lattice.points_in((pose[0] - 700, pose[1] - 700, pose[0] + 700, pose[1] + 700)) - pose[:2]
    tags = tags @ np.array([[cos, -sin], [sin, cos]])
    slack = 3 * STEP
    assert marched(area, tags, way_mm - slack, 400.0 + slack) - slack <= found
    assert found <= marched(area, tags, way_mm + slack, 400.0 - slack) + slack


def test_the_best_rows_for_a_wide_antenna_are_triangular_with_rows_a_swath_apart():
    asked = PlacementProblem(antenna("660x300"), BASE, 1000.0, 400.0)
    square, triangular, staggered = sparsest_patterns(asked, single(), Drive(1000.0, 300.0, 0.05), 20.0)
    # No rows of the lattice may be farther apart than 300 mm; at 300 mm exactly nothing is to spare.
    assert (square.pitch_mm, triangular.pitch_mm) == (280.0, 340.0)
    assert triangular.row_spacing_mm == pytest.approx(340 * math.sqrt(3) / 2)
    assert triangular.pattern.tags_per_m2 < staggered.pattern.tags_per_m2 < square.pattern.tags_per_m2
    assert staggered.stagger == 0.5
    for found in (square, triangular, staggered):
        drives = blind_distances(single(), Rectangle(660.0, 300.0), found.pattern)
        assert max(drive.max_mm for drive in drives) <= 1000


def test_short_distances_and_fast_robots_need_more_tags():
    asked = PlacementProblem(antenna("320x230"), BASE, 1000.0, 320.0)
    density = [
        sparsest_patterns(asked, single(), Drive(*drive), 20.0)[1].pattern.tags_per_m2
        for drive in ((1000.0, 300.0, 0.05), (150.0, 300.0, 0.05), (150.0, 300.0, 0.3))
    ]
    assert density[0] < density[1] < density[2]


def test_a_robot_too_fast_for_its_readers_is_refused():
    asked = PlacementProblem(antenna("60x60"), BASE, 1000.0, 320.0)
    with pytest.raises(ValueError, match="too far"):
        with_read_time(asked, 1000.0, 0.1)
    with pytest.raises(ValueError, match="distance_mm"):
        with_read_time(PlacementProblem(antenna("660x300"), BASE, 90.0, 400.0), 1000.0, 0.1)
    with pytest.raises(ValueError, match="forward alone"):
        with_read_time(PlacementProblem(antenna("60x60"), BASE, 500.0, 320.0, motions=("sideways",)), 100.0, 0.1)
    with pytest.raises(ValueError, match="step_mm"):
        sparsest_patterns(PlacementProblem(antenna("660x300"), BASE, 9e3, 400.0), single(), Drive(9e3, 300.0, 0.0), 5.0)
