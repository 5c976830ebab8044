"""Blind distances against marching point by point, and the aliasing that findings 1 and 9 measured."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.geometry.areas import Disc, Rectangle
from rfiddesign.geometry.drive import aliased_headings, blind_corridors, blind_distances
from rfiddesign.geometry.layouts import bar, cross, listed, make_layout, single
from rfiddesign.geometry.patterns import ListedPattern, make_pattern

CROSS, AREA = make_layout("cross-8"), Disc(30.0)


def square(pitch_mm):
    return make_pattern("square", pitch_mm=pitch_mm)


def march(layout, area, pattern, heading_deg, course_deg, horizon_mm, n=1500, step_mm=1.0):
    """Distances to the next read of n random starts, by moving on `step_mm` at a time until some antenna sees a tag."""
    rng = np.random.default_rng(7)
    basis = np.array(pattern.lattice.basis_mm)
    heading, course = math.radians(heading_deg), math.radians(heading_deg + course_deg)
    start = rng.random((n, 2)) @ basis
    distance, waiting = np.full(n, horizon_mm), np.arange(n)
    # All tags that an antenna in the cell may see, since no area below reaches beyond the next cell.
    tags = np.stack(np.meshgrid(np.arange(-1, 3), np.arange(-1, 3)), axis=-1).reshape(-1, 2) @ basis
    for travelled in np.arange(0.0, horizon_mm, step_mm):
        robot = start[waiting] + travelled * np.array([math.cos(course), math.sin(course)])
        is_seen = np.zeros(len(robot), dtype=bool)
        for x, y, yaw in layout.poses:
            c, s = math.cos(heading), math.sin(heading)
            antenna = robot + np.array([c * x - s * y, s * x + c * y])
            antenna -= np.floor(antenna @ np.linalg.inv(basis)) @ basis
            c, s = math.cos(heading + yaw), math.sin(heading + yaw)
            offset = tags[:, None] - antenna[None]
            local = np.stack(
                [c * offset[..., 0] + s * offset[..., 1], c * offset[..., 1] - s * offset[..., 0]], axis=-1
            )
            is_seen |= area.contains(local).any(axis=0)
        distance[waiting[is_seen]] = travelled
        waiting = waiting[~is_seen]
        if len(waiting) == 0:
            break
    return distance


@pytest.mark.parametrize("pitch_mm", [200.0, 250.0, 300.0, 400.0])
def test_the_cross_of_eight_aliases_where_its_offsets_fit_the_pitch(pitch_mm):
    found = aliased_headings(CROSS, AREA, square(pitch_mm))
    ahead = next(aliasing for aliasing in found if aliasing.heading_deg == 0)
    # By hand: the offsets 0, +-150, +-250 modulo the pitch, each 30 mm to either side.
    assert ahead.blind_share == pytest.approx({200: 0.2, 250: 0.32, 300: 80 / 300, 400: 0.55}[pitch_mm])
    assert ahead.row_spacing_mm == pytest.approx(pitch_mm)
    assert ahead.blind_distance_mm == 5000
    assert "heading 0 deg" in ahead.message
    assert f"{ahead.blind_share:.1%}" in ahead.message


def test_the_cross_of_eight_does_not_alias_at_150_mm():
    assert aliased_headings(CROSS, AREA, square(150.0)) == ()
    assert max(drive.max_mm for drive in blind_distances(CROSS, AREA, square(150.0))) < 200


def test_at_100_tags_per_m2_offsets_of_whole_pitches_alias():
    pattern = make_pattern("square", tags_per_m2=100.0)
    (aliasing,) = aliased_headings(cross(first_mm=100.0, spacing_mm=100.0), AREA, pattern)
    assert (aliasing.heading_deg, aliasing.blind_share) == (0, pytest.approx(0.4))
    assert aliased_headings(CROSS, AREA, pattern) == ()


def test_a_bar_that_closes_the_lanes_never_aliases_and_a_wider_one_does():
    # Findings 9: eight at 55 mm read at pitch 300, at 70 mm they do not.
    assert aliased_headings(bar(8, 55.0), AREA, square(300.0)) == ()
    assert aliased_headings(bar(8, 70.0), AREA, square(300.0)) != ()


def test_too_few_readers_are_a_corridor_and_no_aliasing():
    assert aliased_headings(single(), AREA, square(100.0)) == ()
    ahead, diagonal = blind_corridors(single(), AREA, square(100.0))
    assert (ahead.heading_deg, ahead.blind_share) == (0, pytest.approx(0.4))
    assert (diagonal.heading_deg, diagonal.blind_share) == (45, pytest.approx(1 - 60 / (100 / math.sqrt(2))))
    assert blind_corridors(CROSS, AREA, square(300.0)) == ()


def test_a_bar_that_drives_sideways_is_one_reader_wide():
    sideways = aliased_headings(bar(8, 55.0), AREA, square(300.0), course_deg=90.0)
    (alone, *_) = blind_corridors(single(), AREA, square(300.0), course_deg=90.0)
    assert sideways[0].blind_share == pytest.approx(alone.blind_share) == pytest.approx(0.8)


def test_a_layout_without_mirror_axis_has_both_of_two_mirrored_headings():
    layout = listed([(0.0, 0.0), (40.0, 110.0), (-90.0, 45.0)])
    headings = [
        round(drive.heading_deg, 2) for drive in blind_distances(layout, AREA, square(150.0)) if drive.is_aligned
    ]
    assert headings == [0, 26.57, 45, 63.43]


@pytest.mark.parametrize(
    ("layout", "area", "kind", "pitch_mm", "heading_deg", "course_deg"),
    [
        (CROSS, AREA, "square", 200.0, 0.0, 0.0),
        (CROSS, AREA, "square", 250.0, 7.3, 20.0),
        (CROSS, AREA, "triangular", 300.0, 30.0, 0.0),
        (single(), Disc(40.0), "triangular", 150.0, 11.0, 0.0),
        (listed([(0, 0, 0.4), (130, 40, 1.2)]), Rectangle(120.0, 50.0), "square", 220.0, 45.0, 0.0),
        (listed([(0, 0, 0.4), (130, 40, 1.2)]), Rectangle(120.0, 50.0), "square", 220.0, 10.0, 33.0),
    ],
)
def test_distances_agree_with_marching(layout, area, kind, pitch_mm, heading_deg, course_deg):
    pattern = make_pattern(kind, pitch_mm=pitch_mm)
    (drive,) = blind_distances(
        layout, area, pattern, [heading_deg], limit_mm=150.0, horizon_mm=1200.0, course_deg=course_deg
    )
    marched = march(layout, area, pattern, heading_deg, course_deg, 1200.0)
    error = marched.std() / math.sqrt(len(marched))
    assert drive.mean_mm == pytest.approx(marched.mean(), abs=4 * error + 1)
    assert drive.share_over_limit == pytest.approx((marched > 150).mean(), abs=0.04)
    # The marched share below the stated percentile is 95 % within what 1,500 starts can tell.
    assert (marched <= drive.p95_mm + 1).mean() >= 0.925
    assert drive.p95_mm == 0 or (marched < drive.p95_mm - 1).mean() <= 0.97
    assert marched.max() <= drive.max_mm + 25


def test_one_reader_along_a_row_reads_by_the_book():
    # Lanes within the disc's radius r of the row: chords 2 sqrt(r^2 - y^2), gaps of the rest of the pitch p.
    p, r, horizon = 100.0, 30.0, 5000.0
    (drive,) = blind_distances(single(), Disc(r), square(p), [0.0])
    y = (np.arange(200_000) + 0.5) / 200_000 * r
    gaps = p - 2 * np.sqrt(r * r - y * y)
    expected = (2 * r / p) * (gaps**2 / (2 * p)).mean() + (1 - 2 * r / p) * horizon
    assert drive.mean_mm == pytest.approx(expected, rel=2e-3)
    assert drive.share_over_limit == pytest.approx(0.4, abs=2e-3)
    assert (drive.p95_mm, drive.max_mm, drive.is_aligned) == (horizon, horizon, True)


def test_default_headings_name_the_rows_that_are_farther_apart_than_a_view_is_wide():
    drives = blind_distances(CROSS, AREA, square(150.0))
    # Rows of pitch 150 are 150, 106 and 67 mm apart at 0, 45 and 26.57 deg, the next 47 mm, which is less than 60 mm.
    assert [round(drive.heading_deg, 2) for drive in drives if drive.is_aligned] == [0, 26.57, 45]
    assert sum(not drive.is_aligned for drive in drives) >= 6
    assert not any(drive.is_aligned for drive in blind_distances(CROSS, Disc(80.0), square(150.0)))


def test_the_reverse_course_is_as_blind():
    for course in (0.0, 40.0):
        layout = listed([(0, 0), (130, 40), (-60, 85)])
        there = blind_distances(layout, AREA, square(180.0), [0.0, 30.0], course_deg=course)
        back = blind_distances(layout, AREA, square(180.0), [0.0, 30.0], course_deg=course + 180)
        assert [d.mean_mm for d in there] == pytest.approx([d.mean_mm for d in back], rel=0.05)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(-300, 300), st.integers(-300, 300)), min_size=1, max_size=8, unique=True),
    st.sampled_from([120.0, 180.0, 250.0, 310.0]),
    st.sampled_from(["square", "triangular"]),
)
def test_a_lane_is_never_read_exactly_where_the_robot_drives_to_the_horizon(places, pitch_mm, kind):
    layout, pattern = listed(places), make_pattern(kind, pitch_mm=pitch_mm)
    blind = aliased_headings(layout, AREA, pattern) + blind_corridors(layout, AREA, pattern)
    headings = [drive.heading_deg for drive in blind_distances(layout, AREA, pattern) if drive.is_aligned]
    assert {found.heading_deg for found in blind} <= set(headings)
    drives = blind_distances(layout, AREA, pattern, headings, limit_mm=4999.0)
    share = {found.heading_deg: found.blind_share for found in blind}
    for drive in drives:
        assert drive.share_over_limit == pytest.approx(share.get(drive.heading_deg, 0.0), abs=0.01)


@settings(max_examples=40, deadline=None)
@given(st.floats(0, 180), st.floats(60, 300), st.floats(-90, 90))
def test_statistics_are_ordered_and_capped(heading, pitch_mm, course):
    (drive,) = blind_distances(CROSS, AREA, square(pitch_mm), [heading], horizon_mm=900.0, course_deg=course)
    assert 0 <= drive.mean_mm <= drive.max_mm <= 900
    assert 0 <= drive.p95_mm <= drive.max_mm
    assert (drive.share_over_limit > 0) == (drive.max_mm > 500)


def test_more_random_tags_are_read_sooner():
    sparse, dense = (
        blind_distances(CROSS, AREA, make_pattern("random", tags_per_m2=density), [20.0])[0] for density in (10.0, 40.0)
    )
    assert 0 < dense.mean_mm < 0.5 * sparse.mean_mm
    assert not dense.is_aligned
    assert aliased_headings(CROSS, AREA, make_pattern("random", tags_per_m2=10.0)) == ()


def test_random_tags_without_least_distance_are_met_at_the_rate_of_a_poisson_field():
    # One disc meets tags of density d at rate 2 r d per length: the distance is 0 with 1 - exp(-d pi r^2), else
    # exponential.
    density, radius = 40e-6, 50.0
    pattern = make_pattern("random", tags_per_m2=40.0, min_distance_mm=0.0, seed=4)
    drives = blind_distances(single(), Disc(radius), pattern, range(0, 360, 30))
    expected = math.exp(-density * math.pi * radius**2) / (2 * radius * density)
    assert np.mean([drive.mean_mm for drive in drives]) == pytest.approx(expected, rel=0.1)


def test_a_thinned_lattice_keeps_its_blind_lanes():
    pattern = make_pattern("thinned", pitch_mm=200.0)
    found = aliased_headings(CROSS, AREA, pattern)
    assert found[0].heading_deg == 0
    drive = blind_distances(CROSS, AREA, pattern, [0.0])[0]
    assert drive.is_aligned
    assert drive.share_over_limit >= found[0].blind_share - 0.02


def test_bad_numbers_are_named():
    with pytest.raises(ValueError, match=r"limit_mm = 6000: must be below horizon_mm = 5000"):
        blind_distances(CROSS, AREA, square(100.0), limit_mm=6000.0)
    with pytest.raises(ValueError, match="headings_deg = nan"):
        blind_distances(CROSS, AREA, square(100.0), [math.nan])
    with pytest.raises(ValueError, match="pattern = list"):
        blind_distances(CROSS, AREA, ListedPattern(square(100.0).lay(shapely.box(0, 0, 1000, 1000))))
