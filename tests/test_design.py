"""A design: its name, and whether it can be built."""

import pytest
import shapely

from rfiddesign.catalog import antenna
from rfiddesign.design import Design, check_design
from rfiddesign.geometry import make_layout, make_pattern

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
