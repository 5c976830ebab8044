import math

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.geometry import Rectangle, check_layout, make_layout
from rfiddesign.geometry.layouts import bar, grid, listed

ANTENNA = Rectangle(60, 60).outline()
WIDE = shapely.box(-2000, -2000, 2000, 2000)


def test_antennas_may_touch_each_other_and_the_rim():
    check_layout(grid(3, 3, 60, 60), ANTENNA, shapely.box(-90, -90, 90, 90))


@given(st.floats(0.001, 59.0))
def test_overlapping_antennas_are_named_with_the_depth(overlap):
    named = r"antennas 1 \(x = 0, y = -.*\) and 2 \(x = 0, y = .*\) overlap by"
    with pytest.raises(ValueError, match=named) as refusal:
        check_layout(bar(2, 60 - overlap), ANTENNA, WIDE)
    assert float(str(refusal.value).split("by ")[1].split()[0]) == pytest.approx(overlap, rel=6e-3)


def test_antennas_one_upon_the_other_overlap_by_their_full_width():
    with pytest.raises(ValueError, match=r"antennas 1 .* and 2 .* overlap by 60 mm$"):
        check_layout(listed([(5, 5), (5, 5)]), ANTENNA, WIDE)


@given(st.floats(0.001, 1000.0))
def test_an_antenna_beyond_the_rim_is_named_with_how_far(beyond):
    with pytest.raises(ValueError, match=r"antenna 2 \(x = .*, y = 0\) sticks out of the footprint by") as refusal:
        check_layout(listed([(0, 0), (70 + beyond, 0)]), ANTENNA, shapely.box(-100, -100, 100, 100))
    assert float(str(refusal.value).split("by ")[1].split()[0]) == pytest.approx(beyond, rel=6e-3)


def test_a_turned_antenna_needs_its_diagonal():
    footprint = shapely.box(-31, -31, 31, 31)
    check_layout(listed([(0, 0, math.pi / 2)]), ANTENNA, footprint)
    with pytest.raises(ValueError, match=r"by 11\.4 mm"):
        check_layout(listed([(0, 0, math.pi / 4)]), ANTENNA, footprint)


def test_an_edge_across_a_notch_of_the_footprint_sticks_out():
    notched = WIDE.difference(shapely.box(-10, 0, 10, 2000))
    with pytest.raises(ValueError, match=r"antenna 1 .* sticks out of the footprint by (9|10)\b"):
        check_layout(listed([(0, 0)]), ANTENNA, notched)


def test_a_long_list_of_faults_stays_one_line():
    with pytest.raises(ValueError, match=r"and 5 more$") as refusal:
        check_layout(bar(10, 50), ANTENNA, WIDE)
    assert "\n" not in str(refusal.value)


def test_the_papers_crosses_can_be_built():
    for name, size in (("cross-96", 30), ("cross-24", 60), ("cross-20", 60), ("cross-8", 60)):
        check_layout(make_layout(name), Rectangle(size, size).outline(), shapely.Point(0, 0).buffer(350))
    # 80 mm antennas fit the cross of eight, but not crosses of 75 mm spacing.
    check_layout(make_layout("cross-8"), Rectangle(80, 80).outline(), WIDE)
    with pytest.raises(ValueError, match="overlap by 5 mm"):
        check_layout(make_layout("cross-24"), Rectangle(80, 80).outline(), WIDE)
