"""A design: its name, whether it can be built, and whether its readers see one tag at a time."""

import math

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from rfiddesign.catalog import Antenna, antenna, reader
from rfiddesign.design import Design, check_design, check_tag_spacing, span_mm
from rfiddesign.geometry import (
    Disc,
    Ellipse,
    ListedPattern,
    PolygonArea,
    ProbabilityMap,
    Rectangle,
    Ring,
    RoundedRectangle,
    make_layout,
    make_pattern,
    single,
    to_local,
)

ROUND = shapely.Point(0, 0).buffer(300.0, quad_segs=256)


def design(layout="cross-8", housing="60x60") -> Design:
    return Design(make_layout(layout), antenna(housing), make_pattern("square", tags_per_m2=62.5))


def test_the_name_tells_layout_antenna_pattern_and_density():
    assert design().name == "cross-8, 60x60, square, 62.5 tags/m2"


def test_equal_designs_are_one_key():
    assert design() == design()
    assert {design(): 1}[design()] == 1
    assert design() != design(housing="80x80")


def test_the_paper_s_cross_of_eight_fits_under_a_round_robot_of_300_mm():
    check_design(design(), ROUND)


def test_antennas_that_stick_out_are_named_with_their_place():
    with pytest.raises(ValueError, match=r"layout cross-8: antenna 2 \(x = 250, y = 0\) sticks out .* by .* mm"):
        check_design(design(), shapely.Point(0, 0).buffer(270.0))


def test_antennas_that_overlap_are_named_by_how_much():
    with pytest.raises(ValueError, match=r"antennas 1 \(x = 0, y = -25\) and 2 \(x = 0, y = 25\) overlap by 10 mm"):
        check_design(design({"kind": "bar", "n": 2, "spacing_mm": 50.0}), ROUND)


def test_antennas_may_touch():
    check_design(design({"kind": "bar", "n": 2, "spacing_mm": 60.0}), ROUND)


# Readers that must never see two tags at once

ONE_TAG = reader("goetting-hg-g-98830")
sizes = st.floats(20, 200)
areas = st.one_of(
    sizes.map(Disc),
    st.builds(Rectangle, sizes, sizes),
    st.builds(lambda length, width: RoundedRectangle(length, width, 0.3 * min(length, width)), sizes, sizes),
    st.builds(Ellipse, sizes, sizes),
    sizes.map(lambda outer: Ring(0.5 * outer, outer)),
    st.builds(lambda x, y: PolygonArea(((-20.0, -10.0), (x, 0.0), (0.0, y))), sizes, sizes),
)
patterns = st.builds(
    lambda kind, pitch: make_pattern(kind, pitch_mm=pitch, seed=3),
    st.sampled_from(["square", "triangular", "striped", "thinned", "random"]),
    st.floats(60, 400),
)


def widest_direction(area):
    """Direction between the two corners of the outline that lie furthest apart."""
    corners = shapely.get_coordinates(area.outline())
    ways = corners[:, None] - corners
    return np.arctan2(*ways.reshape(-1, 2)[np.hypot(*np.moveaxis(ways, -1, 0)).argmax()][::-1])


def poses_with_two_tags_in_view(area, tags):
    """Antenna poses (n, 3) with the two tags of a close pair in the area: turned by steps, and along its widest way."""
    pairs, found = cKDTree(tags).query_pairs(2.1 * area.reach_mm, output_type="ndarray"), []
    ways = tags[pairs[:, 1]] - tags[pairs[:, 0]]
    for k in np.hypot(*ways.T).argsort()[:6]:
        along = np.arctan2(ways[k, 1], ways[k, 0]) - widest_direction(area)
        for yaw in (along, *np.linspace(0, 2 * np.pi, 40, endpoint=False)):
            # Antenna places with the first tag in view, and those with the second.
            turned = shapely.affinity.rotate(area.outline(), yaw + np.pi, origin=(0, 0), use_radians=True)
            first, second = (shapely.affinity.translate(turned, *tags[i]) for i in pairs[k])
            both = first.intersection(second)
            if both.area > 1e-3:
                place = both.representative_point()
                found.append((place.x, place.y, yaw))
    return np.array(found).reshape(-1, 3)


def n_in_view(area, tags, poses):
    return np.array([np.count_nonzero(area.contains(to_local(pose, tags))) for pose in poses], int)


@given(area=areas, pattern=patterns, seed=st.integers(0, 1000))
@settings(max_examples=40)
def test_exactly_designs_in_which_two_tags_can_be_in_the_field_at_once_are_rejected(area, pattern, seed):
    span, distance = span_mm(area), pattern.min_distance_mm
    # What just so fits in leaves no room for rounding.
    assume(not 0.999 < distance / span < 1.0)
    design = Design(single(), Antenna("test", (1.0, 1.0), area, "test"), pattern, ONE_TAG)
    side = 12 * math.sqrt(1e6 / pattern.tags_per_m2)
    tags = pattern.lay(shapely.box(0, 0, side, side))
    witnesses = poses_with_two_tags_in_view(area, tags)
    if distance < span:
        with pytest.raises(ValueError, match="must never see two tags at once"):
            check_tag_spacing(design)
        # The nearest tags of a random pattern are not quite as near as they may be.
        is_seen = n_in_view(area, tags, witnesses).max(initial=0) >= 2
        assert is_seen or (pattern.name == "random" and distance > 0.9 * span)
    else:
        check_tag_spacing(design)
        assert len(witnesses) == 0
        anywhere = np.random.Generator(np.random.PCG64(seed)).uniform(0, [side, side, 2 * np.pi], (500, 3))
        assert n_in_view(area, tags, anywhere).max() <= 1


@pytest.mark.parametrize(
    ("area", "span"),
    [
        (Disc(30.0), 60.0),
        (Rectangle(320.0, 230.0), math.hypot(320, 230)),
        (RoundedRectangle(80.0, 60.0, 10.0), 2 * (math.hypot(30, 20) + 10)),
        (Ellipse(90.0, 40.0), 180.0),
        (Ring(30.0, 70.0), 140.0),
        (PolygonArea(((-30.0, -20.0), (70.0, -10.0), (10.0, 50.0))), math.hypot(100, 10)),
        (ProbabilityMap(np.array([[0.9, 0.1, 0.8], [0.1, 0.0, 0.2]]), 20.0), math.hypot(60, 20)),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_span_of_an_area_is_its_widest_extent(area, span):
    assert span_mm(area) == pytest.approx(span, rel=1e-6)


def test_tags_just_as_far_apart_as_the_field_is_wide_are_allowed():
    for distance, is_allowed in ((60.0, True), (59.999, False)):
        pattern = ListedPattern(np.array([[0.0, 0.0], [distance, 0.0], [500.0, 0.0]]))
        design = Design(single(), antenna("60x60"), pattern, ONE_TAG)
        if is_allowed:
            check_tag_spacing(design)
        else:
            with pytest.raises(ValueError, match="60"):
                check_tag_spacing(design)


def test_a_single_tag_is_never_two():
    check_tag_spacing(Design(single(), antenna("660x300"), ListedPattern(np.zeros((1, 2))), ONE_TAG))


def test_readers_with_anti_collision_take_any_spacing():
    dense = make_pattern("square", pitch_mm=20.0)
    check_tag_spacing(Design(make_layout("cross-8"), antenna("320x230"), dense, reader("hf-anticollision")))


def test_a_rejection_names_reader_antenna_pattern_and_both_lengths():
    message = (
        r"reader goetting-hg-g-98830 must never see two tags at once; antenna 80x80 sees tags up to 80 mm apart, those"
        r" of pattern striped with 80 tags/m2 lie 64.55 mm apart"
    )
    with pytest.raises(ValueError, match=message):
        check_tag_spacing(
            Design(make_layout("cross-8"), antenna("80x80"), make_pattern("striped", tags_per_m2=80.0), ONE_TAG)
        )
